"""Stamps against the receiving clock: a sensor's time cannot run ahead of the time in which its data arrive."""

from __future__ import annotations

from collections import Counter
from statistics import median

from polyins.navigate.samples import Sample

AHEAD = 0.4
"""s by which a stamp may be ahead of the newest before it and the time since then"""
DECAY = 0.1
"""s per s by which the newest falls back: what one wrong stamp below AHEAD moved, good ones set right again"""
FIRST_EPOCHS = 100
FIRST_SECONDS = 1.0
"""The first stamps are judged together, when so many are there or so much time has passed: one that is wrong could
otherwise be the one that all others are judged by."""


class StampCheck:
    """How far the stamps of one source have come."""

    def __init__(self, counts: Counter[str]) -> None:
        self.counts = counts
        self.held: list[Sample] = []
        self.since = 0.0
        """when the first of the held samples, or the newest that was admitted, arrived, s"""
        self.lead: float | None = None
        """stamp of the newest less its arrival, s"""

    def admit(self, samples: list[Sample], now: float) -> list[Sample]:
        """Return the samples that are not from the future; `now`: their arrival, s, on any steady clock."""
        if self.lead is None:
            if not self.held:
                self.since = now
            self.held += samples
            if not self.held or (len(self.held) < FIRST_EPOCHS and now - self.since < FIRST_SECONDS):
                return []
            samples = self.release(now)
        return [sample for sample in samples if self._possible(sample.time, now)]

    def release(self, now: float) -> list[Sample]:
        """Return the samples that are still held; the newest is then the middle of them."""
        samples, self.held = self.held, []
        if samples:
            self.lead, self.since = median(sample.time for sample in samples) - now, now
        return samples

    def _possible(self, time: float, now: float) -> bool:
        assert self.lead is not None
        if time - now > self.lead + AHEAD:
            self.counts["future-stamped"] += 1
            return False
        fallen = self.lead - min(DECAY * (now - self.since), 0.5 * AHEAD)
        if time - now >= fallen:
            self.lead, self.since = time - now, now
        return True
