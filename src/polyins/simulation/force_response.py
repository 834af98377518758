"""What specific force does to the readings beyond being measured: g-sensitivity and rectified vibration.

A gyro shows G f besides the rate. An accelerometer shows k f^2 besides the force f, which of a vibration leaves the
constant k times its mean square.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import Vector, zero_vector
from polyins.simulation.triads import product

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ForceResponse:
    """How one chip answers to force, in its own axes."""

    g_sensitivity: Array = field(default_factory=lambda: np.zeros((3, 3)))
    """of the gyros, rad/s per m/s^2, shape (3, 3)"""
    rectification: Vector = field(default_factory=zero_vector)
    """of the accelerometers, m/s^2 per (m/s^2)^2"""

    def gyro(self, dvel: Array) -> Array:
        """Return what velocity increments, m/s, shape (T, 3), add to the gyro's, rad."""
        return product(self.g_sensitivity, dvel)

    def accel(self, dvel: Array, vibration: Array, interval: float) -> Array:
        """Return what the squares of force add to the velocity increments, m/s, shape (T, 3).

        `vibration` is the mean square of the vibration along each axis that the increments do not show, (m/s^2)^2,
        shape (T,). What gravity alone adds along the vertical is part of the bias that a bench shows, so it is not
        counted again.
        """
        square = (dvel / interval) ** 2
        # the first interval is one at rest, or near enough to one for a constant
        return np.asarray(self.rectification * (square - square[0] + vibration[:, None]) * interval)


def draw_force_response(
    g_sensitivity_std: float, rectification_mean: float, rectification_std: float, rng: np.random.Generator
) -> ForceResponse:
    """Draw one chip: nine independent elements of G, three of k about a mean that is that of the chip's type."""
    matrix = g_sensitivity_std * rng.standard_normal((3, 3))
    return ForceResponse(matrix, rectification_mean + rectification_std * rng.standard_normal(3))
