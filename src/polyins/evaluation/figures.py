"""The figures of a solution, whole or in parts: sums over all epochs, and the few epochs that maxima come from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.consistency import position_nees
from polyins.evaluation.drift import STEP
from polyins.evaluation.errors import ANGLES, ROUNDING_S, Errors, compare_to_reference, path_length
from polyins.evaluation.outages import Interval
from polyins.model.recording import Reference, usual_interval
from polyins.model.solution import Solution

Array = NDArray[np.float64]

MARGIN = 3
"""reference epochs beyond both ends of a part"""


@dataclass
class Epochs:
    """How many epochs a solution has, and how many of them are good."""

    first: float = 0.0
    """s"""
    last: float = 0.0
    """s"""
    count: int = 0
    interval: float = np.nan
    """the usual one, s"""
    broken: int = 0
    """those that are not finite"""
    uncovered: int = 0
    """those without reference"""

    @property
    def duration(self) -> float:
        """From the first to the last, s."""
        return self.last - self.first


class Figures:
    """Errors against a reference, summed up part by part; those of parts differ from those of the whole by rounding."""

    def __init__(self, reference: Reference | None, outages: Sequence[Interval], geodetic: bool) -> None:
        self.epochs = Epochs()
        self.outages = outages
        self._reference = reference
        self._way = None if reference is None else path_length(reference.position, geodetic)
        self._from = np.nan
        self._telling: list[Errors] = []
        self._squares = np.zeros(5)
        """sums of squares: horizontal and vertical, m^2; roll, pitch, heading, deg^2"""
        self._nees = 0.0
        self._largest = 0.0
        self._evaluated = 0

    def add(self, part: Solution) -> Errors | None:
        """Take in the epochs of a part, which follows the one before; returns its errors, None without reference.

        Raises InputError if the reference cannot be compared with.
        """
        errors = self._errors(part)
        self._count(part, errors)
        if errors is None or not errors.time.size:
            return errors
        angles = np.full((len(errors.time), 3), np.nan) if errors.attitude is None else np.degrees(errors.attitude)
        self._squares += [float(np.sum(np.square(e))) for e in (errors.horizontal, errors.position[:, 2], *angles.T)]
        self._nees += float(position_nees(part, errors).sum())
        self._largest = float(np.maximum(self._largest, np.max(errors.horizontal)))
        self._evaluated += len(errors.time)
        self._telling.append(errors.at(_telling(errors, self.outages)))
        return errors

    @property
    def reference(self) -> dict[str, float | None]:
        """The `reference` document; None where there is nothing to compute a figure from."""
        known = self._evaluated > 0
        means = self._squares / self._evaluated if known else np.full(5, np.nan)
        horizontal, vertical, *angles = (float(np.sqrt(mean)) if np.isfinite(mean) else None for mean in means)
        return {
            "horizontal_rms_m": horizontal,
            "horizontal_max_m": self._largest if known else None,
            "vertical_rms_m": vertical,
            **{f"{angle}_rmse_deg": value for angle, value in zip(ANGLES, angles, strict=True)},
        }

    @property
    def nees_position(self) -> float | None:
        """The mean NEES of the position, 3 where the filter is consistent; None without errors."""
        return self._nees / self._evaluated if self._evaluated else None

    @property
    def errors(self) -> Errors | None:
        """The errors that outage statistic and drift come from; None without a reference."""
        return None if self._reference is None else Errors.joined(self._telling)

    def _errors(self, part: Solution) -> Errors | None:
        if self._reference is None or self._way is None:
            return None
        time = self._reference.time
        if not part.time.size:
            return compare_to_reference(part, self._reference)
        first, last = np.searchsorted(time, part.time[[0, -1]])
        near = self._reference.between(max(0, int(first) - MARGIN), int(last) + MARGIN)
        if len(near.time) < 2:
            near = self._reference
        errors = compare_to_reference(part, near)
        way = np.interp(errors.time, time, self._way)
        if way.size and not np.isfinite(self._from):
            self._from = float(way[0])
        return replace(errors, distance=way - self._from)

    def _count(self, part: Solution, errors: Errors | None) -> None:
        epochs, time = self.epochs, part.time
        if not time.size:
            return
        if not epochs.count:
            epochs.first = float(time[0])
        if not np.isfinite(epochs.interval) and time.size > 1:
            epochs.interval = usual_interval(time)
        epochs.last = float(time[-1])
        epochs.count += time.size
        epochs.broken += int(np.count_nonzero(~part.is_finite))
        epochs.uncovered += 0 if errors is None else errors.epochs_without_reference


def _telling(errors: Errors, outages: Sequence[Interval]) -> NDArray[np.intp]:
    """Return the epochs that outage statistic and drift need.

    Those within outages, the last, and of each step of the way the first and the one of the largest error.
    """
    kept = np.zeros(errors.time.size, dtype=bool)
    for begin, end in outages:
        kept[slice(*np.searchsorted(errors.time, [begin - ROUNDING_S, end + ROUNDING_S]))] = True
    kept[-1] = True
    multiples = STEP * np.arange(1, int(errors.distance[-1] / STEP) + 2)
    edges = np.unique([0, *np.searchsorted(errors.distance, multiples)])
    edges = edges[edges < errors.time.size]
    kept[edges] = True
    for first, last in zip(edges, [*edges[1:], errors.time.size], strict=True):
        kept[first + int(np.argmax(errors.horizontal[first:last]))] = True
    return np.flatnonzero(kept)
