"""Covariance prediction in the shape in which the papers and the field's C++ programs have it: full matrices.

Kept as the yardstick of what the structured form of `share.predict` saves; both give the same P to rounding.
"""

from __future__ import annotations

import numpy as np

from polyins.kernels import share
from polyins.kernels.jit import Array, kernel
from polyins.kernels.share import HALF, INERTIAL, NAV, STRIDE, P

NOISES = 18

PHI, COVARIANCE, NOISE, PRODUCT, RESULT = range(5)


def workspace() -> tuple[Array, Array]:
    """Return the square matrices (5, 21, 21) and the noise shaping matrices G and G Qc, (2, 21, 18)."""
    return np.zeros((5, INERTIAL, INERTIAL)), np.zeros((2, INERTIAL, NOISES))


@kernel
def _fill_phi(g: Array, dt: float, phi: Array) -> None:
    phi[:] = 0.0
    for k in range(INERTIAL):
        for i in range(NAV):
            phi[i, k] = g[share.F + k * HALF + i]
        phi[k, k] += 1.0
    for k in range(12):
        phi[NAV + k, NAV + k] -= dt * g[share.DECAY + k]


@kernel
def _fill_noise(g: Array, dt: float, shaping: Array) -> None:
    for i in range(3):
        for j in range(3):
            c = g[share.MATRIX + 3 * i + j]
            shaping[0, 3 + i, j] = c
            shaping[1, 3 + i, j] = c * g[share.ACCEL_PSD + j] * dt
            shaping[0, 6 + i, 3 + j] = c
            shaping[1, 6 + i, 3 + j] = c * g[share.GYRO_PSD + j] * dt
    for k in range(12):
        shaping[0, NAV + k, 6 + k] = 1.0
        shaping[1, NAV + k, 6 + k] = g[share.ERROR_PSD + k] * dt


@kernel
def predict(g: Array, dt: float, squares: Array, shaping: Array) -> None:
    """Advance P by dt: Qd = (Phi Q Phi' + Q) / 2 with Q = G Qc G' dt, P = Phi P Phi' + Qd; five products."""
    phi, p, q = squares[PHI], squares[COVARIANCE], squares[NOISE]
    product, result = squares[PRODUCT], squares[RESULT]
    share.mirror(g)
    _fill_phi(g, dt, phi)
    _fill_noise(g, dt, shaping)
    for i in range(INERTIAL):
        for j in range(INERTIAL):
            p[i, j] = g[P + i * STRIDE + j]
    np.dot(shaping[1], shaping[0].T, q)
    np.dot(phi, q, product)
    np.dot(product, phi.T, result)
    for i in range(INERTIAL):
        for j in range(INERTIAL):
            q[i, j] = 0.5 * (result[i, j] + q[i, j])
    np.dot(phi, p, product)
    np.dot(product, phi.T, result)
    for i in range(INERTIAL):
        for j in range(INERTIAL):
            g[P + i * STRIDE + j] = result[i, j] + q[i, j]
