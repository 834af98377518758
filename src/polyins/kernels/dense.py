"""Covariance prediction in the shape in which the papers and the field's C++ programs have it: full matrices.

Kept as the yardstick of what the structured form of `share.predict` saves; both give the same P to rounding.
"""

from __future__ import annotations

import numpy as np

from polyins.kernels import share
from polyins.kernels.jit import Array, blas_kernel, kernel
from polyins.kernels.share import HALF, INERTIAL, NAV, STATES, STRIDE, P

NOISES = 18

PHI, COVARIANCE, NOISE, PRODUCT, RESULT = range(5)


def workspace(shares: int = 1) -> tuple[Array, Array]:
    """Return the square matrices (5, 21 n, 21 n) and the noise shaping matrices G and G Qc, (2, 21 n, 18 n)."""
    size = shares * INERTIAL
    return np.zeros((5, size, size)), np.zeros((2, size, shares * NOISES))


@kernel
def _fill_phi(g: Array, dt: float, phi: Array, o: int) -> None:
    share.scale_terms(g)
    for k in range(INERTIAL):
        for i in range(NAV):
            phi[o + i, o + k] = g[share.F + k * HALF + i]
        for i in range(NAV, INERTIAL):
            phi[o + i, o + k] = 0.0
        phi[o + k, o + k] += 1.0
    for k in range(12):
        phi[o + NAV + k, o + NAV + k] -= dt * g[share.DECAY + k]


@kernel
def _fill_noise(g: Array, dt: float, shaping: Array, o: int, n: int) -> None:
    for i in range(3):
        for j in range(3):
            c = g[share.MATRIX + 3 * i + j]
            shaping[0, o + 3 + i, n + j] = c
            shaping[1, o + 3 + i, n + j] = c * g[share.ACCEL_PSD + j] * dt
            shaping[0, o + 6 + i, n + 3 + j] = c
            shaping[1, o + 6 + i, n + 3 + j] = c * g[share.GYRO_PSD + j] * dt
    for k in range(12):
        shaping[0, o + NAV + k, n + 6 + k] = 1.0
        shaping[1, o + NAV + k, n + 6 + k] = g[share.ERROR_PSD + k] * dt


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
def predict(g: Array, dt: float, squares: Array, shaping: Array) -> None:
    """Advance P of one share by dt."""
    share.complete(g)
    _fill_phi(g, dt, squares[PHI], 0)
    _fill_noise(g, dt, shaping, 0, 0)
    for i in range(INERTIAL):
        for j in range(INERTIAL):
            squares[COVARIANCE, i, j] = g[P + i * STRIDE + j]
    _advance(squares, shaping)
    for i in range(INERTIAL):
        for j in range(INERTIAL):
            g[P + i * STRIDE + j] = squares[RESULT, i, j]


@kernel
def predict_joined(groups: Array, shares: int, dt: float, whole: Array, squares: Array, shaping: Array) -> None:
    """Advance the covariance of all shares by dt: blocks on the diagonal in the shares, the others in `whole`."""
    for s in range(shares):
        share.complete(groups[s])
        _fill_phi(groups[s], dt, squares[PHI], s * INERTIAL)
        _fill_noise(groups[s], dt, shaping, s * INERTIAL, s * NOISES)
        for i in range(INERTIAL):
            for j in range(INERTIAL):
                squares[COVARIANCE, s * INERTIAL + i, s * INERTIAL + j] = groups[s, P + i * STRIDE + j]
                for t in range(s + 1, shares):
                    cross = whole[s * STATES + i, t * STATES + j]
                    squares[COVARIANCE, s * INERTIAL + i, t * INERTIAL + j] = cross
                    squares[COVARIANCE, t * INERTIAL + j, s * INERTIAL + i] = cross
    _advance(squares, shaping)
    for s in range(shares):
        for i in range(INERTIAL):
            for j in range(INERTIAL):
                groups[s, P + i * STRIDE + j] = squares[RESULT, s * INERTIAL + i, s * INERTIAL + j]
                for t in range(s + 1, shares):
                    whole[s * STATES + i, t * STATES + j] = squares[RESULT, s * INERTIAL + i, t * INERTIAL + j]
