"""How the error of the vehicle's attitude depends on the states: the part that all measurements in v have in common."""

from __future__ import annotations

from polyins.kernels import bank, kalman, share, vehicle
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import INERTIAL, STRIDE


@scalar_kernel
def add_own(g: Array, w: Array, lane: int, m: Array) -> None:
    """Add TURN times the rotation of the vehicle by the IMU's own errors to the design matrix.

    On the body the vehicle turns by phi - C dm, m the mount; on a wheel only about the vertical, by
    phi_D - a_D (a_N phi_N + a_E phi_E) / (a_N^2 + a_E^2), a the axle: the heading of a tilted axle.
    """
    if w[bank.WHEEL + lane] != 0.0:
        n, e, d = g[share.MATRIX], g[share.MATRIX + 3], g[share.MATRIX + 6]
        tilt = -d / (n * n + e * e)
        for a in range(3):
            about_down = m[kalman.TURN + 3 * a + 2]
            m[kalman.H + a * STRIDE + 6] += about_down * tilt * n
            m[kalman.H + a * STRIDE + 7] += about_down * tilt * e
            m[kalman.H + a * STRIDE + 8] += about_down
    else:
        for a in range(3):
            t = kalman.TURN + 3 * a
            for k in range(3):
                m[kalman.H + a * STRIDE + 6 + k] += m[t + k]
            _add_mount(g, m, kalman.H + a * STRIDE, m[t], m[t + 1], m[t + 2])


@scalar_kernel
def write_lent(groups: Array, s: int, lender: int, m: Array) -> None:
    """Write the design matrix in the states of the share that lends roll and pitch to share s.

    Its phi less that of its mount, turned about the vertical with the lent attitude, tilts the vehicle; the heading
    stays that of the axle, which is tilted with it.
    """
    for k in range(kalman.ROWS * STRIDE):
        m[kalman.LENT + k] = 0.0
    v = vehicle.matrix_at(groups[s], share.VEHICLE)
    u = vehicle.matrix_at(groups[lender], share.VEHICLE)
    # the angle about the vertical between both: first columns have equal down parts
    scale = 1.0 / (v[0] * v[0] + v[3] * v[3])
    cos = (u[0] * v[0] + u[3] * v[3]) * scale
    sin = (u[0] * v[3] - u[3] * v[0]) * scale
    slope = v[7] / (v[1] * v[1] + v[4] * v[4])
    for a in range(3):
        t = kalman.TURN + 3 * a
        n = m[t] + m[t + 2] * slope * v[1]
        e = m[t + 1] + m[t + 2] * slope * v[4]
        h = kalman.LENT + a * STRIDE
        m[h + 6] = n * cos + e * sin
        m[h + 7] = e * cos - n * sin
        _add_mount(groups[lender], m, h, m[h + 6], m[h + 7], 0.0)


@scalar_kernel
def _add_mount(g: Array, m: Array, row: int, n: float, e: float, d: float) -> None:
    """Add -(n, e, d) C in the columns of pitch and yaw of a mount."""
    c = share.MATRIX
    for k in range(1, 3):
        m[row + INERTIAL + k] -= n * g[c + k] + e * g[c + 3 + k] + d * g[c + 6 + k]
