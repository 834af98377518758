"""Overlapping Allan deviation of stretches at rest, and how sure it is.

With the angle x(t) that a rate adds up to, the Allan variance at an averaging time tau is half the mean square of the
difference of neighbouring means (IEEE Std 952; Riley, NIST SP 1065),

    sigma^2(tau) = < (x(t + 2 tau) - 2 x(t + tau) + x(t))^2 > / (2 tau^2),

over all t of all stretches; none reaches over the end of one, for which allantools has no function. Terms that overlap
depend on each other: what they are worth follows from their covariance, which the noise that was fitted has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from polyins.calibration.noise_model import FLICKER, WALK, WHITE

Array = NDArray[np.float64]

PER_DECADE = 10
LEAST_TERMS = 2.0
"""times the averaging time is in the longest stretch beyond the two of a difference"""
AROUND = 8
"""averaging times, after which terms no longer depend on each other"""
STEPS = 16
"""lags in an averaging time, at which their covariance is taken"""
WEIGHTS = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
"""of a second difference squared"""


@dataclass(frozen=True)
class AllanCurve:
    """Allan deviation with its 95 % interval, in the unit of the rate, shape (K,) each."""

    tau: Array
    """s"""
    deviation: Array
    low: Array
    high: Array


def factors(lengths: Sequence[int]) -> NDArray[np.intp]:
    """Return averaging times in samples, ten a decade, for stretches of so many samples."""
    most = int(max(lengths) / (2.0 + LEAST_TERMS))
    if most < 1:
        return np.array([], dtype=np.intp)
    count = int(PER_DECADE * np.log10(most)) + 1
    return np.unique(np.round(10.0 ** (np.arange(count) / PER_DECADE)).astype(np.intp))


def variances(stretches: Sequence[Array], of: NDArray[np.intp]) -> Array:
    """Return the overlapping Allan variance at averaging times in samples, (K,), of rates, (n,) each."""
    # the mean, which is no part of it, would take digits of the sums
    angles = [np.concatenate([[0.0], np.cumsum(one - one.mean())]) for one in stretches]
    found = np.full(len(of), np.nan)
    for k, m in enumerate(of):
        total, terms = 0.0, 0
        for x in angles:
            if len(x) > 2 * m:
                bent = -2.0 * x[m:-m]
                bent += x[2 * m :]
                bent += x[: -2 * m]
                total += float(bent @ bent)
                terms += len(bent)
        if terms:
            found[k] = total / (2.0 * m**2 * terms)
    return found


def curve(stretches: Sequence[Array], interval: float, squares: Array) -> AllanCurve:
    """Return the Allan deviation of rates, (n,) each; `squares`: N^2, B^2, K^2 that say how sure it is."""
    lengths = [len(one) for one in stretches]
    of = factors(lengths)
    deviation = np.sqrt(variances(stretches, of))
    freedom = np.array([degrees_of_freedom(int(m), lengths, interval, squares) for m in of])
    low = deviation * np.sqrt(freedom / chi2.ppf(0.975, freedom))
    high = deviation * np.sqrt(freedom / chi2.ppf(0.025, freedom))
    return AllanCurve(np.asarray(of * interval, float), deviation, low, high)


def degrees_of_freedom(m: int, lengths: Sequence[int], interval: float, squares: Array) -> float:
    """Return of how many independent squares the mean of all terms is worth.

    2 E^2 / var, with the variance of a sum of squares from the covariance of its terms.
    """
    terms = np.array([n + 1 - 2 * m for n in lengths if n + 1 > 2 * m], dtype=float)
    step = max(1, m // STEPS)
    lags = np.arange(0, min(int(terms.max()), AROUND * m + 1), step)
    square = _covariance(np.asarray(lags * interval, float), m * interval, squares) ** 2
    weight = np.where(lags == 0, 1.0, 2.0) * step
    weight[0] = float(step)
    remaining = np.maximum(terms[:, None] - lags, 0.0).sum(axis=0)
    variance = 2.0 * float(np.sum(weight * remaining * square))
    return float(max(2.0 * terms.sum() ** 2 * square[0] / variance, 1.0))


def _covariance(lag: Array, tau: float, squares: Array) -> Array:
    """Return that of second differences of the angle a lag apart, by its generalised covariance."""
    time = np.abs(lag[:, None] + tau * np.arange(-2, 3))
    logarithm = np.log(np.where(time > 0.0, time / tau, 1.0))
    of_angle = (
        -0.5 * squares[WHITE] * time
        + squares[FLICKER] / (2.0 * np.pi) * time**2 * logarithm
        + squares[WALK] / 12.0 * time**3
    )
    return np.asarray(of_angle @ WEIGHTS)
