"""Exports of phyphox and Sensor Logger."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.phone import read
from polyins.formats.recognize import data_format, read_log
from polyins.formats.rows import intervals

SECOND = 1_700_000_000_000_000_000
"""ns"""


def force_at(time: np.ndarray) -> np.ndarray:
    return np.column_stack([0.1 * time, 0.2 * time, 9.8 + 0.0 * time])


def put(folder: Path, name: str, header: str, rows: np.ndarray, mark: str = ",") -> None:
    folder.mkdir(exist_ok=True, parents=True)
    lines = [mark.join(f"{value:.9E}" for value in row) for row in rows]
    text = "\n".join(lines) + "\n"
    (folder / name).write_text(header + "\n" + (text.replace(".", ",") if mark == ";" else text))


def phyphox(folder: Path, mark: str = ",", names: str = '"X ({0})"M"Y ({0})"M"Z ({0})"') -> Path:
    gyro, force = 0.01 * np.arange(1, 300), 0.0037 + 0.01 * np.arange(300)
    header = '"Time (s)"' + mark + names.replace("M", mark)
    put(folder, "Gyroscope.csv", header.format("rad/s"), np.column_stack([gyro, np.tile([1, 2, 3], (299, 1))]), mark)
    put(folder, "Accelerometer.csv", header.format("m/s^2"), np.column_stack([force, force_at(force)]), mark)
    place = [
        np.array([0.5, 1.5, 2.5]),
        [48.1] * 3,
        [11.2] * 3,
        [500.0] * 3,
        [1.0] * 3,
        [90.0] * 3,
        [4.0] * 3,
        [6.0] * 3,
    ]
    columns = "Latitude (°)|Longitude (°)|Height (m)|Velocity (m/s)|Direction (°)"
    columns += "|Horizontal Accuracy (m)|Vertical Accuracy (°)"
    header = mark.join(f'"{name}"' for name in ["Time (s)", *columns.split("|")])
    put(folder, "Location.csv", header, np.column_stack(place), mark)
    return folder


@pytest.mark.parametrize("mark", [",", "\t", ";"])
@pytest.mark.parametrize("names", ['"X ({0})"M"Y ({0})"M"Z ({0})"', '"Some x ({0})"M"Some y ({0})"M"Some z ({0})"'])
def test_forces_are_taken_at_the_stamps_of_the_rates(mark: str, names: str, tmp_path: Path) -> None:
    path = phyphox(tmp_path / "a", mark, names)
    assert data_format(path) == "phone"
    log = read_log(path)
    rows = log.imus["imu"]
    steps = intervals(rows.time)[:, None]
    np.testing.assert_allclose(rows.time, 0.01 * np.arange(1, 300), atol=1e-9)
    np.testing.assert_allclose(rows.dtheta / steps, np.tile([1, 2, 3], (299, 1)))
    np.testing.assert_allclose(rows.dvel / steps, force_at(rows.time), atol=1e-7)
    track = log.tracks["Location"]
    assert track.above_sea
    np.testing.assert_allclose(track.position[0], [np.radians(48.1), np.radians(11.2), 500.0])
    np.testing.assert_array_equal(track.position_std[0], [4.0, 4.0, 6.0])


def test_an_archive(tmp_path: Path) -> None:
    folder, path = phyphox(tmp_path / "a"), tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as file:
        for one in folder.iterdir():
            file.write(one, one.name)
    assert data_format(path) == "phone"
    np.testing.assert_array_equal(read(path).imus["imu"].dvel, read(folder).imus["imu"].dvel)


def test_pauses_are_put_into_the_stamps_of_phyphox(tmp_path: Path) -> None:
    path = phyphox(tmp_path / "a")
    (path / "meta").mkdir()
    (path / "meta" / "time.csv").write_text(
        '"event","experiment time","system time","system time text"\n"START",0.0E0,1759650000.000,"2025, UTC"\n'
        '"PAUSE",1.0E0,1759650001.000,"2025"\n"START",1.0E0,1759650005.500,"2025"\n'
    )
    log = read(path)
    time = log.imus["imu"].time
    assert np.diff(time).max() == pytest.approx(4.51)
    assert time[-1] == pytest.approx(2.99 + 4.5)
    np.testing.assert_allclose(log.tracks["Location"].time, [0.5, 6.0, 7.0])
    assert log.utc_of_zero == 1759650000.0
    assert "1 pause(s)" in log.notes[0]


def test_where_the_accelerometer_is_silent_there_are_no_rows(tmp_path: Path) -> None:
    path = phyphox(tmp_path / "a")
    lines = (path / "Accelerometer.csv").read_text().splitlines(keepends=True)
    (path / "Accelerometer.csv").write_text("".join(lines[:100] + lines[200:])[:-30])
    log = read(path)
    assert np.diff(log.imus["imu"].time).max() == pytest.approx(1.01, abs=0.011)
    assert "is cut off" in log.notes[0]


def test_what_is_missing_is_said(tmp_path: Path) -> None:
    path = phyphox(tmp_path / "a")
    (path / "Accelerometer.csv").rename(path / "Linear Accelerometer.csv")
    log = read(path)
    assert log.imus == {}
    assert "no Accelerometer.csv" in log.notes[0]
    assert "has no gravity" in log.notes[0]


def sensor_logger(folder: Path, sign: float = 1.0, metadata: str = "android,false", total: bool = False) -> Path:
    time = 0.01 * np.arange(300)
    stamps = SECOND + (time * 1e9).astype(int)
    folder.mkdir()

    def sensor(name: str, values: np.ndarray) -> None:
        lines = [
            f"{t},{(t - SECOND) * 1e-9:.9f},{z:.9f},{y:.9f},{x:.9f}"
            for t, (x, y, z) in zip(stamps, values, strict=True)
        ]
        (folder / name).write_text("time,seconds_elapsed,z,y,x\n" + "\n".join(lines) + "\n")

    gravity = np.tile([0.0, 0.0, 9.8], (300, 1))
    sensor("Gyroscope.csv", np.tile([1.0, 2.0, 3.0], (300, 1)))
    sensor("Accelerometer.csv", sign * (force_at(time) - gravity))
    if total:
        sensor("TotalAcceleration.csv", force_at(time))
    else:
        sensor("Gravity.csv", sign * gravity)
    header = "time,seconds_elapsed,bearingAccuracy,speedAccuracy,verticalAccuracy,horizontalAccuracy,speed,bearing"
    fixes = [(0.5, 3.0, 5.0), (1.5, -1.0, -1.0), (2.5, 3.0, 5.0)]
    lines = [f"{SECOND + int(t * 1e9)},{t},0,0,{v},{h},1,90,550.5,11.2,48.1" for t, v, h in fixes]
    (folder / "Location.csv").write_text(f"{header},altitude,longitude,latitude\n" + "\n".join(lines) + "\n")
    if metadata:
        (folder / "Metadata.csv").write_text(f"version,platform,standardisation\n3,{metadata}\n")
    return folder


@pytest.mark.parametrize(
    ("sign", "metadata", "total"),
    [(1.0, "android,false", False), (-1.0, "iOS,false", False), (1.0, "ios,true", False), (1.0, "", True)],
)
def test_sensor_logger_on_both_systems(sign: float, metadata: str, total: bool, tmp_path: Path) -> None:
    path = sensor_logger(tmp_path / "a", sign, metadata, total)
    assert data_format(path) == "phone"
    log = read_log(path)
    assert (log.clock, log.utc_of_zero) == ("unix", 0.0)
    rows = log.imus["imu"]
    steps = intervals(rows.time)[:, None]
    np.testing.assert_allclose(rows.time, SECOND * 1e-9 + 0.01 * np.arange(300), atol=1e-6)
    np.testing.assert_allclose(rows.dtheta / steps, np.tile([1, 2, 3], (300, 1)))
    np.testing.assert_allclose(rows.dvel / steps, force_at(0.01 * np.arange(300)), atol=1e-5)
    track = log.tracks["Location"]
    assert (len(track.time), track.above_sea) == (2, False)
    np.testing.assert_allclose(track.position[0], [np.radians(48.1), np.radians(11.2), 550.5])
    np.testing.assert_array_equal(track.position_std[0], [5.0, 5.0, 3.0])


def test_a_sign_that_nothing_tells_is_not_guessed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no Metadata\.csv that tells the platform"):
        read(sensor_logger(tmp_path / "a", metadata=""))


def test_other_columns_are_refused(tmp_path: Path) -> None:
    path = phyphox(tmp_path / "a")
    (path / "Gyroscope.csv").write_text((path / "Gyroscope.csv").read_text().replace("(rad/s)", "(deg/s)"))
    with pytest.raises(InputError, match=r"Gyroscope\.csv: no column of x in rad/s"):
        read(path)
