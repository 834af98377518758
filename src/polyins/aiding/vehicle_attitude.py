"""How the error of the vehicle's attitude depends on the states: the part that all measurements in v have in common."""

from __future__ import annotations

from polyins.kernels import bank, covariance, kalman, vehicle
from polyins.kernels.covariance import LARGEST
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

_MOUNT = place("mount")


@scalar_kernel
def add_own(block: Array, lanes: Array, lane: int, update: Array) -> None:
    """Add TURN times the rotation of the vehicle by the IMU's own errors to the design matrix.

    On the body the vehicle turns by phi - C dm, m the mount; on a wheel only about the vertical, by
    phi_D - a_D (a_N phi_N + a_E phi_E) / (a_N^2 + a_E^2), a the axle: the heading of a tilted axle.
    """
    if lanes[bank.RADIUS + lane] != 0.0:
        n, e, d = block[covariance.MATRIX], block[covariance.MATRIX + 3], block[covariance.MATRIX + 6]
        tilt = -d / (n * n + e * e)
        for a in range(3):
            about_down = update[kalman.TURN + 3 * a + 2]
            update[kalman.H + a * LARGEST + 6] += about_down * tilt * n
            update[kalman.H + a * LARGEST + 7] += about_down * tilt * e
            update[kalman.H + a * LARGEST + 8] += about_down
    else:
        for a in range(3):
            t = kalman.TURN + 3 * a
            for k in range(3):
                update[kalman.H + a * LARGEST + 6 + k] += update[t + k]
            _add_mount(block, update, kalman.H + a * LARGEST, update[t], update[t + 1], update[t + 2])


@scalar_kernel
def write_lent(blocks: Array, s: int, lender: int, update: Array) -> None:
    """Write the design matrix in the states of the block that lends roll and pitch to block s.

    Its phi less that of its mount, turned about the vertical with the lent attitude, tilts the vehicle; the heading
    stays that of the axle, which is tilted with it.
    """
    for k in range(kalman.ROWS * LARGEST):
        update[kalman.LENT + k] = 0.0
    v = vehicle.matrix_at(blocks[s], covariance.VEHICLE)
    u = vehicle.matrix_at(blocks[lender], covariance.VEHICLE)
    # the angle about the vertical between both: first columns have equal down parts
    scale = 1.0 / (v[0] * v[0] + v[3] * v[3])
    cos = (u[0] * v[0] + u[3] * v[3]) * scale
    sin = (u[0] * v[3] - u[3] * v[0]) * scale
    slope = v[7] / (v[1] * v[1] + v[4] * v[4])
    for a in range(3):
        t = kalman.TURN + 3 * a
        n = update[t] + update[t + 2] * slope * v[1]
        e = update[t + 1] + update[t + 2] * slope * v[4]
        h = kalman.LENT + a * LARGEST
        update[h + 6] = n * cos + e * sin
        update[h + 7] = e * cos - n * sin
        _add_mount(blocks[lender], update, h, update[h + 6], update[h + 7], 0.0)


@scalar_kernel
def _add_mount(block: Array, update: Array, row: int, n: float, e: float, d: float) -> None:
    """Add -(n, e, d) C in the columns of pitch and yaw of a mount."""
    c = covariance.MATRIX
    for k in range(1, 3):
        update[row + _MOUNT + k - 1] -= n * block[c + k] + e * block[c + 3 + k] + d * block[c + 6 + k]
