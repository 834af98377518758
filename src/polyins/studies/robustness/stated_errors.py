"""Errors of a solution beside what it says that they may be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.errors import Errors
from polyins.model.attitude import euler_angles, euler_variance
from polyins.model.solution import Solution

Array = NDArray[np.float64]


class StatedErrors(NamedTuple):
    """Errors of a solution, and what it said they might be."""

    time: Array
    """s, shape (T,)"""
    horizontal: Array
    """m, shape (T,)"""
    over: Array
    """the larger one of horizontal position and heading over its standard deviation, shape (T,)"""


def stated_errors(solution: Solution, errors: Errors) -> StatedErrors:
    """Return the errors of a solution over its standard deviations; without attitudes the position's alone."""
    rows = errors.covered
    over = errors.horizontal / np.sqrt(solution.position_variance[rows, :2].sum(axis=1))
    if errors.attitude is not None:
        variance = euler_variance(euler_angles(solution.attitude[rows]), solution.phi_covariance[rows])
        over = np.maximum(over, np.abs(errors.attitude[:, 2]) / np.sqrt(variance[:, 2]))
    return StatedErrors(errors.time, errors.horizontal, over)
