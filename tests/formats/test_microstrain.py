"""CSV of MicroStrain's MIP Monitor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.microstrain import read
from polyins.formats.recognize import data_format, read_log

SESSION = (
    "FILE_INFO\nListSeparator=comma\nDecimalSeparator=period\n\nSESSION_INFO\nStartTime,01/01/2020\n\nDATA_START\n"
)
IMU = [
    *(f"{axis} Accel [x8004]" for axis in "XYZ"),
    *(f"{axis} Gyro [x8005]" for axis in "XYZ"),
]
GPS = [
    "Lat [x8103]", "Long [x8103]", "Height [x8103]", "MSL Height [x8103]", "Horz Acc [x8103]", "Vert Acc [x8103]",
    "Flags [x8103]", "Vel N [x8105]", "Vel E [x8105]", "Vel D [x8105]", "Speed [x8105]", "Speed Acc [x8105]",
]  # fmt: skip
NAMES = ["GPS TFlags", "GPS Week", "GPS TOW", *IMU, *GPS]


def imu_row(tow: float) -> str:
    return ",".join(map(str, [7, 1970, f"{tow:.6f}", 0.01, 0.02, -1.0, 0.1, 0.2, 0.3])) + "," * len(GPS)


def gps_row(tow: float, place: tuple[float, float] = (48.0, 11.0)) -> str:
    values = [*place, 500.0, 454.0, 1.5, 2.5, 31, 1.0, 2.0, 3.0, 3.7, 0.1]
    return ",".join(map(str, [7, 1970, f"{tow:.6f}", *[""] * len(IMU), *values]))


def write(path: Path, rows: list[str]) -> Path:
    path.write_text(SESSION + "\n".join([",".join(NAMES), *rows]) + "\n")
    return path


def test_imu_and_receiver(tmp_path: Path) -> None:
    rows = [imu_row(0.0), *(imu_row(490025.0 + 0.01 * k) for k in range(100)), gps_row(490025.5), gps_row(490026.0)]
    path = write(tmp_path / "a.csv", [*rows, gps_row(490026.5, (0.0, 0.0))])
    assert data_format(path) == "microstrain"
    log = read_log(path)
    assert log.clock == "gps-week"
    assert log.utc_of_zero == 315964800 + 1970 * 604800 - 18
    assert log.notes == ("1 row(s) without GPS TOW are left out",)
    imu, track = log.imus["imu"], log.tracks["gnss"]
    np.testing.assert_allclose(imu.dvel[3], np.array([0.01, 0.02, -1.0]) * 9.80665 * 0.01, rtol=1e-6)
    np.testing.assert_allclose(imu.dtheta[3], np.array([0.1, 0.2, 0.3]) * 0.01, rtol=1e-6)
    np.testing.assert_array_equal(track.time, [490025.5, 490026.0])
    np.testing.assert_allclose(track.position[0], [np.radians(48), np.radians(11), 500.0])
    np.testing.assert_array_equal(track.position_std[0], [1.5, 1.5, 2.5])
    np.testing.assert_array_equal(track.velocity[1], [1, 2, 3])
    assert not track.above_sea


def test_the_week_ends_and_rows_are_missing(tmp_path: Path) -> None:
    tows = (604799.9 + 0.01 * np.array([0, 1, 2, 3, 7, 8, 9, 10, 11])) % 604800
    log = read(write(tmp_path / "a.csv", [imu_row(tow) for tow in tows if tow]))
    steps = np.diff(log.imus["imu"].time)
    assert (steps.min(), steps.max()) == (pytest.approx(0.01, abs=1e-5), pytest.approx(0.04, abs=1e-5))


def test_a_cut_end_and_no_stamps(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", [imu_row(1.0 + k) for k in range(9)])
    path.write_text(path.read_text()[:-30])
    log = read(path)
    assert len(log.imus["imu"].time) == 8
    assert "line 18: is cut off" in log.notes[0]
    with pytest.raises(InputError, match="no row has GPS TOW"):
        read(write(path, [imu_row(0.0)]))
