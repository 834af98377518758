"""A height: design matrices against differences of residuals, the bias among the states."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import BODY, Check, Moving

from polyins.aiding import kinds
from polyins.kernels import covariance as cov


def event(moving: Moving) -> np.ndarray:
    return np.array([kinds.HEIGHT, moving.run.state.blocks[0, cov.POSITION + 2], 0.0, 0.0, 0.4, -0.7, -1.1])


def test_of_an_array(array: Moving, check_design: Check) -> None:
    check_design(array, event(array))


@pytest.mark.parametrize("s", [0, 1, BODY])
def test_of_a_vehicle(vehicle: Moving, check_design: Check, s: int) -> None:
    check_design(vehicle, event(vehicle), s, range(21))
    check_design(vehicle, event(vehicle), s, range(21, 26), 2e-4)
