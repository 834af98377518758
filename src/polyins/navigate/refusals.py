"""Which samples of which IMU could not be taken live, and when: findings of what a run went on without."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import LEFT_OUT, Finding
from polyins.prepare.assembly import DUPLICATED, FUTURE_STAMPED, LATE
from polyins.prepare.plausible import Limits

Array = NDArray[np.float64]

NOT_FINITE, OUT_OF_RANGE, ZEROS = "not finite", "out of range", "zeros"

WHY = {
    NOT_FINITE: "sends what is not a number",
    OUT_OF_RANGE: "shows values beyond the range of any sensor",
    ZEROS: "shows zeros only",
    DUPLICATED: "repeats stamps",
    FUTURE_STAMPED: "has stamps far ahead of the others'",
    LATE: "sends samples too late, or has stamps that go back",
}
APART = 1.0
"""s between samples that are told apart"""
MOST_NAMED = 5
"""stretches of one kind and IMU, above which all are one"""


def unfit(time: float, values: Array, limits: Limits, interval: float) -> str:
    """Return why a sample, (6,), is no data, or nothing; `interval`: that it is of, s, NaN if that is not known."""
    size = math.hypot(*values.tolist())
    if math.isfinite(size + time) and size > 0.0 and not size > limits.rate * interval:
        return ""
    if size == 0.0:
        return ZEROS if math.isfinite(time) else NOT_FINITE
    if not (math.isfinite(time) and np.isfinite(values).all()):
        return NOT_FINITE
    largest = np.abs(values)
    fast, hard = largest[:3].max() > limits.rate * interval, largest[3:].max() > limits.force * interval
    return OUT_OF_RANGE if fast or hard or not math.isfinite(size) else ""


@dataclass
class _Stretch:
    begin: float
    end: float
    count: int


class Refusals:
    """Stretches of refused samples by IMU and kind."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], list[_Stretch]] = {}

    def add(self, imu: str, why: str, time: float) -> None:
        """Note a sample of an IMU that came at a time of the run, s."""
        stretches = self._known.setdefault((imu, why), [])
        if stretches and (time - stretches[-1].end <= APART or len(stretches) > MOST_NAMED):
            stretches[-1].end, stretches[-1].count = max(time, stretches[-1].end), stretches[-1].count + 1
        else:
            stretches.append(_Stretch(time, time, 1))

    def take_over(self, other: Refusals) -> None:
        """Go on with what another one noted before."""
        self._known = other._known

    def findings(self) -> tuple[Finding, ...]:
        """Return what was left out, a finding for each stretch, or for all where there are many."""
        return tuple(
            Finding(
                LEFT_OUT,
                f"IMU {imu} {WHY[why]} from {one.begin:.3f} to {one.end:.3f} s; {one.count} sample(s) left out",
                stream=imu,
                from_s=one.begin,
                to_s=one.end,
                size=float(one.count),
                expected=0.0,
                remedy="look at its cable, its supply and what sends it",
            )
            for (imu, why), stretches in self._known.items()
            for one in _told(stretches)
        )


def _told(stretches: list[_Stretch]) -> list[_Stretch]:
    if len(stretches) <= MOST_NAMED:
        return stretches
    return [_Stretch(stretches[0].begin, stretches[-1].end, sum(one.count for one in stretches))]
