"""The WGS-84 earth: radii, gravity, rates, and the metric of positions.

Sources: WGS 84; the gravity formula is the one of KF-GINS, whose results serve as a check.
"""

from __future__ import annotations

import math

from polyins.kernels.bank import (
    AT_POSITION,
    AT_VELOCITY,
    EARTH_RATE,
    GRAVITY,
    LANES,
    TO_LATITUDE,
    TO_LONGITUDE,
    TRANSPORT_RATE,
)
from polyins.kernels.jit import Array, formula, kernel, scalar_kernel

A = 6378137.0
"""semi-major axis, m"""
E2 = 0.00669437999014
"""first eccentricity squared"""
EARTH_RATE_RAD_S = 7.2921151467e-5


@formula
def normal_gravity(s2: float, height: float) -> float:
    """Return gravity, m/s^2, from the squared sine of latitude and the ellipsoidal height in metres."""
    g0 = 9.7803267715 * (1.0 + s2 * (0.0052790414 + s2 * (0.0000232718 + s2 * (0.0000001262 + s2 * 0.0000000007))))
    return g0 - (3.0877e-6 - 4.3e-9 * s2) * height + 0.72e-12 * height * height


@kernel
def gravity(latitude: float, height: float) -> float:
    """Return gravity, m/s^2, at a latitude (rad) and ellipsoidal height (m)."""
    s = math.sin(latitude)
    return normal_gravity(s * s, height)


@kernel
def radii(latitude: float) -> tuple[float, float]:
    """Return the meridian and the transverse radius of curvature R_M, R_N, m."""
    s = math.sin(latitude)
    w2 = 1.0 - E2 * s * s
    w = math.sqrt(w2)
    return A * (1.0 - E2) / (w2 * w), A / w


@kernel
def metric(position: Array, geodetic: bool, metres: Array) -> None:
    """Write D, metres north, east, down per unit of each coordinate of a position, into `metres`, shape (3,)."""
    metres[0] = 1.0
    metres[1] = 1.0
    metres[2] = -1.0
    if geodetic:
        r_m, r_n = radii(position[0])
        metres[0] = r_m + position[2]
        metres[1] = (r_n + position[2]) * math.cos(position[0])


@kernel
def evaluate(lanes: Array, latitude: float, sine: float, cosine: float) -> None:
    """Evaluate the earth for each IMU of a block at AT_POSITION, AT_VELOCITY.

    `latitude` is one near all of them (within 1e-3 rad), with its sine and cosine: the sines of the others follow
    from the addition theorem to rounding, without a call that would stop the loop from vectorizing.
    """
    for i in range(LANES):
        d = lanes[AT_POSITION + i] - latitude
        height = lanes[AT_POSITION + 2 * LANES + i]
        v_n = lanes[AT_VELOCITY + i]
        v_e = lanes[AT_VELOCITY + LANES + i]
        d2 = d * d
        sin_d = d * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0)))
        cos_d = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0))
        s = sine * cos_d + cosine * sin_d
        c = cosine * cos_d - sine * sin_d
        s2 = s * s
        w2 = 1.0 - E2 * s2
        root = math.sqrt(w2)
        # R_N = A / root, R_M = A (1 - E2) / root^3; one division for all three reciprocals
        east = A + height * root
        north = A * (1.0 - E2) + height * root * w2
        inverse = 1.0 / (north * east * c)
        per_north = root * w2 * (inverse * east * c)
        per_east = root * (inverse * north * c)
        secant = inverse * north * east
        lanes[GRAVITY + i] = normal_gravity(s2, height)
        lanes[EARTH_RATE + i] = EARTH_RATE_RAD_S * c
        lanes[EARTH_RATE + LANES + i] = -EARTH_RATE_RAD_S * s
        lanes[TRANSPORT_RATE + i] = v_e * per_east
        lanes[TRANSPORT_RATE + LANES + i] = -v_n * per_north
        lanes[TRANSPORT_RATE + 2 * LANES + i] = -v_e * per_east * s * secant
        lanes[TO_LATITUDE + i] = per_north
        lanes[TO_LONGITUDE + i] = per_east * secant


@scalar_kernel
def move_reference(earth_reference: Array, latitude: float) -> None:
    """Make a latitude the one near which the earth is evaluated."""
    earth_reference[1] = latitude
    earth_reference[2] = math.sin(latitude)
    earth_reference[3] = math.cos(latitude)


@kernel
def evaluate_plane(lanes: Array, plane_gravity: float) -> None:
    """Fill the same fields for a local tangent plane: constant gravity, no rates, positions in metres."""
    for i in range(LANES):
        lanes[GRAVITY + i] = plane_gravity
        lanes[EARTH_RATE + i] = 0.0
        lanes[EARTH_RATE + LANES + i] = 0.0
        lanes[TRANSPORT_RATE + i] = 0.0
        lanes[TRANSPORT_RATE + LANES + i] = 0.0
        lanes[TRANSPORT_RATE + 2 * LANES + i] = 0.0
        lanes[TO_LATITUDE + i] = 1.0
        lanes[TO_LONGITUDE + i] = 1.0
