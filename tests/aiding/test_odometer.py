"""Odometer and nonholonomic constraint: design matrices against differences of residuals."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import BODY, Check, Moving

from polyins.aiding import kinds

EVENT = np.array([kinds.ODOMETER, 3.0, 0.0, 0.0, -0.4, 0.1, 0.5])


def test_of_an_array(array: Moving, check_design: Check) -> None:
    check_design(array, EVENT, atol=1e-5)


@pytest.mark.parametrize("s", [0, 1, BODY])
def test_of_a_vehicle(vehicle: Moving, check_design: Check, s: int) -> None:
    check_design(vehicle, EVENT, s, range(21), 2e-5)
    check_design(vehicle, EVENT, s, range(21, 26), 2e-3)
