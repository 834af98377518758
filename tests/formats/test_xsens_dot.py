"""Exports of the Xsens DOT."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.xsens_dot import read_imu
from polyins.model.rig import DEG

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
    assert f"{length} destroyed row(s) repaired from its neighbours: line 7" in read.warnings[0]


def test_longer_damage_is_a_gap(tmp_path: Path) -> None:
    whole = read_imu(write(tmp_path / "a.csv", rows(12)))
    values = rows(12)
    for row in range(5, 9):
        values[row][4] = "x"
    read = read_imu(write(tmp_path / "b.csv", values))
    kept = [0, 1, 2, 3, 4, 9, 10, 11]
    np.testing.assert_array_equal(read.time, whole.time[kept])
    np.testing.assert_array_equal(read.dtheta, whole.dtheta[kept])
    (warning,) = read.warnings
    assert "4 destroyed row(s) left out, a gap: line 7, 8, 9, 10" in warning


def test_mostly_damage_is_refused(tmp_path: Path) -> None:
    values = rows(12)
    for row in range(7):
        values[row][4] = "x"
    with pytest.raises(InputError, match="7 of 12 rows without valid Acc and Gyr; expected few"):
        read_imu(write(tmp_path / "a.csv", values))


def test_a_late_halved_row_and_the_empty_one_after_it_are_put_right(tmp_path: Path) -> None:
    whole = read_imu(write(tmp_path / "a.csv", rows(12)))
    values = rows(12)
    late, empty = values[6], values[7]
    late[0] = int(str(late[0])) + STEP_US
    late[4:] = [float(str(value)) / 2.0 for value in late[4:]]
    empty[4:] = ["nan"] * 3 + ["-inf"] * 3
    read = read_imu(write(tmp_path / "b.csv", values))
    np.testing.assert_allclose(read.time, whole.time, atol=1e-9)
    np.testing.assert_allclose(read.dtheta, whole.dtheta, atol=1e-12)
    np.testing.assert_allclose(read.dvel, whole.dvel, atol=1e-12)
    assert len(read.warnings) == 1


def spinning(count: int = 40) -> list[list[object]]:
    values = rows(count)
    for k, row in enumerate(values):
        row[7:] = [3.0 * np.sin(k), 2.0 * np.cos(k), 800.0 + 4.0 * np.sin(3.0 * k)]
    return values


def test_a_believable_rate_that_nothing_around_supports_is_damage(tmp_path: Path) -> None:
    values = spinning()
    values[20][7:] = [-171.0, -3.2, -7.1]
    read = read_imu(write(tmp_path / "a.csv", values))
    step = STEP_US * 1e-6
    assert read.dtheta[20, 2] / DEG / step == pytest.approx(800.0, abs=5.0)
    assert read.dtheta[20, 0] / DEG / step == pytest.approx(0.0, abs=4.0)
    assert "1 destroyed row(s) repaired from its neighbours: line 22" in read.warnings[0]


def test_a_shock_that_rings_is_not_damage(tmp_path: Path) -> None:
    values = spinning()
    for row, rate in zip(values[18:25], (760, 930, 640, 980, 700, 850, 780), strict=True):
        row[9] = rate
    read = read_imu(write(tmp_path / "a.csv", values))
    assert read.warnings == ()
    np.testing.assert_allclose(read.dtheta[19, 2], 930 * DEG * STEP_US * 1e-6)


DAMAGED = {
    ("02", "IMU2_radial"): 1,
    ("09", "CAR"): 1,
    ("09", "IMU2_radial"): 7,
    ("09", "IMU3"): 7,
    ("09", "IMU4"): 9,
    ("09", "IMU4_radial"): 2,
}


@pytest.mark.parametrize(("trial", "name"), [*DAMAGED, ("02", "IMU2"), ("08", "IMU4"), ("02", "IMU1_radial")])
def test_damage_of_a_real_car(trial: str, name: str, data_folder: Path) -> None:
    """All of it is found, and no shock of the road is taken for it."""
    read = read_imu(data_folder / "wid" / f"trial{trial}" / f"{name}.csv")
    steps = np.diff(read.time)
    real_gaps = 1 if (trial, name) == ("09", "IMU4") else 0
    assert np.sum(np.abs(steps - STEP_US * 1e-6) > 1e-6) == real_gaps
    repaired = [text for text in read.warnings if "destroyed" in text]
    assert len(read.warnings) - len(repaired) == 1
    if (trial, name) in DAMAGED:
        assert f": {DAMAGED[trial, name]} destroyed row(s) repaired" in repaired[0]
    else:
        assert not repaired


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


def test_ticks_of_mt_manager_are_no_microseconds(tmp_path: Path) -> None:
    values = [[10 * k, 0, 0, 0, 0.0, 0.0, 9.8, 0.0, 0.0, 0.0] for k in range(9)]
    with pytest.raises(InputError, match="is it an export of MT Manager"):
        read_imu(write(tmp_path / "a.csv", values))
