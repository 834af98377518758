"""The velocity of a point: design matrices against differences of residuals, for arrays and on wheels."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import BODY, Check, Moving

from polyins.aiding import kinds
from polyins.kernels import kalman

EVENT = np.array([kinds.GNSS_VELOCITY, 0.1, -0.2, 0.3, 0.4, -0.7, -1.1])
PHI = range(6, 9)


def test_of_an_array(array: Moving, check_design: Check) -> None:
    check_design(array, EVENT)


@pytest.mark.parametrize("s", [0, 1, BODY])
def test_of_a_vehicle(vehicle: Moving, check_design: Check, s: int) -> None:
    check_design(vehicle, EVENT, s, range(21), 2e-5)
    check_design(vehicle, EVENT, s, range(21, 26), 2e-3)


@pytest.mark.parametrize("s", [0, 1])
def test_of_the_roll_and_pitch_that_the_body_lends(vehicle: Moving, s: int) -> None:
    differences = vehicle.differences(EVENT, s, BODY, PHI)
    np.testing.assert_allclose(vehicle.design(EVENT, s, PHI, kalman.LENT), differences, atol=1e-6)
