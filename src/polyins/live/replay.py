"""A recording as a source: its samples in the order of their stamps, at real speed, faster, or as fast as it goes."""

from __future__ import annotations

import math
import threading
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np

from polyins.live.source import POLL
from polyins.model.recording import Recording
from polyins.navigate.samples import GnssFix, ImuSample, Sample, SensorSample

AT_ONCE = 256
"""samples in a chunk"""
TICK = 0.02
"""s of waiting that are worth a chunk of their own"""


class Replay:
    """The samples of a recording; fixes in its outages are withheld."""

    def __init__(self, recording: Recording, speed: float = math.inf, after: float = -math.inf) -> None:
        """`speed`: seconds of data per second; `after`: leave out what is not after this time, s."""
        self.url = "replay:"
        self.counts: Counter[str] = Counter()
        self.recording = recording
        self.speed = speed
        self.after = after
        self.stopped = threading.Event()

    def chunks(self) -> Iterator[list[Sample]]:
        """Yield what is due, as `Source` says."""
        begin, first = time.monotonic(), None
        pending: list[Sample] = []
        for sample in self._samples():
            if self.stopped.is_set():
                return
            first = sample.time if first is None else first
            due = begin + (sample.time - first) / self.speed
            if len(pending) >= AT_ONCE or (pending and due - time.monotonic() > TICK):
                yield pending
                pending = []
                self._wait_until(due)
            pending.append(sample)
        yield pending

    def stop(self) -> None:
        """Let `chunks` end."""
        self.stopped.set()

    def _wait_until(self, due: float) -> None:
        while not self.stopped.is_set() and (left := due - time.monotonic()) > 0.0:
            self.stopped.wait(min(left, POLL))

    def _samples(self) -> Iterator[Sample]:
        imus, gnss, aiding = self.recording.imus, self.recording.gnss, self.recording.aiding
        times = [stream.time for stream in imus] + [shown.time for shown in aiding]
        times += [] if gnss is None else [gnss.time]
        stamps = np.concatenate(times)
        stream_of = np.repeat(np.arange(len(times)), [len(one) for one in times])
        row_of = np.concatenate([np.arange(len(one)) for one in times])
        # what is measured at a sample is in the state of that sample
        due = stamps - np.where(stream_of < len(imus), 0.0, self.recording.options.gnss_snap)
        for k in np.lexsort([stream_of, due]):
            if stamps[k] <= self.after:
                continue
            number, row = stream_of[k], row_of[k]
            if number < len(imus):
                stream = imus[number]
                yield ImuSample(stream.name, float(stamps[k]), stream.dtheta[row], stream.dvel[row])
            elif number < len(imus) + len(aiding):
                shown = aiding[number - len(imus)]
                yield SensorSample(shown.kind, float(stamps[k]), float(shown.value[row]), shown.std[row])
            elif not self._withheld(float(stamps[k])):
                yield self._fix(row)

    def _withheld(self, stamp: float) -> bool:
        return any(begin < stamp < end for begin, end in self.recording.outages)

    def _fix(self, row: int) -> GnssFix:
        gnss = self.recording.gnss
        assert gnss is not None
        velocity = None if gnss.velocity is None or gnss.velocity_std is None else gnss.velocity[row]
        velocity_std = None if gnss.velocity is None or gnss.velocity_std is None else gnss.velocity_std[row]
        time, position, std = float(gnss.time[row]), gnss.position[row], gnss.position_std[row]
        return GnssFix(time, position, std, velocity, velocity_std, geodetic=self.recording.geodetic)
