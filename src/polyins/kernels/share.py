"""One covariance block and what drives it: the IMUs that share it, their fused state, the error model.

The 21 error states are position (m), velocity (m/s), phi (rad), in n; gyro bias, accelerometer bias, gyro scale,
accelerometer scale. Navigation errors are estimate minus truth, r_hat = r + dr, v_hat = v + dv, C_hat = (I - phi x) C;
IMU errors are truth minus estimate. So estimates are corrected by r -= dr, v -= dv, C = (I + phi x) C, errors += dx.
"""

from __future__ import annotations

import math

from polyins.kernels import earth
from polyins.kernels.jit import Array, formula, kernel

STATES = 21
STRIDE = 24  # a row of P, padded to whole vectors
NAV = 9  # position, velocity, phi
NAV_STRIDE = 12

_fields = 0


def _take(count: int) -> int:
    global _fields
    offset = _fields
    _fields += count
    return offset


P = _take(STATES * STRIDE)
# the fused state of the members, and the mean of their corrected increments as rates
POSITION = _take(3)
VELOCITY = _take(3)
QUATERNION = _take(4)
MATRIX = _take(9)
RATE = _take(3)  # rad/s
FORCE = _take(3)  # m/s^2
METRIC = _take(3)  # metres per unit of each coordinate at the last fix
ANTENNA = _take(3)  # from the point of the fused state, in array axes, m
# noise of one member
GYRO_PSD = _take(3)  # angle random walk squared, rad^2/s
ACCEL_PSD = _take(3)  # velocity random walk squared, m^2/s^3
ERROR_PSD = _take(12)  # 2 sigma^2 / tau of each Gauss-Markov process
DECAY = _take(12)  # 1 / tau
FACTOR = _take(12)  # 1 - dt / tau
# error model times dt: rows velocity and phi of F, 3 x 3 each
F_RR = _take(9)
F_VR = _take(9)
F_VV = _take(9)
F_VP = _take(9)
F_VA = _take(9)  # accelerometer bias
F_VS = _take(9)  # accelerometer scale
F_PR = _take(9)
F_PV = _take(9)
F_PP = _take(9)
F_PG = _take(9)  # gyro bias
F_PS = _take(9)  # gyro scale
HALF_Q_V = _take(9)
HALF_Q_P = _take(9)
# products
T = _take(NAV * STRIDE)  # the navigation rows of Phi P
U = _take(STATES * NAV_STRIDE)  # T transposed
V = _take(NAV * NAV_STRIDE)

SIZE = (_fields + 7) // 8 * 8

_R, _V, _P, _G, _A, _GS, _AS = 0, 3, 6, 9, 12, 15, 18


@kernel
def _earth_terms(g: Array, dt: float, latitude: float, sine: float, cosine: float) -> None:
    """Write the terms of F dt that come from earth rate, transport rate and gravity.

    Complete phi-angle model in n with position errors in metres; see docs/theory.
    """
    d = g[POSITION] - latitude
    sin_d = d * (1.0 - d * d / 6.0)
    cos_d = 1.0 - d * d * (0.5 - d * d / 24.0)
    s = sine * cos_d + cosine * sin_d
    c = cosine * cos_d - sine * sin_d
    t = s / c
    w2 = 1.0 - earth.E2 * s * s
    r_n = earth.A / math.sqrt(w2)
    r_m = r_n * (1.0 - earth.E2) / w2
    height = g[POSITION + 2]
    gravity = earth.normal_gravity(s * s, height)
    m = 1.0 / (r_m + height)
    n = 1.0 / (r_n + height)
    rate = earth.EARTH_RATE_RAD_S
    vn, ve, vd = g[VELOCITY], g[VELOCITY + 1], g[VELOCITY + 2]
    wn, wd = rate * c, -rate * s
    tn, te, td = ve * n, -vn * m, -ve * n * t
    sec2 = 1.0 + t * t

    g[F_RR + 0] = -vd * m * dt
    g[F_RR + 2] = vn * m * dt
    g[F_RR + 3] = ve * t * m * dt
    g[F_RR + 4] = -(vd * n + vn * t * m) * dt
    g[F_RR + 5] = ve * n * dt

    g[F_VR + 0] = -(2.0 * ve * wn + ve * ve * n * sec2) * m * dt
    g[F_VR + 2] = (vn * vd * m * m - ve * ve * t * n * n) * dt
    g[F_VR + 3] = (2.0 * (vn * wn + vd * wd) + vn * ve * n * sec2) * m * dt
    g[F_VR + 5] = (ve * vd + vn * ve * t) * n * n * dt
    g[F_VR + 6] = -2.0 * ve * wd * m * dt
    g[F_VR + 8] = (-ve * ve * n * n - vn * vn * m * m + 2.0 * gravity / (math.sqrt(r_m * r_n) + height)) * dt

    g[F_VV + 0] = vd * m * dt
    g[F_VV + 1] = 2.0 * (wd + td) * dt
    g[F_VV + 2] = -te * dt
    g[F_VV + 3] = -(2.0 * wd + td) * dt
    g[F_VV + 4] = (vd + vn * t) * n * dt
    g[F_VV + 5] = (2.0 * wn + tn) * dt
    g[F_VV + 6] = 2.0 * te * dt
    g[F_VV + 7] = -2.0 * (wn + tn) * dt

    g[F_PR + 0] = wd * m * dt
    g[F_PR + 2] = ve * n * n * dt
    g[F_PR + 5] = -vn * m * m * dt
    g[F_PR + 6] = -(wn + ve * n * sec2) * m * dt
    g[F_PR + 8] = -ve * t * n * n * dt
    g[F_PV + 1] = n * dt
    g[F_PV + 3] = -m * dt
    g[F_PV + 7] = -t * n * dt

    _skew(g, F_PP, -(wn + tn) * dt, -te * dt, -(wd + td) * dt)


@kernel
def _skew(g: Array, offset: int, x: float, y: float, z: float) -> None:
    g[offset + 1] = -z
    g[offset + 2] = y
    g[offset + 3] = z
    g[offset + 5] = -x
    g[offset + 6] = -y
    g[offset + 7] = x


@kernel
def _sensor_terms(g: Array, dt: float) -> None:
    """Write the terms of F dt that come from attitude and measurements, and half of the noise over dt."""
    fx, fy, fz = g[FORCE], g[FORCE + 1], g[FORCE + 2]
    n = g[MATRIX] * fx + g[MATRIX + 1] * fy + g[MATRIX + 2] * fz
    e = g[MATRIX + 3] * fx + g[MATRIX + 4] * fy + g[MATRIX + 5] * fz
    d = g[MATRIX + 6] * fx + g[MATRIX + 7] * fy + g[MATRIX + 8] * fz
    _skew(g, F_VP, n * dt, e * dt, d * dt)
    for i in range(3):
        for j in range(3):
            c = g[MATRIX + 3 * i + j] * dt
            g[F_VA + 3 * i + j] = c
            g[F_VS + 3 * i + j] = c * g[FORCE + j]
            g[F_PG + 3 * i + j] = -c
            g[F_PS + 3 * i + j] = -c * g[RATE + j]
            q_v = 0.0
            q_p = 0.0
            for k in range(3):
                cc = g[MATRIX + 3 * i + k] * g[MATRIX + 3 * j + k]
                q_v += cc * g[ACCEL_PSD + k]
                q_p += cc * g[GYRO_PSD + k]
            g[HALF_Q_V + 3 * i + j] = 0.5 * dt * q_v
            g[HALF_Q_P + 3 * i + j] = 0.5 * dt * q_p


@kernel
def error_model(g: Array, dt: float, near: Array) -> None:
    """Write F dt and Q dt / 2 at the fused state, which is that of the start of the interval."""
    if near[0] != 0.0:
        _earth_terms(g, dt, near[1], near[2], near[3])
    _sensor_terms(g, dt)


@formula
def _product(g: Array, source: int, stride: int, j: int, f: tuple[float, float, float]) -> float:
    return f[0] * g[source + j] + f[1] * g[source + stride + j] + f[2] * g[source + 2 * stride + j]


@formula
def _skew_product(g: Array, source: int, stride: int, j: int, i: int, f: tuple[float, float]) -> float:
    return f[0] * g[source + (i + 1) % 3 * stride + j] + f[1] * g[source + (i + 2) % 3 * stride + j]


@formula
def _outer_product(g: Array, source: int, stride: int, j: int, f: tuple[float, float]) -> float:
    return f[0] * g[source + j] + f[1] * g[source + 2 * stride + j]


@formula
def _triple(g: Array, f: int, i: int) -> tuple[float, float, float]:
    return g[f + 3 * i], g[f + 3 * i + 1], g[f + 3 * i + 2]


@formula
def _skew_pair(g: Array, f: int, i: int) -> tuple[float, float]:
    return g[f + 3 * i + (i + 1) % 3], g[f + 3 * i + (i + 2) % 3]


@formula
def _position_row(g: Array, i: int, source: int, stride: int, target: int, begin: int, end: int, dt: float) -> None:
    r = _triple(g, F_RR, i)
    for j in range(begin, end):
        g[target + i * stride + j] = (
            g[source + i * stride + j] + dt * g[source + (_V + i) * stride + j] + _product(g, source, stride, j, r)
        )


@formula
def _velocity_row(g: Array, i: int, source: int, stride: int, target: int, begin: int, end: int) -> None:
    r = g[F_VR + 3 * i], g[F_VR + 3 * i + 2]  # no error depends on longitude
    v, p = _triple(g, F_VV, i), _skew_pair(g, F_VP, i)
    a, s = _triple(g, F_VA, i), _triple(g, F_VS, i)
    for j in range(begin, end):
        g[target + (_V + i) * stride + j] = (
            g[source + (_V + i) * stride + j]
            + _outer_product(g, source + _R * stride, stride, j, r)
            + _product(g, source + _V * stride, stride, j, v)
            + _skew_product(g, source + _P * stride, stride, j, i, p)
            + _product(g, source + _A * stride, stride, j, a)
            + _product(g, source + _AS * stride, stride, j, s)
        )


@formula
def _phi_row(g: Array, i: int, source: int, stride: int, target: int, begin: int, end: int) -> None:
    r = g[F_PR + 3 * i], g[F_PR + 3 * i + 2]
    column = 1 - i % 2  # north and down turn with east velocity, east with north velocity
    v, p = g[F_PV + 3 * i + column], _skew_pair(g, F_PP, i)
    b, s = _triple(g, F_PG, i), _triple(g, F_PS, i)
    for j in range(begin, end):
        g[target + (_P + i) * stride + j] = (
            g[source + (_P + i) * stride + j]
            + _outer_product(g, source + _R * stride, stride, j, r)
            + v * g[source + (_V + column) * stride + j]
            + _skew_product(g, source + _P * stride, stride, j, i, p)
            + _product(g, source + _G * stride, stride, j, b)
            + _product(g, source + _GS * stride, stride, j, s)
        )


@kernel
def _navigation_rows_of_phi_p(g: Array, dt: float) -> None:
    """T = the navigation rows of Phi P."""
    _position_row(g, 0, P, STRIDE, T, 0, STRIDE, dt)
    _position_row(g, 1, P, STRIDE, T, 0, STRIDE, dt)
    _position_row(g, 2, P, STRIDE, T, 0, STRIDE, dt)
    _velocity_row(g, 0, P, STRIDE, T, 0, STRIDE)
    _velocity_row(g, 1, P, STRIDE, T, 0, STRIDE)
    _velocity_row(g, 2, P, STRIDE, T, 0, STRIDE)
    _phi_row(g, 0, P, STRIDE, T, 0, STRIDE)
    _phi_row(g, 1, P, STRIDE, T, 0, STRIDE)
    _phi_row(g, 2, P, STRIDE, T, 0, STRIDE)


@kernel
def _navigation_rows_of_phi_u(g: Array, dt: float) -> None:
    """V = Phi U with U = T', so that V is the navigation block of Phi P Phi'; its upper blocks suffice."""
    for k in range(STATES):
        for j in range(NAV):
            g[U + k * NAV_STRIDE + j] = g[T + j * STRIDE + k]
    _position_row(g, 0, U, NAV_STRIDE, V, 0, 12, dt)
    _position_row(g, 1, U, NAV_STRIDE, V, 0, 12, dt)
    _position_row(g, 2, U, NAV_STRIDE, V, 0, 12, dt)
    _velocity_row(g, 0, U, NAV_STRIDE, V, 3, 11)
    _velocity_row(g, 1, U, NAV_STRIDE, V, 3, 11)
    _velocity_row(g, 2, U, NAV_STRIDE, V, 3, 11)
    _phi_row(g, 0, U, NAV_STRIDE, V, 6, 10)
    _phi_row(g, 1, U, NAV_STRIDE, V, 6, 10)
    _phi_row(g, 2, U, NAV_STRIDE, V, 6, 10)


@kernel
def _add_half_noise(g: Array, dt: float) -> None:
    for i in range(3):
        for j in range(3):
            g[P + (_V + i) * STRIDE + _V + j] += g[HALF_Q_V + 3 * i + j]
            g[P + (_P + i) * STRIDE + _P + j] += g[HALF_Q_P + 3 * i + j]
    for i in range(12):
        g[P + (NAV + i) * (STRIDE + 1)] += 0.5 * dt * g[ERROR_PSD + i]


@kernel
def _take_over(g: Array, dt: float) -> None:
    """Put the products in their places in P; the IMU errors decay, and the lower triangle mirrors the upper one."""
    for k in range(12):
        g[FACTOR + k] = 1.0 - dt * g[DECAY + k]
    for i in range(NAV):
        for k in range(12):
            g[P + i * STRIDE + NAV + k] = g[FACTOR + k] * g[T + i * STRIDE + NAV + k]
    for k in range(12):
        decay = g[FACTOR + k]
        for i in range(NAV):
            g[P + (NAV + k) * STRIDE + i] = decay * g[U + (NAV + k) * NAV_STRIDE + i]
        for i in range(12):
            g[P + (NAV + k) * STRIDE + NAV + i] *= decay * g[FACTOR + i]
    for i in range(NAV):
        for j in range(i, NAV):
            g[P + i * STRIDE + j] = g[V + i * NAV_STRIDE + j]
            g[P + j * STRIDE + i] = g[V + i * NAV_STRIDE + j]


@kernel
def predict(g: Array, dt: float) -> None:
    """Advance P by dt, paper A (5), with Phi = I + F dt and trapezoidal noise.

    Phi P Phi' + (Phi Q Phi' + Q) / 2 = Phi (P + Q / 2) Phi' + Q / 2; only the blocks of Phi that are neither zero
    nor one are multiplied.
    """
    _add_half_noise(g, dt)
    _navigation_rows_of_phi_p(g, dt)
    _navigation_rows_of_phi_u(g, dt)
    _take_over(g, dt)
    _add_half_noise(g, dt)
