"""Values that wrap round: a number of 16 bits runs over its end, from the largest value to the smallest.

From one sample to the next it leaps by the whole range, with calm on both sides; a blow does not come back by the same.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.checks.faults import NAMES
from polyins.checks.stream_checks import GAP_INTERVALS
from polyins.formats.rows import intervals
from polyins.model.findings import Finding
from polyins.model.recording import Array, usual_interval

LEAPS = 1.7
"""times the largest value"""
BOTH_ENDS = 0.9
"""of the largest value, that the smallest is on the other side: the range is about zero"""
CALM = 6.0
"""times the changes beside a leap, in the middle, that it is at least"""
BESIDE = 5
"""changes on either side"""
LEAST = 2
"""leaps: out, and back"""
ALIKE = 0.1
"""of their size, by which leaps may differ"""


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say which axes wrap."""
    for one in evidence.imus:
        values = np.hstack([one.rows.dtheta, one.rows.dvel]) / intervals(one.rows.time)[:, None]
        for axis in range(6):
            leaps, range_ = _leaps(values[:, axis])
            leaps = leaps[np.diff(one.rows.time)[leaps] < GAP_INTERVALS * usual_interval(one.rows.time)]
            if len(leaps) >= LEAST:
                yield Diagnosis(_finding(one, axis, leaps, range_))


def _leaps(values: Array) -> tuple[NDArray[np.intp], float]:
    """Return the rows before leaps by the whole range, and that range."""
    largest = float(np.abs(values).max(initial=0.0))
    if min(float(values.max(initial=0.0)), -float(values.min(initial=0.0))) < BOTH_ENDS * largest:
        return np.zeros(0, dtype=int), largest
    change = np.abs(np.diff(values))
    where = np.flatnonzero(change > LEAPS * largest)
    where = where[(where > 0) & (where < len(change) - 1)]
    if not len(where):
        return where, largest
    near = where[:, None] + np.concatenate([np.arange(-BESIDE, 0), np.arange(1, BESIDE + 1)])
    calm = np.median(change[np.clip(near, 0, len(change) - 1)], axis=1)
    where = where[change[where] > CALM * calm]
    if not len(where):
        return where, largest
    range_ = float(np.median(change[where]))
    return where[np.abs(change[where] / range_ - 1.0) < ALIKE], range_


def _finding(one: ImuEvidence, axis: int, leaps: NDArray[np.intp], range_: float) -> Finding:
    time = one.rows.time[leaps] + one.entry.clock_offset_s
    unit = "deg/s" if axis < 3 else "m/s^2"
    size = float(np.degrees(range_)) if axis < 3 else range_
    return Finding(
        "wrap",
        f"IMU {one.name}: {NAMES[axis]} leaps by its whole range, {size:.4g} {unit}, {len(leaps)} times, first at "
        f"{time[0]:.3f} s: its numbers wrap round",
        "serious",
        stream=one.name,
        axis=NAMES[axis],
        from_s=float(time[0]),
        to_s=float(time[-1]),
        size=size,
        remedy="choose a larger range of the sensor, or log more bits",
    )
