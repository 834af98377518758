"""The velocity of a point of the vehicle in n, as GNSS gives that of its antenna.

An IMU predicts u = v + W x L + W_h x A: its velocity; its rate over ground W = C w - w_ie times the way L = C l to the
centre of its wheel (nothing on the body); and the rate of the vehicle times the way A = C_nv (a - p) from its place to
the point. On the body the vehicle turns as the IMU does, W_h = W; a wheel spins besides, so that what is about its axle
x, the first column of C, is left out: W_h = W - (W x') x.

Of the value: velocity 3, place of the point 3.
"""

from __future__ import annotations

from polyins.aiding.measurement import DT, PLACE, VALUE, put_column, put_turn, unit
from polyins.kernels import bank, covariance, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

Three = vehicle.Three

_VELOCITY, _PHI, _MOUNT = place("velocity"), place("phi"), place("mount")
_GYRO_BIAS, _GYRO_SCALE = place("gyro_bias"), place("gyro_scale")


@scalar_kernel
def _sum(a: Three, b: Three) -> Three:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@scalar_kernel
def _times(a: Three, factor: float) -> Three:
    return a[0] * factor, a[1] * factor, a[2] * factor


@scalar_kernel
def _dot(a: Three, b: Three) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@scalar_kernel
def _cross(a: Three, b: Three) -> Three:
    return vehicle.cross(a[0], a[1], a[2], b[0], b[1], b[2])


@scalar_kernel
def without_spin(rate: Three, axle: Three) -> Three:
    """Return a rate over ground less what is about the axle."""
    return _sum(rate, _times(axle, -_dot(rate, axle)))


@scalar_kernel
def _without_change_of_spin(rate: Three, axle: Three, d_rate: Three, d_axle: Three) -> Three:
    spin, d_spin = _dot(rate, axle), _dot(d_rate, axle) + _dot(rate, d_axle)
    return _sum(d_rate, _sum(_times(axle, -d_spin), _times(d_axle, -spin)))


@scalar_kernel
def way(v: vehicle.Matrix, x: float, y: float, z: float, measurement: Array) -> Three:
    """Find A, the way from the place (x, y, z) in the vehicle to the point, m north, east, down."""
    return vehicle.rotated(v, measurement[PLACE] - x, measurement[PLACE + 1] - y, measurement[PLACE + 2] - z)


@scalar_kernel
def of_point(lanes: Array, lane: int, v: vehicle.Matrix, measurement: Array) -> Three:
    """Return u as one IMU has it, m/s north, east, down; its rate is the mean of the last DT seconds."""
    c = vehicle.lane_matrix(lanes, bank.MATRIX + lane)
    dt, d, p = measurement[DT], bank.DTHETA + lane, bank.IN_VEHICLE + lane
    turn = vehicle.rotated(c, lanes[d] / dt, lanes[d + LANES] / dt, lanes[d + 2 * LANES] / dt)
    rate = turn[0] - lanes[bank.EARTH_RATE + lane], turn[1], turn[2] - lanes[bank.EARTH_RATE + LANES + lane]
    lever = vehicle.lever_to_wheel(lanes, lane)
    to_point = way(v, lanes[p], lanes[p + LANES], lanes[p + 2 * LANES], measurement)
    own = lanes[bank.VELOCITY + lane], lanes[bank.VELOCITY + LANES + lane], lanes[bank.VELOCITY + 2 * LANES + lane]
    if lanes[bank.RADIUS + lane] == 0.0:
        return _sum(own, _cross(rate, to_point))
    about = _cross(rate, vehicle.rotated(c, lever[0], lever[1], lever[2]))
    return _sum(_sum(own, about), _cross(without_spin(rate, (c[0], c[3], c[6])), to_point))


@scalar_kernel
def of_fused_point(block: Array, lanes: Array, lane: int, measurement: Array) -> Three:
    """Return u at the fused state of a block."""
    c, v = vehicle.matrix_at(block, covariance.MATRIX), vehicle.matrix_at(block, covariance.VEHICLE)
    rate = rate_over_ground(block, lanes, lane)
    lever, p = vehicle.lever_to_wheel(lanes, lane), covariance.PLACE
    to_point = way(v, block[p], block[p + 1], block[p + 2], measurement)
    own = block[covariance.VELOCITY], block[covariance.VELOCITY + 1], block[covariance.VELOCITY + 2]
    if lanes[bank.RADIUS + lane] == 0.0:
        return _sum(own, _cross(rate, to_point))
    about = _cross(rate, vehicle.rotated(c, lever[0], lever[1], lever[2]))
    return _sum(_sum(own, about), _cross(without_spin(rate, (c[0], c[3], c[6])), to_point))


@scalar_kernel
def rate_over_ground(block: Array, lanes: Array, lane: int) -> Three:
    """W at the fused state of a block, rad/s north, east, down."""
    c, r = vehicle.matrix_at(block, covariance.MATRIX), covariance.RATE
    turn = vehicle.rotated(c, block[r], block[r + 1], block[r + 2])
    return turn[0] - lanes[bank.EARTH_RATE + lane], turn[1], turn[2] - lanes[bank.EARTH_RATE + LANES + lane]


@scalar_kernel
def _change(block: Array, lanes: Array, lane: int, measurement: Array, d_rate: Three, d_phi: Three) -> Three:
    """Change of u with a change of W, and with one of phi that turns the IMU but not A."""
    c, v = vehicle.matrix_at(block, covariance.MATRIX), vehicle.matrix_at(block, covariance.VEHICLE)
    p = covariance.PLACE
    to_point = way(v, block[p], block[p + 1], block[p + 2], measurement)
    if lanes[bank.RADIUS + lane] == 0.0:
        return _cross(d_rate, to_point)
    rate, lever = rate_over_ground(block, lanes, lane), vehicle.lever_to_wheel(lanes, lane)
    to_wheel, axle = vehicle.rotated(c, lever[0], lever[1], lever[2]), (c[0], c[3], c[6])
    # C_hat = (I - phi x) C turns both
    by_wheel = _sum(_cross(d_rate, to_wheel), _cross(rate, _cross(to_wheel, d_phi)))
    horizontal = _without_change_of_spin(rate, axle, d_rate, _cross(axle, d_phi))
    return _sum(by_wheel, _cross(horizontal, to_point))


@scalar_kernel
def design(block: Array, lanes: Array, lane: int, measurement: Array, update: Array) -> None:
    """Write the design matrix at the fused state of a block, and TURN, what a rotation of the vehicle does.

    I on velocity. phi turns the measured rate, W changes by (C w) x phi; a gyro's bias adds C e_k to it, its scale that
    times w_k; the lever arm of a wheel changes L by -C e_k; the rotation of the vehicle changes A by A x theta.
    """
    c, v = vehicle.matrix_at(block, covariance.MATRIX), vehicle.matrix_at(block, covariance.VEHICLE)
    w = block[covariance.RATE], block[covariance.RATE + 1], block[covariance.RATE + 2]
    turn, rate = vehicle.rotated(c, w[0], w[1], w[2]), rate_over_ground(block, lanes, lane)
    spins, p, nothing = lanes[bank.RADIUS + lane] != 0.0, covariance.PLACE, (0.0, 0.0, 0.0)
    to_point = way(v, block[p], block[p + 1], block[p + 2], measurement)
    of_vehicle = without_spin(rate, (c[0], c[3], c[6])) if spins else rate
    for k in range(3):
        e = unit(k)
        put_column(update, _VELOCITY + k, e)
        put_column(update, _PHI + k, _change(block, lanes, lane, measurement, _cross(turn, e), e))
        put_turn(update, k, _cross(of_vehicle, _cross(to_point, e)))
        by_bias = _change(block, lanes, lane, measurement, (c[k], c[3 + k], c[6 + k]), nothing)
        put_column(update, _GYRO_BIAS + k, by_bias)
        put_column(update, _GYRO_SCALE + k, _times(by_bias, w[k]))
        if k > 0 and spins:
            put_column(update, _MOUNT + k - 1, _cross(rate, (-c[k], -c[3 + k], -c[6 + k])))


@scalar_kernel
def residual(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> Three:
    """Predicted less measured velocity of the point, m/s north, east, down."""
    u = of_point(lanes, lane, vehicle.vehicle_matrix(lanes, lane, lent), measurement)
    return u[0] - measurement[VALUE], u[1] - measurement[VALUE + 1], u[2] - measurement[VALUE + 2]
