"""An axis that stands still while the others of its sensor go on: dead throughout, or stuck for a while."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.checks.faults import NAMES, SAME, is_rough
from polyins.formats.rows import intervals
from polyins.model.findings import Finding
from polyins.model.recording import Array

Mask = NDArray[np.bool_]

LEAST_S = 1.0
LEAST_ROWS = 30
LONGER = 20.0
"""times the longest run of equal values that is usual, of a coarse resolution"""
OTHERS_CHANGE = 0.5
"""of the rows meanwhile, of another axis of the sensor"""


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say which axes stand still."""
    for one in evidence.imus:
        values = np.hstack([one.rows.dtheta, one.rows.dvel]) / intervals(one.rows.time)[:, None]
        for first in (0, 3):
            sensor = values[:, first : first + 3]
            largest = max(1.0, float(np.abs(sensor).max(initial=0.0)))
            still = np.abs(np.diff(sensor, axis=0)) <= SAME * largest
            for axis in range(3):
                others = np.delete(sensor, axis, axis=1)
                changed = (np.diff(others, axis=0, prepend=np.nan) != 0.0).any(axis=1)
                if not is_rough(others[changed], 1, SAME * largest):
                    continue
                begin, end = _longest(still[:, axis], np.delete(still, axis, axis=1), one.rows.time)
                if end > begin:
                    yield Diagnosis(_finding(one, first + axis, float(sensor[begin + 1, axis]), (begin, end)))


def _longest(still: Mask, others: Mask, time: Array) -> tuple[int, int]:
    """Return the first row and the last of the longest stretch that is no rest; the same row twice: there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    begins, ends = edges[::2], edges[1::2]
    if not len(begins):
        return 0, 0
    lengths = ends - begins
    k = int(np.argmax(lengths))
    begin, end = int(begins[k]), int(ends[k])
    usual = max(float(np.quantile(np.delete(lengths, k), 0.95)) if len(lengths) > 1 else 0.0, 1.0)
    moving = 1.0 - float(others[begin:end].mean(axis=0).min())
    long = lengths[k] >= max(LEAST_ROWS, LONGER * usual) and time[end] - time[begin] >= LEAST_S
    return (begin, end) if long and moving > OTHERS_CHANGE else (0, 0)


def _finding(one: ImuEvidence, axis: int, value: float, rows: tuple[int, int]) -> Finding:
    begin, end = (float(one.rows.time[row]) + one.entry.clock_offset_s for row in rows)
    shown = f"{np.degrees(value):.4g} deg/s" if axis < 3 else f"{value:.4g} m/s^2"
    return Finding(
        "stuck",
        f"IMU {one.name}: {NAMES[axis]} stays at {shown} from {begin:.2f} to {end:.2f} s while its other axes go on",
        "serious",
        stream=one.name,
        axis=NAMES[axis],
        from_s=begin,
        to_s=end,
        size=float(np.degrees(value)) if axis < 3 else value,
        remedy="look at what logged it, or leave the IMU out",
    )
