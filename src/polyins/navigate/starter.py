"""From nothing to a start: collect samples until the search for a start succeeds on them."""

from __future__ import annotations

from array import array
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from polyins.errors import InputError
from polyins.model.findings import Finding
from polyins.model.methods import find_method
from polyins.model.recording import GnssStream, ImuStream, Recording
from polyins.navigate import batch, restart
from polyins.navigate.choice import choose
from polyins.navigate.refusals import Refusals, unfit
from polyins.navigate.restart import Known, Pause
from polyins.navigate.samples import Array, GnssFix, ImuSample, Sample, SensorSample
from polyins.navigate.start import same
from polyins.prepare import course, timesync
from polyins.prepare.alignment import Start
from polyins.prepare.assembly import DUPLICATED, LATE, LONGEST_BEGIN
from polyins.prepare.plausible import limits_of

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
LONGEST_STEP = 1.0
"""s that a sample is taken to be of where that is not known"""


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
        self.after: Pause | None = None
        """s, s: the pause of all IMUs after which the state is looked for"""
        self.before: Known | None = None
        """what was known before it, where that is all that there is of place and heading"""
        self.findings: list[Finding] = []
        self.method = find_method(method)
        self.taken = choose(self.method, blank.rig, imu).all
        self.found: tuple[float, Start] | None = None
        """when the start was first found, s, and it"""
        self.blank = blank
        self.delay = delay
        self.needs_fix = needs_fix
        self.counts: Counter[str] = Counter()
        self.refusals = Refusals()
        self.limits = {imu.name: limits_of(on_wheel=imu.wheel is not None) for imu in blank.rig.imus}
        self.why = "no data"
        """why there is no start yet"""
        self.imus = {imu.name: _Rows(7) for imu in blank.rig.imus}
        self.fixes = _Rows(13)
        self.shown: list[SensorSample] = []
        """by sensors that say nothing of the start"""
        self.newest = self.newest_imu = float("-inf")
        self.oldest = float("inf")
        """s, of IMU data"""
        self.attempt: float | None = None
        """s: data up to this time are looked at next"""

    def take(self, sample: Sample) -> tuple[Start, list[Sample]] | None:
        """Take a sample; returns the start, once it is found, and all that was collected in the order of stamps."""
        if self.after is not None and sample.time < self.after.end:
            return None
        if isinstance(sample, SensorSample):
            self.shown.append(sample)
            return None
        rows = self.imus[sample.imu] if isinstance(sample, ImuSample) else self.fixes
        why = self._refused(sample, rows)
        if why:
            self.counts[why] += 1
            if isinstance(sample, ImuSample):
                self.refusals.add(sample.imu, why, self.newest if rows.numbers else sample.time)
            return None
        if isinstance(sample, ImuSample):
            longest = restart.hopeless(self.blank.rig.has_wheels)
            if self.newest_imu > float("-inf") and sample.time - self.newest_imu > longest:
                found = self._from(self._found(self.newest_imu))
                if found is not None:
                    return found[0], [*found[1], sample]
                self._begin_anew(sample.time)
            self.newest_imu = max(self.newest_imu, sample.time)
            self.oldest = min(self.oldest, sample.time)
        self.newest = max(self.newest, sample.time)
        rows.add(*_row(sample))
        if self.attempt is None:
            self.attempt = self._first_attempt(sample.time)
            self.why = f"collecting data until {self.attempt:.0f} s"
        if sample.time < self.attempt + self.delay:
            return None
        until, self.attempt = self.attempt, self.attempt + EVERY
        found = self._from(self._settled(until))
        if found is not None:
            return found
        if until % CUT_EVERY == 0.0:
            for rows in (*self.imus.values(), self.fixes):
                rows.cut(until - KEPT)
            self.shown = [sample for sample in self.shown if sample.time >= until - KEPT]
        return None

    def _refused(self, sample: ImuSample | GnssFix, rows: _Rows) -> str:
        """Return why a sample cannot be taken, or nothing."""
        if isinstance(sample, ImuSample):
            step = sample.time - rows.numbers[-7] if rows.numbers else LONGEST_STEP
            interval = step if 0.0 < step < LONGEST_STEP else LONGEST_STEP
            why = unfit(sample.time, np.concatenate([sample.dtheta, sample.dvel]), self.limits[sample.imu], interval)
            if why:
                return why
        if sample.time in rows.stamps:
            return DUPLICATED
        return LATE if sample.time < self.newest - self.delay else ""

    def finish(self) -> tuple[Start, list[Sample]] | None:
        """Return the start that the data have, now that there are no more, and all that was collected."""
        return self._from(self._found(self.newest))

    def _from(self, start: Start | None) -> tuple[Start, list[Sample]] | None:
        """Return a start that was found, as sure as the pause before it lets it be, and all that was collected."""
        if start is None:
            return None
        if self.before is not None:
            start = restart.as_lost(start, self.before, self.blank.geodetic)
        if self.after is not None:
            self.findings.append(restart.restarted(self.after, {"time_s": start.time, **start.sources}))
        return start, self._collected()

    def _begin_anew(self, time: float) -> None:
        """Let all go that lies before the end of a pause, s: there is no start in it."""
        if self.after is not None:
            self.findings.append(restart.left_out(self.after, self.why))
        else:
            self.blank = restart.after(self.blank, None, lost=False)
        self.after = Pause(self.newest_imu, time)
        for rows in (*self.imus.values(), self.fixes):
            rows.cut(time)
        self.shown = [sample for sample in self.shown if sample.time >= time]
        self.attempt = self.found = None

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
            if len(rows) < 2 and (self.blank.rig.has_wheels or not self._missed(until)):
                raise InputError(f"no data from {name}")
            streams.append(ImuStream(name, rows[:, 0], rows[:, 1:4], rows[:, 4:7]))
        gnss = self._gnss(until)
        if gnss is None and self.needs_fix:
            raise InputError("no fix from GNSS")
        return replace(self.blank, imus=tuple(streams), gnss=gnss)

    def _missed(self, until: float) -> bool:
        """Whether one IMU at least has sent for so long that those that have not are no longer waited for."""
        firsts = [rows[0, 0] for one in self.imus.values() if len(rows := _until(one, until)) > 1]
        return bool(firsts) and until - min(firsts) >= LONGEST_BEGIN

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
