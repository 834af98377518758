"""What a fault is: how it changes a recording, and by what it is to be named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import GnssStream, ImuStream, Recording
from polyins.simulation.scenario import Scenario

Array = NDArray[np.float64]
DRAWN = "drawn"
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Draw:
    """What chance decides of a fault."""

    rng: np.random.Generator
    at: float
    """s, when it begins"""
    imu: int
    """index of the IMU that has it"""

    def axis(self) -> int:
        """Draw an axis: 0, 1 or 2."""
        return int(self.rng.integers(3))

    def sign(self) -> float:
        """Draw a sign."""
        return float(self.rng.choice([-1.0, 1.0]))

    def between(self, low: float, high: float) -> float:
        """Draw a size above zero, evenly in its logarithm."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def direction(self) -> Array:
        """Draw a horizontal direction, a unit vector north, east, down."""
        angle = self.rng.uniform(-np.pi, np.pi)
        return np.array([np.cos(angle), np.sin(angle), 0.0])


Injection = Callable[[Recording, Draw], Recording]


@dataclass(frozen=True)
class Fault:
    """One kind of fault."""

    name: str
    stream: str
    """imu, gnss, clock, gap, start or wheel"""
    inject: Injection
    kinds: tuple[str, ...]
    """kinds of finding that name it"""
    words: tuple[str, ...] = ()
    """of which a refusal has one if it names it"""
    scenario: Callable[[Scenario, Draw], Scenario] | None = None
    """what it changes of the scenario, which is then simulated anew"""
    whose: str = ""
    """whose name a finding has to say: `DRAWN`, that of the IMU which chance chose, or the name of one"""


def unchanged(recording: Recording, _: Draw) -> Recording:
    """Return the recording: all is in the scenario."""
    return recording


def with_imu(recording: Recording, index: int, stream: ImuStream) -> Recording:
    """Return the recording with another stream of one IMU."""
    streams = list(recording.imus)
    streams[index] = stream
    return replace(recording, imus=tuple(streams))


def with_rows(recording: Recording, index: int, kept: Mask) -> Recording:
    """Return the recording with just some rows of one IMU."""
    return with_imu(recording, index, recording.imus[index].at(kept))


def with_gnss(recording: Recording, **changes: Any) -> Recording:
    """Return the recording with other columns of its fixes."""
    return replace(recording, gnss=replace(fixes(recording), **changes))


def with_fixes(recording: Recording, kept: Mask) -> Recording:
    """Return the recording with just some of its fixes."""
    return replace(recording, gnss=fixes(recording).at(kept))


def fixes(recording: Recording) -> GnssStream:
    """Return the fixes of a recording that has some."""
    assert recording.gnss is not None
    return recording.gnss


def moved(recording: Recording, where: Mask, metres: Array) -> Recording:
    """Return the recording with some fixes moved, m north, east, down, shape (3,) or one row for each."""
    stream = fixes(recording)
    position = stream.position.copy()
    position[where] += metres / metres_per_unit(position[0], recording.geodetic)
    return with_gnss(recording, position=position)


def during(recording: Recording, begin: float, length: float = np.inf) -> Mask:
    """Return which fixes lie in an interval, s."""
    time, end = fixes(recording).time, begin + length if np.isfinite(length) else np.inf
    return np.asarray((time >= begin) & (time < end))
