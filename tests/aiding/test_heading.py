"""A heading: design matrices against differences of residuals, the offset among the states."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import BODY, Check, Moving

from polyins.aiding import kinds

EVENT = np.array([kinds.HEADING, 1.5])


def test_of_an_array(array: Moving, check_design: Check) -> None:
    check_design(array, EVENT)


@pytest.mark.parametrize("s", [0, 1, BODY])
def test_of_a_vehicle(vehicle: Moving, check_design: Check, s: int) -> None:
    check_design(vehicle, EVENT, s, range(21))
    check_design(vehicle, EVENT, s, range(21, 26), 2e-4)
