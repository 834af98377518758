"""What brings the stamps of a stream to the clock of the recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Stamps = TypeVar("Stamps", float, NDArray[np.float64])


@dataclass(frozen=True)
class Clock:
    """A constant, a drift, and leaps: common = stamp + offset + drift x (stamp - reference) + the leaps until then."""

    offset: float = 0.0
    """s"""
    drift: float = 0.0
    """relative; above zero where the clock is slow"""
    reference: float = 0.0
    """stamp at which the drift adds nothing, s"""
    leaps: tuple[tuple[float, float], ...] = ()
    """stamp from which on, and what is added from there on, s, in order"""

    def common(self, stamps: Stamps) -> Stamps:
        """Return stamps, s, on the recording's clock; one alone has the bits that it has among many."""
        if not self.drift and not self.leaps:
            return stamps + self.offset
        out = stamps + (self.offset + self.drift * (stamps - self.reference))
        for at, size in self.leaps:
            out = out + size * (stamps >= at)
        return out

    @property
    def inverse(self) -> Clock:
        """The clock that leads from the common stamps to these."""
        leaps, before = [], 0.0
        for at, size in self.leaps:
            leaps.append((self._steady(at) + before + max(size, 0.0), -size / (1.0 + self.drift)))
            before += size
        drift = -self.drift / (1.0 + self.drift)
        return Clock(-self.offset, drift, self.reference + self.offset, tuple(leaps))

    def then(self, onward: Clock) -> Clock:
        """Return the clock that does what this one does and then what `onward` does."""
        leaps = [(at, size * (1.0 + onward.drift)) for at, size in self.leaps]
        leaps += [(self._stamp(at), size) for at, size in onward.leaps]
        if not onward.drift:
            return Clock(self.offset + onward.offset, self.drift, self.reference, tuple(sorted(leaps)))
        drift = (1.0 + self.drift) * (1.0 + onward.drift) - 1.0
        reference = (onward.reference - self.offset + self.drift * self.reference) / (1.0 + self.drift)
        return Clock(onward.reference + onward.offset - reference, drift, reference, tuple(sorted(leaps)))

    def _steady(self, stamp: float) -> float:
        return stamp + self.offset + self.drift * (stamp - self.reference)

    def _stamp(self, common: float) -> float:
        """Return the stamp that is common time `common`."""
        passed = sum(size for at, size in self.leaps if self.common(at) <= common)
        return (common - passed - self.offset + self.drift * self.reference) / (1.0 + self.drift)
