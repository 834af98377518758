"""How far a solution drifts while GNSS is withheld: the accuracy metric of paper A."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.errors import ROUNDING_S, Errors, rms

Interval = tuple[float, float]


def outage_statistic(errors: Errors | None, outages: Sequence[Interval]) -> dict[str, object]:
    """Return the `outages` document: each outage's maximum horizontal error, ends included, and their rms.

    An outage in which no error is known has None, and does not count in the rms.
    """
    each = [_maximum(errors, outage) for outage in outages]
    known = np.array([value for value in each if value is not None])
    return {
        "count": len(outages),
        "length_s": _common_length(outages),
        "horizontal_max_rms_m": rms(known),
        "each_m": each,
    }


def partly_covered(errors: Errors, outages: Sequence[Interval], interval: float) -> list[Interval]:
    """Return the outages in part of which no error is known: their maxima may be too small.

    `interval`: the usual one of the solution's epochs, s.
    """
    if errors.time.size < 2:
        return list(outages)
    longest = 5.0 * interval
    return [outage for outage in outages if _longest_gap(errors.time, outage) > longest]


def _maximum(errors: Errors | None, outage: Interval) -> float | None:
    if errors is None:
        return None
    inside = errors.horizontal[_within(errors.time, outage)]
    return float(np.max(inside)) if inside.size else None


def _within(time: NDArray[np.float64], outage: Interval) -> slice:
    begin, end = outage
    return slice(*np.searchsorted(time, [begin - ROUNDING_S, end + ROUNDING_S]))


def _longest_gap(time: NDArray[np.float64], outage: Interval) -> float:
    begin, end = outage
    return float(np.max(np.diff([begin, *time[_within(time, outage)], end])))


def _common_length(outages: Sequence[Interval]) -> float | None:
    lengths = {round(end - begin, 6) for begin, end in outages}
    return lengths.pop() if len(lengths) == 1 else None
