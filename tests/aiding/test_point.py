"""A known point of the vehicle: design matrices against differences of residuals, for arrays and on wheels."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import BODY, Check, Moving

from polyins.aiding import kinds
from polyins.kernels import covariance as cov
from polyins.kernels import kalman

PLACE = np.array([0.2, 0.1, -0.8])
OWN, PHI = range(26), range(6, 9)


def event(moving: Moving, kind: int = kinds.GNSS_POSITION) -> np.ndarray:
    return np.array([kind, *moving.run.state.blocks[0, cov.POSITION : cov.POSITION + 3], *PLACE])


def test_of_an_array(array: Moving, check_design: Check) -> None:
    check_design(array, event(array))


@pytest.mark.parametrize("kind", [kinds.GNSS_POSITION, kinds.REFERENCE_POINT])
@pytest.mark.parametrize("s", [0, 1, BODY])
def test_of_a_vehicle(vehicle: Moving, check_design: Check, kind: int, s: int) -> None:
    check_design(vehicle, event(vehicle, kind), s, range(21))
    check_design(vehicle, event(vehicle, kind), s, range(21, 26), 2e-4)


@pytest.mark.parametrize("s", [0, 1])
def test_of_the_roll_and_pitch_that_the_body_lends(vehicle: Moving, s: int) -> None:
    differences = vehicle.differences(event(vehicle), s, BODY, PHI)
    np.testing.assert_allclose(vehicle.design(event(vehicle), s, PHI, kalman.LENT), differences, atol=1e-6)
    assert np.abs(differences).max() > 0.1


@pytest.mark.parametrize("turns", [-1, 1])
def test_longitudes_are_compared_around_the_globe(array: Moving, turns: int) -> None:
    here = event(array)
    around = here.copy()
    around[2] += 2.0 * np.pi * turns
    residuals = [
        array.measure(one, 0, 0, np.zeros(26))[kalman.RESIDUAL : kalman.RESIDUAL + 3] for one in (here, around)
    ]
    np.testing.assert_allclose(residuals[1], residuals[0], atol=1e-8)
