"""Rows that are no data are left out, named, and counted; what is data stays as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from polyins.checks.no_data import AFTER, FAR, in_order, within_any_range, without_nonsense
from polyins.checks.stream_checks import check_imu
from polyins.errors import InputError
from polyins.formats.rows import ImuRows, RowSource
from polyins.prepare.plausible import BODY, WHEEL

RATE_HZ = 100.0
COUNT = 1000
Array = NDArray[np.float64]


def rows() -> ImuRows:
    """An IMU at rest, in increments."""
    values = np.random.default_rng(1).normal([0.0, 0.0, 0.0, 0.0, 0.0, -9.8], 1e-3, (COUNT, 6)) / RATE_HZ
    return ImuRows(RowSource("a.csv", 2), 100.0 + np.arange(COUNT) / RATE_HZ, values[:, :3], values[:, 3:])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("block", ["dtheta", "dvel", "time"])
def test_rows_that_are_no_numbers_are_left_out(block: str, value: float) -> None:
    spoiled = rows()
    getattr(spoiled, block)[300:400] = value
    kept, (finding,) = without_nonsense(spoiled, "left", 7.0)
    np.testing.assert_array_equal(kept.time, np.delete(rows().time, slice(300, 400)))
    np.testing.assert_array_equal(kept.dvel, np.delete(rows().dvel, slice(300, 400), axis=0))
    assert (finding.kind, finding.stream, finding.size, finding.severity) == ("left out", "left", 100, "note")
    assert finding.from_s == pytest.approx(109.99)
    assert finding.to_s == pytest.approx(110.99)


def test_good_rows_are_returned_as_they_are() -> None:
    good = rows()
    assert without_nonsense(good, "left", 0.0) == (good, ())
    assert within_any_range(good, "left", 0.0, BODY) == (good, ())


def test_a_row_after_one_that_is_left_out_stands_for_its_time() -> None:
    spoiled = rows()
    spoiled.dtheta[500] = np.nan
    kept, _ = without_nonsense(spoiled, "left", 0.0)
    np.testing.assert_allclose(kept.dvel[500], 2.0 * rows().dvel[501], rtol=1e-9)


def test_repeated_stamps_and_one_that_leaps_ahead_are_left_out() -> None:
    spoiled = rows()
    spoiled.time[200] = spoiled.time[199]
    spoiled.time[600:605] += 1000.0
    kept, found = without_nonsense(spoiled, "left", 0.0)
    np.testing.assert_array_equal(kept.time, np.delete(rows().time, [200, *range(600, 605)]))
    assert [(one.kind, one.size) for one in found] == [("left out", 1), ("left out", 5)]
    assert found[1].from_s == pytest.approx(105.99)
    assert found[1].to_s == pytest.approx(106.04)


def test_a_clock_that_goes_back_is_believed_again_when_it_goes_on() -> None:
    spoiled = rows()
    spoiled.time[500:] -= 1.0
    kept, (finding,) = without_nonsense(spoiled, "left", 0.0)
    np.testing.assert_array_equal(kept.time, np.delete(spoiled.time, slice(500, 600)))
    assert finding.size == 100


@pytest.mark.parametrize("stamp", [1e300, -1e300, 0.0, 1e9 + 2.0 * FAR])
@pytest.mark.parametrize("row", [0, 3, 500, COUNT - 4, COUNT - 1])
def test_one_odd_stamp_is_left_out_wherever_it_stands(row: int, stamp: float) -> None:
    time = 1e9 + np.arange(COUNT) / RATE_HZ
    time[row] = stamp
    np.testing.assert_array_equal(np.flatnonzero(~in_order(time)), [row])


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=200))
def test_what_is_in_order_increases(steps: list[float]) -> None:
    time = np.cumsum(steps)
    good = in_order(time)
    assert (np.diff(time[good]) > 0.0).all()
    if (np.diff(time) > 0.0).all():
        assert good.all()


def test_a_long_gap_is_no_leap() -> None:
    time = np.arange(COUNT) / RATE_HZ
    time[500:] += 2.0 * FAR
    assert in_order(time).all()
    assert AFTER < 500


@pytest.mark.parametrize(("block", "size"), [("dtheta", 5.0), ("dvel", 200.0), ("dtheta", 1e30), ("dvel", -1e300)])
def test_one_sample_beyond_any_range_is_left_out(block: str, size: float) -> None:
    spoiled = rows()
    getattr(spoiled, block)[400, 1] = size
    kept, (finding,) = within_any_range(spoiled, "left", 0.0, BODY)
    np.testing.assert_array_equal(kept.time, np.delete(rows().time, 400))
    assert (finding.kind, finding.size) == ("left out", 1)


def test_nonsense_for_most_of_the_time_is_left_out() -> None:
    spoiled = rows()
    spoiled.dtheta[300:, 0] = 1e30
    kept, (finding,) = within_any_range(spoiled, "left", 0.0, BODY)
    assert len(kept.time) == 300
    assert finding.size == 700


def test_degrees_taken_for_radians_are_a_wrong_unit_and_no_fault_of_the_chip() -> None:
    turning = replace(rows(), dtheta=rows().dtheta + 90.0 / RATE_HZ)
    assert within_any_range(turning, "left", 0.0, BODY) == (turning, ())
    with pytest.raises(InputError, match="is the unit"):
        check_imu(turning)


def test_a_wheel_may_turn_faster() -> None:
    turning = replace(rows(), dtheta=rows().dtheta + 90.0 / RATE_HZ)
    assert within_any_range(turning, "left", 0.0, WHEEL) == (turning, ())
