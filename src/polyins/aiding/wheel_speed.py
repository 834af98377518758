"""Wheel speed and nonholonomic constraint as a velocity in vehicle axes, paper B (3)-(6).

The speed is the mean over a short window. It belongs to a point of the rear axle: `lateral` m to the right of its
middle, the mean place of the wheels that give it. What is predicted is the velocity of that point.
"""

from __future__ import annotations

from polyins.kernels import bank, kalman, share, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import INERTIAL, STRIDE


@scalar_kernel
def open_window(w: Array, lane: int, lent: vehicle.Matrix, lateral: float) -> None:
    """Begin to add up what the point travels."""
    for k in range(3):
        w[bank.TRAVELLED + k * LANES + lane] = 0.0
        w[bank.TURNED + k * LANES + lane] = 0.0
    _remember(w, lane, vehicle.vehicle_matrix(w, lane, lent), _point(w, lane, lateral))


@scalar_kernel
def fill_window(w: Array, lane: int, lent: vehicle.Matrix, lateral: float, dt: float) -> None:
    """Add what the point travelled during the last epoch, in vehicle axes of the middle of the epoch."""
    v = vehicle.vehicle_matrix(w, lane, lent)
    point = _point(w, lane, lateral)
    n = point[0] - w[bank.BEFORE_POINT + lane]
    e = point[1] - w[bank.BEFORE_POINT + LANES + lane]
    d = point[2] - w[bank.BEFORE_POINT + 2 * LANES + lane]
    n += 0.5 * dt * (w[bank.VELOCITY + lane] + w[bank.BEFORE_VELOCITY + lane])
    e += 0.5 * dt * (w[bank.VELOCITY + LANES + lane] + w[bank.BEFORE_VELOCITY + LANES + lane])
    d += 0.5 * dt * (w[bank.VELOCITY + 2 * LANES + lane] + w[bank.BEFORE_VELOCITY + 2 * LANES + lane])
    before = vehicle.rotated_back(vehicle.lane_matrix(w, bank.BEFORE_VEHICLE + lane), n, e, d)
    after = vehicle.rotated_back(v, n, e, d)
    for k in range(3):
        w[bank.TRAVELLED + k * LANES + lane] += 0.5 * (before[k] + after[k])
        w[bank.TURNED + k * LANES + lane] += w[bank.DTHETA + k * LANES + lane]
    _remember(w, lane, v, point)


@scalar_kernel
def _point(w: Array, lane: int, lateral: float) -> vehicle.Three:
    """C l to the point of the speed, m north, east, down."""
    x, y, z = vehicle.lever_to_speed(w, lane, lateral)
    return vehicle.rotated(vehicle.lane_matrix(w, bank.MATRIX + lane), x, y, z)


@scalar_kernel
def _remember(w: Array, lane: int, v: vehicle.Matrix, point: vehicle.Three) -> None:
    for k in range(3):
        w[bank.BEFORE_POINT + k * LANES + lane] = point[k]
        w[bank.BEFORE_VELOCITY + k * LANES + lane] = w[bank.VELOCITY + k * LANES + lane]
    for k in range(9):
        w[bank.BEFORE_VEHICLE + k * LANES + lane] = v[k]


@scalar_kernel
def residual_of_window(w: Array, lane: int, speed: float, duration: float) -> vehicle.Three:
    """Mean velocity of the point over the window, less the measured one: forward, right, down, m/s."""
    measured = (1.0 + w[bank.MOUNTING + lane]) * speed
    per_second = 1.0 / duration
    return (
        w[bank.TRAVELLED + lane] * per_second - measured,
        w[bank.TRAVELLED + LANES + lane] * per_second,
        w[bank.TRAVELLED + 2 * LANES + lane] * per_second,
    )


@scalar_kernel
def residual_at_end(
    w: Array, lane: int, lent: vehicle.Matrix, lateral: float, speed: float, dt: float
) -> vehicle.Three:
    """Velocity of the point now, with the mean rate of the last `dt` seconds, less the measured one, m/s."""
    c = vehicle.lane_matrix(w, bank.MATRIX + lane)
    n, e, d = _point(w, lane, lateral)
    rn, re, rd = vehicle.rotated(
        c,
        w[bank.DTHETA + lane] / dt,
        w[bank.DTHETA + LANES + lane] / dt,
        w[bank.DTHETA + 2 * LANES + lane] / dt,
    )
    un, ue, ud = vehicle.cross(rn - w[bank.EARTH_RATE + lane], re, rd - w[bank.EARTH_RATE + LANES + lane], n, e, d)
    x, y, z = vehicle.rotated_back(
        vehicle.vehicle_matrix(w, lane, lent),
        w[bank.VELOCITY + lane] + un,
        w[bank.VELOCITY + LANES + lane] + ue,
        w[bank.VELOCITY + 2 * LANES + lane] + ud,
    )
    return x - (1.0 + w[bank.MOUNTING + lane]) * speed, y, z


@scalar_kernel
def design(g: Array, w: Array, lane: int, lateral: float, speed: float, m: Array) -> None:
    """Write the design matrix at the fused state of a share, and TURN, what a rotation of the vehicle does.

    z = C_vn u, u = v + C (w x l): C_vn on velocity, C_vn (C (w x l)) x on phi, C_vn C (e_k x l) on the gyro's bias,
    times w_k on its scale; -C_vn (u x) on the rotation of the vehicle; the speed on its own relative error; on a
    wheel -C_vn C (w x e_k) on the lever arm. See docs/theory; paper B (5), (6), (12), (14), which misprint signs.
    """
    for k in range(kalman.ROWS * STRIDE):
        m[kalman.H + k] = 0.0
    v = vehicle.matrix_at(g, share.VEHICLE)
    c = vehicle.matrix_at(g, share.MATRIX)
    x, y, z = g[share.RATE], g[share.RATE + 1], g[share.RATE + 2]
    lx, ly, lz = vehicle.lever_to_speed(w, lane, lateral)
    bx, by, bz = vehicle.cross(x, y, z, lx, ly, lz)
    n, e, d = vehicle.rotated(c, bx, by, bz)
    un, ue, ud = g[share.VELOCITY] + n, g[share.VELOCITY + 1] + e, g[share.VELOCITY + 2] + d
    for k in range(3):
        i, j, h = _unit(k)
        _column(m, 3 + k, vehicle.rotated_back(v, i, j, h))
        # (a x) e_k = a x e_k
        _column(m, 6 + k, vehicle.rotated_back(v, *vehicle.cross(n, e, d, i, j, h)))
        _turn(m, k, vehicle.rotated_back(v, *vehicle.cross(i, j, h, un, ue, ud)))
        by_bias = vehicle.rotated_back(v, *vehicle.rotated(c, *vehicle.cross(i, j, h, lx, ly, lz)))
        rate = g[share.RATE + k]
        _column(m, 9 + k, by_bias)
        _column(m, 15 + k, (by_bias[0] * rate, by_bias[1] * rate, by_bias[2] * rate))
        if k > 0 and w[bank.WHEEL + lane] != 0.0:
            _column(m, INERTIAL + k, vehicle.rotated_back(v, *vehicle.rotated(c, *vehicle.cross(i, j, h, x, y, z))))
    m[kalman.H + INERTIAL] = speed


@scalar_kernel
def _unit(k: int) -> vehicle.Three:
    return 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0


@scalar_kernel
def _column(m: Array, column: int, values: vehicle.Three) -> None:
    for a in range(3):
        m[kalman.H + a * STRIDE + column] = values[a]


@scalar_kernel
def _turn(m: Array, k: int, values: vehicle.Three) -> None:
    for a in range(3):
        m[kalman.TURN + 3 * a + k] = values[a]
