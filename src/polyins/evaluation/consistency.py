"""Do the errors fit the covariance that the filter states: NEES and NIS (Bar-Shalom, Li, Kirubarajan 2001, 5.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.errors import Errors
from polyins.model.solution import Innovations, Solution

Array = NDArray[np.float64]


def nees(errors: Array, covariance: Array) -> Array:
    """Return the normalized estimation error squared at each instant, averaged over the runs, shape (T,).

    `errors` has shape (S, T, n) for S independent runs, `covariance` (S, T, n, n). Where the filter is consistent, S
    times the result is chi-square distributed with S n degrees of freedom. Raises numpy.linalg.LinAlgError if a
    covariance is singular.
    """
    weighted = np.linalg.solve(covariance, errors[..., None])[..., 0]
    return np.asarray(np.mean(np.sum(errors * weighted, axis=-1), axis=0), dtype=float)


def nees_bounds(runs: int, states: int, probability: float = 0.95) -> tuple[float, float]:
    """Return the two-sided chi-square bounds of a NEES of `states` states averaged over `runs` runs."""
    from scipy.stats import chi2

    tail = 0.5 * (1.0 - probability)
    lower, upper = chi2.ppf([tail, 1.0 - tail], runs * states) / runs
    return float(lower), float(upper)


def share_inside(average: Array, runs: int, states: int, probability: float = 0.95) -> float:
    """Return the share of instants whose averaged NEES, shape (T,), lies inside the two-sided bounds."""
    lower, upper = nees_bounds(runs, states, probability)
    return float(np.mean((average >= lower) & (average <= upper)))


def position_nees(solution: Solution, errors: Errors) -> Array:
    """Return the NEES of north, east and down, three degrees of freedom, shape (E,), from the variances alone."""
    variance = solution.position_variance[errors.covered]
    ratio = np.full_like(variance, np.nan)
    np.divide(errors.position**2, variance, out=ratio, where=variance > 0.0)
    return np.asarray(np.sum(ratio, axis=1), dtype=float)


def mean_nis(innovations: Innovations) -> float | None:
    """Return the mean normalized innovation squared of the accepted fixes; None without any."""
    accepted = innovations.nis[innovations.accepted]
    return float(np.mean(accepted)) if accepted.size else None
