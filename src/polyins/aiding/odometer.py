"""The speed of an odometer, and that a vehicle moves neither sideways nor up where its wheels touch the ground.

A point of the vehicle, usually the middle of the rear axle, moves with C_vn u in vehicle axes, u as in `velocity`:
forward as fast as the odometer says, times one plus its scale error, and not at all to the right and down. Without a
speed the two latter still hold; the variances say which components are measured.

Of the value: speed, m/s; place of the point 3, from the fourth number on.
"""

from __future__ import annotations

from polyins.aiding import velocity
from polyins.aiding.measurement import VALUE, put_turn, unit
from polyins.kernels import bank, covariance, kalman, vehicle
from polyins.kernels.covariance import LARGEST
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

_SPEED_SCALE = place("speed_scale")
COLUMNS = place("speed_scale") + 3
"""beyond these `velocity.design` writes nothing"""


@scalar_kernel
def design(block: Array, lanes: Array, lane: int, measurement: Array, update: Array) -> None:
    """Write the design matrix at the fused state of a block, and TURN.

    C_vn times that of u; the rotation of the vehicle turns C_vn as well, which adds C_vn (theta x u); the speed stands
    beside its own relative error.
    """
    velocity.design(block, lanes, lane, measurement, update)
    v = vehicle.matrix_at(block, covariance.VEHICLE)
    u = velocity.of_fused_point(block, lanes, lane, measurement)
    for j in range(COLUMNS):
        h = kalman.H + j
        x, y, z = vehicle.rotated_back(v, update[h], update[h + LARGEST], update[h + 2 * LARGEST])
        update[h], update[h + LARGEST], update[h + 2 * LARGEST] = x, y, z
    for k in range(3):
        i, j_, h_ = unit(k)
        n, e, d = vehicle.cross(i, j_, h_, u[0], u[1], u[2])
        t = kalman.TURN + k
        put_turn(update, k, vehicle.rotated_back(v, update[t] + n, update[t + 3] + e, update[t + 6] + d))
    update[kalman.H + _SPEED_SCALE] = measurement[VALUE]


@scalar_kernel
def residual(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> vehicle.Three:
    """Velocity of the point now less the measured one: forward, right, down, m/s."""
    v = vehicle.vehicle_matrix(lanes, lane, lent)
    u = velocity.of_point(lanes, lane, v, measurement)
    x, y, z = vehicle.rotated_back(v, u[0], u[1], u[2])
    return x - (1.0 + lanes[bank.SPEED_SCALE + lane]) * measurement[VALUE], y, z
