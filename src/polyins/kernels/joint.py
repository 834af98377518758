"""Joined covariance blocks: the cross-covariances between shares, their prediction, and updates of all states at once.

One square matrix holds the covariance of all shares, share s from row s * STATES on. Between updates only the blocks
right of the diagonal are up to date; those on it live in the shares, where `share.predict` advances them.
"""

from __future__ import annotations

from polyins.kernels import kalman, share
from polyins.kernels.jit import Array, kernel
from polyins.kernels.layout import Layout
from polyins.kernels.share import HALF, INERTIAL, STATES, STRIDE, F, P

ROWS = kalman.ROWS

_A, _G, _AS, _GS = 12, 9, 18, 15

_layout = Layout()
_take = _layout.take

FROM = _take(STATES * STRIDE)
TO = _take(STATES * STRIDE)

SIZE = _layout.size
"""Length of the work array of `predict`."""


@kernel
def _through(g: Array, dt: float, w: Array) -> None:
    """TO = Phi FROM, with Phi = I + F dt of a share."""
    f0, f1 = share._factors(g, F + 0), share._factors(g, F + 1)
    f3, f4, f5 = share._row(g, 3, 7, 8), share._row(g, 4, 8, 6), share._row(g, 5, 6, 7)
    f6, f7, f8 = share._row(g, 6, 7, 8), share._row(g, 7, 8, 6), share._row(g, 8, 6, 7)
    for j in range(STRIDE):
        r = share._column(w, FROM + j, STRIDE)
        v = share._column(w, FROM + 3 * STRIDE + j, STRIDE)
        p = share._column(w, FROM + 6 * STRIDE + j, STRIDE)
        w[TO + j] = r[0] + dt * v[0] + share._dot(f0, r)
        w[TO + STRIDE + j] = r[1] + dt * v[1] + share._dot(f1, r)
        w[TO + 2 * STRIDE + j] = r[2] + dt * v[2]
        w[TO + 3 * STRIDE + j] = v[0] + share._times(f3, r, v, p[1], p[2])
        w[TO + 4 * STRIDE + j] = v[1] + share._times(f4, r, v, p[2], p[0])
        w[TO + 5 * STRIDE + j] = v[2] + share._times(f5, r, v, p[0], p[1])
        w[TO + 6 * STRIDE + j] = p[0] + share._times(f6, r, v, p[1], p[2])
        w[TO + 7 * STRIDE + j] = p[1] + share._times(f7, r, v, p[2], p[0])
        w[TO + 8 * STRIDE + j] = p[2] + share._times(f8, r, v, p[0], p[1])
    _through_sensors(g, dt, w, 3, _A, _AS)
    _through_sensors(g, dt, w, 6, _G, _GS)
    for j in range(3 * STRIDE):
        w[TO + INERTIAL * STRIDE + j] = w[FROM + INERTIAL * STRIDE + j]


@kernel
def _decay(g: Array, dt: float, state: int) -> share.Three:
    d = share.DECAY + state - share.NAV
    return 1.0 - dt * g[d], 1.0 - dt * g[d + 1], 1.0 - dt * g[d + 2]


@kernel
def _through_sensors(g: Array, dt: float, w: Array, row: int, bias: int, scale: int) -> None:
    """Three rows of navigation states take what biases and scales do to them; those decay."""
    b0, b1, b2 = (
        share._factors(g, F + bias * HALF + row),
        share._factors(g, F + bias * HALF + row + 1),
        share._factors(g, F + bias * HALF + row + 2),
    )
    s0, s1, s2 = (
        share._factors(g, F + scale * HALF + row),
        share._factors(g, F + scale * HALF + row + 1),
        share._factors(g, F + scale * HALF + row + 2),
    )
    d, h = _decay(g, dt, bias), _decay(g, dt, scale)
    to = TO + row * STRIDE
    for j in range(STRIDE):
        b = share._column(w, FROM + bias * STRIDE + j, STRIDE)
        s = share._column(w, FROM + scale * STRIDE + j, STRIDE)
        w[to + j] += share._dot(b0, b) + share._dot(s0, s)
        w[to + STRIDE + j] += share._dot(b1, b) + share._dot(s1, s)
        w[to + 2 * STRIDE + j] += share._dot(b2, b) + share._dot(s2, s)
        w[TO + bias * STRIDE + j] = d[0] * b[0]
        w[TO + (bias + 1) * STRIDE + j] = d[1] * b[1]
        w[TO + (bias + 2) * STRIDE + j] = d[2] * b[2]
        w[TO + scale * STRIDE + j] = h[0] * s[0]
        w[TO + (scale + 1) * STRIDE + j] = h[1] * s[1]
        w[TO + (scale + 2) * STRIDE + j] = h[2] * s[2]


@kernel
def predict(groups: Array, a: int, b: int, dt: float, whole: Array, w: Array) -> None:
    """P_ab <- Phi_a P_ab Phi_b' in the square matrix; the noises of two IMUs have nothing in common."""
    for i in range(STATES):
        for j in range(STATES):
            w[FROM + i * STRIDE + j] = whole[a * STATES + i, b * STATES + j]
    _through(groups[a], dt, w)
    for i in range(STATES):
        for j in range(STATES):
            w[FROM + j * STRIDE + i] = w[TO + i * STRIDE + j]
    _through(groups[b], dt, w)
    for i in range(STATES):
        for j in range(STATES):
            whole[a * STATES + j, b * STATES + i] = w[TO + i * STRIDE + j]


@kernel
def gather(groups: Array, shares: int, whole: Array) -> None:
    """Complete the square matrix: blocks on the diagonal from the shares, those left of it by symmetry.

    The shares stay as they are, so that a measurement that is rejected changes no bit.
    """
    for s in range(shares):
        g, o = groups[s], s * STATES
        for i in range(STATES):
            scale = share.scale_of(g, i)
            for j in range(i, STATES):
                whole[o + i, o + j] = g[P + i * STRIDE + j] * (scale * share.scale_of(g, j))
            whole[o + i, o + i] += share.owed(g, i)
    for i in range(shares * STATES):
        for j in range(i):
            whole[i, j] = whole[j, i]


@kernel
def scatter(groups: Array, shares: int, whole: Array) -> None:
    """Give the shares their blocks back."""
    for s in range(shares):
        for i in range(STATES):
            for j in range(STATES):
                groups[s, P + i * STRIDE + j] = whole[s * STATES + i, s * STATES + j]
        share.settle(groups[s])


@kernel
def gain(h: Array, r: Array, whole: Array, hp: Array, k: Array, m: Array) -> None:
    """Write H P, S and its inverse (in the work array of a measurement) and K = P H' / S.

    `h` and `hp` are (3, states of all shares), `k` the same transposed in meaning; `r` holds the variances.
    """
    size = whole.shape[0]
    for a in range(ROWS):
        for j in range(size):
            hp[a, j] = 0.0
        for i in range(size):
            factor = h[a, i]
            if factor != 0.0:
                for j in range(size):
                    hp[a, j] += factor * whole[i, j]
    for a in range(ROWS):
        for b in range(ROWS):
            total = 0.0
            for j in range(size):
                total += hp[a, j] * h[b, j]
            m[kalman.S + ROWS * a + b] = total
        m[kalman.S + ROWS * a + a] += r[a]
        m[kalman.R + a] = r[a]
    kalman._invert(m)
    for a in range(ROWS):
        for i in range(size):
            total = 0.0
            for b in range(ROWS):
                total += hp[b, i] * m[kalman.S_INVERSE + ROWS * b + a]
            k[a, i] = total


@kernel
def update(h: Array, r: Array, whole: Array, hp: Array, k: Array, ah: Array) -> None:
    """Update the square matrix in Joseph form: A = (I - K H) P, then P = A - (A H') K' + K R K'."""
    size = whole.shape[0]
    for i in range(size):
        k0, k1, k2 = k[0, i], k[1, i], k[2, i]
        for j in range(size):
            whole[i, j] -= k0 * hp[0, j] + k1 * hp[1, j] + k2 * hp[2, j]
    for a in range(ROWS):
        for i in range(size):
            ah[a, i] = 0.0
        for j in range(size):
            factor = h[a, j]
            if factor != 0.0:
                for i in range(size):
                    ah[a, i] += factor * whole[i, j]
    for i in range(size):
        a0, a1, a2 = k[0, i] * r[0] - ah[0, i], k[1, i] * r[1] - ah[1, i], k[2, i] * r[2] - ah[2, i]
        for j in range(i, size):
            whole[i, j] += a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j]
    for i in range(size):
        for j in range(i):
            whole[i, j] = whole[j, i]
