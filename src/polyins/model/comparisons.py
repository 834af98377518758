"""How the IMUs of an array kept together in a run: comparisons with their mean, and who was left out by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import LEFT_OUT, Finding

Array = NDArray[np.float64]

GYRO, ACCELEROMETER = "gyro", "accelerometer"
CAUGHT_IN = 30.0
"""s from the begin of a fault within which an IMU that is left out for it has done little harm"""
NOBODY = -1


@dataclass(frozen=True)
class Comparisons:
    """One row per comparison of IMUs that share a covariance block with their mean."""

    time: Array
    """s, shape (C,)"""
    left_out: NDArray[np.int64]
    """which navigator counts no more from here on, an index into `Solution.imu_names`, or -1; shape (C,)"""
    taken_back: NDArray[np.int64]
    """which one counts again, or -1; shape (C,)"""
    statistic: Array
    """of one that counts no more: by how much it deviated over the limit, squared; shape (C,)"""
    by_gyro: NDArray[np.bool_]
    """whether it deviated most in attitude; otherwise in velocity or position; shape (C,)"""
    own_noise: Array
    """times the variances that IMUs are said to have of their own, which the filter believes; shape (C,)"""
    mean_square: Array
    """of what IMUs deviate by, over what is expected; shape (C,)"""

    @classmethod
    def joined(cls, parts: Sequence[Comparisons]) -> Comparisons:
        """Return those of parts of a recording that follow one another."""
        names = [item.name for item in fields(cls)]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


_NEVER = np.zeros(0)
_NO_ONE = np.zeros(0, dtype=np.int64)
NO_COMPARISONS = Comparisons(_NEVER, _NO_ONE, _NO_ONE, _NEVER, np.zeros(0, dtype=bool), _NEVER, _NEVER)
"""of a run whose IMUs have a block each"""


@dataclass(frozen=True)
class Exclusion:
    """From when to when an IMU did not count since it deviated from the others."""

    imu: str
    from_s: float
    to_s: float | None
    """None: to the end"""
    sensor: str
    """gyro or accelerometer"""
    statistic: float
    """by how much it deviated over the limit, squared"""

    @property
    def finding(self) -> Finding:
        """What there is to say of it."""
        end = "to the end" if self.to_s is None else f"to {self.to_s:.1f} s"
        return Finding(
            LEFT_OUT,
            f"IMU {self.imu}: left out from {self.from_s:.1f} s {end}: its {self.sensor} deviates from the others",
            stream=self.imu,
            axis=self.sensor,
            from_s=self.from_s,
            to_s=self.to_s,
            size=self.statistic,
            expected=1.0,
        )


def exclusions(comparisons: Comparisons, names: Sequence[str]) -> tuple[Exclusion, ...]:
    """Return who did not count when; `names`: of the navigators."""
    found: list[Exclusion] = []
    open_: dict[int, int] = {}
    for k in np.flatnonzero((comparisons.left_out != NOBODY) | (comparisons.taken_back != NOBODY)):
        back, out, time = int(comparisons.taken_back[k]), int(comparisons.left_out[k]), float(comparisons.time[k])
        if back in open_:
            place = open_.pop(back)
            found[place] = replace(found[place], to_s=time)
        if out != NOBODY:
            open_[out] = len(found)
            sensor = GYRO if comparisons.by_gyro[k] else ACCELEROMETER
            found.append(Exclusion(names[out], time, None, sensor, float(comparisons.statistic[k])))
    return tuple(found)


def answered(findings: Sequence[Finding], left_out: Sequence[Exclusion]) -> tuple[Finding, ...]:
    """Return findings, of which those are notes that tell of an IMU soon left out, and for as long as they last."""
    return tuple(replace(one, severity="note") if _is_answered(one, left_out) else one for one in findings)


def _is_answered(finding: Finding, left_out: Sequence[Exclusion]) -> bool:
    if finding.severity == "note" or finding.from_s is None or finding.to_s is None:
        return False
    return any(
        one.imu == finding.stream
        and one.from_s <= finding.from_s + CAUGHT_IN
        and (one.to_s is None or one.to_s >= finding.to_s - CAUGHT_IN)
        for one in left_out
    )
