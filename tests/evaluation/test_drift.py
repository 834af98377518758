"""Drift rates of errors that grow in a known way."""

import numpy as np
import pytest

from polyins.evaluation.drift import drift, drift_curve, drift_rates
from polyins.evaluation.errors import Errors


def errors_of(distance: np.ndarray, horizontal: np.ndarray) -> Errors:
    position = np.column_stack([0.6 * horizontal, 0.8 * horizontal, np.full_like(distance, 50.0)])
    return Errors(distance / 5.0, position, None, None, distance, np.ones(distance.shape, bool))


def test_an_error_proportional_to_the_way_has_that_rate():
    distance = np.linspace(0.0, 1050.0, 5001)
    result = drift(errors_of(distance, 0.007 * distance))
    assert result["step_m"] == 100.0
    assert result["distance_m"] == pytest.approx(1050.0)
    assert result["rate_percent"] == pytest.approx(0.7, rel=1e-3)
    assert result["end_percent"] == pytest.approx(0.7)


def test_the_maximum_so_far_counts_not_the_error_at_the_multiple():
    distance = np.arange(0.0, 301.0)
    horizontal = np.where(distance == 50.0, 3.0, 0.0)
    result = drift(errors_of(distance, horizontal))
    assert result["rate_percent"] == pytest.approx(100.0 * 3.0 * (1 / 100 + 1 / 200 + 1 / 300) / 3)
    assert result["end_percent"] == 0.0


def test_the_step_is_free():
    distance = np.arange(0.0, 101.0)
    horizontal = np.where(distance == 80.0, 2.0, 0.0)
    assert drift(errors_of(distance, horizontal))["rate_percent"] == pytest.approx(2.0)
    assert drift(errors_of(distance, horizontal), step=50.0)["rate_percent"] == pytest.approx(1.0)


def test_too_short_a_way_has_no_rate():
    short = drift(errors_of(np.array([0.0, 99.0]), np.array([0.0, 1.0])))
    assert short["rate_percent"] is None
    assert short["distance_m"] == 99.0
    still = drift(errors_of(np.zeros(3), np.ones(3)))
    assert (still["rate_percent"], still["end_percent"]) == (None, None)
    assert drift(None) == {"step_m": 100.0, "distance_m": None, "rate_percent": None, "end_percent": None}


def test_the_curve_is_the_maximum_so_far_over_the_way_so_far():
    distance = np.arange(0.0, 301.0)
    errors = errors_of(distance, np.where(distance == 50.0, 3.0, 0.0))
    curve = drift_curve(errors)
    assert np.isnan(curve[0])
    assert curve[49] == 0.0
    np.testing.assert_allclose(curve[50:], 300.0 / distance[50:])


def test_the_rate_is_the_mean_of_the_curve_at_the_multiples():
    distance = np.linspace(0.0, 550.0, 2201)
    errors = errors_of(distance, np.random.default_rng(1).normal(size=distance.size).cumsum())
    multiples, rates = drift_rates(errors)
    np.testing.assert_array_equal(multiples, [100.0, 200.0, 300.0, 400.0, 500.0])
    np.testing.assert_allclose(rates, drift_curve(errors)[np.searchsorted(distance, multiples)])
    assert drift(errors)["rate_percent"] == pytest.approx(rates.mean())


def test_a_vehicle_that_stands_has_no_curve():
    errors = errors_of(np.zeros(3), np.ones(3))
    assert np.isnan(drift_curve(errors)).all()
    assert drift_rates(errors)[0].size == 0
