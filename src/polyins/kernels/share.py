"""One covariance block and what drives it: the IMUs that share it, their fused state, the error model.

The 21 error states are position (m), velocity (m/s), phi (rad), in n; gyro bias, accelerometer bias, gyro scale,
accelerometer scale. Three more are of the mounting of an IMU on a vehicle with wheels and zero elsewhere: the relative
error of the wheel speed, then for a wheel its lever arm (y, z, m), for the body pitch and yaw of the mount (rad).

Navigation errors are estimate minus truth, r_hat = r + dr, v_hat = v + dv, C_hat = (I - phi x) C;
the others are truth minus estimate. So estimates are corrected by r -= dr, v -= dv, C = (I + phi x) C, errors += dx.
"""

from __future__ import annotations

import math

from polyins.kernels import earth
from polyins.kernels.jit import Array, kernel
from polyins.kernels.layout import Layout

STATES = 24
INERTIAL = 21
NAV = 9  # position, velocity, phi
# Loops over columns have constant bounds and whole vectors of eight. What they compute beyond the columns that count is
# finite and never used, or overwritten.
STRIDE = 24
HALF = 16
SENSORS = 8  # from here on a row of P holds the covariances with IMU errors, of which the first is in column 9

_layout = Layout()
_take = _layout.take


P = _take(STATES * STRIDE)
# the fused state of the members, and the mean of their corrected increments as rates
POSITION = _take(3)
VELOCITY = _take(3)
QUATERNION = _take(4)
MATRIX = _take(9)
RATE = _take(3)  # rad/s
FORCE = _take(3)  # m/s^2
VEHICLE = _take(9)  # C_nv of a vehicle with wheels
WEIGHTS = _take(1)  # sum of the members' weights
BASES = _take(16)  # work of the means, see `fuse`
LANE_SUMS = _take(16 * 8)
METRIC = _take(3)  # metres per unit of each coordinate at the last fix
ANTENNA = _take(3)  # from the point of the fused state, in array axes, m
# noise of one member
GYRO_PSD = _take(3)  # angle random walk squared, rad^2/s
ACCEL_PSD = _take(3)  # velocity random walk squared, m^2/s^3
ERROR_PSD = _take(12)  # 2 sigma^2 / tau of each Gauss-Markov process
DECAY = _take(12)  # 1 / tau
FACTOR = _take(STRIDE)  # 1 - dt / tau by column
# error model times dt: row k holds what state k does to position, velocity and phi, that is F' without its zero rows
F = _take(INERTIAL * HALF)
HALF_Q_V = _take(9)
HALF_Q_P = _take(9)
# products
T = _take(NAV * STRIDE)
W = _take(NAV * HALF)
V = _take(NAV * SENSORS)
Z = _take(NAV * SENSORS)

SIZE = _layout.size

_V, _P, _G, _A, _GS, _AS = 3, 6, 9, 12, 15, 18
BY_N, BY_E, BY_D, BY_VN, BY_VE, BY_VD = (F + k * HALF for k in range(6))


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

    g[BY_N + 0] = -vd * m * dt
    g[BY_D + 0] = vn * m * dt
    g[BY_N + 1] = ve * t * n * dt
    g[BY_E + 1] = -(vd + vn * t) * n * dt
    g[BY_D + 1] = ve * n * dt

    g[BY_N + 3] = -(2.0 * ve * wn + ve * ve * n * sec2) * m * dt
    g[BY_D + 3] = (vn * vd * m * m - ve * ve * t * n * n) * dt
    g[BY_N + 4] = (2.0 * (vn * wn + vd * wd) + vn * ve * n * sec2) * m * dt
    g[BY_D + 4] = (ve * vd + vn * ve * t) * n * n * dt
    g[BY_N + 5] = -2.0 * ve * wd * m * dt
    g[BY_D + 5] = (-ve * ve * n * n - vn * vn * m * m + 2.0 * gravity / (math.sqrt(r_m * r_n) + height)) * dt

    g[BY_VN + 3] = vd * m * dt
    g[BY_VE + 3] = 2.0 * (wd + td) * dt
    g[BY_VD + 3] = -te * dt
    g[BY_VN + 4] = -(2.0 * wd + td) * dt
    g[BY_VE + 4] = (vd + vn * t) * n * dt
    g[BY_VD + 4] = (2.0 * wn + tn) * dt
    g[BY_VN + 5] = 2.0 * te * dt
    g[BY_VE + 5] = -2.0 * (wn + tn) * dt

    g[BY_N + 6] = wd * m * dt
    g[BY_D + 6] = ve * n * n * dt
    g[BY_D + 7] = -vn * m * m * dt
    g[BY_N + 8] = -(wn + ve * n * sec2) * m * dt
    g[BY_D + 8] = -ve * t * n * n * dt
    g[BY_VE + 6] = n * dt
    g[BY_VN + 7] = -m * dt
    g[BY_VE + 8] = -t * n * dt

    _skew(g, _P, _P, -(wn + tn) * dt, -te * dt, -(wd + td) * dt)


@kernel
def _skew(g: Array, row: int, column: int, x: float, y: float, z: float) -> None:
    """Write the block (x, y, z) x of F."""
    c0 = F + column * HALF + row
    c1, c2 = c0 + HALF, c0 + 2 * HALF
    g[c0 + 1], g[c0 + 2] = z, -y
    g[c1], g[c1 + 2] = -z, x
    g[c2], g[c2 + 1] = y, -x


@kernel
def _sensor_terms(g: Array, dt: float) -> None:
    """Write the terms of F dt that come from attitude and measurements, and half of the noise over dt."""
    fx, fy, fz = g[FORCE], g[FORCE + 1], g[FORCE + 2]
    n = g[MATRIX] * fx + g[MATRIX + 1] * fy + g[MATRIX + 2] * fz
    e = g[MATRIX + 3] * fx + g[MATRIX + 4] * fy + g[MATRIX + 5] * fz
    d = g[MATRIX + 6] * fx + g[MATRIX + 7] * fy + g[MATRIX + 8] * fz
    _skew(g, _V, _P, n * dt, e * dt, d * dt)
    for i in range(3):
        for j in range(3):
            c = g[MATRIX + 3 * i + j] * dt
            g[F + (_A + j) * HALF + _V + i] = c
            g[F + (_AS + j) * HALF + _V + i] = c * g[FORCE + j]
            g[F + (_G + j) * HALF + _P + i] = -c
            g[F + (_GS + j) * HALF + _P + i] = -c * g[RATE + j]
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
    for i in range(3):
        g[F + (_V + i) * HALF + i] = dt
    if near[0] != 0.0:
        _earth_terms(g, dt, near[1], near[2], near[3])
    _sensor_terms(g, dt)


Three = tuple[float, float, float]


@kernel
def _factors(g: Array, f: int) -> Three:
    """F dt in three columns of one row, from the place of the first on."""
    return g[f], g[f + HALF], g[f + 2 * HALF]


@kernel
def _column(g: Array, x: int, stride: int) -> Three:
    return g[x], g[x + stride], g[x + 2 * stride]


@kernel
def _dot(a: Three, b: Three) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


Row = tuple[float, float, Three, float, float]


@kernel
def _row(g: Array, i: int, k: int, m: int) -> Row:
    """Row i of F dt among the navigation states: no error depends on longitude, phi enters as a vector product."""
    return g[F + i], g[F + 2 * HALF + i], _factors(g, F + _V * HALF + i), g[F + k * HALF + i], g[F + m * HALF + i]


@kernel
def _times(f: Row, r: Three, v: Three, p1: float, p2: float) -> float:
    return (f[0] * r[0] + f[1] * r[2]) + _dot(f[2], v) + (f[3] * p1 + f[4] * p2)


@kernel
def _through_navigation(g: Array, dt: float) -> None:
    """T = A [N C]."""
    # all factors before the loop: loads in it that do not move would keep it from vectorizing
    f0, f1 = _factors(g, F + 0), _factors(g, F + 1)
    f3, f4, f5 = _row(g, _V + 0, _P + 1, _P + 2), _row(g, _V + 1, _P + 2, _P + 0), _row(g, _V + 2, _P + 0, _P + 1)
    f6, f7, f8 = _row(g, _P + 0, _P + 1, _P + 2), _row(g, _P + 1, _P + 2, _P + 0), _row(g, _P + 2, _P + 0, _P + 1)
    for j in range(STRIDE):
        r = _column(g, P + j, STRIDE)
        v = _column(g, P + _V * STRIDE + j, STRIDE)
        p = _column(g, P + _P * STRIDE + j, STRIDE)
        g[T + j] = r[0] + dt * v[0] + _dot(f0, r)
        g[T + STRIDE + j] = r[1] + dt * v[1] + _dot(f1, r)
        g[T + 2 * STRIDE + j] = r[2] + dt * v[2]
        g[T + 3 * STRIDE + j] = v[0] + _times(f3, r, v, p[1], p[2])
        g[T + 4 * STRIDE + j] = v[1] + _times(f4, r, v, p[2], p[0])
        g[T + 5 * STRIDE + j] = v[2] + _times(f5, r, v, p[0], p[1])
        g[T + 6 * STRIDE + j] = p[0] + _times(f6, r, v, p[1], p[2])
        g[T + 7 * STRIDE + j] = p[1] + _times(f7, r, v, p[2], p[0])
        g[T + 8 * STRIDE + j] = p[2] + _times(f8, r, v, p[0], p[1])


@kernel
def _put_c(g: Array, row: int, half_row: int, j: int, half: float) -> None:
    """Element of W = A C + G B / 2 and of the new C = (A C + G B) D, in the rows that begin at these offsets."""
    w = g[T + row + SENSORS + j] + half
    g[W + half_row + j] = w
    g[P + row + SENSORS + j] = g[FACTOR + SENSORS + j] * (w + half)


@kernel
def _half(f: Three, b: Three, h: Three, s: Three) -> float:
    return 0.5 * (_dot(f, b) + _dot(h, s))


@kernel
def _decay(g: Array, row: int, j: int, factors: Three, b: Three) -> None:
    """Three rows of B <- D B D, from the one that begins at this offset on."""
    factor = g[FACTOR + SENSORS + j]
    g[P + row + SENSORS + j] = factors[0] * factor * b[0]
    g[P + row + STRIDE + SENSORS + j] = factors[1] * factor * b[1]
    g[P + row + 2 * STRIDE + SENSORS + j] = factors[2] * factor * b[2]


@kernel
def _through_sensors(g: Array, dt: float) -> None:
    """Bring B and C up to date and leave W behind."""
    for k in range(12):
        g[FACTOR + NAV + k] = 1.0 - dt * g[DECAY + k]
    f3, f4, f5 = _factors(g, F + _A * HALF + 3), _factors(g, F + _A * HALF + 4), _factors(g, F + _A * HALF + 5)
    f6, f7, f8 = _factors(g, F + _G * HALF + 6), _factors(g, F + _G * HALF + 7), _factors(g, F + _G * HALF + 8)
    h3, h4, h5 = _factors(g, F + _AS * HALF + 3), _factors(g, F + _AS * HALF + 4), _factors(g, F + _AS * HALF + 5)
    h6, h7, h8 = _factors(g, F + _GS * HALF + 6), _factors(g, F + _GS * HALF + 7), _factors(g, F + _GS * HALF + 8)
    d_b, d_a = _column(g, FACTOR + _G, 1), _column(g, FACTOR + _A, 1)
    d_sb, d_sa = _column(g, FACTOR + _GS, 1), _column(g, FACTOR + _AS, 1)
    for j in range(HALF):
        b = _column(g, P + _G * STRIDE + SENSORS + j, STRIDE)
        a = _column(g, P + _A * STRIDE + SENSORS + j, STRIDE)
        sb = _column(g, P + _GS * STRIDE + SENSORS + j, STRIDE)
        sa = _column(g, P + _AS * STRIDE + SENSORS + j, STRIDE)
        _put_c(g, 0 * STRIDE, 0 * HALF, j, 0.0)
        _put_c(g, 1 * STRIDE, 1 * HALF, j, 0.0)
        _put_c(g, 2 * STRIDE, 2 * HALF, j, 0.0)
        _put_c(g, 3 * STRIDE, 3 * HALF, j, _half(f3, a, h3, sa))
        _put_c(g, 4 * STRIDE, 4 * HALF, j, _half(f4, a, h4, sa))
        _put_c(g, 5 * STRIDE, 5 * HALF, j, _half(f5, a, h5, sa))
        _put_c(g, 6 * STRIDE, 6 * HALF, j, _half(f6, b, h6, sb))
        _put_c(g, 7 * STRIDE, 7 * HALF, j, _half(f7, b, h7, sb))
        _put_c(g, 8 * STRIDE, 8 * HALF, j, _half(f8, b, h8, sb))
        _decay(g, _G * STRIDE, j, d_b, b)
        _decay(g, _A * STRIDE, j, d_a, a)
        _decay(g, _GS * STRIDE, j, d_sb, sb)
        _decay(g, _AS * STRIDE, j, d_sa, sa)


@kernel
def _back_row(g: Array, i: int) -> None:
    """Row i of V = (A N) A' and of Z = W G', the first eight columns."""
    t, w = T + i * STRIDE, W + i * HALF - SENSORS
    r, v, p = _column(g, t, 1), _column(g, t + _V, 1), _column(g, t + _P, 1)
    b, a = _column(g, w + _G, 1), _column(g, w + _A, 1)
    sb, sa = _column(g, w + _GS, 1), _column(g, w + _AS, 1)
    for j in range(SENSORS):
        f = F + j
        g[V + i * SENSORS + j] = (
            (g[t + j] + _dot(r, _column(g, f, HALF)))
            + _dot(v, _column(g, f + _V * HALF, HALF))
            + _dot(p, _column(g, f + _P * HALF, HALF))
        )
        g[Z + i * SENSORS + j] = (
            _dot(b, _column(g, f + _G * HALF, HALF)) + _dot(a, _column(g, f + _A * HALF, HALF))
        ) + (_dot(sb, _column(g, f + _GS * HALF, HALF)) + _dot(sa, _column(g, f + _AS * HALF, HALF)))


@kernel
def _back_to_navigation(g: Array) -> None:
    """N = V + Z + Z'; the loop makes the first eight columns, the ninth follows from symmetry."""
    _back_row(g, 0)
    _back_row(g, 1)
    _back_row(g, 2)
    _back_row(g, 3)
    _back_row(g, 4)
    _back_row(g, 5)
    _back_row(g, 6)
    _back_row(g, 7)
    _back_row(g, 8)
    _last_column(g)
    for i in range(NAV - 1):
        for j in range(i, NAV - 1):
            n = g[V + i * SENSORS + j] + (g[Z + i * SENSORS + j] + g[Z + j * SENSORS + i])
            g[P + i * STRIDE + j] = n
            g[P + j * STRIDE + i] = n


@kernel
def _last_column(g: Array) -> None:
    last = NAV - 1
    own = g[T + last * STRIDE + last]
    for k in range(NAV):
        own += g[T + last * STRIDE + k] * g[F + k * HALF + last]
    for i in range(NAV):
        z = 0.0
        for k in range(3):
            z += g[W + i * HALF + _G - SENSORS + k] * g[F + (_G + k) * HALF + last]
            z += g[W + i * HALF + _GS - SENSORS + k] * g[F + (_GS + k) * HALF + last]
        n = own + 2.0 * z if i == last else g[V + last * SENSORS + i] + (g[Z + last * SENSORS + i] + z)
        g[P + i * STRIDE + last] = n
        g[P + last * STRIDE + i] = n


@kernel
def _add_half_noise(g: Array, dt: float) -> None:
    for i in range(3):
        for j in range(3):
            g[P + (_V + i) * STRIDE + _V + j] += g[HALF_Q_V + 3 * i + j]
            g[P + (_P + i) * STRIDE + _P + j] += g[HALF_Q_P + 3 * i + j]
    for i in range(12):
        g[P + (NAV + i) * (STRIDE + 1)] += 0.5 * dt * g[ERROR_PSD + i]


@kernel
def predict(g: Array, dt: float) -> None:
    """Advance P by dt, paper A (5), with Phi = I + F dt and trapezoidal noise.

    Phi P Phi' + (Phi Q Phi' + Q) / 2 = Phi (P + Q / 2) Phi' + Q / 2. With P = [N C; C' B] in navigation states and
    IMU errors and Phi = [A G; 0 D], D diagonal:

        B <- D B D,    C <- (A C + G B) D,    N <- A N A' + W G' + (W G')',    W = A C + G B / 2

    Only what is neither zero nor one is multiplied, and C' is left behind: `mirror` brings it up to date.
    """
    _add_half_noise(g, dt)
    _through_navigation(g, dt)
    _through_sensors(g, dt)
    _back_to_navigation(g)
    _add_half_noise(g, dt)


@kernel
def mirror(g: Array) -> None:
    """Write the lower left block of P, which predictions leave behind, from the upper right one."""
    for i in range(NAV):
        for k in range(NAV, STATES):
            g[P + k * STRIDE + i] = g[P + i * STRIDE + k]
    for i in range(NAV, INERTIAL):
        for k in range(INERTIAL, STATES):
            g[P + k * STRIDE + i] = g[P + i * STRIDE + k]
