"""Kalman update of one covariance block by a measurement of three components, paper A (8)-(11).

A component that is not measured has a row of zeros in H, no residual and variance 1: nothing follows from it.
"""

from __future__ import annotations

from polyins.kernels.covariance import LARGEST, P, complete, mirror, owed, scale_of
from polyins.kernels.jit import Array, kernel, scalar_kernel
from polyins.kernels.layout import Layout

ROWS = 3

_layout = Layout()
_take = _layout.take

H = _take(ROWS * LARGEST)
LENT = _take(ROWS * LARGEST)  # the design matrix in the states of the IMU that lends roll and pitch
TURN = _take(ROWS * 3)  # what a small rotation of the vehicle, in n, does to the measurement
R = _take(ROWS)  # variances of the measurement
HP = _take(ROWS * LARGEST)
S = _take(ROWS * ROWS)  # innovation covariance
S_INVERSE = _take(ROWS * ROWS)
K = _take(LARGEST * ROWS)
AH = _take(LARGEST * ROWS)
SCALES = _take(LARGEST)
NOISES = _take(LARGEST)
RESIDUAL = _take(ROWS)

SIZE = _layout.size
"""Length of the work array `update` of a measurement."""


@scalar_kernel
def clear(update: Array) -> None:
    """Write zeros into H and TURN."""
    for k in range(ROWS * LARGEST):
        update[H + k] = 0.0
    for k in range(ROWS * 3):
        update[TURN + k] = 0.0


@kernel
def gain(block: Array, update: Array, stride: int) -> None:
    """Write H P, S = H P H' + R, its inverse and K = P H' / S, paper A (8). What P says does not change."""
    mirror(block, stride)
    for k in range(stride):
        update[SCALES + k] = scale_of(block, k)
        update[NOISES + k] = owed(block, k)
    for a in range(ROWS):
        h, hp = H + a * LARGEST, HP + a * LARGEST
        for j in range(stride):
            update[hp + j] = 0.0
        for k in range(stride):
            factor = update[h + k] * update[SCALES + k]
            if factor != 0.0:
                for j in range(stride):
                    update[hp + j] += factor * block[P + k * stride + j]
        for j in range(stride):
            update[hp + j] = update[hp + j] * update[SCALES + j] + update[h + j] * update[NOISES + j]
    for a in range(ROWS):
        for b in range(ROWS):
            total = 0.0
            for k in range(stride):
                total += update[HP + a * LARGEST + k] * update[H + b * LARGEST + k]
            update[S + ROWS * a + b] = total
        update[S + ROWS * a + a] += update[R + a]
    invert(update)
    for i in range(stride):
        for a in range(ROWS):
            total = 0.0
            for b in range(ROWS):
                total += update[HP + b * LARGEST + i] * update[S_INVERSE + ROWS * b + a]
            update[K + ROWS * i + a] = total


@kernel
def invert(update: Array) -> None:
    """Write the inverse of S."""
    a, b, c = update[S], update[S + 1], update[S + 2]
    d, e, f = update[S + 4], update[S + 5], update[S + 8]
    c00, c01, c02 = d * f - e * e, c * e - b * f, b * e - c * d
    scale = 1.0 / (a * c00 + b * c01 + c * c02)
    update[S_INVERSE] = c00 * scale
    update[S_INVERSE + 1] = update[S_INVERSE + 3] = c01 * scale
    update[S_INVERSE + 2] = update[S_INVERSE + 6] = c02 * scale
    update[S_INVERSE + 4] = (a * f - c * c) * scale
    update[S_INVERSE + 5] = update[S_INVERSE + 7] = (b * c - a * e) * scale
    update[S_INVERSE + 8] = (a * d - b * b) * scale


@kernel
def normalized_innovation_squared(update: Array) -> float:
    """Return z' S^-1 z of the residual in `update`."""
    total = 0.0
    for a in range(ROWS):
        for b in range(ROWS):
            total += update[RESIDUAL + a] * update[S_INVERSE + ROWS * a + b] * update[RESIDUAL + b]
    return total


@kernel
def cautious_innovation_squared(update: Array, caution: float) -> float:
    """Return z' S^-1 z as if the prediction's std were `caution` times as large: S = caution^2 H P H' + R.

    Writes over S and its inverse, not over the gain.
    """
    factor = caution * caution
    for a in range(ROWS):
        for b in range(ROWS):
            update[S + ROWS * a + b] *= factor
        update[S + ROWS * a + a] -= (factor - 1.0) * update[R + a]
    invert(update)
    return normalized_innovation_squared(update)


@kernel
def update_covariance(block: Array, update: Array, stride: int) -> None:
    """Update P in Joseph form, paper A (10): A = (I - K H) P, then P = A - (A H') K' + K R K'."""
    complete(block, stride)
    for i in range(stride):
        k0, k1, k2 = update[K + ROWS * i], update[K + ROWS * i + 1], update[K + ROWS * i + 2]
        for j in range(stride):
            block[P + i * stride + j] -= (
                k0 * update[HP + j] + k1 * update[HP + LARGEST + j] + k2 * update[HP + 2 * LARGEST + j]
            )
    for i in range(stride):
        for a in range(ROWS):
            total = 0.0
            for k in range(stride):
                total += block[P + i * stride + k] * update[H + a * LARGEST + k]
            update[AH + ROWS * i + a] = total
    for i in range(stride):
        for j in range(i, stride):
            total = block[P + i * stride + j]
            for a in range(ROWS):
                total += (update[K + ROWS * i + a] * update[R + a] - update[AH + ROWS * i + a]) * update[
                    K + ROWS * j + a
                ]
            block[P + i * stride + j] = total
            block[P + j * stride + i] = total
