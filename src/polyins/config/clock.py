"""The clock that stamps a stream."""

from __future__ import annotations

from typing import Any, Literal

from polyins.config.fields import Number, Pair, Section
from polyins.model.clock import Clock
from polyins.model.rig import PPM


class ClockSettings(Section):
    """What brings the stamps of a stream to the clock of the recording."""

    clock_offset_s: Number = 0.0
    """added to the stamps, s; the larger, the later the values count"""
    clock_drift_ppm: Number = 0.0
    """added besides, in ppm of the time since `clock_reference_s`: above zero for a clock that is slow; the larger, the
    longer the stream lasts"""
    clock_reference_s: Number = 0.0
    """the stamp at which the drift adds nothing, s; without a drift it says nothing"""
    clock_leaps_s: tuple[Pair, ...] = ()
    """[stamp, s] of each leap of the clock: from that stamp on so much more is added; the larger, the later what
    follows counts"""
    time_offset: Literal["estimate"] | None = None
    """estimate: what is left of the clock's offset, drift and leaps is found from the motion that others show too"""

    @property
    def clock(self) -> Clock:
        """What they say, in SI."""
        drift = PPM * self.clock_drift_ppm
        return Clock(self.clock_offset_s, drift, self.clock_reference_s, tuple(sorted(self.clock_leaps_s)))

    def settled(self, found: Clock | None = None) -> dict[str, Any]:
        """Return the keys whose values change when what was found, of stamps on this clock, is added to it."""
        clock = self.clock if found is None else self.clock.then(found)
        known = {"clock_offset_s": clock.offset, "time_offset": None}
        if clock.drift != PPM * self.clock_drift_ppm:
            known |= {"clock_drift_ppm": clock.drift / PPM, "clock_reference_s": clock.reference}
        return known | ({"clock_leaps_s": clock.leaps} if clock.leaps else {})
