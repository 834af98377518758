"""What is stamped ahead of all IMU data: a stamp that lies, or what comes in a pause and after it.

Which of them it is the next samples tell: if the IMUs go on where they were it was a lie, if they go on ahead for a
second it was a pause.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polyins.navigate.events import Events
from polyins.navigate.samples import Sample
from polyins.prepare.assembly import FUTURE

Array = NDArray[np.float64]

LONGEST = 30.0
"""s of measurements that are held; of a longer pause the first ones are of no use"""


@dataclass(frozen=True)
class Measured:
    """A measurement as it came, and as the engine takes it."""

    sample: Sample
    events: tuple[Events, ...]


@dataclass(frozen=True)
class HeldIncrements:
    """A sample of IMU `imu`, dtheta and dvel, (6,)."""

    time: float
    imu: int
    values: Array


@dataclass
class Ahead:
    """What is held until it is told what it was."""

    increments: list[HeldIncrements] = field(default_factory=list)
    measured: list[Measured] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.increments or self.measured)

    def hold(self, one: HeldIncrements) -> list[HeldIncrements]:
        """Hold a sample; returns those held so far if it does not go on where they are."""
        dropped: list[HeldIncrements] = []
        if self.increments and abs(one.time - self.increments[-1].time) > FUTURE:
            dropped, self.increments = self.increments, []
        self.increments.append(one)
        return dropped

    def hold_measured(self, one: Measured) -> list[Measured]:
        """Hold a measurement; returns those that are too old by now."""
        self.measured.append(one)
        old = [each for each in self.measured if each.sample.time < one.sample.time - LONGEST]
        self.measured = self.measured[len(old) :]
        return old

    @property
    def first(self) -> float:
        """Where the IMUs go on, s."""
        return min(one.time for one in self.increments)

    @property
    def goes_on(self) -> bool:
        """Whether the IMUs have gone on ahead for as long as no lie lasts."""
        return bool(self.increments) and self.increments[-1].time - self.first > FUTURE

    def in_order(self, snap: float) -> list[HeldIncrements | Measured]:
        """Return all that is held, and hold nothing more; a measurement goes before a sample nearer than `snap`, s."""
        dues = [(one.time, one) for one in self.increments] + [(one.sample.time - snap, one) for one in self.measured]
        self.increments, self.measured = [], []
        return [one for _, one in sorted(dues, key=lambda pair: pair[0])]
