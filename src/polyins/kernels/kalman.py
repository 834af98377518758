"""Kalman update of one covariance block by a measurement of three components, paper A (8)-(11)."""

from __future__ import annotations

from polyins.kernels.jit import Array, kernel
from polyins.kernels.layout import Layout
from polyins.kernels.share import STATES, STRIDE, P, complete, mirror, owed, scale_of

ROWS = 3

_layout = Layout()
_take = _layout.take


H = _take(ROWS * STRIDE)
LENT = _take(ROWS * STRIDE)  # the design matrix in the states of the IMU that lends roll and pitch
TURN = _take(ROWS * 3)  # what a small rotation of the vehicle, in n, does to the measurement
R = _take(ROWS)  # variances of the measurement
HP = _take(ROWS * STRIDE)
S = _take(ROWS * ROWS)  # innovation covariance
S_INVERSE = _take(ROWS * ROWS)
K = _take(STATES * ROWS)
AH = _take(STATES * ROWS)
SCALES = _take(STRIDE)
NOISES = _take(STRIDE)
RESIDUAL = _take(ROWS)

SIZE = _layout.size
"""Length of the work array `m` of a measurement."""


@kernel
def gain(g: Array, m: Array) -> None:
    """Write H P, S = H P H' + R, its inverse and K = P H' / S, paper A (8). What P says does not change."""
    mirror(g)
    for k in range(STATES):
        m[SCALES + k] = scale_of(g, k)
        m[NOISES + k] = owed(g, k)
    for a in range(ROWS):
        for j in range(STRIDE):
            total = 0.0
            for k in range(STATES):
                total += m[H + a * STRIDE + k] * m[SCALES + k] * g[P + k * STRIDE + j]
            m[HP + a * STRIDE + j] = total * m[SCALES + j] + m[H + a * STRIDE + j] * m[NOISES + j]
    for a in range(ROWS):
        for b in range(ROWS):
            total = 0.0
            for k in range(STATES):
                total += m[HP + a * STRIDE + k] * m[H + b * STRIDE + k]
            m[S + ROWS * a + b] = total
        m[S + ROWS * a + a] += m[R + a]
    _invert(m)
    for i in range(STATES):
        for a in range(ROWS):
            total = 0.0
            for b in range(ROWS):
                total += m[HP + b * STRIDE + i] * m[S_INVERSE + ROWS * b + a]
            m[K + ROWS * i + a] = total


@kernel
def _invert(m: Array) -> None:
    a, b, c = m[S], m[S + 1], m[S + 2]
    d, e, f = m[S + 4], m[S + 5], m[S + 8]
    c00, c01, c02 = d * f - e * e, c * e - b * f, b * e - c * d
    scale = 1.0 / (a * c00 + b * c01 + c * c02)
    m[S_INVERSE] = c00 * scale
    m[S_INVERSE + 1] = m[S_INVERSE + 3] = c01 * scale
    m[S_INVERSE + 2] = m[S_INVERSE + 6] = c02 * scale
    m[S_INVERSE + 4] = (a * f - c * c) * scale
    m[S_INVERSE + 5] = m[S_INVERSE + 7] = (b * c - a * e) * scale
    m[S_INVERSE + 8] = (a * d - b * b) * scale


@kernel
def normalized_innovation_squared(m: Array) -> float:
    """Return z' S^-1 z of the residual in `m`."""
    total = 0.0
    for a in range(ROWS):
        for b in range(ROWS):
            total += m[RESIDUAL + a] * m[S_INVERSE + ROWS * a + b] * m[RESIDUAL + b]
    return total


@kernel
def cautious_innovation_squared(m: Array, caution: float) -> float:
    """Return z' S^-1 z as if the prediction's std were `caution` times as large: S = caution^2 H P H' + R.

    Writes over S and its inverse, not over the gain.
    """
    factor = caution * caution
    for a in range(ROWS):
        for b in range(ROWS):
            m[S + ROWS * a + b] *= factor
        m[S + ROWS * a + a] -= (factor - 1.0) * m[R + a]
    _invert(m)
    return normalized_innovation_squared(m)


@kernel
def update_covariance(g: Array, m: Array) -> None:
    """Update P in Joseph form, paper A (10): A = (I - K H) P, then P = A - (A H') K' + K R K'."""
    complete(g)
    for i in range(STATES):
        k0, k1, k2 = m[K + ROWS * i], m[K + ROWS * i + 1], m[K + ROWS * i + 2]
        for j in range(STRIDE):
            g[P + i * STRIDE + j] -= k0 * m[HP + j] + k1 * m[HP + STRIDE + j] + k2 * m[HP + 2 * STRIDE + j]
    for i in range(STATES):
        for a in range(ROWS):
            total = 0.0
            for k in range(STATES):
                total += g[P + i * STRIDE + k] * m[H + a * STRIDE + k]
            m[AH + ROWS * i + a] = total
    for i in range(STATES):
        for j in range(i, STATES):
            total = g[P + i * STRIDE + j]
            for a in range(ROWS):
                total += (m[K + ROWS * i + a] * m[R + a] - m[AH + ROWS * i + a]) * m[K + ROWS * j + a]
            g[P + i * STRIDE + j] = total
            g[P + j * STRIDE + i] = total
