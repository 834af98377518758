"""Wheel speed: design matrices against differences of residuals, for a vehicle that drives over hills."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import BODY, Check, Moving

from polyins.aiding import kinds
from polyins.kernels import kalman

EVENT = np.array([kinds.WHEEL_SPEED, 3.0, 0.0, 0.1, 1.0])
PHI = range(6, 9)


@pytest.mark.parametrize("s", [0, 1, BODY])
def test_own_columns(vehicle: Moving, check_design: Check, s: int) -> None:
    check_design(vehicle, EVENT, s, range(21), 2e-5)
    check_design(vehicle, EVENT, s, range(21, 24), 2e-4)


@pytest.mark.parametrize("s", [0, 1])
def test_columns_of_the_roll_and_pitch_that_the_body_lends(vehicle: Moving, s: int) -> None:
    differences = vehicle.differences(EVENT, s, BODY, PHI)
    np.testing.assert_allclose(vehicle.design(EVENT, s, PHI, kalman.LENT), differences, atol=1e-6)
    assert np.abs(differences).max() > 0.1
