"""Tables: declared columns, units, CSV and Parquet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from written_recordings import still_imu, write_rows

from polyins.config import ImuColumns, TrackColumns
from polyins.formats.table import read_imu, read_track
from polyins.model.rig import DEG

SCALES = {"rad/s": 1.0, "deg/s": 1 / DEG, "rad": 0.02, "deg": 0.02 / DEG, "m/s^2": 1.0, "g": 1 / 9.80665, "m/s": 0.02}


def imu_columns(gyro: str, accel: str, time: str = "s") -> ImuColumns:
    return ImuColumns.model_validate(
        {
            "time": {"name": "t", "unit": time},
            "gyro": {"names": ["gx", "gy", "gz"], "unit": gyro},
            "accel": {"names": ["ax", "ay", "az"], "unit": accel},
        }
    )


@pytest.mark.parametrize("gyro", ["rad/s", "deg/s", "rad", "deg"])
@pytest.mark.parametrize("accel", ["m/s^2", "g", "m/s"])
def test_all_units_say_the_same(gyro: str, accel: str, tmp_path: Path) -> None:
    rows = still_imu(50)
    written = rows * np.r_[1.0, [SCALES[gyro]] * 3, [SCALES[accel]] * 3]
    write_rows(tmp_path / "a.csv", written, "t,gx,gy,gz,ax,ay,az", ",")
    read = read_imu(tmp_path / "a.csv", imu_columns(gyro, accel))
    np.testing.assert_allclose(read.dtheta, rows[:, 1:4] * 0.02, atol=1e-8)
    np.testing.assert_allclose(read.dvel, rows[:, 4:7] * 0.02, atol=1e-8)
    assert (read.gyro_unit, read.accel_unit) == (gyro, accel)


@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_units_of_time(unit: str, factor: float, tmp_path: Path) -> None:
    rows = still_imu(50)
    table = {name: rows[:, n] for n, name in enumerate(["t", "gx", "gy", "gz", "ax", "ay", "az"])}
    table["t"] = np.round(rows[:, 0] * factor, 3)
    parquet.write_table(pa.table(table), tmp_path / "a.parquet")
    read = read_imu(tmp_path / "a.parquet", imu_columns("rad/s", "m/s^2", unit))
    np.testing.assert_allclose(read.time, rows[:, 0], atol=1e-3)


@pytest.mark.parametrize(
    ("frame", "expected", "velocity", "std"),
    [
        ("north-east-down", [1, 2, -3], [4, 5, 6], [7, 8, 9]),
        ("north-east-up", [1, 2, 3], [4, 5, -6], [7, 8, 9]),
        ("east-north-up", [2, 1, 3], [5, 4, -6], [8, 7, 9]),
    ],
)
def test_frames_of_position_and_velocity(
    frame: str, expected: list[int], velocity: list[int], std: list[int], tmp_path: Path
) -> None:
    (tmp_path / "a.csv").write_text("t,a,b,c,va,vb,vc,sa,sb,sc\n0,1,2,3,4,5,6,7,8,9\n")
    columns = TrackColumns.model_validate(
        {
            "time": {"name": "t"},
            "position": {"names": ["a", "b", "c"], "frame": frame},
            "std": {"names": ["sa", "sb", "sc"]},
            "velocity": {"names": ["va", "vb", "vc"], "frame": frame},
            "velocity_std": {"names": ["sa", "sb", "sc"]},
        }
    )
    track = read_track(tmp_path / "a.csv", columns)
    np.testing.assert_array_equal(track.position, [expected])
    np.testing.assert_array_equal(track.velocity, [velocity])
    np.testing.assert_array_equal(track.position_std, [std])
    np.testing.assert_array_equal(track.velocity_std, [std])


def positions(folder: Path, **declared: object) -> TrackColumns:
    """Write 40 rows at 10 Hz: row n (from 0) is at north n, has heading n deg, and is valid unless n ends in 7."""
    n = np.arange(40.0)
    rows = np.column_stack([100 + n / 10, n, 0 * n, 0 * n, n, n % 10 != 7])
    write_rows(folder / "p.csv", rows, "t,n,e,d,heading,ok", ",")
    position = {"names": ["n", "e", "d"], "frame": "north-east-down"}
    return TrackColumns.model_validate({"position": position, **declared})


def test_counted_rows_have_times_without_stamps(tmp_path: Path) -> None:
    columns = positions(tmp_path, rows={"first": 4, "every": 10, "rate_hz": 10})
    track = read_track(tmp_path / "p.csv", columns)
    np.testing.assert_allclose(track.position[:, 0], [3, 13, 23, 33])
    np.testing.assert_allclose(track.time, [0.3, 1.3, 2.3, 3.3])
    assert "row 2" in track.source.place(1)


def test_stamps_go_before_counting(tmp_path: Path) -> None:
    columns = positions(tmp_path, time={"name": "t"}, rows={"every": 20, "rate_hz": 10})
    np.testing.assert_allclose(read_track(tmp_path / "p.csv", columns).time, [100.0, 102.0])


def test_rows_that_are_not_valid_are_left_out_with_all_that_belongs_to_them(tmp_path: Path) -> None:
    columns = positions(tmp_path, time={"name": "t"}, valid="ok", heading={"name": "heading"})
    track = read_track(tmp_path / "p.csv", columns)
    kept = [n for n in range(40) if n % 10 != 7]
    np.testing.assert_allclose(track.position[:, 0], kept)
    assert track.attitude is not None
    np.testing.assert_allclose(track.attitude[:, 2], np.array(kept) * DEG)
    assert np.isnan(track.attitude[:, :2]).all()


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ({}, "is missing; expected it, or rows to count"),
        ({"time": {"name": "t"}, "rows": {"first": 0, "rate_hz": 10}}, "greater than or equal to 1"),
        (
            {
                "time": {"name": "t"},
                "heading": {"name": "heading"},
                "attitude": {"names": ["n", "e", "heading"]},
            },
            "is given with attitude",
        ),
    ],
)
def test_choices_of_rows_and_angles_that_are_not_clear(
    declared: dict[str, object], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=message):
        positions(tmp_path, **declared)
