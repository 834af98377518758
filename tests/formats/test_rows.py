"""Rows left out of a stream."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polyins.formats.rows import ImuRows, RowSource, without

STEP = 0.01


def constant(count: int) -> ImuRows:
    """Constant rates: 1 rad/s and 10 m/s^2."""
    time = STEP * np.arange(1, count + 1)
    return ImuRows(RowSource("a"), time, np.full((count, 3), STEP), np.full((count, 3), 10 * STEP))


@given(st.integers(1, 3), st.integers(1, 15))
def test_a_short_hole_loses_nothing_of_a_constant_motion(length: int, first: int) -> None:
    rows = constant(20)
    bad = np.zeros(20, dtype=bool)
    bad[first : first + length] = True
    left = without(rows, bad)
    np.testing.assert_allclose(left.dtheta.sum(axis=0), rows.dtheta.sum(axis=0))
    np.testing.assert_allclose(left.dvel.sum(axis=0), rows.dvel.sum(axis=0))
    assert len(left.time) == 20 - length


def test_a_long_hole_is_a_gap() -> None:
    rows = constant(20)
    bad = np.zeros(20, dtype=bool)
    bad[5:9] = True
    left = without(rows, bad)
    np.testing.assert_allclose(left.dtheta, STEP)
    assert np.diff(left.time).max() == pytest.approx(5 * STEP)


def test_rows_left_out_at_the_ends_belong_to_nobody() -> None:
    rows = constant(20)
    bad = np.zeros(20, dtype=bool)
    bad[[0, 1, 19]] = True
    np.testing.assert_allclose(without(rows, bad).dtheta, STEP)
