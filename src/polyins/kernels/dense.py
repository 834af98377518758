"""Covariance prediction in the shape in which the papers and the field's C++ programs have it: full matrices.

Kept as the yardstick of what the structured form of `covariance.predict` saves; both give the same P to rounding.
"""

from __future__ import annotations

import numpy as np

from polyins.kernels import covariance
from polyins.kernels.covariance import HALF, INERTIAL, NAV, STRIDE, P
from polyins.kernels.jit import Array, blas_kernel, kernel

NOISES = 18

PHI, COVARIANCE, NOISE, PRODUCT, RESULT = range(5)


def workspace(blocks: int = 1) -> tuple[Array, Array]:
    """Return the square matrices (5, 21 n, 21 n) and the noise shaping matrices G and G Qc, (2, 21 n, 18 n)."""
    size = blocks * INERTIAL
    return np.zeros((5, size, size)), np.zeros((2, size, blocks * NOISES))


@kernel
def _fill_phi(block: Array, work: Array, dt: float, phi: Array, o: int) -> None:
    covariance.scale_terms(block, work)
    for k in range(INERTIAL):
        for i in range(NAV):
            phi[o + i, o + k] = work[covariance.F + k * HALF + i]
        for i in range(NAV, INERTIAL):
            phi[o + i, o + k] = 0.0
        phi[o + k, o + k] += 1.0
    for k in range(12):
        phi[o + NAV + k, o + NAV + k] -= dt * block[covariance.DECAY + k]


@kernel
def _fill_noise(block: Array, dt: float, shaping: Array, o: int, n: int) -> None:
    for i in range(3):
        for j in range(3):
            c = block[covariance.MATRIX + 3 * i + j]
            shaping[0, o + 3 + i, n + j] = c
            shaping[1, o + 3 + i, n + j] = c * block[covariance.ACCEL_PSD + j] * dt
            shaping[0, o + 6 + i, n + 3 + j] = c
            shaping[1, o + 6 + i, n + 3 + j] = c * block[covariance.GYRO_PSD + j] * dt
    for k in range(12):
        shaping[0, o + NAV + k, n + 6 + k] = 1.0
        shaping[1, o + NAV + k, n + 6 + k] = block[covariance.ERROR_PSD + k] * dt


@blas_kernel
def _advance(squares: Array, shaping: Array) -> None:
    """Qd = (Phi Q Phi' + Q) / 2 with Q = G Qc G' dt, then Phi P Phi' + Qd in RESULT: five products."""
    phi, p, q = squares[PHI], squares[COVARIANCE], squares[NOISE]
    product, result = squares[PRODUCT], squares[RESULT]
    size = phi.shape[0]
    np.dot(shaping[1], shaping[0].T, q)
    np.dot(phi, q, product)
    np.dot(product, phi.T, result)
    for i in range(size):
        for j in range(size):
            q[i, j] = 0.5 * (result[i, j] + q[i, j])
    np.dot(phi, p, product)
    np.dot(product, phi.T, result)
    for i in range(size):
        for j in range(size):
            result[i, j] += q[i, j]


@kernel
def predict(block: Array, work: Array, dt: float, squares: Array, shaping: Array) -> None:
    """Advance P of one block by dt; `work` holds F dt but for the terms of scales."""
    covariance.complete(block, STRIDE)
    _fill_phi(block, work, dt, squares[PHI], 0)
    _fill_noise(block, dt, shaping, 0, 0)
    for i in range(INERTIAL):
        for j in range(INERTIAL):
            squares[COVARIANCE, i, j] = block[P + i * STRIDE + j]
    _advance(squares, shaping)
    for i in range(INERTIAL):
        for j in range(INERTIAL):
            block[P + i * STRIDE + j] = squares[RESULT, i, j]


@kernel
def predict_joined(blocks: Array, work: Array, dt: float, joint: Array, squares: Array, shaping: Array) -> None:
    """Advance the covariance of all blocks by dt: those on the diagonal, and the others in `joint`."""
    count = joint.shape[0] // STRIDE
    for s in range(count):
        covariance.complete(blocks[s], STRIDE)
        _fill_phi(blocks[s], work[s], dt, squares[PHI], s * INERTIAL)
        _fill_noise(blocks[s], dt, shaping, s * INERTIAL, s * NOISES)
        for i in range(INERTIAL):
            for j in range(INERTIAL):
                squares[COVARIANCE, s * INERTIAL + i, s * INERTIAL + j] = blocks[s, P + i * STRIDE + j]
                for t in range(s + 1, count):
                    cross = joint[s * STRIDE + i, t * STRIDE + j]
                    squares[COVARIANCE, s * INERTIAL + i, t * INERTIAL + j] = cross
                    squares[COVARIANCE, t * INERTIAL + j, s * INERTIAL + i] = cross
    _advance(squares, shaping)
    for s in range(count):
        for i in range(INERTIAL):
            for j in range(INERTIAL):
                blocks[s, P + i * STRIDE + j] = squares[RESULT, s * INERTIAL + i, s * INERTIAL + j]
                for t in range(s + 1, count):
                    joint[s * STRIDE + i, t * STRIDE + j] = squares[RESULT, s * INERTIAL + i, t * INERTIAL + j]
