"""What a filter is told of flicker and random walk."""

from __future__ import annotations

import numpy as np
import pytest

from polyins.calibration.allan import variances
from polyins.calibration.gauss_markov import CORRELATION_TIME_S, drift_std, unit_variance
from polyins.calibration.noise_model import allan_variance_of
from polyins.simulation.imu_errors import gauss_markov


def test_the_allan_variance_of_the_process_is_that_of_a_simulation() -> None:
    step, factors = 0.02, np.array([5, 50, 200])
    made = gauss_markov(200_000, step, np.random.default_rng(0))
    shown = np.mean([variances([column], factors) for column in made.T], axis=0)
    np.testing.assert_allclose(shown, unit_variance(factors * step), rtol=0.05)


def test_short_times_go_over_without_a_step() -> None:
    below, above = unit_variance(np.array([0.009999, 0.010001]))
    assert above == pytest.approx(below, rel=3e-4)


@pytest.mark.parametrize("squares", [[4.0, 0.01, 1e-5], [4.0, 0.01, 0.0], [4.0, 0.0, 1e-4]])
def test_it_is_nowhere_less_and_somewhere_equal(squares: list[float]) -> None:
    of, longest = np.array(squares), 3000.0
    tau = np.geomspace(1.0, longest, 400)
    slow = allan_variance_of(np.array([0.0, *squares[1:]]), tau)
    seen = slow > 1.2 * of[0] / tau
    ratio = drift_std(of, longest) ** 2 * unit_variance(tau / CORRELATION_TIME_S) / slow
    assert ratio[seen].min() > 0.98
    assert ratio[slow > of[0] / tau].min() == pytest.approx(1.0, abs=0.05)


def test_a_random_walk_is_told_as_one() -> None:
    walk = 1e-3
    expected = walk * np.sqrt(CORRELATION_TIME_S / 2.0)
    assert drift_std(np.array([1.0, 0.0, walk**2]), 20.0) == pytest.approx(expected, rel=0.01)
