"""Tables: declared columns, units, CSV and Parquet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyarrow import parquet
from written_recordings import still_imu, write_rows

from polyins.config import ImuColumns, TrackColumns
from polyins.errors import InputError
from polyins.formats.columns import column_names, read_columns
from polyins.formats.table import read_imu, read_track
from polyins.formats.written_table import write_gnss, write_imu
from polyins.model.recording import GnssStream, ImuStream
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


@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.parquet"])
@settings(deadline=None, max_examples=20)
@given(values=arrays(float, (4, 6), elements=st.floats(-1e3, 1e3)))
def test_imu_written_and_read_is_the_same_bit_for_bit(
    name: str, values: np.ndarray, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("table") / name
    stream = ImuStream("a", 456300.0 + np.arange(4) / 3, values[:, :3], values[:, 3:])
    write_imu(path, stream)
    read = read_imu(path)
    np.testing.assert_array_equal(read.time, stream.time)
    np.testing.assert_array_equal(read.dtheta, stream.dtheta)
    np.testing.assert_array_equal(read.dvel, stream.dvel)


@pytest.mark.parametrize("geodetic", [True, False])
@pytest.mark.parametrize("name", ["g.csv", "g.parquet"])
def test_gnss_written_and_read(geodetic: bool, name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    position = rng.normal(size=(5, 3)) * ([0.3, 0.3, 10.0] if geodetic else 10.0)
    velocity, std = rng.normal(size=(5, 3)), rng.uniform(0.01, 1.0, (5, 3))
    write_gnss(tmp_path / name, GnssStream(np.arange(5.0), position, std, velocity, 2 * std), geodetic=geodetic)
    track = read_track(tmp_path / name)
    assert track.geodetic is geodetic
    np.testing.assert_allclose(track.position, position, rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(track.position_std, std)
    np.testing.assert_array_equal(track.velocity, velocity)
    np.testing.assert_array_equal(track.velocity_std, 2 * std)


def test_a_solution_on_a_local_plane_is_a_track(tmp_path: Path) -> None:
    nothing = pa.nulls(3, pa.float64())
    columns: dict[str, object] = {"time_s": [0.0, 1.0, 2.0], "latitude_deg": nothing, "longitude_deg": nothing}
    columns |= {"height_m": [5.0] * 3, "north_m": [1.0, 2.0, 3.0], "east_m": [0.0] * 3, "down_m": [-5.0] * 3}
    columns |= {"roll_deg": [1.0] * 3, "pitch_deg": [2.0] * 3, "heading_deg": [3.0] * 3}
    parquet.write_table(pa.table(columns), tmp_path / "solution.parquet")
    track = read_track(tmp_path / "solution.parquet")
    assert not track.geodetic
    np.testing.assert_array_equal(track.position[1], [2.0, 0.0, 5.0])
    np.testing.assert_allclose(track.attitude, np.tile(np.array([1.0, 2.0, 3.0]) * DEG, (3, 1)))


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


@pytest.mark.parametrize(
    "text",
    [
        "t,x\n1,2\n3,4\n",
        " t , x ,\n1,2,\n3,4,\n",
        "t;x\n1;2\n3;4\n",
        "t\tx\n1\t2\n3\t4\n",
        "  t    x\n  1    2\n  3    4\n",
        "sep=,\nt,x\n1,2\n3,4\n",
        "# a remark\n# t x\n1 2\n3 4\n",
        '"t","x"\r\n1,2\r\n3,4\r\n',
        "t,x\n1,2,\n3,4,\n",
        "\ufefft,x\n1,2\n3,4\n",
    ],
)
def test_headers_and_separators(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8", newline="")
    _, (t, x) = read_columns(tmp_path / "a.csv", ["t", "x"])
    np.testing.assert_array_equal(t, [1.0, 3.0])
    np.testing.assert_array_equal(x, [2.0, 4.0])


def test_empty_cells_are_nan(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,x\n1,2\n3,\n5,nan\n")
    _, (x,) = read_columns(tmp_path / "a.csv", ["x"])
    np.testing.assert_array_equal(x, [2.0, np.nan, np.nan])


def test_the_bad_line_is_named_behind_a_preamble(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("sep=,\n\nt,x\n1,2\n3,four\n")
    with pytest.raises(InputError, match="line 5: x is 'four'; expected a number"):
        read_columns(tmp_path / "a.csv", ["t", "x"])
    (tmp_path / "b.csv").write_text("sep=,\n\nt,x\n1,2\n3\n")
    with pytest.raises(InputError, match="line 5: 1 columns; expected 2"):
        read_columns(tmp_path / "b.csv", ["t", "x"])


def test_parquet_that_is_cut(tmp_path: Path) -> None:
    parquet.write_table(pa.table({"t": [1.0, 2.0]}), tmp_path / "a.parquet")
    content = (tmp_path / "a.parquet").read_bytes()
    (tmp_path / "b.parquet").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match=r"b\.parquet: is not a whole Parquet file"):
        column_names(tmp_path / "b.parquet")


def test_parquet_of_text(tmp_path: Path) -> None:
    parquet.write_table(pa.table({"t": ["now", "then"]}), tmp_path / "a.parquet")
    with pytest.raises(InputError, match=r"a\.parquet: cannot be read as numbers"):
        read_columns(tmp_path / "a.parquet", ["t"])


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
