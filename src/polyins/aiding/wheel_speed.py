"""Wheel speed and nonholonomic constraint as a mean velocity in vehicle axes over a short window, paper B (3)-(6).

The wheels' gyros give the speed as a mean over the window. It belongs to a point of the rear axle: `lateral` m to the
right of its middle, the mean place of the wheels that give it. What is predicted is what that point travelled. With
`predict: end` the prediction is its velocity at the end of the window, as the paper has it: half a window late.

Of the value: speed, m/s; lateral, m; how long the window was, s; whether the end is predicted.
"""

from __future__ import annotations

from polyins.aiding.measurement import DT, VALUE, put_column, put_turn, unit
from polyins.kernels import bank, covariance, kalman, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

SPEED, LATERAL, DURATION, AT_END = range(VALUE, VALUE + 4)

_VELOCITY, _PHI, _MOUNT, _SPEED_SCALE = place("velocity"), place("phi"), place("mount"), place("speed_scale")
_GYRO_BIAS, _GYRO_SCALE = place("gyro_bias"), place("gyro_scale")


@scalar_kernel
def open_window(lanes: Array, lane: int, lent: vehicle.Matrix, lateral: float) -> None:
    """Begin to add up what the point travels."""
    for k in range(3):
        lanes[bank.TRAVELLED + k * LANES + lane] = 0.0
        lanes[bank.TURNED + k * LANES + lane] = 0.0
    _remember(lanes, lane, vehicle.vehicle_matrix(lanes, lane, lent), _point(lanes, lane, lateral))


@scalar_kernel
def fill_window(lanes: Array, lane: int, lent: vehicle.Matrix, lateral: float, dt: float) -> None:
    """Add what the point travelled during the last epoch, in vehicle axes of the middle of the epoch."""
    v = vehicle.vehicle_matrix(lanes, lane, lent)
    point = _point(lanes, lane, lateral)
    n = point[0] - lanes[bank.BEFORE_POINT + lane]
    e = point[1] - lanes[bank.BEFORE_POINT + LANES + lane]
    d = point[2] - lanes[bank.BEFORE_POINT + 2 * LANES + lane]
    n += 0.5 * dt * (lanes[bank.VELOCITY + lane] + lanes[bank.BEFORE_VELOCITY + lane])
    e += 0.5 * dt * (lanes[bank.VELOCITY + LANES + lane] + lanes[bank.BEFORE_VELOCITY + LANES + lane])
    d += 0.5 * dt * (lanes[bank.VELOCITY + 2 * LANES + lane] + lanes[bank.BEFORE_VELOCITY + 2 * LANES + lane])
    before = vehicle.rotated_back(vehicle.lane_matrix(lanes, bank.BEFORE_VEHICLE + lane), n, e, d)
    after = vehicle.rotated_back(v, n, e, d)
    for k in range(3):
        lanes[bank.TRAVELLED + k * LANES + lane] += 0.5 * (before[k] + after[k])
        lanes[bank.TURNED + k * LANES + lane] += lanes[bank.DTHETA + k * LANES + lane]
    _remember(lanes, lane, v, point)


@scalar_kernel
def _point(lanes: Array, lane: int, lateral: float) -> vehicle.Three:
    """C l to the point of the speed, m north, east, down."""
    p = bank.IN_VEHICLE + lane
    x, y, z = vehicle.lever_to_speed(lanes, lane, lanes[p], lanes[p + LANES], lanes[p + 2 * LANES], lateral)
    return vehicle.rotated(vehicle.lane_matrix(lanes, bank.MATRIX + lane), x, y, z)


@scalar_kernel
def _remember(lanes: Array, lane: int, v: vehicle.Matrix, point: vehicle.Three) -> None:
    for k in range(3):
        lanes[bank.BEFORE_POINT + k * LANES + lane] = point[k]
        lanes[bank.BEFORE_VELOCITY + k * LANES + lane] = lanes[bank.VELOCITY + k * LANES + lane]
    for k in range(9):
        lanes[bank.BEFORE_VEHICLE + k * LANES + lane] = v[k]


@scalar_kernel
def residual(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> vehicle.Three:
    """Velocity of the point, its mean over the window or that at its end, less the measured one, m/s."""
    measured = (1.0 + lanes[bank.SPEED_SCALE + lane]) * measurement[SPEED]
    if measurement[AT_END] != 0.0:
        x, y, z = _at_end(lanes, lane, lent, measurement)
        return x - measured, y, z
    per_second = 1.0 / measurement[DURATION]
    return (
        lanes[bank.TRAVELLED + lane] * per_second - measured,
        lanes[bank.TRAVELLED + LANES + lane] * per_second,
        lanes[bank.TRAVELLED + 2 * LANES + lane] * per_second,
    )


@scalar_kernel
def _at_end(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> vehicle.Three:
    """Velocity of the point now, with the mean rate of the last DT seconds: forward, right, down, m/s."""
    c, dt = vehicle.lane_matrix(lanes, bank.MATRIX + lane), measurement[DT]
    n, e, d = _point(lanes, lane, measurement[LATERAL])
    rn, re, rd = vehicle.rotated(
        c,
        lanes[bank.DTHETA + lane] / dt,
        lanes[bank.DTHETA + LANES + lane] / dt,
        lanes[bank.DTHETA + 2 * LANES + lane] / dt,
    )
    rn -= lanes[bank.EARTH_RATE + lane]
    rd -= lanes[bank.EARTH_RATE + LANES + lane]
    un, ue, ud = vehicle.cross(rn, re, rd, n, e, d)
    return vehicle.rotated_back(
        vehicle.vehicle_matrix(lanes, lane, lent),
        lanes[bank.VELOCITY + lane] + un,
        lanes[bank.VELOCITY + LANES + lane] + ue,
        lanes[bank.VELOCITY + 2 * LANES + lane] + ud,
    )


@scalar_kernel
def design(block: Array, lanes: Array, lane: int, measurement: Array, update: Array) -> None:
    """Write the design matrix at the fused state of a block, and TURN, what a rotation of the vehicle does.

    z = C_vn u, u = v + C (w x l): C_vn on velocity, C_vn (C (w x l)) x on phi, C_vn C (e_k x l) on the gyro's bias,
    times w_k on its scale; -C_vn (u x) on the rotation of the vehicle; the speed on its own relative error; on a
    wheel -C_vn C (w x e_k) on the lever arm. See docs/theory; paper B (5), (6), (12), (14), which misprint signs.
    """
    v = vehicle.matrix_at(block, covariance.VEHICLE)
    c = vehicle.matrix_at(block, covariance.MATRIX)
    x, y, z = block[covariance.RATE], block[covariance.RATE + 1], block[covariance.RATE + 2]
    p = covariance.PLACE
    lx, ly, lz = vehicle.lever_to_speed(lanes, lane, block[p], block[p + 1], block[p + 2], measurement[LATERAL])
    bx, by, bz = vehicle.cross(x, y, z, lx, ly, lz)
    n, e, d = vehicle.rotated(c, bx, by, bz)
    un = block[covariance.VELOCITY] + n
    ue = block[covariance.VELOCITY + 1] + e
    ud = block[covariance.VELOCITY + 2] + d
    for k in range(3):
        i, j, h = unit(k)
        put_column(update, _VELOCITY + k, vehicle.rotated_back(v, i, j, h))
        # (a x) e_k = a x e_k
        put_column(update, _PHI + k, vehicle.rotated_back(v, *vehicle.cross(n, e, d, i, j, h)))
        put_turn(update, k, vehicle.rotated_back(v, *vehicle.cross(i, j, h, un, ue, ud)))
        by_bias = vehicle.rotated_back(v, *vehicle.rotated(c, *vehicle.cross(i, j, h, lx, ly, lz)))
        rate = block[covariance.RATE + k]
        put_column(update, _GYRO_BIAS + k, by_bias)
        put_column(update, _GYRO_SCALE + k, (by_bias[0] * rate, by_bias[1] * rate, by_bias[2] * rate))
        if k > 0 and lanes[bank.RADIUS + lane] != 0.0:
            by_arm = vehicle.rotated_back(v, *vehicle.rotated(c, *vehicle.cross(i, j, h, x, y, z)))
            put_column(update, _MOUNT + k - 1, by_arm)
    update[kalman.H + _SPEED_SCALE] = measurement[SPEED]
