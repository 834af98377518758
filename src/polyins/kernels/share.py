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
from polyins.kernels.jit import Array, formula, kernel, scalar_kernel
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


# first what loops read and write in vectors of eight, in whole ones
P = _take(STATES * STRIDE)
# error model times dt: row k holds what state k does to position, velocity and phi, that is F' without its zero rows
F = _take(INERTIAL * HALF)
HALF_Q = _take(6 * SENSORS)  # by rows of velocity and phi, columns from the second on
# products
T = _take(NAV * STRIDE)
W = _take(NAV * HALF)
SCALE = _take(STRIDE)  # 1 - LOST
NOISE = _take(STRIDE)
RATIO = _take(SENSORS)  # what a scale does for each unit of what the bias beside it does
U = _take(NAV * SENSORS)
S = _take(NAV * SENSORS)
Z = _take(NAV * SENSORS)
# twelve each; longer loops than these would need, since LLVM unrolls short ones before it could vectorize
ERROR_PSD = _take(STRIDE)  # 2 sigma^2 / tau of each Gauss-Markov process
DECAY = _take(STRIDE)  # 1 / tau
LOST = _take(STRIDE)  # the IMU errors that P speaks of are those of the filter divided by 1 less this
BASES = _take(16)  # work of the means, see `fuse`
LANE_SUMS = _take(16 * 8)
# the fused state of the members, and the mean of their corrected increments as rates
POSITION = _take(3)
VELOCITY = _take(3)
QUATERNION = _take(4)
MATRIX = _take(9)
RATE = _take(3)  # rad/s
FORCE = _take(3)  # m/s^2
VEHICLE = _take(9)  # C_nv of a vehicle with wheels
WEIGHTS = _take(1)  # sum of the members' weights
METRIC = _take(3)  # metres per unit of each coordinate at the last fix
ANTENNA = _take(3)  # from the point of the fused state, in array axes, m
# noise of one member
GYRO_PSD = _take(3)  # angle random walk squared, rad^2/s
ACCEL_PSD = _take(3)  # velocity random walk squared, m^2/s^3
OWED = _take(1)  # seconds for which half of their noise is yet to be added
SINCE = _take(1)  # seconds since P was completed
FASTEST = _take(1)  # the largest 1 / tau

SIZE = _layout.size

_V, _P, _G, _A, _GS, _AS = 3, 6, 9, 12, 15, 18
MEAN_RADIUS = earth.A * math.sqrt(1.0 - earth.E2)
"""m, which over 1 - e^2 sin^2 is sqrt(R_M R_N)"""

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
    w2 = 1.0 - earth.E2 * s * s
    root = math.sqrt(w2)
    height = g[POSITION + 2]
    gravity = earth.normal_gravity(s * s, height)
    # 1 / (R_M + h), 1 / (R_N + h) and the tangent by one division, see `earth.evaluate`
    east = earth.A + height * root
    north = earth.A * (1.0 - earth.E2) + height * root * w2
    inverse = 1.0 / (north * east * c)
    m = root * w2 * (inverse * east * c)
    n = root * (inverse * north * c)
    t = s * (inverse * north * east)
    by_height = 2.0 * gravity * w2 / (MEAN_RADIUS + height * w2)
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
    g[BY_D + 5] = (-ve * ve * n * n - vn * vn * m * m + by_height) * dt

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


@scalar_kernel
def _skew(g: Array, row: int, column: int, x: float, y: float, z: float) -> None:
    """Write the block (x, y, z) x of F."""
    c0 = F + column * HALF + row
    c1, c2 = c0 + HALF, c0 + 2 * HALF
    g[c0 + 1], g[c0 + 2] = z, -y
    g[c1], g[c1 + 2] = -z, x
    g[c2], g[c2 + 1] = y, -x


@kernel
def _sensor_terms(g: Array, dt: float) -> None:
    """Write the terms of F dt that come from attitude and biases, and half of the noise over dt."""
    fx, fy, fz = g[FORCE], g[FORCE + 1], g[FORCE + 2]
    n = g[MATRIX] * fx + g[MATRIX + 1] * fy + g[MATRIX + 2] * fz
    e = g[MATRIX + 3] * fx + g[MATRIX + 4] * fy + g[MATRIX + 5] * fz
    d = g[MATRIX + 6] * fx + g[MATRIX + 7] * fy + g[MATRIX + 8] * fz
    _skew(g, _V, _P, n * dt, e * dt, d * dt)
    for i in range(3):
        for j in range(3):
            c = g[MATRIX + 3 * i + j] * dt
            g[F + (_A + j) * HALF + _V + i] = c
            g[F + (_G + j) * HALF + _P + i] = -c
        for j in range(i, 3):
            q_v = 0.0
            q_p = 0.0
            for k in range(3):
                cc = g[MATRIX + 3 * i + k] * g[MATRIX + 3 * j + k]
                q_v += cc * g[ACCEL_PSD + k]
                q_p += cc * g[GYRO_PSD + k]
            _put_half_noise(g, i, j, 2, 0.5 * dt * q_v)
            _put_half_noise(g, 3 + i, 3 + j, 2, 0.5 * dt * q_p)


@scalar_kernel
def _put_half_noise(g: Array, i: int, j: int, offset: int, q: float) -> None:
    """Write an element of the symmetric noise; columns are counted from `offset` before that of the first row."""
    g[HALF_Q + i * SENSORS + offset + j] = q
    g[HALF_Q + j * SENSORS + offset + i] = q


@kernel
def scale_terms(g: Array) -> None:
    """Write the terms of F dt that come from scales, which `predict` does without."""
    for k in range(3):
        for i in range(3):
            g[F + (_AS + k) * HALF + _V + i] = g[F + (_A + k) * HALF + _V + i] * g[FORCE + k]
            g[F + (_GS + k) * HALF + _P + i] = g[F + (_G + k) * HALF + _P + i] * g[RATE + k]


@kernel
def error_model(g: Array, dt: float, near: Array) -> None:
    """Write F dt, but for the terms of scales, and Q dt / 2 at the fused state, that of the start of the interval."""
    for i in range(3):
        g[F + (_V + i) * HALF + i] = dt
    if near[0] != 0.0:
        _earth_terms(g, dt, near[1], near[2], near[3])
    _sensor_terms(g, dt)


Three = tuple[float, float, float]


@scalar_kernel
def _factors(g: Array, f: int) -> Three:
    """F dt in three columns of one row, from the place of the first on."""
    return g[f], g[f + HALF], g[f + 2 * HALF]


@scalar_kernel
def _column(g: Array, x: int, stride: int) -> Three:
    return g[x], g[x + stride], g[x + 2 * stride]


@scalar_kernel
def _dot(a: Three, b: Three) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


Row = tuple[float, float, Three, float, float]


@scalar_kernel
def _row(g: Array, i: int, k: int, m: int) -> Row:
    """Row i of F dt among the navigation states: no error depends on longitude, phi enters as a vector product."""
    return g[F + i], g[F + 2 * HALF + i], _factors(g, F + _V * HALF + i), g[F + k * HALF + i], g[F + m * HALF + i]


@scalar_kernel
def _times(f: Row, r: Three, v: Three, p1: float, p2: float) -> float:
    return (f[0] * r[0] + f[1] * r[2]) + _dot(f[2], v) + (f[3] * p1 + f[4] * p2)


@kernel
def _position_rows(g: Array, dt: float) -> None:
    """Three rows of T = A [N C]."""
    f0, f1 = _factors(g, F + 0), _factors(g, F + 1)
    for j in range(STRIDE):
        r = _column(g, P + j, STRIDE)
        v = _column(g, P + _V * STRIDE + j, STRIDE)
        g[T + j] = r[0] + dt * v[0] + _dot(f0, r)
        g[T + STRIDE + j] = r[1] + dt * v[1] + _dot(f1, r)
        g[T + 2 * STRIDE + j] = r[2] + dt * v[2]


@kernel
def _velocity_rows(g: Array) -> None:
    """Three rows of T = A [N C]."""
    # all factors before the loop: loads in it that do not move would keep it from vectorizing
    f0, f1, f2 = (
        _row(g, _V + 0, _P + 1, _P + 2),
        _row(g, _V + 1, _P + 2, _P + 0),
        _row(g, _V + 2, _P + 0, _P + 1),
    )
    for j in range(STRIDE):
        r = _column(g, P + j, STRIDE)
        v = _column(g, P + _V * STRIDE + j, STRIDE)
        p = _column(g, P + _P * STRIDE + j, STRIDE)
        g[T + (_V + 0) * STRIDE + j] = v[0] + _times(f0, r, v, p[1], p[2])
        g[T + (_V + 1) * STRIDE + j] = v[1] + _times(f1, r, v, p[2], p[0])
        g[T + (_V + 2) * STRIDE + j] = v[2] + _times(f2, r, v, p[0], p[1])


@kernel
def _phi_rows(g: Array) -> None:
    """Three rows of T = A [N C]."""
    # all factors before the loop: loads in it that do not move would keep it from vectorizing
    f0, f1, f2 = (
        _row(g, _P + 0, _P + 1, _P + 2),
        _row(g, _P + 1, _P + 2, _P + 0),
        _row(g, _P + 2, _P + 0, _P + 1),
    )
    for j in range(STRIDE):
        r = _column(g, P + j, STRIDE)
        v = _column(g, P + _V * STRIDE + j, STRIDE)
        p = _column(g, P + _P * STRIDE + j, STRIDE)
        g[T + (_P + 0) * STRIDE + j] = p[0] + _times(f0, r, v, p[1], p[2])
        g[T + (_P + 1) * STRIDE + j] = p[1] + _times(f1, r, v, p[2], p[0])
        g[T + (_P + 2) * STRIDE + j] = p[2] + _times(f2, r, v, p[0], p[1])


@kernel
def _through_navigation(g: Array, dt: float) -> None:
    """T = A [N C], in parts whose factors stay in registers."""
    _position_rows(g, dt)
    _velocity_rows(g)
    _phi_rows(g)


@kernel
def _scale(g: Array, dt: float) -> None:
    """Bring scales and noise of the IMU errors up to date.

    With x = s x' an IMU error that decays, x <- (1 - dt / tau) x, is a constant x' and a smaller s. The half of the
    noise that comes after a step is added with that before the next: both are divided by the same s^2.
    """
    # scales must not vanish; not when something looks at P, so that what comes of a replay does not depend on that
    if g[SINCE] * g[FASTEST] > 1.0:
        complete(g)
    g[SINCE] += dt
    half = 0.5 * (g[OWED] + dt)
    g[OWED] = dt
    for k in range(STRIDE):
        scale = 1.0 - g[LOST + k]
        g[SCALE + k] = scale
        g[NOISE + k] = half * g[ERROR_PSD + k] / (scale * scale)
        g[LOST + k] += scale * (dt * g[DECAY + k])
    for k in range(12):
        g[P + (NAV + k) * (STRIDE + 1)] += g[NOISE + k]
    for k in range(6):
        g[RATIO + k] = g[RATE + k] * g[SCALE + 6 + k]


@scalar_kernel
def _felt(s: Three, b: Three, ratio: Three, h: Three) -> Three:
    """Errors of a measured vector that biases and scales make."""
    return s[0] * b[0] + ratio[0] * h[0], s[1] * b[1] + ratio[1] * h[1], s[2] * b[2] + ratio[2] * h[2]


@scalar_kernel
def _put_c(g: Array, row: int, j: int, own: float) -> None:
    """Element of C <- A C + G B and of W = A C + G B / 2."""
    t = g[T + row * STRIDE + SENSORS + j]
    g[P + row * STRIDE + SENSORS + j] = t + own
    g[W + row * HALF + j] = t + 0.5 * own


@kernel
def _through_sensors(g: Array) -> None:
    """Bring C up to date and leave W behind."""
    s_b, s_a = _column(g, SCALE, 1), _column(g, SCALE + 3, 1)
    h_b, h_a = _column(g, RATIO, 1), _column(g, RATIO + 3, 1)
    f3, f4, f5 = _factors(g, F + _A * HALF + 3), _factors(g, F + _A * HALF + 4), _factors(g, F + _A * HALF + 5)
    f6, f7, f8 = _factors(g, F + _G * HALF + 6), _factors(g, F + _G * HALF + 7), _factors(g, F + _G * HALF + 8)
    for j in range(HALF):
        b = _column(g, P + _G * STRIDE + SENSORS + j, STRIDE)
        a = _column(g, P + _A * STRIDE + SENSORS + j, STRIDE)
        sb = _column(g, P + _GS * STRIDE + SENSORS + j, STRIDE)
        sa = _column(g, P + _AS * STRIDE + SENSORS + j, STRIDE)
        rate, force = _felt(s_b, b, h_b, sb), _felt(s_a, a, h_a, sa)
        _put_c(g, 0, j, 0.0)
        _put_c(g, 1, j, 0.0)
        _put_c(g, 2, j, 0.0)
        _put_c(g, 3, j, _dot(f3, force))
        _put_c(g, 4, j, _dot(f4, force))
        _put_c(g, 5, j, _dot(f5, force))
        _put_c(g, 6, j, _dot(f6, rate))
        _put_c(g, 7, j, _dot(f7, rate))
        _put_c(g, 8, j, _dot(f8, rate))


@scalar_kernel
def _put_u(g: Array, i: int, j: int, scale: float, ratio: float) -> None:
    w = W + i * HALF + NAV - SENSORS + j
    g[U + i * SENSORS + j] = g[w] * scale + g[w + 6] * ratio


@kernel
def _felt_by_rows(g: Array) -> None:
    """U = what W says of the errors of rate and force, which biases and scales make."""
    for j in range(SENSORS):
        scale, ratio = g[SCALE + j], g[RATIO + j]
        _put_u(g, 0, j, scale, ratio)
        _put_u(g, 1, j, scale, ratio)
        _put_u(g, 2, j, scale, ratio)
        _put_u(g, 3, j, scale, ratio)
        _put_u(g, 4, j, scale, ratio)
        _put_u(g, 5, j, scale, ratio)
        _put_u(g, 6, j, scale, ratio)
        _put_u(g, 7, j, scale, ratio)
        _put_u(g, 8, j, scale, ratio)


Nine = tuple[Three, Three, Three]


@kernel
def _factors_of_row(g: Array, i: int) -> Nine:
    t = T + i * STRIDE
    return _column(g, t, 1), _column(g, t + _V, 1), _column(g, t + _P, 1)


@kernel
def _put_s(g: Array, i: int, j: int, t: Nine, r: Three, v: Three, p: Three) -> None:
    g[S + i * SENSORS + j] = g[T + i * STRIDE + 1 + j] + _dot(t[0], r) + _dot(t[1], v) + _dot(t[2], p)


@formula
def _navigation_rows(g: Array, i: int) -> None:
    """Write three rows of S = (A N) A' from the i-th on, all columns but the first."""
    t0, t1, t2 = _factors_of_row(g, i), _factors_of_row(g, i + 1), _factors_of_row(g, i + 2)
    for j in range(SENSORS):
        r, v, p = (
            _column(g, F + 1 + j, HALF),
            _column(g, F + _V * HALF + 1 + j, HALF),
            _column(g, F + _P * HALF + 1 + j, HALF),
        )
        _put_s(g, i, j, t0, r, v, p)
        _put_s(g, i + 1, j, t1, r, v, p)
        _put_s(g, i + 2, j, t2, r, v, p)


@kernel
def _back_to_navigation(g: Array) -> None:
    """S = (A N) A'."""
    _navigation_rows(g, 0)
    _navigation_rows(g, 3)
    _navigation_rows(g, 6)


@kernel
def _put_z(g: Array, i: int, j: int, b: Three, a: Three, rate: Three, force: Three) -> None:
    z = _dot(b, rate) + _dot(a, force)
    g[Z + i * SENSORS + j] = z
    g[S + i * SENSORS + j] += z


@formula
def _sensor_rows(g: Array, i: int) -> None:
    """Write three rows of Z = W G' from the i-th on and add them to those of S."""
    b0, b1, b2 = (
        _column(g, U + i * SENSORS, 1),
        _column(g, U + (i + 1) * SENSORS, 1),
        _column(g, U + (i + 2) * SENSORS, 1),
    )
    a0, a1, a2 = (
        _column(g, U + i * SENSORS + 3, 1),
        _column(g, U + (i + 1) * SENSORS + 3, 1),
        _column(g, U + (i + 2) * SENSORS + 3, 1),
    )
    for j in range(SENSORS):
        rate, force = _column(g, F + _G * HALF + 1 + j, HALF), _column(g, F + _A * HALF + 1 + j, HALF)
        _put_z(g, i, j, b0, a0, rate, force)
        _put_z(g, i + 1, j, b1, a1, rate, force)
        _put_z(g, i + 2, j, b2, a2, rate, force)


@kernel
def _from_sensors(g: Array) -> None:
    """N = S + Z' + Q / 2, the upper triangle and by symmetry the lower one."""
    _sensor_rows(g, 0)
    _sensor_rows(g, 3)
    _sensor_rows(g, 6)
    g[P] = g[T] + _dot(_column(g, T, 1), _column(g, F, HALF)) + g[T + _V] * g[F + _V * HALF]
    for i in range(3):  # no IMU error moves a position: Z' has no such rows
        for j in range(max(i, 1), NAV):
            _put_n(g, i, j, g[S + i * SENSORS + j - 1])
    for i in range(3, NAV):
        for j in range(i, NAV):
            n = g[S + i * SENSORS + j - 1] + g[Z + j * SENSORS + i - 1]
            _put_n(g, i, j, n + g[HALF_Q + (i - 3) * SENSORS + j - 1])


@scalar_kernel
def _put_n(g: Array, i: int, j: int, n: float) -> None:
    g[P + i * STRIDE + j] = n
    g[P + j * STRIDE + i] = n


@kernel
def _add_half_noise(g: Array) -> None:
    for i in range(3):
        for j in range(3):
            g[P + (_V + i) * STRIDE + _V + j] += g[HALF_Q + i * SENSORS + 2 + j]
            g[P + (_P + i) * STRIDE + _P + j] += g[HALF_Q + (3 + i) * SENSORS + 5 + j]


@kernel
def predict(g: Array, dt: float) -> None:
    """Advance P by dt, paper A (5), with Phi = I + F dt and trapezoidal noise.

    Phi P Phi' + (Phi Q Phi' + Q) / 2 = Phi (P + Q / 2) Phi' + Q / 2. With P = [N C; C' B] in navigation states and
    scaled IMU errors, see `_scale`, Phi = [A G; 0 I] and

        C <- A C + G B,    N <- A N A' + W G' + (W G')',    W = A C + G B / 2

    G is C_nb times the errors of rate and force, to which a bias adds itself and a scale what it multiplies. Only what
    is neither zero nor one is multiplied. C' and the scales are left behind: `complete` brings P up to date, and who
    only looks at P heeds `scale_of` and `owed`, so that a look changes no bit.
    """
    # in an order that lets what was written number by number reach the cache before it is read in vectors
    _add_half_noise(g)
    _scale(g, dt)
    _through_navigation(g, dt)
    _through_sensors(g)
    _back_to_navigation(g)
    _felt_by_rows(g)
    _from_sensors(g)


@kernel
def mirror(g: Array) -> None:
    """Write the lower left block of P, which predictions leave behind, from the upper right one."""
    for i in range(NAV):
        for k in range(NAV, STATES):
            g[P + k * STRIDE + i] = g[P + i * STRIDE + k]
    for i in range(NAV, INERTIAL):
        for k in range(INERTIAL, STATES):
            g[P + k * STRIDE + i] = g[P + i * STRIDE + k]


@scalar_kernel
def scale_of(g: Array, state: int) -> float:
    """Return what P takes for one unit of a state: 1 but for IMU errors."""
    if NAV <= state < INERTIAL:
        scale: float = 1.0 - g[LOST + state - NAV]
        return scale
    return 1.0


@scalar_kernel
def owed(g: Array, state: int) -> float:
    """Return the noise that is yet to be added to the variance of a state."""
    if NAV <= state < INERTIAL:
        noise: float = 0.5 * g[OWED] * g[ERROR_PSD + state - NAV]
        return noise
    return 0.0


@scalar_kernel
def variance(g: Array, state: int) -> float:
    """Return the variance of a state."""
    scale = scale_of(g, state)
    total: float = g[P + state * (STRIDE + 1)] * scale * scale + owed(g, state)
    return total


@kernel
def complete(g: Array) -> None:
    """Bring all of P up to date after predictions: scales, noise still owed, and the lower left block."""
    for i in range(STATES):
        scale = scale_of(g, i)
        for k in range(NAV, INERTIAL):
            g[P + i * STRIDE + k] *= scale * (1.0 - g[LOST + k - NAV])
        for k in range(INERTIAL, STATES):
            g[P + i * STRIDE + k] *= scale
        g[P + i * (STRIDE + 1)] += owed(g, i)
    settle(g)
    mirror(g)


@kernel
def settle(g: Array) -> None:
    """Note that P speaks of the states themselves and is owed nothing."""
    for k in range(12):
        g[LOST + k] = 0.0
    g[OWED] = 0.0
    g[SINCE] = 0.0
