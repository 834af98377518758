"""One covariance block and what drives it: the fused state of its members, the error model, the prediction of P.

The error states are those of `model.states`, position, velocity and phi in n. Navigation errors are estimate minus
truth, r_hat = r + dr, v_hat = v + dv, C_hat = (I - phi x) C; the others are truth minus estimate. So estimates are
corrected by r -= dr, v -= dv, C = (I + phi x) C, errors += dx.

Most filters have at most 24 states: for rows of that many numbers the prediction uses all structure that there is
(`predict`). With more of them it is Phi times a matrix, twice (`predict_any`), which a test holds equal.
"""

from __future__ import annotations

import math

from polyins.kernels import earth
from polyins.kernels.jit import Array, formula, kernel, scalar_kernel
from polyins.kernels.layout import Layout
from polyins.model.states import IMU_ERRORS, NAVIGATION, STATES, place, stride_for

NAV = NAVIGATION  # position, velocity, phi
INERTIAL = NAVIGATION + IMU_ERRORS
LARGEST = stride_for(STATES)
"""length of a row of P with all states"""
# Loops over columns have constant bounds and whole vectors of eight. What they compute beyond the columns that count is
# finite and never used, or overwritten.
STRIDE = 24
HALF = 16
SENSORS = 8  # from here on a row of P holds the covariances with IMU errors, of which the first is in column 9

_layout = Layout()
_take = _layout.take

# what a block is told: of the errors beside the navigation state
ERROR_PSD = _take(LARGEST)  # of what drives each, 2 sigma^2 / tau for a Gauss-Markov process
GYRO_PSD = _take(3)  # of noise: angle random walk squared, rad^2/s
ACCEL_PSD = _take(3)  # velocity random walk squared, m^2/s^3
NOISES = LARGEST + 6
"""numbers up to here that say how fast it becomes unsure"""
DECAY = _take(LARGEST)  # 1 / tau; zero for what stays
FASTEST = _take(1)  # the largest 1 / tau
MEMBERS = _take(1)  # that count
COMPARISONS = _take(1)  # of its members with their mean, so far
OWN_SCALE = _take(1)  # of the noise that each member has of its own, see `navigate.deviations`
PLACE = _take(3)  # of the point whose state is fused, in vehicle axes, m
# the fused state of the members, and the mean of their corrected increments as rates
POSITION = _take(3)
VELOCITY = _take(3)
QUATERNION = _take(4)
MATRIX = _take(9)
RATE = _take(3)  # rad/s
FORCE = _take(3)  # m/s^2
VEHICLE = _take(9)  # C_nv
METRIC = _take(3)  # metres per unit of each coordinate at the last update
COUNTS = _take(1)  # 1, or 0 while none of its members counts: then it is left out of what is merged
FORWARD = _take(1)  # speed of the vehicle as this block has it, where several are merged, m/s
# P speaks of the IMU errors divided by 1 less LOST, and is owed half of their noise over OWED: see `_scale`
LOST = _take(LARGEST)
OWED = _take(1)  # s
SINCE = _take(1)  # seconds since P was completed
P = _layout.aligned()
"""last, since it grows with the number of states"""

_layout = Layout()
_take = _layout.take

# work, which exists once: error model times dt; row k holds what state k does to position, velocity and phi, that is
# F' without its zero rows
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
FROM = _take(LARGEST * LARGEST)  # a square of rows as long as those of P, and Phi times it
TO = _take(LARGEST * LARGEST)

WORK = _layout.size
"""length of the work array"""

_V, _P, _G, _A = place("velocity"), place("phi"), place("gyro_bias"), place("accel_bias")
_GS, _AS = place("gyro_scale"), place("accel_scale")
MEAN_RADIUS = earth.A * math.sqrt(1.0 - earth.E2)
"""m, which over 1 - e^2 sin^2 is sqrt(R_M R_N)"""

BY_N, BY_E, BY_D, BY_VN, BY_VE, BY_VD = (F + k * HALF for k in range(6))


@kernel
def _earth_terms(block: Array, work: Array, dt: float, latitude: float, sine: float, cosine: float) -> None:
    """Write the terms of F dt that come from earth rate, transport rate and gravity.

    Complete phi-angle model in n with position errors in metres; see docs/theory.
    """
    d = block[POSITION] - latitude
    sin_d = d * (1.0 - d * d / 6.0)
    cos_d = 1.0 - d * d * (0.5 - d * d / 24.0)
    s = sine * cos_d + cosine * sin_d
    c = cosine * cos_d - sine * sin_d
    w2 = 1.0 - earth.E2 * s * s
    root = math.sqrt(w2)
    height = block[POSITION + 2]
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
    vn, ve, vd = block[VELOCITY], block[VELOCITY + 1], block[VELOCITY + 2]
    wn, wd = rate * c, -rate * s
    tn, te, td = ve * n, -vn * m, -ve * n * t
    sec2 = 1.0 + t * t

    work[BY_N + 0] = -vd * m * dt
    work[BY_D + 0] = vn * m * dt
    work[BY_N + 1] = ve * t * n * dt
    work[BY_E + 1] = -(vd + vn * t) * n * dt
    work[BY_D + 1] = ve * n * dt

    work[BY_N + 3] = -(2.0 * ve * wn + ve * ve * n * sec2) * m * dt
    work[BY_D + 3] = (vn * vd * m * m - ve * ve * t * n * n) * dt
    work[BY_N + 4] = (2.0 * (vn * wn + vd * wd) + vn * ve * n * sec2) * m * dt
    work[BY_D + 4] = (ve * vd + vn * ve * t) * n * n * dt
    work[BY_N + 5] = -2.0 * ve * wd * m * dt
    work[BY_D + 5] = (-ve * ve * n * n - vn * vn * m * m + by_height) * dt

    work[BY_VN + 3] = vd * m * dt
    work[BY_VE + 3] = 2.0 * (wd + td) * dt
    work[BY_VD + 3] = -te * dt
    work[BY_VN + 4] = -(2.0 * wd + td) * dt
    work[BY_VE + 4] = (vd + vn * t) * n * dt
    work[BY_VD + 4] = (2.0 * wn + tn) * dt
    work[BY_VN + 5] = 2.0 * te * dt
    work[BY_VE + 5] = -2.0 * (wn + tn) * dt

    work[BY_N + 6] = wd * m * dt
    work[BY_D + 6] = ve * n * n * dt
    work[BY_D + 7] = -vn * m * m * dt
    work[BY_N + 8] = -(wn + ve * n * sec2) * m * dt
    work[BY_D + 8] = -ve * t * n * n * dt
    work[BY_VE + 6] = n * dt
    work[BY_VN + 7] = -m * dt
    work[BY_VE + 8] = -t * n * dt

    _skew(work, _P, _P, -(wn + tn) * dt, -te * dt, -(wd + td) * dt)


@scalar_kernel
def _skew(work: Array, row: int, column: int, x: float, y: float, z: float) -> None:
    """Write the block (x, y, z) x of F."""
    c0 = F + column * HALF + row
    c1, c2 = c0 + HALF, c0 + 2 * HALF
    work[c0 + 1], work[c0 + 2] = z, -y
    work[c1], work[c1 + 2] = -z, x
    work[c2], work[c2 + 1] = y, -x


@kernel
def _sensor_terms(block: Array, work: Array, dt: float) -> None:
    """Write the terms of F dt that come from attitude and biases, and half of the noise over dt."""
    fx, fy, fz = block[FORCE], block[FORCE + 1], block[FORCE + 2]
    n = block[MATRIX] * fx + block[MATRIX + 1] * fy + block[MATRIX + 2] * fz
    e = block[MATRIX + 3] * fx + block[MATRIX + 4] * fy + block[MATRIX + 5] * fz
    d = block[MATRIX + 6] * fx + block[MATRIX + 7] * fy + block[MATRIX + 8] * fz
    _skew(work, _V, _P, n * dt, e * dt, d * dt)
    for i in range(3):
        for j in range(3):
            c = block[MATRIX + 3 * i + j] * dt
            work[F + (_A + j) * HALF + _V + i] = c
            work[F + (_G + j) * HALF + _P + i] = -c
    noise_terms(block, work, dt)


@kernel
def noise_terms(block: Array, work: Array, dt: float) -> None:
    """Write half of the noise of gyros and accelerometers over dt."""
    for i in range(3):
        for j in range(i, 3):
            q_v = 0.0
            q_p = 0.0
            for k in range(3):
                cc = block[MATRIX + 3 * i + k] * block[MATRIX + 3 * j + k]
                q_v += cc * block[ACCEL_PSD + k]
                q_p += cc * block[GYRO_PSD + k]
            _put_half_noise(work, i, j, 2, 0.5 * dt * q_v)
            _put_half_noise(work, 3 + i, 3 + j, 2, 0.5 * dt * q_p)


@scalar_kernel
def _put_half_noise(work: Array, i: int, j: int, offset: int, q: float) -> None:
    """Write an element of the symmetric noise; columns are counted from `offset` before that of the first row."""
    work[HALF_Q + i * SENSORS + offset + j] = q
    work[HALF_Q + j * SENSORS + offset + i] = q


@kernel
def scale_terms(block: Array, work: Array) -> None:
    """Write the terms of F dt that come from scales, which `predict` does without."""
    for k in range(3):
        for i in range(3):
            work[F + (_AS + k) * HALF + _V + i] = work[F + (_A + k) * HALF + _V + i] * block[FORCE + k]
            work[F + (_GS + k) * HALF + _P + i] = work[F + (_G + k) * HALF + _P + i] * block[RATE + k]


@kernel
def error_model(block: Array, work: Array, dt: float, earth_reference: Array) -> None:
    """Write F dt, but for the terms of scales, and Q dt / 2 at the fused state, that of the start of the interval.

    `earth_reference`: see `earth.evaluate`.
    """
    for i in range(3):
        work[F + (_V + i) * HALF + i] = dt
    if earth_reference[0] != 0.0:
        _earth_terms(block, work, dt, earth_reference[1], earth_reference[2], earth_reference[3])
    _sensor_terms(block, work, dt)


Three = tuple[float, float, float]


@formula
def factors(work: Array, f: int) -> Three:
    """F dt in three columns of one row, from the place of the first on."""
    return work[f], work[f + HALF], work[f + 2 * HALF]


@formula
def column(array: Array, x: int, stride: int) -> Three:
    """Three numbers that stand `stride` apart."""
    return array[x], array[x + stride], array[x + 2 * stride]


@formula
def dot(a: Three, b: Three) -> float:
    """Multiply: A' b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


Row = tuple[float, float, Three, float, float]


@formula
def row(work: Array, i: int, k: int, m: int) -> Row:
    """Row i of F dt among the navigation states: no error depends on longitude, phi enters as a vector product."""
    return (
        work[F + i],
        work[F + 2 * HALF + i],
        factors(work, F + _V * HALF + i),
        work[F + k * HALF + i],
        work[F + m * HALF + i],
    )


@formula
def times(f: Row, r: Three, v: Three, p1: float, p2: float) -> float:
    """Multiply a row of F dt by a column of position, velocity and the two components of phi."""
    return (f[0] * r[0] + f[1] * r[2]) + dot(f[2], v) + (f[3] * p1 + f[4] * p2)


@kernel
def _position_rows(block: Array, work: Array, dt: float) -> None:
    """Three rows of T = A [N C]."""
    f0, f1 = factors(work, F + 0), factors(work, F + 1)
    for j in range(STRIDE):
        r = column(block, P + j, STRIDE)
        v = column(block, P + _V * STRIDE + j, STRIDE)
        work[T + j] = r[0] + dt * v[0] + dot(f0, r)
        work[T + STRIDE + j] = r[1] + dt * v[1] + dot(f1, r)
        work[T + 2 * STRIDE + j] = r[2] + dt * v[2]


@kernel
def _velocity_rows(block: Array, work: Array) -> None:
    """Three rows of T = A [N C]."""
    # all factors before the loop: loads in it that do not move would keep it from vectorizing
    f0, f1, f2 = (
        row(work, _V + 0, _P + 1, _P + 2),
        row(work, _V + 1, _P + 2, _P + 0),
        row(work, _V + 2, _P + 0, _P + 1),
    )
    for j in range(STRIDE):
        r = column(block, P + j, STRIDE)
        v = column(block, P + _V * STRIDE + j, STRIDE)
        p = column(block, P + _P * STRIDE + j, STRIDE)
        work[T + (_V + 0) * STRIDE + j] = v[0] + times(f0, r, v, p[1], p[2])
        work[T + (_V + 1) * STRIDE + j] = v[1] + times(f1, r, v, p[2], p[0])
        work[T + (_V + 2) * STRIDE + j] = v[2] + times(f2, r, v, p[0], p[1])


@kernel
def _phi_rows(block: Array, work: Array) -> None:
    """Three rows of T = A [N C]."""
    # all factors before the loop: loads in it that do not move would keep it from vectorizing
    f0, f1, f2 = (
        row(work, _P + 0, _P + 1, _P + 2),
        row(work, _P + 1, _P + 2, _P + 0),
        row(work, _P + 2, _P + 0, _P + 1),
    )
    for j in range(STRIDE):
        r = column(block, P + j, STRIDE)
        v = column(block, P + _V * STRIDE + j, STRIDE)
        p = column(block, P + _P * STRIDE + j, STRIDE)
        work[T + (_P + 0) * STRIDE + j] = p[0] + times(f0, r, v, p[1], p[2])
        work[T + (_P + 1) * STRIDE + j] = p[1] + times(f1, r, v, p[2], p[0])
        work[T + (_P + 2) * STRIDE + j] = p[2] + times(f2, r, v, p[0], p[1])


@kernel
def _through_navigation(block: Array, work: Array, dt: float) -> None:
    """T = A [N C], in parts whose factors stay in registers."""
    _position_rows(block, work, dt)
    _velocity_rows(block, work)
    _phi_rows(block, work)


@kernel
def _scale(block: Array, work: Array, dt: float) -> None:
    """Bring scales and noise of the IMU errors up to date.

    With x = s x' an IMU error that decays, x <- (1 - dt / tau) x, is a constant x' and a smaller s. The half of the
    noise that comes after a step is added with that before the next: both are divided by the same s^2.
    """
    # scales must not vanish; not when something looks at P, so that what comes of a replay does not depend on that
    if block[SINCE] * block[FASTEST] > 1.0:
        complete(block, STRIDE)
    block[SINCE] += dt
    half = 0.5 * (block[OWED] + dt)
    block[OWED] = dt
    for k in range(STRIDE):
        scale = 1.0 - block[LOST + k]
        work[SCALE + k] = scale
        work[NOISE + k] = half * block[ERROR_PSD + k] / (scale * scale)
        block[LOST + k] += scale * (dt * block[DECAY + k])
    for k in range(STRIDE - NAV):
        block[P + (NAV + k) * (STRIDE + 1)] += work[NOISE + k]
    for k in range(6):
        work[RATIO + k] = block[RATE + k] * work[SCALE + 6 + k]


@scalar_kernel
def _felt(s: Three, b: Three, ratio: Three, h: Three) -> Three:
    """Errors of a measured vector that biases and scales make."""
    return s[0] * b[0] + ratio[0] * h[0], s[1] * b[1] + ratio[1] * h[1], s[2] * b[2] + ratio[2] * h[2]


@scalar_kernel
def _put_c(block: Array, work: Array, row: int, j: int, own: float) -> None:
    """Element of C <- A C + G B and of W = A C + G B / 2."""
    t = work[T + row * STRIDE + SENSORS + j]
    block[P + row * STRIDE + SENSORS + j] = t + own
    work[W + row * HALF + j] = t + 0.5 * own


@kernel
def _through_sensors(block: Array, work: Array) -> None:
    """Bring C up to date and leave W behind."""
    s_b, s_a = column(work, SCALE, 1), column(work, SCALE + 3, 1)
    h_b, h_a = column(work, RATIO, 1), column(work, RATIO + 3, 1)
    f3, f4, f5 = factors(work, F + _A * HALF + 3), factors(work, F + _A * HALF + 4), factors(work, F + _A * HALF + 5)
    f6, f7, f8 = factors(work, F + _G * HALF + 6), factors(work, F + _G * HALF + 7), factors(work, F + _G * HALF + 8)
    for j in range(HALF):
        b = column(block, P + _G * STRIDE + SENSORS + j, STRIDE)
        a = column(block, P + _A * STRIDE + SENSORS + j, STRIDE)
        sb = column(block, P + _GS * STRIDE + SENSORS + j, STRIDE)
        sa = column(block, P + _AS * STRIDE + SENSORS + j, STRIDE)
        rate, force = _felt(s_b, b, h_b, sb), _felt(s_a, a, h_a, sa)
        _put_c(block, work, 0, j, 0.0)
        _put_c(block, work, 1, j, 0.0)
        _put_c(block, work, 2, j, 0.0)
        _put_c(block, work, 3, j, dot(f3, force))
        _put_c(block, work, 4, j, dot(f4, force))
        _put_c(block, work, 5, j, dot(f5, force))
        _put_c(block, work, 6, j, dot(f6, rate))
        _put_c(block, work, 7, j, dot(f7, rate))
        _put_c(block, work, 8, j, dot(f8, rate))


@scalar_kernel
def _put_u(work: Array, i: int, j: int, scale: float, ratio: float) -> None:
    w = W + i * HALF + NAV - SENSORS + j
    work[U + i * SENSORS + j] = work[w] * scale + work[w + 6] * ratio


@kernel
def _felt_by_rows(work: Array) -> None:
    """U = what W says of the errors of rate and force, which biases and scales make."""
    for j in range(SENSORS):
        scale, ratio = work[SCALE + j], work[RATIO + j]
        _put_u(work, 0, j, scale, ratio)
        _put_u(work, 1, j, scale, ratio)
        _put_u(work, 2, j, scale, ratio)
        _put_u(work, 3, j, scale, ratio)
        _put_u(work, 4, j, scale, ratio)
        _put_u(work, 5, j, scale, ratio)
        _put_u(work, 6, j, scale, ratio)
        _put_u(work, 7, j, scale, ratio)
        _put_u(work, 8, j, scale, ratio)


Nine = tuple[Three, Three, Three]


@scalar_kernel
def _navigation_factors(work: Array, i: int) -> Nine:
    t = T + i * STRIDE
    return column(work, t, 1), column(work, t + _V, 1), column(work, t + _P, 1)


@scalar_kernel
def _back(own: float, t: Nine, a: Nine) -> float:
    """Element of (A N) A', of which A' is the identity and what F dt adds."""
    return own + dot(t[0], a[0]) + dot(t[1], a[1]) + dot(t[2], a[2])


@formula
def _navigation_rows(work: Array, i: int) -> None:
    """Write three rows of S = (A N) A' from the i-th on, all columns but the first."""
    t0, t1, t2 = _navigation_factors(work, i), _navigation_factors(work, i + 1), _navigation_factors(work, i + 2)
    s, t = S + i * SENSORS, T + i * STRIDE + 1
    for j in range(SENSORS):
        a = (
            column(work, F + 1 + j, HALF),
            column(work, F + _V * HALF + 1 + j, HALF),
            column(work, F + _P * HALF + 1 + j, HALF),
        )
        work[s + j] = _back(work[t + j], t0, a)
        work[s + SENSORS + j] = _back(work[t + STRIDE + j], t1, a)
        work[s + 2 * SENSORS + j] = _back(work[t + 2 * STRIDE + j], t2, a)


@kernel
def _back_to_navigation(work: Array) -> None:
    """S = (A N) A'."""
    _navigation_rows(work, 0)
    _navigation_rows(work, 3)
    _navigation_rows(work, 6)


@scalar_kernel
def _put_z(work: Array, i: int, j: int, z: float) -> None:
    work[Z + i * SENSORS + j] = z
    work[S + i * SENSORS + j] += z


@formula
def _sensor_rows(work: Array, i: int) -> None:
    """Write three rows of Z = W G' from the i-th on and add them to those of S."""
    b0, b1, b2 = (
        column(work, U + i * SENSORS, 1),
        column(work, U + (i + 1) * SENSORS, 1),
        column(work, U + (i + 2) * SENSORS, 1),
    )
    a0, a1, a2 = (
        column(work, U + i * SENSORS + 3, 1),
        column(work, U + (i + 1) * SENSORS + 3, 1),
        column(work, U + (i + 2) * SENSORS + 3, 1),
    )
    for j in range(SENSORS):
        rate, force = column(work, F + _G * HALF + 1 + j, HALF), column(work, F + _A * HALF + 1 + j, HALF)
        _put_z(work, i, j, dot(b0, rate) + dot(a0, force))
        _put_z(work, i + 1, j, dot(b1, rate) + dot(a1, force))
        _put_z(work, i + 2, j, dot(b2, rate) + dot(a2, force))


@kernel
def _from_sensors(block: Array, work: Array) -> None:
    """N = S + Z' + Q / 2, the upper triangle and by symmetry the lower one."""
    _sensor_rows(work, 0)
    _sensor_rows(work, 3)
    _sensor_rows(work, 6)
    block[P] = work[T] + dot(column(work, T, 1), column(work, F, HALF)) + work[T + _V] * work[F + _V * HALF]
    for i in range(3):  # no IMU error moves a position: Z' has no such rows
        for j in range(max(i, 1), NAV):
            _put_n(block, i, j, work[S + i * SENSORS + j - 1])
    for i in range(3, NAV):
        for j in range(i, NAV):
            n = work[S + i * SENSORS + j - 1] + work[Z + j * SENSORS + i - 1]
            _put_n(block, i, j, n + work[HALF_Q + (i - 3) * SENSORS + j - 1])


@scalar_kernel
def _put_n(block: Array, i: int, j: int, n: float) -> None:
    block[P + i * STRIDE + j] = n
    block[P + j * STRIDE + i] = n


@kernel
def _add_half_noise(block: Array, work: Array) -> None:
    for i in range(3):
        for j in range(3):
            block[P + (_V + i) * STRIDE + _V + j] += work[HALF_Q + i * SENSORS + 2 + j]
            block[P + (_P + i) * STRIDE + _P + j] += work[HALF_Q + (3 + i) * SENSORS + 5 + j]


@kernel
def predict(block: Array, work: Array, dt: float) -> None:
    """Advance P by dt, paper A (5), with Phi = I + F dt and trapezoidal noise.

    Phi P Phi' + (Phi Q Phi' + Q) / 2 = Phi (P + Q / 2) Phi' + Q / 2. With P = [N C; C' B] in navigation states and
    scaled IMU errors, see `_scale`, Phi = [A G; 0 I] and

        C <- A C + G B,    N <- A N A' + W G' + (W G')',    W = A C + G B / 2

    G is C_nb times the errors of rate and force, to which a bias adds itself and a scale what it multiplies. Only what
    is neither zero nor one is multiplied. C' and the scales are left behind, which costs a sixth of an epoch less than
    bringing them along: `complete` brings P up to date, and who only looks at P heeds `scale_of` and `owed`, so that a
    look changes no bit.
    """
    # in an order that lets what was written number by number reach the cache before it is read in vectors
    _add_half_noise(block, work)
    _scale(block, work, dt)
    _through_navigation(block, work, dt)
    _through_sensors(block, work)
    _back_to_navigation(work)
    _felt_by_rows(work)
    _from_sensors(block, work)


@kernel
def _through_errors(work: Array, stride: int, row_: int, bias: int, scale: int) -> None:
    """Three rows of navigation states take what biases and scales do to them."""
    b0, b1, b2 = (
        factors(work, F + bias * HALF + row_),
        factors(work, F + bias * HALF + row_ + 1),
        factors(work, F + bias * HALF + row_ + 2),
    )
    s0, s1, s2 = (
        factors(work, F + scale * HALF + row_),
        factors(work, F + scale * HALF + row_ + 1),
        factors(work, F + scale * HALF + row_ + 2),
    )
    to = TO + row_ * stride
    for j in range(stride):
        b = column(work, FROM + bias * stride + j, stride)
        s = column(work, FROM + scale * stride + j, stride)
        work[to + j] += dot(b0, b) + dot(s0, s)
        work[to + stride + j] += dot(b1, b) + dot(s1, s)
        work[to + 2 * stride + j] += dot(b2, b) + dot(s2, s)


@kernel
def through(block: Array, work: Array, dt: float, stride: int) -> None:
    """TO = Phi FROM, with Phi = I + F dt of a block; F is complete, with its terms of scales."""
    f0, f1 = factors(work, F + 0), factors(work, F + 1)
    f3, f4, f5 = row(work, 3, 7, 8), row(work, 4, 8, 6), row(work, 5, 6, 7)
    f6, f7, f8 = row(work, 6, 7, 8), row(work, 7, 8, 6), row(work, 8, 6, 7)
    for j in range(stride):
        r = column(work, FROM + j, stride)
        v = column(work, FROM + 3 * stride + j, stride)
        p = column(work, FROM + 6 * stride + j, stride)
        work[TO + j] = r[0] + dt * v[0] + dot(f0, r)
        work[TO + stride + j] = r[1] + dt * v[1] + dot(f1, r)
        work[TO + 2 * stride + j] = r[2] + dt * v[2]
        work[TO + 3 * stride + j] = v[0] + times(f3, r, v, p[1], p[2])
        work[TO + 4 * stride + j] = v[1] + times(f4, r, v, p[2], p[0])
        work[TO + 5 * stride + j] = v[2] + times(f5, r, v, p[0], p[1])
        work[TO + 6 * stride + j] = p[0] + times(f6, r, v, p[1], p[2])
        work[TO + 7 * stride + j] = p[1] + times(f7, r, v, p[2], p[0])
        work[TO + 8 * stride + j] = p[2] + times(f8, r, v, p[0], p[1])
    _through_errors(work, stride, 3, _A, _AS)
    _through_errors(work, stride, 6, _G, _GS)
    for i in range(NAV, stride):
        keep = 1.0 - dt * block[DECAY + i - NAV]
        for j in range(stride):
            work[TO + i * stride + j] = keep * work[FROM + i * stride + j]


@kernel
def transpose_back(work: Array, stride: int) -> None:
    """FROM = TO'."""
    for i in range(stride):
        for j in range(stride):
            work[FROM + j * stride + i] = work[TO + i * stride + j]


@kernel
def _add_half_noises(block: Array, work: Array, dt: float, stride: int) -> None:
    for i in range(3):
        for j in range(3):
            block[P + (_V + i) * stride + _V + j] += work[HALF_Q + i * SENSORS + 2 + j]
            block[P + (_P + i) * stride + _P + j] += work[HALF_Q + (3 + i) * SENSORS + 5 + j]
    for k in range(NAV, stride):
        block[P + k * (stride + 1)] += 0.5 * dt * block[ERROR_PSD + k - NAV]


@kernel
def predict_any(block: Array, work: Array, dt: float, stride: int) -> None:
    """Advance P by dt as `predict` does, for any number of states, and leave all of it up to date."""
    scale_terms(block, work)
    _add_half_noises(block, work, dt, stride)
    for k in range(stride * stride):
        work[FROM + k] = block[P + k]
    through(block, work, dt, stride)
    transpose_back(work, stride)
    through(block, work, dt, stride)
    for i in range(stride):
        for j in range(i, stride):
            block[P + i * stride + j] = block[P + j * stride + i] = work[TO + i * stride + j]
    _add_half_noises(block, work, dt, stride)


@kernel
def mirror(block: Array, stride: int) -> None:
    """Write the lower left part of P, which predictions leave behind, from the upper right one."""
    for i in range(INERTIAL):
        for k in range(max(i + 1, NAV), stride):
            block[P + k * stride + i] = block[P + i * stride + k]


@scalar_kernel
def scale_of(block: Array, state: int) -> float:
    """Return what P takes for one unit of a state: 1 but for what decays."""
    if state < NAV:
        return 1.0
    scale: float = 1.0 - block[LOST + state - NAV]
    return scale


@scalar_kernel
def owed(block: Array, state: int) -> float:
    """Return the noise that is yet to be added to the variance of a state."""
    if state < NAV:
        return 0.0
    noise: float = 0.5 * block[OWED] * block[ERROR_PSD + state - NAV]
    return noise


@scalar_kernel
def variance(block: Array, state: int, stride: int) -> float:
    """Return the variance of a state."""
    scale = scale_of(block, state)
    total: float = block[P + state * (stride + 1)] * scale * scale + owed(block, state)
    return total


@kernel
def complete(block: Array, stride: int) -> None:
    """Bring all of P up to date after predictions: scales, noise still owed, and the lower left part."""
    for i in range(stride):
        scale = scale_of(block, i)
        for k in range(max(i, NAV), stride):
            block[P + i * stride + k] *= scale * scale_of(block, k)
        block[P + i * (stride + 1)] += owed(block, i)
    settle(block)
    mirror(block, stride)


@kernel
def settle(block: Array) -> None:
    """Note that P speaks of the states themselves and is owed nothing."""
    for k in range(LARGEST):
        block[LOST + k] = 0.0
    block[OWED] = 0.0
    block[SINCE] = 0.0


@scalar_kernel
def begin_anew(block: Array, i: int, variance: float, stride: int) -> None:
    """Let nothing be known of a state but its variance; P is complete."""
    for j in range(stride):
        block[P + i * stride + j] = 0.0
        block[P + j * stride + i] = 0.0
    block[P + i * (stride + 1)] = variance


@kernel
def grow(block: Array, factor: float, stride: int) -> None:
    """Multiply all of P."""
    complete(block, stride)
    for i in range(stride * stride):
        block[P + i] *= factor
