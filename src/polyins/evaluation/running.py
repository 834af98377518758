"""The figures of a solution that comes in parts: sums of all epochs, and the few epochs that maxima come from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.consistency import mean_nis, position_nees
from polyins.evaluation.errors import ANGLES, ROUNDING_S, Errors, compare_to_reference, path_length
from polyins.evaluation.outages import Interval
from polyins.evaluation.summary import NO_FIGURES, Document, Extent, document
from polyins.model.recording import Reference, usual_interval
from polyins.model.solution import Solution

Array = NDArray[np.float64]

DRIFT_STEP = 100.0
"""m, of the drift document"""
MARGIN = 3
"""reference epochs beyond both ends of a part"""


class Running:
    """Errors and figures, part by part; the same as those of the whole but for the rounding of means."""

    def __init__(self, reference: Reference | None, outages: Sequence[Interval], geodetic: bool) -> None:
        self._reference = reference
        self._outages = outages
        self._way = None if reference is None else path_length(reference.position, geodetic)
        self._from = np.nan
        self._kept: list[Errors] = []
        self._sums = np.zeros(6)
        """of squares: horizontal, vertical, roll, pitch, heading; of NEES"""
        self._largest = 0.0
        self._evaluated = 0
        self._extent = Extent(np.nan, np.nan, 0, np.nan, 0, 0)

    def add(self, part: Solution) -> None:
        """Take in the epochs of a part, which follows the one before."""
        errors = self._errors(part)
        count, extent = len(part.time), self._extent
        self._extent = Extent(
            first=extent.first if extent.epochs else float(part.time[0]),
            last=float(part.time[-1]),
            epochs=extent.epochs + count,
            interval=extent.interval if np.isfinite(extent.interval) else usual_interval(part.time),
            broken=extent.broken + int(np.count_nonzero(~np.isfinite(part.position).all(axis=1))),
            uncovered=extent.uncovered + (count if errors is None else errors.epochs_without_reference),
        )
        if errors is None or not errors.time.size:
            return
        angles = np.full((len(errors.time), 3), np.nan) if errors.attitude is None else np.degrees(errors.attitude)
        squares = np.column_stack([errors.horizontal, errors.position[:, 2], angles]) ** 2
        self._sums += [*squares.sum(axis=0), position_nees(part, errors).sum()]
        self._largest = max(self._largest, float(np.max(errors.horizontal)))
        self._evaluated += len(errors.time)
        self._kept.append(_at(errors, _telling(errors, self._outages)))

    def document(self, solution: Solution) -> Document:
        """Return the `run` document; of the solution only what has no row per epoch is looked at."""
        nis = {"nees_position": None, "nis_gnss": mean_nis(solution.innovations)}
        if self._reference is None or not self._evaluated:
            return document(solution, self._extent, None, NO_FIGURES, nis, self._outages)
        means = self._sums / self._evaluated
        root = [float(value) if np.isfinite(value) else None for value in np.sqrt(means[:5])]
        figures = {
            "horizontal_rms_m": root[0],
            "horizontal_max_m": self._largest,
            "vertical_rms_m": root[1],
            **{f"{angle}_rmse_deg": value for angle, value in zip(ANGLES, root[2:], strict=True)},
        }
        consistent = {**nis, "nees_position": float(means[5])}
        return document(solution, self._extent, _joined(self._kept), figures, consistent, self._outages)

    def _errors(self, part: Solution) -> Errors | None:
        if self._reference is None or self._way is None:
            return None
        time = self._reference.time
        first, last = np.searchsorted(time, part.time[[0, -1]])
        near = _slice(self._reference, slice(max(0, first - MARGIN), last + MARGIN))
        if len(near.time) < 2:
            return None
        errors = compare_to_reference(part, near)
        way = np.interp(errors.time, time, self._way)
        if way.size and not np.isfinite(self._from):
            self._from = float(way[0])
        return replace(errors, distance=way - self._from)


def _telling(errors: Errors, outages: Sequence[Interval]) -> NDArray[np.intp]:
    """Return the epochs that outage statistic and drift need.

    Those within outages, the last, and of each step of the way the first and the one of the largest error.
    """
    kept = np.zeros(errors.time.size, dtype=bool)
    for begin, end in outages:
        kept[slice(*np.searchsorted(errors.time, [begin - ROUNDING_S, end + ROUNDING_S]))] = True
    kept[-1] = True
    multiples = DRIFT_STEP * np.arange(1, int(errors.distance[-1] / DRIFT_STEP) + 2)
    edges = np.unique([0, *np.searchsorted(errors.distance, multiples)])
    edges = edges[edges < errors.time.size]
    kept[edges] = True
    for first, last in zip(edges, [*edges[1:], errors.time.size], strict=True):
        kept[first + int(np.argmax(errors.horizontal[first:last]))] = True
    return np.flatnonzero(kept)


def _slice(reference: Reference, part: slice) -> Reference:
    def of(values: Array | None) -> Array | None:
        return None if values is None else values[part]

    return replace(
        reference,
        time=reference.time[part],
        position=reference.position[part],
        velocity=of(reference.velocity),
        attitude=of(reference.attitude),
    )


def _at(errors: Errors, rows: NDArray[np.intp]) -> Errors:
    """Return the errors at some epochs: positions, and none of what drift and outages do not ask for."""
    return Errors(errors.time[rows], errors.position[rows], None, None, errors.distance[rows], np.ones(len(rows), bool))


def _joined(parts: Sequence[Errors]) -> Errors:
    def whole(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    return Errors(whole("time"), whole("position"), None, None, whole("distance"), whole("covered").astype(bool))
