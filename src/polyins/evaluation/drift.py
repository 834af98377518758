"""Drift per distance travelled: the accuracy metric of paper B."""

from __future__ import annotations

import numpy as np

from polyins.evaluation.errors import Errors


def drift(errors: Errors | None, step: float = 100.0) -> dict[str, float | None]:
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
    multiples = step * np.arange(1, int(distance / step) + 1)
    multiples = multiples[multiples <= distance]  # a quotient may be rounded up
    if multiples.size:
        reached = np.searchsorted(errors.distance, multiples)
        so_far = np.maximum.accumulate(errors.horizontal)[reached]
        result["rate_percent"] = float(100.0 * np.mean(so_far / multiples))
    return result
