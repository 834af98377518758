"""The GPS/IMU stream of KITTI's raw drives."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.kitti import read
from polyins.formats.recognize import data_format, read_log
from polyins.tools.propose.proposal import propose

STAMP = "2011-09-26 13:02:{:012.9f}"


def values(k: int) -> list[float]:
    pose = [49.0 + 1e-6 * k, 8.5, 112.5, 0.01, 0.02, 0.5]
    velocity = [1.0, 2.0, 2.2, 0.1, 0.3]
    forces = [0.1, 0.2, 9.8, 0.0, 0.0, 9.8]
    rates = [0.01, 0.02, 0.03, 0.01, 0.02, 0.03]
    return [*pose, *velocity, *forces, *rates, 0.05, 0.02, 4, 11, 6, 6, 6]


def drive(root: Path, name: str = "2011_09_26_drive_0001_sync", count: int = 40, step: float = 0.01) -> Path:
    folder = root / name / "oxts"
    (folder / "data").mkdir(parents=True)
    (folder / "timestamps.txt").write_text("".join(STAMP.format(25.0 + step * k) + "\n" for k in range(count)))
    for k in range(count):
        (folder / "data" / f"{k:010}.txt").write_text(" ".join(map(str, values(k))) + "\n")
    return root / name


def test_imu_and_pose(tmp_path: Path) -> None:
    path = drive(tmp_path, count=100)
    assert data_format(path) == "kitti-oxts"
    log = read_log(path)
    assert (log.clock, log.utc_of_zero) == ("local-time", None)
    rows, pose = log.imus["imu"], log.tracks["pose"]
    first = np.datetime64("2011-09-26T13:02:25").astype(float)
    np.testing.assert_allclose(rows.time, first + 0.01 * np.arange(100), atol=1e-6)
    np.testing.assert_allclose(rows.dtheta[3], np.array([0.01, 0.02, 0.03]) * 0.01, rtol=1e-4)
    np.testing.assert_allclose(rows.dvel[3], np.array([0.1, 0.2, 9.8]) * 0.01, rtol=1e-4)
    np.testing.assert_allclose(pose.position[2], [np.radians(49.000002), np.radians(8.5), 112.5])
    np.testing.assert_array_equal(pose.velocity[0], [1.0, 2.0, -0.3])
    np.testing.assert_allclose(pose.attitude[0], [0.01, -0.02, 0.5 * np.pi - 0.5])
    np.testing.assert_array_equal(pose.position_std[0], [0.05, 0.05, 0.05])


def test_the_pose_is_a_reference_and_the_axes_are_known(tmp_path: Path) -> None:
    text = propose([drive(tmp_path)]).text
    assert "axes: [x, -y, -z]  # forward, right, down, as the format has them" in text
    assert "gnss:" not in text
    assert "stream: 'pose'" in text.split("reference:")[1]
    start = text.split("start:")[1]
    assert "velocity_m_s: [1.0, 2.0, -0.3]" in start
    assert "roll_pitch_deg: [0.572958, -1.145916]" in start
    assert "estimate_gyro_bias: false" in start
    assert "heading_deg: 61.35211" in start


@pytest.mark.parametrize("part", ["..", "oxts"])
def test_the_folder_around_it_and_the_stream_alone(part: str, tmp_path: Path) -> None:
    path = drive(tmp_path / "2011_09_26") / part
    assert data_format(path) == "kitti-oxts"
    assert len(read(path).imus["imu"].time) == 40


def test_an_archive_and_several_drives(tmp_path: Path) -> None:
    path, archive = drive(tmp_path / "day"), tmp_path / "drive.zip"
    with zipfile.ZipFile(archive, "w") as file:
        for one in sorted(path.rglob("*.txt")):
            file.write(one, one.relative_to(tmp_path))
    assert data_format(archive) == "kitti-oxts"
    np.testing.assert_array_equal(read(archive).imus["imu"].dvel, read(path).imus["imu"].dvel)
    drive(tmp_path / "day", "2011_09_26_drive_0002_sync")
    with pytest.raises(InputError, match=r"holds several recordings; expected one of 2011_09_26_drive_0001_sync, 2011"):
        read(tmp_path / "day")


def test_ten_hertz_are_said_to_be_few(tmp_path: Path) -> None:
    assert "10 Hz: the unsynchronized version" in read(drive(tmp_path, step=0.1)).notes[0]


def test_files_go_by_their_number(tmp_path: Path) -> None:
    path = drive(tmp_path)
    (path / "oxts" / "data" / "0000000007.txt").unlink()
    log = read(path)
    assert np.diff(log.imus["imu"].time).max() == pytest.approx(0.02, abs=1e-6)
    assert "39 files of values and 40 stamps" in log.notes[0]


def test_damage_is_named(tmp_path: Path) -> None:
    path = drive(tmp_path)
    data, stamps = path / "oxts" / "data", path / "oxts" / "timestamps.txt"
    (data / "0000000039.txt").write_text("49 8 112")
    log = read(path)
    assert len(log.imus["imu"].time) == 39
    assert "0000000039.txt is cut off (3 values; expected 30)" in log.notes[0]
    (data / "0000000007.txt").write_text("49 8 112")
    with pytest.raises(InputError, match=r"0000000007\.txt: 3 values; expected 30"):
        read(path)
    (data / "0000000007.txt").write_text(" ".join(map(str, values(7))))
    stamps.write_text(stamps.read_text().replace("13:02:25.03", "13:02:xx.03"))
    with pytest.raises(InputError, match=r"timestamps\.txt, line 4: .*expected a date"):
        read(path)
