"""Consistency figures of errors drawn from the stated covariance, and of errors that are not."""

import numpy as np
import pytest
from synthetic_solutions import drive, innovations, moved, reference, solution

from polyins.evaluation.consistency import mean_nis, nees, nees_bounds, position_nees, share_inside
from polyins.evaluation.errors import compare_to_reference
from polyins.evaluation.summary import summarize
from polyins.model.solution import NO_INNOVATIONS

RUNS, INSTANTS, STATES = 40, 2000, 4


def drawn(scale: float) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(7)
    root = generator.normal(size=(INSTANTS, STATES, STATES)) + 2.0 * np.eye(STATES)
    covariance = root @ root.swapaxes(1, 2)
    errors = (root @ generator.normal(size=(RUNS, INSTANTS, STATES, 1)))[..., 0]
    return scale * errors, np.broadcast_to(covariance, (RUNS, *covariance.shape))


def test_errors_of_the_stated_covariance_are_inside_the_bounds_as_often_as_promised():
    average = nees(*drawn(1.0))
    assert average.shape == (INSTANTS,)
    assert np.mean(average) == pytest.approx(STATES, rel=0.02)
    assert share_inside(average, RUNS, STATES) == pytest.approx(0.95, abs=0.015)
    assert share_inside(average, RUNS, STATES, probability=0.5) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_errors_too_small_or_too_large_for_the_covariance_fall_outside(scale):
    assert share_inside(nees(*drawn(scale)), RUNS, STATES) < 0.01


def test_bounds_of_one_run_are_those_of_the_tables():
    assert nees_bounds(1, 3) == pytest.approx((0.2158, 9.3484), abs=1e-4)
    assert nees_bounds(50, 2) == pytest.approx((74.222 / 50, 129.561 / 50), abs=1e-4)


def test_position_nees_of_one_run_is_three_when_the_variances_are_right():
    truth = drive(duration=600.0)
    generator = np.random.default_rng(1)
    std = np.array([0.5, 2.0, 1.0]) * np.linspace(1.0, 3.0, truth.time.size)[:, None]
    noise = generator.normal(size=(truth.time.size, 3)) * std
    noisy = solution(truth, position=moved(truth.geodetic, noise), position_variance=std**2)
    late = reference(truth, time=truth.time[100:], position=truth.geodetic[100:], velocity=None, attitude=None)
    errors = compare_to_reference(noisy, late)
    expected = np.sum((noise / std)[100:] ** 2, axis=1)
    np.testing.assert_allclose(position_nees(noisy, errors), expected, rtol=1e-5)
    assert summarize(noisy, late)["consistency"]["nees_position"] == pytest.approx(3.0, rel=0.05)


def test_rejected_fixes_do_not_count_in_the_mean_nis():
    shown = innovations(np.arange(3000.0), seed=2, rejected=(3, 700))
    assert mean_nis(shown) == pytest.approx(3.0, rel=0.05)
    assert mean_nis(NO_INNOVATIONS) is None
    assert summarize(solution(drive()), None)["consistency"] == {"nees_position": None, "nis_gnss": None}
