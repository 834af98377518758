"""Gain, normalized innovation squared and Joseph form against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lanes import SIZES, Array, close_in_sigmas, covariance, random_covariance, set_covariance
from reference_filter import gain, joseph

from polyins.kernels import kalman
from polyins.kernels.covariance import LARGEST, STRIDE
from polyins.navigate.state import block_size


def measurement(H: Array, variances: Array, residual: Array) -> Array:
    m = np.zeros(kalman.SIZE)
    m[kalman.H : kalman.H + 3 * LARGEST].reshape(3, LARGEST)[:, :21] = H
    m[kalman.R : kalman.R + 3] = variances
    m[kalman.RESIDUAL : kalman.RESIDUAL + 3] = residual
    return m


def drawn(seed: int) -> tuple[Array, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    H = rng.standard_normal((3, 21)) / SIZES * rng.integers(0, 2, (3, 21))
    return random_covariance(rng), H, rng.uniform(0.01, 4.0, 3), 3.0 * rng.standard_normal(3)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_update_is_the_textbooks(seed: int) -> None:
    P, H, variances, residual = drawn(seed)
    g, m = np.zeros(block_size(STRIDE)), measurement(H, variances, residual)
    set_covariance(g, P)
    kalman.gain(g, m, STRIDE)
    S = H @ P @ H.T + np.diag(variances)
    K = gain(P, H, np.diag(variances))
    actual = m[kalman.K : kalman.K + 63].reshape(21, 3)
    condition = np.linalg.cond(S)
    np.testing.assert_allclose(m[kalman.S : kalman.S + 9].reshape(3, 3), S, rtol=1e-12, atol=1e-12 * np.abs(S).max())
    assert np.abs((actual - K) / SIZES[:, None]).max() < 1e-14 * condition * np.abs(K / SIZES[:, None]).max()
    nis = residual @ np.linalg.solve(S, residual)
    assert kalman.normalized_innovation_squared(m) == pytest.approx(nis, rel=1e-14 * condition + 1e-13)
    kalman.update_covariance(g, m, STRIDE)
    close_in_sigmas(covariance(g), joseph(P, K, H, np.diag(variances)), 1e-13 * condition + 1e-12)


def test_only_what_is_measured_is_believed() -> None:
    """Two unit variances average; what is not correlated with them stays."""
    g, H = np.zeros(block_size(STRIDE)), np.eye(3, 21)
    set_covariance(g, np.eye(21))
    m = measurement(H, np.ones(3), np.array([2.0, 0.0, 0.0]))
    kalman.gain(g, m, STRIDE)
    assert kalman.normalized_innovation_squared(m) == pytest.approx(2.0, rel=1e-15)
    kalman.update_covariance(g, m, STRIDE)
    np.testing.assert_allclose(covariance(g), np.diag([0.5] * 3 + [1.0] * 18), atol=1e-16)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_exact_measurements_leave_p_symmetric_and_positive(seed: int) -> None:
    """A hundred nearly perfect fixes of a very uncertain state: what breaks the short form P - K H P."""
    rng = np.random.default_rng(seed)
    P, g = 1e4 * random_covariance(rng), np.zeros(block_size(STRIDE))
    set_covariance(g, P)
    for _ in range(100):
        H = np.hstack([np.eye(3), np.zeros((3, 3)), rng.standard_normal((3, 3)), np.zeros((3, 12))])
        m = measurement(H, np.full(3, 1e-6), np.zeros(3))
        kalman.gain(g, m, STRIDE)
        kalman.update_covariance(g, m, STRIDE)
    after = covariance(g)
    np.testing.assert_array_equal(after, after.T)
    sigma = np.sqrt(np.diag(after))
    assert np.all(sigma > 0.0)
    assert np.linalg.eigvalsh(after / np.outer(sigma, sigma)).min() > -1e-12
