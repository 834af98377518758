"""A point of the vehicle that is known from outside: the middle of the rear axle, or a GNSS antenna.

The former is known as the mean of what all IMUs say of it, paper B (7)-(11). Each IMU predicts the point, a in vehicle
axes, as r + C l - C_nv (p - a): its position, the wheel's centre from it, and its place p in the vehicle.
"""

from __future__ import annotations

import math

from polyins.kernels import bank, kalman, share, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import INERTIAL, STRIDE


@scalar_kernel
def design(g: Array, w: Array, lane: int, point: Array, m: Array) -> None:
    """Write the design matrix at the fused state of a share, and TURN, what a rotation of the vehicle does.

    I on position, (C l) x on phi, -(C_nv (p - a)) x on the rotation of the vehicle, -C e_k on the lever arm of a wheel.
    """
    for k in range(kalman.ROWS * STRIDE):
        m[kalman.H + k] = 0.0
    c = vehicle.matrix_at(g, share.MATRIX)
    x, y, z = vehicle.lever_to_wheel(w, lane)
    n, e, d = vehicle.rotated(c, x, y, z)
    pn, pe, pd = _in_vehicle(w, lane, vehicle.matrix_at(g, share.VEHICLE), point)
    for a in range(3):
        m[kalman.H + a * (STRIDE + 1)] = 1.0
    _skew(m, kalman.H + 6, STRIDE, n, e, d)
    _skew(m, kalman.TURN, 3, -pn, -pe, -pd)
    if w[bank.WHEEL + lane] != 0.0:
        for k in range(1, 3):
            for a in range(3):
                m[kalman.H + a * STRIDE + INERTIAL + k] = -g[share.MATRIX + 3 * a + k]


@scalar_kernel
def residual(
    w: Array, lane: int, lent: vehicle.Matrix, point: Array, position: Array, metres: Array, geodetic: bool
) -> vehicle.Three:
    """Predicted less known position of the point, m north, east, down."""
    x, y, z = vehicle.lever_to_wheel(w, lane)
    n, e, d = vehicle.rotated(vehicle.lane_matrix(w, bank.MATRIX + lane), x, y, z)
    pn, pe, pd = _in_vehicle(w, lane, vehicle.vehicle_matrix(w, lane, lent), point)
    east = w[bank.POSITION + LANES + lane] - position[1]
    if geodetic:
        east -= 2.0 * math.pi * math.floor(east / (2.0 * math.pi) + 0.5)
    return (
        (w[bank.POSITION + lane] - position[0]) * metres[0] + n - pn,
        east * metres[1] + e - pe,
        (w[bank.POSITION + 2 * LANES + lane] - position[2]) * metres[2] + d - pd,
    )


@scalar_kernel
def _in_vehicle(w: Array, lane: int, v: vehicle.Matrix, point: Array) -> vehicle.Three:
    p = bank.IN_VEHICLE + lane
    return vehicle.rotated(v, w[p] - point[0], w[p + LANES] - point[1], w[p + 2 * LANES] - point[2])


@scalar_kernel
def _skew(m: Array, to: int, stride: int, x: float, y: float, z: float) -> None:
    m[to + 1], m[to + 2] = -z, y
    m[to + stride], m[to + stride + 2] = z, -x
    m[to + 2 * stride], m[to + 2 * stride + 1] = -y, x
    m[to] = m[to + stride + 1] = m[to + 2 * stride + 2] = 0.0
