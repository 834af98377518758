"""CSV of VectorNav's sensors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.recognize import data_format, read_log
from polyins.formats.vectornav import read

IMU = (
    "Time [s],GpsTow [s],Time::GpsWeek,IMU::UncompAccel::X [m/s^2],IMU::UncompAccel::Y [m/s^2],"
    "IMU::UncompAccel::Z [m/s^2],IMU::UncompGyro::X [rad/s],IMU::UncompGyro::Y [rad/s],IMU::UncompGyro::Z [rad/s],"
    "IMU::Accel::X [m/s^2],IMU::Accel::Y [m/s^2],IMU::Accel::Z [m/s^2],"
    "IMU::AngularRate::X,IMU::AngularRate::Y [rad/s],IMU::AngularRate::Z [rad/s]"
)
GNSS = (
    ",GNSS1::Tow [ns],GNSS1::Fix,GNSS1::PosLla::latitude [deg],GNSS1::PosLla::longitude [deg],"
    "GNSS1::PosLla::altitude [m],GNSS1::VelNed::N [m/s],GNSS1::VelNed::E [m/s],GNSS1::VelNed::D [m/s],"
    "GNSS1::PosU::N [m],GNSS1::PosU::E [m],GNSS1::PosU::D [m],GNSS1::VelU [m/s],Att::YawPitchRoll::Y [deg],"
    "INS::InsStatus::Mode"
)


def imu_row(tow: float) -> str:
    return f"0,{tow:.6f},2303,0,0,-9.7,1,1,1,0.1,0.2,-9.8,0.01,0.02,0.03"


def fix(tow: float, place: str = "48.5,9.25,300", fix: int = 3, mode: int = 2) -> str:
    return f",{tow * 1e9:.0f},{fix},{place},1,2,3,0.5,0.6,0.7,0.1,90.5,{mode}"


def write(path: Path, header: str, rows: list[str]) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_imu_and_fixes_of_one_file(tmp_path: Path) -> None:
    """Each message repeats the last fix, 0.07 s old when it is new."""
    tows = 100.0 + 0.05 * np.arange(21)
    rows = [imu_row(tow) + fix(np.floor((tow - 0.07) * 5.0) / 5.0) for tow in tows]
    path = write(tmp_path / "a.csv", IMU + GNSS, rows)
    assert data_format(path) == "vectornav"
    log = read_log(path)
    assert log.clock == "gps-week"
    assert set(log.imus) == {"IMU (compensated)", "IMU (Uncomp)"}
    assert "IMU (Uncomp)" in log.unusable
    rows_ = log.imus["IMU (compensated)"]
    np.testing.assert_allclose(rows_.dtheta[3], np.array([0.01, 0.02, 0.03]) * 0.05, rtol=1e-9)
    track = log.tracks["GNSS1"]
    np.testing.assert_allclose(track.time, [99.8, 100.0, 100.2, 100.4, 100.6, 100.8])
    np.testing.assert_allclose(track.position[0], [np.radians(48.5), np.radians(9.25), 300.0])
    np.testing.assert_array_equal(track.velocity[0], [1, 2, 3])
    np.testing.assert_array_equal(track.position_std[0], [0.5, 0.6, 0.7])
    np.testing.assert_allclose(log.sensors["Att"].value, np.radians(90.5))
    assert "Att" not in log.unusable
    assert log.utc_of_zero == 315964800 + 2303 * 604800 - 18


def test_zeros_are_no_positions_and_no_heading(tmp_path: Path) -> None:
    rows = [
        imu_row(1.0) + fix(1.0, "0,0,0", 0, 0),
        imu_row(2.0) + fix(2.0, mode=0),
        imu_row(3.0) + fix(3.0, "0,0,0", mode=0),
    ]
    log = read(write(tmp_path / "a.csv", IMU + GNSS, rows))
    np.testing.assert_array_equal(log.tracks["GNSS1"].time, [2.0])
    assert log.tracks["GNSS1"].quality == {"none": 1, "3D": 2}
    assert "not aligned" in log.unusable["Att"]


def test_the_week_goes_on_over_its_end(tmp_path: Path) -> None:
    rows = [imu_row(tow) + fix(tow - 0.07) for tow in (604799.9, 604799.95)]
    rows += [imu_row(tow) + fix((tow - 0.07) % 604800) for tow in (0.0, 0.05, 0.1)]
    log = read(write(tmp_path / "a.csv", IMU + GNSS, rows))
    np.testing.assert_allclose(np.diff(log.imus["IMU (compensated)"].time), 0.05, atol=1e-6)
    np.testing.assert_allclose(np.diff(log.tracks["GNSS1"].time), 0.05, atol=1e-6)


def test_other_units_a_cut_end_and_no_stamps(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", IMU, [imu_row(1.0 + 0.05 * k) for k in range(9)])
    whole = path.read_text()
    path.write_text(whole[:-30])
    log = read(path)
    assert len(log.imus["IMU (compensated)"].time) == 8
    assert "line 10: is cut off" in log.notes[0]
    path.write_text(whole.replace("IMU::Accel::X [m/s^2]", "IMU::Accel::X [g]"))
    with pytest.raises(InputError, match=r"column IMU::Accel::X \[g\]; expected m/s\^2"):
        read(path)
    write(path, IMU, [])
    with pytest.raises(InputError, match="no row has GpsTow"):
        read(path)
