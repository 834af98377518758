"""The noise of a bridged pause is what a random walk between two known rates integrates to."""

from __future__ import annotations

import numpy as np
import pytest

from polyins.aiding import kinds
from polyins.navigate import bridging

SNAP = 1e-3


def walks(length: float, steps: int, count: int) -> np.ndarray:
    """Random walks of strength one that begin and end at zero, (count, steps + 1)."""
    dt = length / steps
    moved = np.random.default_rng(3).normal(0.0, np.sqrt(dt), (count, steps))
    walk = np.concatenate([np.zeros((count, 1)), np.cumsum(moved, axis=1)], axis=1)
    return np.asarray(walk - np.linspace(0.0, 1.0, steps + 1) * walk[:, -1:])


def epochs(length: float, after: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two epochs of rate zero, a pause after which two IMUs turn at the rate `after`, and one epoch more."""
    time = np.array([0.0, 0.01, 0.01 + length, 0.02 + length])
    increments = np.zeros((4, 6, 2))
    increments[2, 2] = 0.5 * after * length
    increments[3, 2] = after * 0.01
    return time, increments, np.array([False, False, True, False])


@pytest.mark.parametrize("length", [0.1, 0.8])
def test_an_array_is_as_unsure_as_a_walk_between_the_rates(length: float) -> None:
    found = bridging.of_array(*epochs(length, 0.0), SNAP)
    assert list(found.kind) == [kinds.PAUSE]
    assert 0.01 + SNAP < found.time[0] < 0.01 + 2.0 * SNAP
    position, velocity, tilt, heading = found.value[0, :4]
    bridge, dt = walks(length, 400, 4000), length / 400
    once = np.cumsum(bridge, axis=1) * dt
    twice = once.sum(axis=1) * dt
    assert tilt == heading == pytest.approx(bridging.RATE_CHANGE**2 * once[:, -1].var(), rel=0.1)
    assert velocity == pytest.approx(bridging.FORCE_CHANGE**2 * once[:, -1].var(), rel=0.1)
    assert position == pytest.approx(bridging.FORCE_CHANGE**2 * twice.var(), rel=0.1)


def test_rates_that_differ_much_leave_more_unknown() -> None:
    usual, turning = (bridging.of_array(*epochs(0.5, after), SNAP).value[0] for after in (0.0, 2.0))
    np.testing.assert_array_equal(turning[:2], usual[:2])
    np.testing.assert_allclose(turning[2:4], 2.0**2 / 0.5 * 0.5**3 / 12.0, rtol=1e-9)


def test_without_a_pause_there_is_none() -> None:
    time, increments, missing = epochs(0.5, 0.0)
    assert not len(bridging.of_array(time, increments, missing & False, SNAP).time)
    assert not len(bridging.of_wheels(time, missing & False, SNAP).time)
    assert len(bridging.of_wheels(time, missing, SNAP).time) == 1
