"""Exports of the Xsens DOT."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.io.xsens_dot import read_imu
from polyins.rig import DEG

NAMES = "SampleTimeFine,Euler_X,Euler_Y,Euler_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z"
STEP_US = 8333


def rows(count: int, first_us: int = 1_000_000) -> list[list[object]]:
    """Acceleration (1, 2, 9.8 + k / 10), rate (k, -k, 3)."""
    return [
        [(first_us + k * STEP_US) % 2**32, 0, 0, 0, 1.0, 2.0, 9.8 + k / 10, float(k), float(-k), 3.0]
        for k in range(1, count + 1)
    ]


def write(path: Path, values: list[list[object]], header: str = NAMES, end: str = "") -> Path:
    lines = [header, *(",".join(str(value) for value in row) + end for row in values)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_increments_are_mean_rates_times_intervals(tmp_path: Path) -> None:
    read = read_imu(write(tmp_path / "a.csv", rows(6)))
    step = STEP_US * 1e-6
    np.testing.assert_allclose(read.time, 1.0 + step * np.arange(1, 7))
    np.testing.assert_allclose(read.dvel[:, 2], (9.8 + np.arange(1, 7) / 10) * step)
    np.testing.assert_allclose(read.dtheta[:, 1], -np.arange(1, 7) * DEG * step)
    assert read.warnings == ()


@pytest.mark.parametrize(
    ("header", "end"),
    [
        (NAMES, ""),
        (NAMES + ",", ", "),
        (NAMES, ","),
        ("sep=,\n" + NAMES + ",", ", "),
        ("DeviceTag:,x\nFirmwareVersion:,2.0\n\n" + NAMES, ""),
    ],
)
def test_headers_of_all_kinds(header: str, end: str, tmp_path: Path) -> None:
    plain = read_imu(write(tmp_path / "a.csv", rows(6)))
    read = read_imu(write(tmp_path / "b.csv", rows(6), header, end))
    np.testing.assert_array_equal(read.dvel, plain.dvel)
    assert (tmp_path / "b.csv").read_text().splitlines()[read.source.first_line - 1].startswith("1008333")


def test_a_first_row_of_zeros_is_left_out_and_said_so(tmp_path: Path) -> None:
    zero: list[object] = [1_000_000, 5, 5, 5, 0, 0, 0, 0, 0, 0]
    read = read_imu(write(tmp_path / "a.csv", [zero, *rows(6)]))
    assert len(read.time) == 6
    assert "line 2: all values are zero" in read.warnings[0]


def test_the_counter_runs_on_after_its_end(tmp_path: Path) -> None:
    read = read_imu(write(tmp_path / "a.csv", rows(8, first_us=2**32 - 3 * STEP_US)))
    np.testing.assert_allclose(np.diff(read.time), STEP_US * 1e-6, atol=1e-9)


def test_time_in_seconds(tmp_path: Path) -> None:
    values = rows(5)
    for k, row in enumerate(values):
        row[0] = 20.0 + k * 0.01
    read = read_imu(write(tmp_path / "a.csv", values, NAMES.replace("SampleTimeFine", "time")))
    np.testing.assert_allclose(read.time, 20.0 + 0.01 * np.arange(5))


def test_with_a_rate_stamps_are_not_even_read(tmp_path: Path) -> None:
    values = rows(5)
    values[2][0] = "broken"
    read = read_imu(write(tmp_path / "a.csv", values), rate_hz=120.0)
    np.testing.assert_allclose(read.time, np.arange(5) / 120.0)
    np.testing.assert_allclose(read.dtheta[:, 2], 3.0 * DEG / 120.0)


@pytest.mark.parametrize("damage", ["#NAME?", "nan", "", "1e-40", "1e30", "-inf", "2500"])
@pytest.mark.parametrize("length", [1, 3])
def test_damage_is_bridged_with_a_warning(damage: str, length: int, tmp_path: Path) -> None:
    whole = read_imu(write(tmp_path / "a.csv", rows(12)))
    values = rows(12)
    for row in range(5, 5 + length):
        values[row][7] = damage
    read = read_imu(write(tmp_path / "b.csv", values))
    # The values change linearly with the row, so a bridge by interpolation is exact.
    np.testing.assert_allclose(read.dtheta, whole.dtheta, atol=1e-12)
    np.testing.assert_array_equal(read.dvel, whole.dvel)
    assert len(read.warnings) == 1
    assert f"line 7: {length} row(s) without a valid Gyr_X; interpolated" in read.warnings[0]


def test_longer_damage_is_refused(tmp_path: Path) -> None:
    values = rows(12)
    for row in range(5, 9):
        values[row][4] = "x"
    with pytest.raises(InputError, match="line 7: 4 rows in a row without a valid Acc_X; expected at most 3"):
        read_imu(write(tmp_path / "a.csv", values))


def test_missing_columns(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no column 'Gyr_Z'"):
        read_imu(write(tmp_path / "a.csv", [row[:9] for row in rows(3)], NAMES.removesuffix(",Gyr_Z")))
    with pytest.raises(InputError, match=r"no column SampleTimeFine or time; expected one, or rate_hz"):
        read_imu(write(tmp_path / "b.csv", rows(3), NAMES.replace("SampleTimeFine", "count")))
    with pytest.raises(InputError, match=r"no line of column names with Gyr_X"):
        read_imu(write(tmp_path / "c.csv", rows(3), "a,b,c"))


def test_raw_recording(data_folder: Path) -> None:
    for number in (1, 2, 3, 4):
        read = read_imu(data_folder / "quadrotor" / "RAW_1111" / f"IMU_{number}.csv")
        assert len(read.warnings) == 1
        np.testing.assert_allclose(np.diff(read.time), 1 / 120, rtol=1e-3)
        mean = read.dvel.sum(axis=0) / (read.time[-1] - read.time[0])
        assert 8.5 < mean[2] < 11.0
