"""The rotating WGS-84 Earth, vectorized over time: radii, normal gravity and its gradient, rates of the n frame.

Normal gravity is the closed series in powers of sin^2(latitude) with second-order height terms (WGS-84).
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEMI_MAJOR_AXIS = 6378137.0  # m
ECCENTRICITY_SQUARED = 0.00669437999014
ROTATION_RATE = 7.2921151467e-5  # rad/s

EQUATOR_GRAVITY = 9.7803267715  # m/s^2
GRAVITY_SERIES = (1.0, 0.0052790414, 0.0000232718, 0.0000001262, 0.0000000007)
"""in powers of sin^2(latitude)"""


def radii(position: Array) -> tuple[Array, Array]:
    """Return R_M + h and R_N + h, m, shape (T,) each, of positions (lat rad, lon rad, h m), shape (T, 3)."""
    w = 1.0 - ECCENTRICITY_SQUARED * np.sin(position[..., 0]) ** 2
    prime_vertical = SEMI_MAJOR_AXIS / np.sqrt(w)
    return prime_vertical * (1.0 - ECCENTRICITY_SQUARED) / w + position[..., 2], prime_vertical + position[..., 2]


def gravity(position: Array) -> Array:
    """Return normal gravity, m/s^2 downwards, shape (T,), at positions of shape (T, 3)."""
    s2, h = np.sin(position[..., 0]) ** 2, position[..., 2]
    at_ellipsoid = EQUATOR_GRAVITY * polyval(s2, GRAVITY_SERIES)
    return np.asarray(at_ellipsoid - (3.0877e-6 - 4.3e-9 * s2) * h + 0.72e-12 * h**2)


def gravity_gradient(position: Array) -> Array:
    """Return d(gravity vector)/d(displacement), both in one n frame, 1/s^2, shape (T, 3, 3).

    The vector is (0, 0, gravity) in the n frame of each place, and that frame turns by one over the radius per metre.
    """
    meridian, transverse = radii(position)
    s, c, h = np.sin(position[..., 0]), np.cos(position[..., 0]), position[..., 2]
    slope = EQUATOR_GRAVITY * polyval(s**2, polyder(GRAVITY_SERIES)) + 4.3e-9 * h
    gradient = np.zeros((*s.shape, 3, 3))
    gradient[..., 0, 0] = -gravity(position) / meridian
    gradient[..., 1, 1] = -gravity(position) / transverse
    gradient[..., 2, 0] = slope * 2.0 * s * c / meridian
    gradient[..., 2, 2] = 3.0877e-6 - 4.3e-9 * s**2 - 1.44e-12 * h
    return gradient


def earth_rate(position: Array) -> Array:
    """Return w_ie in n, rad/s, shape (T, 3)."""
    latitude = position[..., 0]
    return ROTATION_RATE * np.stack([np.cos(latitude), np.zeros_like(latitude), -np.sin(latitude)], axis=-1)


def transport_rate(position: Array, velocity: Array) -> Array:
    """Return w_en in n, rad/s, shape (T, 3), of a velocity NED, m/s, shape (T, 3)."""
    meridian, transverse = radii(position)
    east = velocity[..., 1] / transverse
    return np.stack([east, -velocity[..., 0] / meridian, -east * np.tan(position[..., 0])], axis=-1)


def displacement(position: Array, metres: Array) -> Array:
    """Return the change of (lat rad, lon rad, h m), shape (T, 3), for small displacements NED, m, shape (T, 3).

    First order: exact to a ten-thousandth of a millimetre per metre of displacement. With a velocity instead of a
    displacement it gives the rates of the coordinates, exactly.
    """
    meridian, transverse = radii(position)
    return np.stack(
        [metres[..., 0] / meridian, metres[..., 1] / (transverse * np.cos(position[..., 0])), -metres[..., 2]], axis=-1
    )
