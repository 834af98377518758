"""From nothing to a start: collect samples until the search for a start succeeds on them."""

from __future__ import annotations

from array import array
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from polyins.errors import InputError
from polyins.model.methods import find_method
from polyins.model.recording import GnssStream, ImuStream, Recording
from polyins.navigate import batch
from polyins.navigate.choice import choose
from polyins.navigate.samples import Array, GnssFix, ImuSample, Sample, SensorSample
from polyins.navigate.start import same
from polyins.prepare import course, timesync
from polyins.prepare.alignment import Start

EVERY = 1.0
"""s of data between two attempts"""
FIRST = 5.0
"""s of data before the first attempt: a standstill of three seconds has its chance, unless nothing is to be found"""
KEPT = 120.0
"""s of data that are kept: the longest standstill that is looked at, and as long again to move off"""
SETTLED = 3.0
"""s of further data that leave a start as it is: then it is that of the whole recording"""
BEFORE_START = 2.0
"""s of data before the start, by which the navigator knows the rates of the IMUs"""
CUT_EVERY = 10.0  # s


@dataclass
class _Rows:
    """Rows of numbers, the stamp first, that grow at one end and are cut at the other."""

    width: int
    numbers: array[float] = field(default_factory=lambda: array("d"))
    stamps: set[float] = field(default_factory=set)

    def add(self, *row: float) -> None:
        self.numbers.extend(row)
        self.stamps.add(row[0])

    def sorted(self) -> Array:
        rows = np.array(self.numbers).reshape(-1, self.width)
        return rows[np.argsort(rows[:, 0], kind="stable")]

    def cut(self, before: float) -> None:
        rows = self.sorted()
        rows = rows[rows[:, 0] >= before]
        self.numbers, self.stamps = array("d", rows.ravel()), set(rows[:, 0])


class Starter:
    """Collects samples until the search finds a start in them which further data do not change."""

    def __init__(
        self, blank: Recording, delay: float, needs_fix: bool, method: str = "enav-fusion", imu: int = 0
    ) -> None:
        """`blank` says all but the streams; a sample may be later than others by `delay`, s.

        `needs_fix`: the position is to come from GNSS. `method`, `imu`: as for `Navigator`.
        """
        self.method = find_method(method)
        self.taken = choose(self.method, blank.rig, imu).all
        self.found: tuple[float, Start] | None = None
        """when the start was first found, s, and it"""
        self.blank = blank
        self.delay = delay
        self.needs_fix = needs_fix
        self.counts: Counter[str] = Counter()
        self.why = "no data"
        """why there is no start yet"""
        self.imus = {imu.name: _Rows(7) for imu in blank.rig.imus}
        self.fixes = _Rows(13)
        self.shown: list[SensorSample] = []
        """by sensors that say nothing of the start"""
        self.newest = float("-inf")
        self.attempt: float | None = None
        """s: data up to this time are looked at next"""

    def take(self, sample: Sample) -> tuple[Start, list[Sample]] | None:
        """Take a sample; returns the start, once it is found, and all that was collected in the order of stamps."""
        if isinstance(sample, SensorSample):
            self.shown.append(sample)
            return None
        rows = self.imus[sample.imu] if isinstance(sample, ImuSample) else self.fixes
        if sample.time in rows.stamps:
            self.counts["duplicated"] += 1
            return None
        if sample.time < self.newest - self.delay:
            self.counts["late"] += 1
            return None
        self.newest = max(self.newest, sample.time)
        rows.add(*_row(sample))
        if self.attempt is None:
            self.attempt = self._first_attempt(sample.time)
            self.why = f"collecting data until {self.attempt:.0f} s"
        if sample.time < self.attempt + self.delay:
            return None
        until, self.attempt = self.attempt, self.attempt + EVERY
        start = self._settled(until)
        if start is not None:
            return start, self._collected()
        if until % CUT_EVERY == 0.0:
            for rows in (*self.imus.values(), self.fixes):
                rows.cut(until - KEPT)
            self.shown = [sample for sample in self.shown if sample.time >= until - KEPT]
        return None

    def finish(self) -> tuple[Start, list[Sample]] | None:
        """Return the start that the data have, now that there are no more, and all that was collected."""
        start = self._found(self.newest)
        return None if start is None else (start, self._collected())

    def _first_attempt(self, begin: float) -> float:
        start = self.blank.start
        earliest = begin if self._is_given() else begin + FIRST - EVERY
        if start.static_interval is not None:
            earliest = max(earliest, start.static_interval[1])
        return (earliest // EVERY + 1.0) * EVERY

    def _settled(self, until: float) -> Start | None:
        """Return the start if data up to `until` leave no doubt that it is that of all data to come."""
        start = self._found(until)
        if start is None or self._is_given():
            return start
        if not start.decided:
            self.why, self.found = "further fixes may still tell the heading better", None
            return None
        if self.found is None or not same(self.found[1], start):
            self.found = until, start
        if until - self.found[0] >= SETTLED:
            return start
        self.why = "further data may still change the start"
        if start.sources.get("time") == "end of the standstill":
            self.why = "the start is at the end of the standstill, or after a minute of it"
        return None

    def _found(self, until: float) -> Start | None:
        try:
            recording = self._recording(until)
            taken = recording.subset(self.taken)
            aligned = timesync.align(taken.imus, bridge=not taken.rig.has_wheels)
            start = batch.start_of(self.method, taken, aligned)
            self._check_decided(taken, start)
        except InputError as error:
            self.why, self.found = str(error), None
            return None
        return start.among(self.blank.rig, self.taken)

    def _check_decided(self, recording: Recording, start: Start) -> None:
        if recording.rig.has_wheels and course.is_wanted(recording) and not course.is_decided(recording, start.time):
            raise InputError(
                f"heading: comes from {course.LENGTH:g} m of track, not driven yet; expected more, or start.heading_deg"
            )

    def _is_given(self) -> bool:
        start = self.blank.start
        given = (start.position, start.velocity, start.roll_pitch, start.heading)
        return not start.estimate_gyro_bias and all(value is not None for value in given)

    def _recording(self, until: float) -> Recording:
        streams = []
        for name, collected in self.imus.items():
            rows = _until(collected, until)
            if len(rows) < 2:
                raise InputError(f"no data from {name}")
            streams.append(ImuStream(name, rows[:, 0], rows[:, 1:4], rows[:, 4:7]))
        gnss = self._gnss(until)
        if gnss is None and self.needs_fix:
            raise InputError("no fix from GNSS")
        return replace(self.blank, imus=tuple(streams), gnss=gnss)

    def _gnss(self, until: float) -> GnssStream | None:
        rows = _until(self.fixes, until)
        if not len(rows):
            return None
        # a velocity is looked at where every fix has one
        velocities = (rows[:, 7:10], rows[:, 10:13]) if np.isfinite(rows).all() else (None, None)
        return GnssStream(rows[:, 0], rows[:, 1:4], rows[:, 4:7], *velocities)

    def _collected(self) -> list[Sample]:
        samples: list[Sample] = [*self.shown]
        for name, collected in self.imus.items():
            samples += [ImuSample(name, float(row[0]), row[1:4], row[4:7]) for row in collected.sorted()]
        for row in self.fixes.sorted():
            velocity, velocity_std = (row[7:10], row[10:13]) if np.isfinite(row).all() else (None, None)
            fix = GnssFix(float(row[0]), row[1:4], row[4:7], velocity, velocity_std, geodetic=self.blank.geodetic)
            samples.append(fix)
        return sorted(samples, key=lambda sample: sample.time)


def _row(sample: ImuSample | GnssFix) -> tuple[float, ...]:
    if isinstance(sample, ImuSample):
        return sample.time, *sample.dtheta, *sample.dvel
    assert sample.position_std is not None
    nothing = np.full(3, np.nan)
    velocity = nothing if sample.velocity is None else sample.velocity
    velocity_std = nothing if sample.velocity_std is None else sample.velocity_std
    return sample.time, *sample.position, *sample.position_std, *velocity, *velocity_std


def _until(rows: _Rows, time: float) -> Array:
    found = rows.sorted()
    return found[found[:, 0] <= time]


def after_start(start: Start, collected: list[Sample]) -> list[Sample]:
    """Return what a navigator is to be given of the collected samples: what came earlier is in the start."""
    return [one for one in collected if one.time > start.time - (BEFORE_START if isinstance(one, ImuSample) else 0.0)]
