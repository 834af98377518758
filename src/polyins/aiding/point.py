"""A point of the vehicle that is known from outside: a GNSS antenna, or the middle of the rear axle.

The latter is known as the mean of what all IMUs say of it, paper B (7)-(11). Each IMU predicts the point, a in vehicle
axes, as r + C l - C_nv (p - a): its position, the centre of its wheel from it (nothing on the body), and its place p in
the vehicle. For an IMU of an array that is r + C (a - p), paper A (6)-(7).

Of the value: position 3, place of the point 3.
"""

from __future__ import annotations

import math

from polyins.aiding.measurement import GEODETIC, METRIC, PLACE, VALUE, put_column, put_skew, put_turn, unit
from polyins.kernels import bank, covariance, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

_PHI, _MOUNT = place("phi"), place("mount")


@scalar_kernel
def design(block: Array, lanes: Array, lane: int, measurement: Array, update: Array) -> None:
    """Write the design matrix at the fused state of a block, and TURN, what a rotation of the vehicle does.

    I on position, (C l) x on phi, -(C_nv (p - a)) x on the rotation of the vehicle, -C e_k on the lever arm of a wheel.
    """
    c, v = vehicle.matrix_at(block, covariance.MATRIX), vehicle.matrix_at(block, covariance.VEHICLE)
    n, e, d = to_wheel(lanes, lane, c)
    p = covariance.PLACE
    pn, pe, pd = vehicle.rotated(
        v,
        block[p] - measurement[PLACE],
        block[p + 1] - measurement[PLACE + 1],
        block[p + 2] - measurement[PLACE + 2],
    )
    put_skew(update, _PHI, n, e, d)
    for k in range(3):
        i, j, h = unit(k)
        put_column(update, k, (i, j, h))
        # -(p x) e_k
        put_turn(update, k, vehicle.cross(i, j, h, pn, pe, pd))
        if k > 0 and lanes[bank.RADIUS + lane] != 0.0:
            put_column(update, _MOUNT + k - 1, (-c[k], -c[3 + k], -c[6 + k]))


@scalar_kernel
def residual(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> vehicle.Three:
    """Predicted less known position of the point, m north, east, down."""
    n, e, d = to_wheel(lanes, lane, vehicle.lane_matrix(lanes, bank.MATRIX + lane))
    p = bank.IN_VEHICLE + lane
    pn, pe, pd = vehicle.rotated(
        vehicle.vehicle_matrix(lanes, lane, lent),
        lanes[p] - measurement[PLACE],
        lanes[p + LANES] - measurement[PLACE + 1],
        lanes[p + 2 * LANES] - measurement[PLACE + 2],
    )
    east = lanes[bank.POSITION + LANES + lane] - measurement[VALUE + 1]
    if measurement[GEODETIC] != 0.0:
        east -= 2.0 * math.pi * math.floor(east / (2.0 * math.pi) + 0.5)
    return (
        (lanes[bank.POSITION + lane] - measurement[VALUE]) * measurement[METRIC] + n - pn,
        east * measurement[METRIC + 1] + e - pe,
        (lanes[bank.POSITION + 2 * LANES + lane] - measurement[VALUE + 2]) * measurement[METRIC + 2] + d - pd,
    )


@scalar_kernel
def to_wheel(lanes: Array, lane: int, c: vehicle.Matrix) -> vehicle.Three:
    """C l, m north, east, down; nothing on the body."""
    if lanes[bank.RADIUS + lane] == 0.0:
        return 0.0, 0.0, 0.0
    x, y, z = vehicle.lever_to_wheel(lanes, lane)
    return vehicle.rotated(c, x, y, z)
