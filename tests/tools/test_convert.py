"""From one data file format to another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from written_recordings import as_increments, fixes, still_imu, write_rows

from polyins.errors import InputError
from polyins.formats import kf_gins, table
from polyins.tools.convert import convert


@pytest.mark.parametrize(
    "chain", [("a.bin", "b.csv", "c.parquet", "d.bin"), ("a.parquet", "b.bin", "c.csv.gz", "d.bin")]
)
def test_imu_data_pass_through_all_formats_unchanged(chain: tuple[str, ...], tmp_path: Path) -> None:
    source = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    original = kf_gins.read_imu(source)
    for name in chain:
        assert convert(source, tmp_path / name) == ()
        source = tmp_path / name
    final = kf_gins.read_imu(source)
    for field in ("time", "dtheta", "dvel"):
        np.testing.assert_array_equal(getattr(final, field), getattr(original, field))


def test_positions_pass_through_all_formats(tmp_path: Path) -> None:
    source = write_rows(tmp_path / "gnss.txt", fixes())
    original = kf_gins.read_gnss(source)
    convert(source, tmp_path / "a.csv")
    convert(tmp_path / "a.csv", tmp_path / "b.parquet")
    convert(tmp_path / "b.parquet", tmp_path / "c.txt")
    final = kf_gins.read_gnss(tmp_path / "c.txt")
    np.testing.assert_allclose(final.position, original.position, rtol=1e-13)
    np.testing.assert_allclose(final.position_std, original.position_std)


def test_a_table_by_the_names_of_its_columns(tmp_path: Path) -> None:
    rows = still_imu()
    rows[:, 1:4] = np.degrees(rows[:, 1:4])
    write_rows(tmp_path / "log.csv", rows, "timestamp,gyro_x(deg/s),gyro_y(deg/s),gyro_z(deg/s),acc_x,acc_y,acc_z", ",")
    (guess,) = convert(tmp_path / "log.csv", tmp_path / "log.bin")
    assert "taken as time in s, gyro in deg/s, accel in m/s^2" in guess
    read = kf_gins.read_imu(tmp_path / "log.bin")
    np.testing.assert_allclose(read.dtheta, as_increments(still_imu())[:, 1:4], atol=1e-9)


def test_a_navigation_result_keeps_velocity_and_attitude(tmp_path: Path) -> None:
    (tmp_path / "truth.nav").write_text("0 1.0 30 114 20 1 2 3 4 5 6\n0 2.0 30 114 20 1 2 3 4 5 6\n")
    convert(tmp_path / "truth.nav", tmp_path / "truth.parquet")
    track = table.read_track(tmp_path / "truth.parquet")
    np.testing.assert_array_equal(track.velocity[0], [1, 2, 3])
    np.testing.assert_allclose(np.degrees(track.attitude[0]), [4, 5, 6])


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        ("imu.txt", "out.xyz", r"out\.xyz: has suffix '\.xyz'; expected \.csv, \.parquet"),
        ("gnss.txt", "out.bin", r"out\.bin: positions have no binary format"),
        ("truth.nav", "out.txt", r"a KF-GINS file holds latitude, longitude and std"),
        ("drive.yaml", "out.csv", r"drive\.yaml: looks like a configuration; expected IMU data or positions"),
        ("words.txt", "out.csv", r"words\.txt: is of no known format"),
        ("odd.csv", "out.csv", r"odd\.csv: columns a, b, c, d are of no known meaning"),
        ("nowhere.txt", "out.bin", r"nowhere\.txt: no such file"),
    ],
)
def test_what_cannot_be_converted(source: str, target: str, message: str, tmp_path: Path) -> None:
    write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    write_rows(tmp_path / "gnss.txt", fixes())
    (tmp_path / "truth.nav").write_text("0 1.0 30 114 20 1 2 3 4 5 6\n")
    (tmp_path / "drive.yaml").write_text("imus:\n  - file: imu.txt\n")
    (tmp_path / "words.txt").write_text("some words\nand more\n")
    (tmp_path / "odd.csv").write_text("a,b,c,d\n1,2,3,4\n2,3,4,5\n")
    with pytest.raises(InputError, match=message):
        convert(tmp_path / source, tmp_path / target)
    assert not (tmp_path / target).exists()


def test_rates_without_header_become_increments(tmp_path: Path) -> None:
    warnings = convert(write_rows(tmp_path / "rates.txt", still_imu()), tmp_path / "out.txt")
    assert any("columns are told by their values" in text for text in warnings)
    np.testing.assert_allclose(
        kf_gins.read_imu(tmp_path / "out.txt").dvel, as_increments(still_imu())[:, 4:], atol=1e-9
    )
