"""What a filter whose biases are Gauss-Markov is told of flicker and random walk.

A first-order Gauss-Markov process of std s and correlation time T has the Allan variance s^2 g(tau / T) with

    g(u) = 2 / u - (3 - 4 exp(-u) + exp(-2u)) / u^2

(IEEE Std 952, C.1.6). No s and T make it that of flicker. The std here is the smallest with which it is nowhere less,
from where flicker and walk outweigh the white noise to the longest time that was measured: a filter is never told that
biases hold better than they do. T is an hour, as scale factors share it, which change more slowly than biases.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.noise_model import WHITE, allan_variance_of

Array = NDArray[np.float64]

CORRELATION_TIME_S = 3600.0
TIMES = 400
"""at which the Allan variances are compared"""


def drift_std(squares: Array, longest: float) -> float:
    """Return the std of a bias for N^2, B^2, K^2 of its noise, (3,), measured up to an averaging time, s."""
    slow = np.where(np.arange(3) == WHITE, 0.0, squares)
    tau = np.geomspace(min(1.0, 0.1 * longest), longest, TIMES)
    outweighs = allan_variance_of(slow, tau) >= squares[WHITE] / tau
    chosen = tau[outweighs] if outweighs.any() else tau[-1:]
    return float(np.sqrt(np.max(allan_variance_of(slow, chosen) / unit_variance(chosen / CORRELATION_TIME_S))))


def unit_variance(u: Array) -> Array:
    """Return the Allan variance of a process of std one at averaging times over its correlation time."""
    exact = 2.0 / u - (3.0 - 4.0 * np.exp(-u) + np.exp(-2.0 * u)) / u**2
    return np.asarray(np.where(u < 1e-2, u * (2.0 / 3.0 - u / 2.0), exact))
