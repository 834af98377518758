"""Decimated curves keep their peaks, their ends and their gaps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from polyins.report.decimation import kept_for_display, points_per_trace


@given(
    arrays(float, st.tuples(st.integers(1, 400), st.integers(1, 3)), elements=st.floats(-1e6, 1e6)), st.integers(8, 60)
)
def test_extremes_and_ends_survive_within_the_limit(columns, limit):
    kept = kept_for_display(columns, limit)
    assert np.all(np.diff(kept) > 0)
    assert kept.size <= max(limit, 6) + 2
    assert (kept[0], kept[-1]) == (0, len(columns) - 1)
    np.testing.assert_array_equal(columns[kept].max(axis=0), columns.max(axis=0))
    np.testing.assert_array_equal(columns[kept].min(axis=0), columns.min(axis=0))


def test_every_single_spike_of_a_long_curve_survives():
    curve = np.sin(np.arange(200_000) / 5000.0)
    spikes = np.arange(777, 200_000, 9_999)
    curve[spikes] += 5.0
    assert set(spikes) <= set(kept_for_display(curve[:, None], 2000))


def test_short_curves_are_drawn_whole():
    np.testing.assert_array_equal(kept_for_display(np.zeros((50, 1)), 50), np.arange(50))


def test_gaps_stay_gaps_and_hide_no_peak():
    curve = np.full(10_000, 3.0)
    curve[4000] = -8.0
    curve[5003:7011] = np.nan
    kept = kept_for_display(curve[:, None], 100)
    drawn = curve[kept]
    assert np.nanmin(drawn) == -8.0
    missing = np.flatnonzero(np.isnan(drawn))
    assert kept[missing[0]] == 5003
    assert kept[missing[-1]] == 7010
    assert {5002, 7011} <= set(kept)


@pytest.mark.parametrize(("traces", "points"), [(0, 4000), (1, 4000), (40, 1000), (10_000, 100)])
def test_points_are_shared_among_the_traces(traces, points):
    assert points_per_trace(traces) == points
