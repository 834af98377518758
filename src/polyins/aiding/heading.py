"""The heading of the vehicle: of two antennas, a compass or another system.

What is shown is the heading and a constant offset, which the filter may estimate. With f the forward axis of the
vehicle in n, a small rotation theta of the vehicle changes f by f x theta and the heading, atan2(f_E, f_N), by

    f_D (f_N theta_N + f_E theta_E) / (f_N^2 + f_E^2) - theta_D

Of the value: heading, rad.
"""

from __future__ import annotations

import math

from polyins.aiding.measurement import VALUE, put_turn
from polyins.kernels import bank, covariance, kalman, vehicle
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

_HEADING_OFFSET = place("heading_offset")


@scalar_kernel
def design(block: Array, update: Array) -> None:
    """Write TURN, what a rotation of the vehicle does, and -1 on the offset, whose estimate is added."""
    v = vehicle.matrix_at(block, covariance.VEHICLE)
    slope = v[6] / (v[0] * v[0] + v[3] * v[3])
    put_turn(update, 0, (slope * v[0], 0.0, 0.0))
    put_turn(update, 1, (slope * v[3], 0.0, 0.0))
    put_turn(update, 2, (-1.0, 0.0, 0.0))
    update[kalman.H + _HEADING_OFFSET] = -1.0


@scalar_kernel
def residual(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> vehicle.Three:
    """Predicted less shown heading, rad, the shorter way round."""
    v = vehicle.vehicle_matrix(lanes, lane, lent)
    off = math.atan2(v[3], v[0]) + lanes[bank.HEADING_OFFSET + lane] - measurement[VALUE]
    return off - 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5), 0.0, 0.0
