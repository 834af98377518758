"""A local tangent plane that does not turn: constant gravity, positions (north m, east m, height m)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import FilterOptions

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plane:
    """The plane as a world for paths."""

    constant_gravity: float = FilterOptions.gravity
    """m/s^2"""

    def gravity(self, position: Array) -> Array:
        """Return gravity, m/s^2 downwards, shape (T,)."""
        return np.full(position.shape[:-1], self.constant_gravity)

    def gravity_gradient(self, position: Array) -> Array:
        """Return no change of gravity, 1/s^2, shape (T, 3, 3)."""
        return np.zeros((*position.shape, 3))

    def earth_rate(self, position: Array) -> Array:
        """Return no w_ie, rad/s, shape (T, 3)."""
        return np.zeros_like(position)

    def transport_rate(self, position: Array, velocity: Array) -> Array:
        """Return no w_en, rad/s, shape (T, 3)."""
        return np.zeros(np.broadcast_shapes(position.shape, velocity.shape))

    def displacement(self, position: Array, metres: Array) -> Array:
        """Return the change of (north m, east m, height m), shape (T, 3), for displacements NED, m, shape (T, 3)."""
        return np.broadcast_to(metres * [1.0, 1.0, -1.0], position.shape)
