"""Streams of several clocks and rates onto one time base."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.recording import ImuStream
from polyins.prepare.timesync import align

Array = NDArray[np.float64]

FREQUENCIES = np.array([2.0, 3.0, 1.3, 2.2, 1.7, 0.9])


def integral(time: Array) -> Array:
    """The angle and velocity gathered up to a time by rates that swing, shape (T, 6)."""
    return np.asarray(0.5 * time[:, None] - np.cos(time[:, None] * FREQUENCIES) / FREQUENCIES)


def stream(name: str, time: Array) -> ImuStream:
    before = np.concatenate([[2.0 * time[0] - time[1]], time])
    increments = np.diff(integral(before), axis=0)
    return ImuStream(name, time, increments[:, :3], increments[:, 3:])


def regular(rate_hz: float, begin: float = 0.0, seconds: float = 5.0) -> Array:
    return begin + np.arange(round(seconds * rate_hz)) / rate_hz


def test_streams_on_one_clock_pass_unchanged() -> None:
    streams = stream("a", regular(100.0)), stream("b", regular(100.0))
    aligned = align(streams)
    np.testing.assert_array_equal(aligned.time, streams[0].time)
    for i, one in enumerate(streams):
        np.testing.assert_array_equal(aligned.increments[:, :, i], np.hstack([one.dtheta, one.dvel]))
    assert aligned.warnings == ()
    assert aligned.rate_hz == pytest.approx(100.0)


@pytest.mark.parametrize("offset", [-0.5371, -0.0042, 0.0013, 0.8008])
def test_a_clock_offset_is_taken_out(offset: float) -> None:
    aligned = align((stream("a", regular(100.0)), stream("b", regular(100.0, offset))))
    assert aligned.time[0] >= max(0.0, offset)
    assert aligned.time[-1] <= min(4.99, 4.99 + offset)
    difference = aligned.increments[1:, :, 1] - aligned.increments[1:, :, 0]
    # interpolation between neighbouring stamps: an eighth of the interval squared times the slope of the rate, twice
    assert np.abs(difference).max() < 0.25 * 0.01**2 * 3.0
    unshifted = np.abs(np.diff(aligned.increments[1:, :, 0], axis=0)).max()
    if abs(offset) > 0.1:
        assert np.abs(difference).max() < unshifted


@pytest.mark.parametrize("rate_hz", [37.0, 250.0, 1000.0])
def test_another_rate_becomes_that_of_the_first_stream(rate_hz: float) -> None:
    aligned = align((stream("a", regular(100.0)), stream("b", regular(rate_hz, -0.1, 5.2))))
    np.testing.assert_allclose(aligned.time, regular(100.0), atol=1e-12)
    interval = max(0.01, 1.0 / rate_hz)
    expected = np.diff(integral(aligned.time), axis=0)
    assert np.abs(aligned.increments[1:, :, 1] - expected).max() < 0.25 * interval**2 * 3.0


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(0, 40))
def test_no_rotation_is_lost_or_counted_twice(seed: int, every: int, first: int) -> None:
    """Stamps of the slow stream are some of the fast one's, which jitters: its increments add up exactly."""
    rng = np.random.default_rng(seed)
    fast = np.cumsum(rng.uniform(0.005, 0.015, 400))
    values = rng.standard_normal((400, 6))
    slow = np.arange(first, 400, every)
    base = ImuStream("slow", fast[slow], np.zeros((len(slow), 3)), np.zeros((len(slow), 3)))
    aligned = align((base, ImuStream("fast", fast, values[:, :3], values[:, 3:])))
    np.testing.assert_array_equal(aligned.time, fast[slow])
    sums = np.add.reduceat(values, slow[:-1] + 1, axis=0)
    sums[-1] = values[slow[-2] + 1 : slow[-1] + 1].sum(axis=0)
    np.testing.assert_allclose(aligned.increments[1:, :, 1], sums, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-0.3, 0.3), st.floats(20.0, 400.0))
def test_the_sum_over_the_common_span_is_that_of_the_stream(seed: int, offset: float, rate_hz: float) -> None:
    """Whatever clocks and rates are: what a stream with a steady rate gathers is rate times time."""
    rng = np.random.default_rng(seed)
    rate, other = rng.standard_normal(6), regular(rate_hz, offset)
    steady = np.tile(rate / rate_hz, (len(other), 1))
    aligned = align((stream("a", regular(100.0)), ImuStream("b", other, steady[:, :3], steady[:, 3:])))
    expected = np.outer(np.diff(aligned.time), rate)
    np.testing.assert_allclose(aligned.increments[1:, :, 1], expected, rtol=1e-9, atol=1e-13)


def without(time: Array, *gaps: tuple[float, float]) -> Array:
    for begin, end in gaps:
        time = time[(time <= begin + 1e-9) | (time >= end - 1e-9)]
    return time


def test_where_one_imu_has_a_gap_it_gets_the_mean_of_the_others() -> None:
    full, holed = regular(100.0), without(regular(100.0), (2.0, 2.2))
    streams = stream("a", full), stream("b", holed), stream("c", full)
    aligned = align(streams)
    inside = (full > 2.0 + 1e-9) & (full <= 2.2 + 1e-9)
    mean = 0.5 * (aligned.increments[:, :, 0] + aligned.increments[:, :, 2])
    assert inside.sum() == 20
    np.testing.assert_allclose(aligned.increments[inside, :, 1], mean[inside], rtol=1e-15)
    exact = np.hstack([streams[0].dtheta, streams[0].dvel])
    np.testing.assert_allclose(aligned.increments[~inside, :, 1], exact[~inside], atol=1e-14)
    assert len(aligned.warnings) == 1
    assert "IMU b" in aligned.warnings[0]
    assert "0.200 s" in aligned.warnings[0]
    assert "2.000 s" in aligned.warnings[0]


def test_a_gap_in_the_first_imu_leaves_no_hole_in_the_time_base() -> None:
    """The time base is that of an IMU without gaps, and where the first one has one it is given what the other has."""
    aligned = align((stream("a", without(regular(100.0), (2.0, 2.2))), stream("b", regular(100.0))))
    np.testing.assert_allclose(np.diff(aligned.time), 0.01, rtol=1e-9)
    inside = (aligned.time > 2.0 + 1e-9) & (aligned.time <= 2.2 + 1e-9)
    assert inside.sum() == 20
    np.testing.assert_array_equal(aligned.increments[inside, :, 0], aligned.increments[inside, :, 1])


def test_where_all_have_a_gap_it_is_bridged_by_the_rates_on_both_sides() -> None:
    aligned = align((stream("a", without(regular(100.0), (2.0, 2.2))),))
    k = np.searchsorted(aligned.time, 2.2 - 1e-9)
    rates = aligned.increments[[k - 1, k + 1], :, 0] / 0.01
    np.testing.assert_allclose(aligned.increments[k, :, 0], 0.2 * rates.mean(axis=0), rtol=1e-12)
    assert len(aligned.warnings) == 1
    np.testing.assert_array_equal(np.isfinite(aligned.increments), True)


def test_a_few_missing_samples_are_no_gap() -> None:
    aligned = align((stream("a", without(regular(100.0), (2.0, 2.03))), stream("b", regular(100.0))))
    assert aligned.warnings == ()


def test_the_warning_says_how_many_gaps_and_where_the_longest_is() -> None:
    holed = without(regular(100.0), (1.0, 1.1), (2.0, 2.5), (3.0, 3.1))
    (warning,) = align((stream("left", holed),)).warnings
    assert "IMU left" in warning
    assert "3 gaps" in warning
    assert "0.500 s at 2.000 s" in warning


def test_gaps_outside_the_common_span_are_not_spoken_of() -> None:
    early = without(regular(100.0, -5.0, 10.0), (-2.0, -1.0))
    aligned = align((stream("a", early), stream("b", regular(100.0))), bridge=False)
    assert not [text for text in aligned.warnings if "gap" in text]


def test_an_imu_that_begins_late_is_waited_for_where_none_stands_in_for_it() -> None:
    aligned = align((stream("a", regular(100.0)), stream("b", regular(100.0)[150:])), bridge=False)
    assert aligned.time[0] == 1.5
    (warning,) = aligned.warnings
    assert "IMU b: begins at 1.5" in warning
    assert "before is not used" in warning
    assert align((stream("a", regular(100.0)), stream("b", regular(100.0)[50:]))).warnings == ()


@pytest.mark.parametrize("late", [0, 1, 2])
def test_an_imu_that_begins_late_is_missing_until_then(late: int) -> None:
    """Whichever it is, and whatever gaps the others have."""
    full = regular(100.0)
    times = [without(full, (3.0, 3.2)), without(full, (2.0, 2.2), (2.5, 2.7)), full]
    times[late] = full[150:]
    aligned = align(tuple(stream(name, time) for name, time in zip("abc", times, strict=True)))
    np.testing.assert_allclose(aligned.time, full, atol=1e-12)
    first = int(np.flatnonzero(~aligned.missing[:, late])[0])
    assert first in (150, 151)
    np.testing.assert_array_equal(aligned.missing[first:, late], False)
    others = [i for i in range(3) if i != late]
    mean = aligned.increments[:first, :, others].mean(axis=2)
    np.testing.assert_allclose(aligned.increments[:first, :, late], mean, atol=1e-15)
    assert [text for text in aligned.warnings if f"IMU {'abc'[late]}: begins at 1.500 s, 1.5 s after" in text]


def test_a_stream_without_any_row_is_missing_throughout() -> None:
    nothing = ImuStream("b", np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
    aligned = align((stream("a", regular(100.0)), nothing))
    assert aligned.missing[:, 1].all()
    np.testing.assert_array_equal(aligned.increments[:, :, 1], aligned.increments[:, :, 0])


def test_an_imu_that_stops_early_does_not_end_the_recording() -> None:
    full = regular(100.0)
    aligned = align((stream("a", full), stream("b", full), stream("c", full[:-200])))
    np.testing.assert_array_equal(aligned.time, full)
    assert aligned.missing[-199:, 2].all()
    np.testing.assert_allclose(aligned.increments[-199:, :, 2], aligned.increments[-199:, :, :2].mean(axis=2))
    assert len(aligned.warnings) == 1
    assert "IMU c" in aligned.warnings[0]


def test_streams_that_hardly_overlap_are_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"less than two common seconds.*left 0\.000.*right 3\.100"):
        align((stream("left", regular(100.0)), stream("right", regular(100.0, 3.1))))
    assert len(align((stream("left", regular(100.0)), stream("right", regular(100.0, 2.9)))).time) > 200


def test_a_part_includes_both_ends() -> None:
    aligned = align((stream("a", regular(100.0)),))
    part = aligned.between(aligned.time[100], aligned.time[200])
    np.testing.assert_array_equal(part.time, aligned.time[100:201])
    np.testing.assert_array_equal(part.increments, aligned.increments[100:201])


@pytest.mark.parametrize("imus", [1, 3, 8, 11, 16])
@pytest.mark.parametrize("order", ["C", "F"])
def test_streams_lie_side_by_side(imus: int, order: Literal["C", "F"]) -> None:
    rng, time = np.random.default_rng(imus), 0.01 * np.arange(1, 701)
    values = [np.asarray(rng.standard_normal((700, 6)), order=order) for _ in range(imus)]
    streams = tuple(ImuStream(f"imu{i}", time, v[:, :3], v[:, 3:]) for i, v in enumerate(values))
    np.testing.assert_array_equal(align(streams).increments, np.stack(values, axis=2))
