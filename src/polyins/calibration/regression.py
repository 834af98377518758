"""Least squares that bears outliers, with an uncertainty that bears correlated residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import Array

BLOCKS = 8
"""Residuals of wheels on a road are correlated over seconds: pieces of this many leave-one-out estimates are not."""
HUBER = 2.0
"""A residual beyond this many (robust) standard deviations counts in proportion to its size, not to its square."""
ROUNDS = 6


@dataclass(frozen=True)
class Fit:
    """What a regression found."""

    values: Array
    """shape (K,)"""
    covariance: Array
    """shape (K, K)"""

    @property
    def std(self) -> Array:
        """Standard deviations of the values, shape (K,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def blocks(count: int) -> NDArray[np.intp]:
    """Return which of the `BLOCKS` consecutive pieces each of `count` rows belongs to, shape (count,)."""
    return np.arange(count) * BLOCKS // max(count, 1)


def fit(design: Array, observed: Array, block: NDArray[np.intp], weights: Array | None = None) -> Fit:
    """Fit `observed`, shape (T,), by the columns of `design`, shape (T, K), with Huber's weights on top of `weights`.

    The covariance is the jackknife's: from the scatter of the fits that leave out one block each. Rows that share a
    block, shape (T,), may have correlated residuals.
    """
    given = np.ones(len(observed)) if weights is None else weights
    scale = np.sqrt(np.mean(design**2, axis=0)) + np.finfo(float).tiny
    rows = design / scale
    trust = given
    for _ in range(ROUNDS):
        normal, right = _normal(rows, observed, block, trust)
        values = _solved(normal.sum(axis=0), right.sum(axis=0))
        trust = given * huber((observed - rows @ values) * np.sqrt(given))
    left_out = _solved(normal.sum(axis=0) - normal, right.sum(axis=0) - right)
    return Fit(values / scale, jackknife_covariance(left_out / scale))


def huber(residuals: Array) -> Array:
    """Return Huber's weights of residuals, shape (T,): 1 inside the limit, falling beyond it."""
    size = np.abs(residuals)
    limit = HUBER * 1.4826 * np.median(size)
    return np.minimum(1.0, limit / np.maximum(size, np.finfo(float).tiny)) if limit > 0.0 else np.ones(len(size))


def jackknife_covariance(left_out: Array) -> Array:
    """Return the covariance of an estimate whose leave-one-out values are `left_out`, shape (B, K)."""
    off = left_out - left_out.mean(axis=0)
    return np.asarray((len(off) - 1) / len(off) * off.T @ off)


def _normal(rows: Array, observed: Array, block: NDArray[np.intp], weights: Array) -> tuple[Array, Array]:
    """Return the normal matrices and right sides of each block, shapes (B, K, K) and (B, K)."""
    width = rows.shape[1]
    both = np.column_stack([rows, observed])
    products = np.zeros((BLOCKS, width, width + 1))
    for b in range(BLOCKS):
        part = both[block == b]
        products[b] = (part[:, :width] * weights[block == b, None]).T @ part
    return products[:, :, :width], products[:, :, width]


def _solved(normal: Array, right: Array) -> Array:
    """Solve normal equations, singular ones by the smallest solution; shapes (..., K, K) and (..., K)."""
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
    return np.asarray(np.einsum("...ij,...j->...i", inverse, right))
