"""Drift per distance travelled: the accuracy metric of paper B."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.errors import Errors

Array = NDArray[np.float64]

STEP = 100.0
"""m"""


def drift(errors: Errors | None, step: float = STEP) -> dict[str, float | None]:
    """Return the `drift` document.

    For every multiple of `step` m travelled, the maximum horizontal error so far over that distance; `rate_percent` is
    the mean over the multiples, `end_percent` the last error over the whole distance. None where the way is too short.
    """
    result: dict[str, float | None] = dict.fromkeys(("step_m", "distance_m", "rate_percent", "end_percent"))
    result["step_m"] = step
    if errors is None or errors.time.size == 0:
        return result
    distance = float(errors.distance[-1])
    result["distance_m"] = distance
    if distance > 0.0:
        result["end_percent"] = float(100.0 * errors.horizontal[-1] / distance)
    _, rates = drift_rates(errors, step)
    if rates.size:
        result["rate_percent"] = float(np.mean(rates))
    return result


def drift_rates(errors: Errors, step: float = STEP) -> tuple[Array, Array]:
    """Return the multiples of `step` travelled, m, and the drift rate at each, percent, shape (K,) both."""
    distance = float(errors.distance[-1]) if errors.distance.size else 0.0
    multiples = step * np.arange(1, int(distance / step) + 1, dtype=np.float64)
    multiples = multiples[multiples <= distance]  # a quotient may be rounded up
    reached = np.searchsorted(errors.distance, multiples)
    rates: Array = 100.0 * np.maximum.accumulate(errors.horizontal)[reached] / multiples
    return multiples, rates


def drift_curve(errors: Errors) -> Array:
    """Return the maximum horizontal error so far over the distance so far, percent, shape (E,); NaN before any."""
    rate = np.full(errors.distance.shape, np.nan)
    so_far = np.maximum.accumulate(errors.horizontal)
    np.divide(100.0 * so_far, errors.distance, out=rate, where=errors.distance > 0.0)
    return rate
