"""Joined covariance blocks: the cross-covariances between blocks, their prediction, and updates of all states at once.

One square matrix holds the covariance of all blocks, block s from row s * stride on. Between updates only what is
right of the diagonal blocks is up to date; those on the diagonal live in the blocks, where `covariance.predict`
advances them.
"""

from __future__ import annotations

from polyins.kernels import covariance, kalman
from polyins.kernels.covariance import FROM, TO, P
from polyins.kernels.jit import Array, kernel

ROWS = kalman.ROWS


@kernel
def predict(blocks: Array, work: Array, dt: float, joint: Array, stride: int) -> None:
    """P_ab <- Phi_a P_ab Phi_b' in the square matrix; the noises of two IMUs have nothing in common.

    `work` (blocks, .) holds F dt of each block, but for the terms of scales.
    """
    count = joint.shape[0] // stride
    for s in range(count):
        covariance.scale_terms(blocks[s], work[s])
    for a in range(count):
        for b in range(a + 1, count):
            for i in range(stride):
                for j in range(stride):
                    work[a, FROM + i * stride + j] = joint[a * stride + i, b * stride + j]
            covariance.through(blocks[a], work[a], dt, stride)
            for i in range(stride):
                for j in range(stride):
                    work[b, FROM + j * stride + i] = work[a, TO + i * stride + j]
            covariance.through(blocks[b], work[b], dt, stride)
            for i in range(stride):
                for j in range(stride):
                    joint[a * stride + j, b * stride + i] = work[b, TO + i * stride + j]


@kernel
def gather(blocks: Array, count: int, joint: Array, stride: int) -> None:
    """Complete the square matrix: blocks on the diagonal, and what is left of it by symmetry.

    The blocks stay as they are, so that a measurement that is rejected changes no bit.
    """
    for s in range(count):
        block, o = blocks[s], s * stride
        for i in range(stride):
            scale = covariance.scale_of(block, i)
            for j in range(i, stride):
                joint[o + i, o + j] = block[P + i * stride + j] * (scale * covariance.scale_of(block, j))
            joint[o + i, o + i] += covariance.owed(block, i)
    for i in range(count * stride):
        for j in range(i):
            joint[i, j] = joint[j, i]


@kernel
def scatter(blocks: Array, count: int, joint: Array, stride: int) -> None:
    """Give the blocks their parts back."""
    for s in range(count):
        for i in range(stride):
            for j in range(stride):
                blocks[s, P + i * stride + j] = joint[s * stride + i, s * stride + j]
        covariance.settle(blocks[s])


@kernel
def gain(h: Array, r: Array, joint: Array, hp: Array, k: Array, update: Array) -> None:
    """Write H P, S and its inverse (in the work array of a measurement) and K = P H' / S.

    `h` and `hp` are (3, states of all blocks), `k` the same transposed in meaning; `r` holds the variances.
    """
    size = joint.shape[0]
    for a in range(ROWS):
        for j in range(size):
            hp[a, j] = 0.0
        for i in range(size):
            factor = h[a, i]
            if factor != 0.0:
                for j in range(size):
                    hp[a, j] += factor * joint[i, j]
    for a in range(ROWS):
        for b in range(ROWS):
            total = 0.0
            for j in range(size):
                total += hp[a, j] * h[b, j]
            update[kalman.S + ROWS * a + b] = total
        update[kalman.S + ROWS * a + a] += r[a]
        update[kalman.R + a] = r[a]
    kalman.invert(update)
    for a in range(ROWS):
        for i in range(size):
            total = 0.0
            for b in range(ROWS):
                total += hp[b, i] * update[kalman.S_INVERSE + ROWS * b + a]
            k[a, i] = total


@kernel
def update_covariance(h: Array, r: Array, joint: Array, hp: Array, k: Array, ah: Array) -> None:
    """Update the square matrix in Joseph form: A = (I - K H) P, then P = A - (A H') K' + K R K'."""
    size = joint.shape[0]
    for i in range(size):
        k0, k1, k2 = k[0, i], k[1, i], k[2, i]
        for j in range(size):
            joint[i, j] -= k0 * hp[0, j] + k1 * hp[1, j] + k2 * hp[2, j]
    for a in range(ROWS):
        for i in range(size):
            ah[a, i] = 0.0
        for j in range(size):
            factor = h[a, j]
            if factor != 0.0:
                for i in range(size):
                    ah[a, i] += factor * joint[i, j]
    for i in range(size):
        a0, a1, a2 = k[0, i] * r[0] - ah[0, i], k[1, i] * r[1] - ah[1, i], k[2, i] * r[2] - ah[2, i]
        for j in range(i, size):
            joint[i, j] += a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j]
    for i in range(size):
        for j in range(i):
            joint[i, j] = joint[j, i]
