"""The engine on live data: samples and measurements as they come, the state at any time.

A recording that is played through it gives the solution of a batch run, bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.aiding import kinds
from polyins.errors import InputError
from polyins.model.attitude import euler_angles, euler_variance
from polyins.model.comparisons import Exclusion, exclusions
from polyins.model.findings import Finding
from polyins.model.methods import find_method
from polyins.model.recording import AidingStream, FilterOptions, Recording, StartOptions
from polyins.model.rig import Rig
from polyins.model.solution import Innovations, Trajectory
from polyins.model.status import STATUSES, status_of
from polyins.navigate import batch, checkpoint, events, outcome, restart
from polyins.navigate.ahead import Ahead, HeldIncrements, Measured
from polyins.navigate.checkpoint import Made
from polyins.navigate.choice import choose
from polyins.navigate.events import Events
from polyins.navigate.record import Record, Segment
from polyins.navigate.refusals import NOT_FINITE, Refusals, unfit
from polyins.navigate.restart import Pause
from polyins.navigate.samples import GnssFix, ImuSample, Sample, SensorSample
from polyins.navigate.starter import Starter, after_start
from polyins.navigate.timeline import Timeline
from polyins.prepare import rigid, wheels
from polyins.prepare.alignment import Start
from polyins.prepare.assembly import DUPLICATED, FUTURE, FUTURE_STAMPED, LATE, Assembly, Epoch
from polyins.prepare.plausible import limits_of
from polyins.prepare.timesync import GAP, Aligned
from polyins.prepare.votes import Windows
from polyins.version import __version__

Array = NDArray[np.float64]

BEFORE_START, NO_STD = "before the start", "std not positive"
IN_PAUSE = "without IMU data"
HEALTH_WINDOW = 1.0  # s


@dataclass(frozen=True)
class NavigatorState:
    """What is known at the newest epoch."""

    time: float
    """s"""
    position: Array
    """(latitude rad, longitude rad, height m), or (north m, east m, height m) on a local plane, shape (3,)"""
    velocity: Array
    """m/s north, east, down, shape (3,)"""
    attitude: Array
    """q_nb, scalar first, shape (4,)"""
    position_std: Array
    """m north, east, down, shape (3,)"""
    velocity_std: Array
    """m/s, shape (3,)"""
    phi_covariance: Array
    """rad^2: NN, NE, ND, EE, ED, DD of the attitude error phi, shape (6,)"""
    status: str
    """what it is worth, one of `model.status.STATUSES`"""

    @property
    def euler(self) -> Array:
        """Roll, pitch and heading, rad, shape (3,)."""
        return np.asarray(euler_angles(self.attitude[None])[0])

    @property
    def attitude_std(self) -> Array:
        """Standard deviations of roll, pitch and heading, rad, shape (3,)."""
        return np.asarray(np.sqrt(euler_variance(self.euler[None], self.phi_covariance[None])[0]))


@dataclass(frozen=True)
class ImuHealth:
    """How one IMU does."""

    name: str
    last_time: float | None
    """s, of its newest sample"""
    rate_hz: float | None
    silent: bool
    """nothing came from it for the newest epoch"""
    gyro_residual: float | None
    """rad/s, rms over the last second and the axes of its difference from the mean of all that are there; None on a rig
    with wheels, whose IMUs turn differently"""
    accel_residual: float | None
    """m/s^2, likewise"""


class Navigator:
    """Navigates with the IMUs of a rig from a start that is known or found in the data.

    `start`: where it is known, or what is known of it; unless given all is found, as in a batch run, and `state` is
    None until then, for which `waits_for` says the reason. `method` and `options` are those of a batch run; `imu` is
    the index of the IMU that `single` uses. `fixes`: GNSS will give the position; unless said it does where positions
    are geodetic and the start's is not given. `delay`: how late a measurement may come, s. `wait`: how long, in time of
    the data, an epoch waits for a sample that is missing, s; samples of several IMUs may arrive in any order within it.
    The gyros of the IMUs need not be synchronised: epochs are those of the first IMU. Raises InputError for a method
    that the rig has not the IMUs for.
    """

    def __init__(
        self,
        rig: Rig,
        start: Start | StartOptions | None = None,
        *,
        method: str = "enav-fusion",
        options: FilterOptions | None = None,
        geodetic: bool = True,
        imu: int = 0,
        fixes: bool | None = None,
        delay: float = 1.0,
        wait: float = 0.05,
    ) -> None:
        self.method = find_method(method)
        choice = choose(self.method, rig, imu)
        self._taken = choice.all
        options = options or FilterOptions()
        self.start: Start | None = None
        self.delay = delay
        self._made = Made(__version__, rig, None, method, options, geodetic, imu, delay, wait, {}, None, None)
        self._recording = Recording(rig.subset(self._taken), (), geodetic=geodetic, options=options)
        self._imus = len(rig.imus)
        self._takes_some = self._taken != list(range(self._imus))
        self._place = {index: place for place, index in enumerate(self._taken)}
        self._choice = choice.renumbered()
        self._assembly = Assembly(len(self._taken), wait, bridge=not rig.has_wheels)
        self._schedule: wheels.Schedule | None = None
        self._timeline: Timeline | None = None
        self._order: list[int] = []
        """of each lane the IMU that stands in it"""
        self._first: Epoch | None = None
        self._early: list[Events] = []
        """measurements that came before the first epoch"""
        self.counts: dict[str, int] = {}
        """what was refused, by kind"""
        self._ahead = Ahead()
        self._record = Record()
        self._ended: Timeline | None = None
        """of the part before a pause, until the part after it has one"""
        self._has_fixes = False
        self.caught_up: Callable[[Sample], None] | None = None
        """called after each of the samples that were collected before a start, with it"""
        self._refusals = Refusals()
        self._limits = [limits_of(on_wheel=imu.wheel is not None) for imu in rig.imus]
        self._usual = min(limits.rate for limits in self._limits)
        """rad/s or m/s^2: below it, no sample of all together is beyond a range"""
        self._starter: Starter | None = None
        if isinstance(start, Start):
            self._begin_from(start)
        else:
            known = start or StartOptions()
            needs_fix = (geodetic and known.position is None) if fixes is None else fixes
            blank = Recording(rig, (), geodetic=geodetic, start=known, options=options)
            self._starter = Starter(blank, max(delay, wait), needs_fix, method, imu)

    @property
    def waits_for(self) -> str:
        """Why there is no start yet; empty once there is one."""
        return "" if self._starter is None else self._starter.why

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What there is to say of the data and of pauses so far; `evaluation.verdict.of_live` judges the rest."""
        part = self._record.part
        of_part = part.findings(self.method, self._choice, self._recording, self._has_fixes) if part else ()
        refusals = self._refusals if self._starter is None else self._starter.refusals
        return (*refusals.findings(), *self._record.findings, *of_part)

    @property
    def measurements(self) -> dict[str, Innovations]:
        """What became of the measurements so far, by kind, as in a `Solution`."""
        wheels = outcome.speed_wheels(self._choice, self._recording.rig)
        return self._record.measurements(None if self._timeline is None else self._timeline.measured, wheels)

    @property
    def exclusions(self) -> tuple[Exclusion, ...]:
        """Which IMUs did not count when, since they deviated from the others, so far."""
        if self._timeline is None:
            return ()
        seats = self._timeline.run.bank
        names = [seats.members[lane].imu.name for lane in seats.lanes]
        return exclusions(self._record.comparisons(self._timeline.measured, seats.lanes), names)

    @property
    def span(self) -> tuple[float, float] | None:
        """From when to when there are IMU data so far, s; None before there are any."""
        newest = self._assembly.newest if self._starter is None else self._starter.newest_imu
        return None if math.isnan(self._record.begin) else (self._record.begin, newest)

    @property
    def record(self) -> Record:
        """What was counted so far."""
        return self._record

    def _begin_from(self, start: Start) -> None:
        if len(start.imu_errors) != self._imus:
            raise InputError(f"start: errors of {len(start.imu_errors)} IMUs; expected those of {self._imus}")
        self._made = replace(self._made, start=start)
        self.start, self._starter = start.subset(self._taken), None

    def _collect(self, sample: Sample | None) -> None:
        """Let the search for a start take a sample, or look at all that there is; go on from the start it finds."""
        starter = self._starter
        assert starter is not None
        found = starter.finish() if sample is None else starter.take(sample)
        if found is None:
            return
        start, collected = found
        for kind, count in starter.counts.items():
            self.counts[kind] = self.counts.get(kind, 0) + count
        self._record.findings += starter.findings
        self._refusals.take_over(starter.refusals)
        self._begin_from(start)
        for one in after_start(start, collected):
            self._take_sample(one)
            if self.caught_up is not None:
                self.caught_up(one)

    def _take_sample(self, sample: Sample) -> None:
        if isinstance(sample, ImuSample):
            names = [imu.name for imu in self._made.rig.imus]
            self.imu(sample.time, sample.dtheta, sample.dvel, names.index(sample.imu))
        elif isinstance(sample, SensorSample):
            self.aid(sample.kind, sample.time, sample.value, sample.std)
        else:
            assert sample.position_std is not None
            self.gnss(sample.time, sample.position, sample.position_std, sample.velocity, sample.velocity_std)

    def imu(self, time: float, dtheta: ArrayLike, dvel: ArrayLike, imu: int | None = None) -> None:
        """Take what IMU `imu` of the rig measured in the interval that ends at `time`, s: rad and m/s, shape (3,).

        In array axes: a rotated mount is the caller's. Without `imu`, samples of all IMUs with one stamp, shape (N, 3).
        A sample that cannot be taken is counted in `counts` and told in `findings`. Raises InputError for samples of
        another number of IMUs.
        """
        if imu is None:
            self._all(time, np.concatenate([dtheta, dvel], axis=-1, dtype=np.float64).reshape(-1, 6))
            return
        values = np.empty(6)
        values[:3], values[3:] = dtheta, dvel
        why = self._unfit(imu, time, values)
        if not why and self._record.epochs == 0 and math.isnan(self._record.begin):
            self._record.begin = time
        if why:
            self._leave_out(imu, why, time)
        elif self._starter is not None:
            self._collect(self._sample(imu, time, values))
        elif imu in self._place:
            self._add(self._place[imu], time, values)
            self._step()

    def _sample(self, imu: int, time: float, values: Array) -> ImuSample:
        return ImuSample(self._made.rig.imus[imu].name, time, values[:3], values[3:])

    def _add(self, i: int, time: float, values: Array) -> None:
        """Let a sample of the IMU at place i wait for its epoch, or for what is told by those after it."""
        if self._starter is not None:
            self._collect(self._sample(self._taken[i], time, values))
            return
        newest = self._assembly.newest
        if time > newest + FUTURE and newest > -math.inf:
            for one in self._ahead.hold(HeldIncrements(time, i, values)):
                self._assemble(one.imu, one.time, one.values)
            if self._ahead.goes_on:
                self._end_pause(newest)
            return
        self._assemble(i, time, values)
        if self._ahead:
            self._settle()

    def _assemble(self, i: int, time: float, values: Array) -> None:
        self._leave_out(self._taken[i], self._assembly.add(i, time, values), time)

    def _settle(self) -> None:
        """Take what is no longer ahead of the IMUs, which go on where they were, and refuse what still is."""
        for one in self._ahead.in_order(self._recording.options.gnss_snap):
            if isinstance(one, HeldIncrements):
                self._assemble(one.imu, one.time, one.values)
            elif one.sample.time > self._assembly.newest + self.delay:
                self._refuse(FUTURE_STAMPED)
            else:
                self._apply(one.events)

    def _end_pause(self, last: float) -> None:
        """Go on after a pause, which began at `last`, s, or anew if it was hopeless."""
        first = self._ahead.first
        held = self._ahead.in_order(self._recording.options.gnss_snap)
        if first - last > restart.hopeless(self._recording.rig.has_wheels):
            self._begin_anew(last, first)
        else:
            self._assembly.newest = first
        for one in held:
            if isinstance(one, HeldIncrements):
                self._add(one.imu, one.time, one.values)
                self._step()
            elif self._starter is None:
                self._apply(one.events)
            elif one.sample.time >= first:
                self._collect(one.sample)
            else:
                self._refuse(IN_PAUSE)

    def _begin_anew(self, last: float, first: float) -> None:
        """End the run at a pause, from `last` to `first`, s, and look for a start after it."""
        self._step(at_end=True)
        if self._starter is None:
            self._search(Pause(last, first))

    def _search(self, pause: Pause) -> None:
        """Look for a start after a pause, with what the run before it knows."""
        line, ended = self._timeline, "" if pause.why == restart.NO_DATA else pause.why
        before = None if line is None else batch.known(line.run, line.last, ended=ended)
        lost = self._recording.rig.has_wheels and not self._has_fixes
        blank = Recording(self._made.rig, (), geodetic=self._recording.geodetic, options=self._recording.options)
        starter = Starter(
            restart.after(blank, before, lost),
            max(self.delay, self._made.wait),
            not lost,
            self._made.method,
            self._made.imu,
        )
        starter.after, starter.before = pause, before if lost else None
        starter.refusals = self._refusals
        if line is not None:
            self._record.findings = list(self.findings)
            self._record.ended.append(line.measured)
            self._record.part = None
        self._ended, self._timeline, self._schedule = line, None, None
        self._first, self._early, self.start = None, [], None
        self._assembly = Assembly(len(self._taken), self._made.wait, bridge=not self._recording.rig.has_wheels)
        self._starter = starter

    def gnss(
        self,
        time: float,
        position: ArrayLike,
        position_std: ArrayLike,
        velocity: ArrayLike | None = None,
        velocity_std: ArrayLike | None = None,
    ) -> None:
        """Take a fix of the antenna: position as in `model.recording`, its std m; velocity and its std, m/s.

        It may come `delay` seconds late and is applied at its own time all the same. A fix that cannot be taken is
        counted in `counts`.
        """
        if self._starter is not None:
            self._collect_fix(time, position, position_std, velocity, velocity_std)
            return
        antenna = self._recording.rig.antenna
        place, std = np.asarray(position, dtype=np.float64), np.asarray(position_std, dtype=np.float64)
        sample = GnssFix(time, place, std, geodetic=self._recording.geodetic)
        fix = [events.of_point(kinds.GNSS_POSITION, time, position, antenna, position_std)]
        if velocity is not None and velocity_std is not None:
            fix.append(events.of_point(kinds.GNSS_VELOCITY, time, velocity, antenna, velocity_std))
            sample = sample._replace(velocity=np.asarray(velocity), velocity_std=np.asarray(velocity_std))
        self._has_fixes = True
        self._measure(sample, *fix)

    def aid(self, kind: str, time: float, value: float, std: ArrayLike) -> None:
        """Take what a sensor of the rig shows: a height in m, a heading in rad, or the speed of an odometer in m/s.

        `std`: of the value; of an odometer that of forward, right and down, m/s, where zero is not measured. It may
        come `delay` seconds late. What cannot be taken is counted in `counts`. Raises InputError for another kind.
        """
        stds = np.atleast_1d(np.asarray(std, dtype=np.float64))
        if self._starter is not None:
            self._recording.rig.sensor(kind)
            if math.isfinite(time + value + stds.sum()):
                self._collect(SensorSample(kind, time, value, stds))
            else:
                self._refuse(NOT_FINITE)
            return
        stream = AidingStream(kind, np.array([time]), np.array([value], dtype=np.float64), stds[None])
        self._measure(SensorSample(kind, time, value, stds), events.of_sensor(stream, self._recording.rig))

    def _collect_fix(
        self,
        time: float,
        position: ArrayLike,
        position_std: ArrayLike,
        velocity: ArrayLike | None,
        velocity_std: ArrayLike | None,
    ) -> None:
        place, std = np.asarray(position, dtype=np.float64), np.asarray(position_std, dtype=np.float64)
        speed = None if velocity is None or velocity_std is None else np.asarray(velocity, dtype=np.float64)
        speed_std = None if speed is None else np.asarray(velocity_std, dtype=np.float64)
        if not math.isfinite(time + place.sum() + std.sum()):
            self._refuse(NOT_FINITE)
        elif not (std > 0.0).all():
            self._refuse(NO_STD)
        else:
            geodetic = self._recording.geodetic
            self._has_fixes = True
            self._collect(GnssFix(time, place, std, speed, speed_std, geodetic=geodetic))

    def flush(self) -> None:
        """Take everything that still waits: there are no more data."""
        if self._ahead:
            self._settle()
        starter = self._starter
        if starter is not None:
            self._collect(None)
            if self._starter is not None and starter.after is not None:
                self._record.findings += [*starter.findings, restart.left_out(starter.after, starter.why)]
        self._step(at_end=True)

    @property
    def state(self) -> NavigatorState | None:
        """The state at the newest epoch; None before the first, and after a pause until there is a start again."""
        line = self._timeline
        return None if line is None else _states(line, line.last)[0]

    def history(self, after: float = -math.inf) -> list[NavigatorState]:
        """Return the states of all epochs later than `after`, s, as far back as a measurement may still come."""
        line = self._timeline or self._ended
        if line is None:
            return []
        begun = 1 if line.whole else 0
        first = int(np.searchsorted(line.inputs.time[: line.last + 1], after, side="right"))
        return _states(line, max(first, begun))

    @property
    def health(self) -> tuple[ImuHealth, ...]:
        """How each IMU that navigates does."""
        assembly, line = self._assembly, self._timeline
        gyro = accel = np.full(len(self._taken), math.nan)
        if line is not None and not self._recording.rig.has_wheels:
            gyro, accel = _residuals(line)
        return tuple(
            ImuHealth(
                name=imu.name,
                last_time=_or_none(assembly.ends[i]),
                rate_hz=_or_none(1.0 / assembly.nominal[i]),
                silent=bool(assembly.silent[i]),
                gyro_residual=_or_none(gyro[i]),
                accel_residual=_or_none(accel[i]),
            )
            for i, imu in enumerate(self._recording.rig.imus)
        )

    def save(self, path: Path | str) -> None:
        """Write everything to a file from which `resume` goes on as if nothing had happened.

        Raises InputError as long as there is no start.
        """
        if self._starter is not None:
            raise InputError(f"{path}: there is no start yet ({self.waits_for}); expected one before a checkpoint")
        due = None if self._schedule is None else self._schedule.memory
        made = replace(
            self._made,
            counts=self.counts,
            first=self._first,
            due=due,
            findings=tuple(self._record.findings),
            fixes=self._has_fixes,
        )
        line = {} if self._timeline is None else self._timeline.arrays()
        early = events.merged(*self._early)
        remembered = checkpoint.Remembered(self._assembly.arrays(), early, line, self._record.arrays())
        checkpoint.write(Path(path), made, remembered)

    @classmethod
    def resume(cls, path: Path | str) -> Navigator:
        """Return the navigator that was saved; raise InputError for a file that is not whole or of another version."""
        made, remembered = checkpoint.read(Path(path))
        early, line = remembered.early, remembered.line
        navigator = cls(
            made.rig,
            made.start,
            method=made.method,
            options=made.options,
            geodetic=made.geodetic,
            imu=made.imu,
            delay=made.delay,
            wait=made.wait,
        )
        navigator.counts, navigator._first = made.counts, made.first
        navigator._has_fixes = made.fixes
        navigator._early = [early.at(slice(row, row + 1)) for row in range(len(early.time))]
        navigator._assembly.restore(remembered.samples)
        if line:
            navigator._timeline = navigator._new_timeline(np.array([0.0, 1.0]), np.zeros((2, 6, len(navigator._taken))))
            navigator._timeline.restore(line)
        navigator._record.restore(remembered.record)
        navigator._record.findings = list(made.findings)
        if made.due is not None and navigator._schedule is not None:
            navigator._schedule.memory = made.due
        return navigator

    def _refuse(self, why: str) -> None:
        if why:
            self.counts[why] = self.counts.get(why, 0) + 1

    def _leave_out(self, imu: int, why: str, time: float) -> None:
        """Count a sample of an IMU that is refused for a reason, if there is one, at the time of the others."""
        if why:
            self._refuse(why)
            newest = self._assembly.newest if self._starter is None else self._starter.newest
            refusals = self._refusals if self._starter is None else self._starter.refusals
            refusals.add(self._made.rig.imus[imu].name, why, newest if math.isfinite(newest) else time)

    def _unfit(self, imu: int, time: float, values: Array) -> str:
        place = self._place.get(imu)
        nominal = math.nan if place is None else float(self._assembly.nominal[place])
        step = math.nan if place is None else time - float(self._assembly.ends[place])
        return unfit(time, values, self._limits[imu], step if 0.0 < step <= GAP * nominal else nominal)

    def _all(self, time: float, values: Array) -> None:
        if len(values) != self._imus:
            raise InputError(f"imu: increments of {len(values)} IMUs; expected those of {self._imus}")
        if self._starter is not None:
            for i, row in enumerate(values):
                self.imu(time, row[:3], row[3:], i)
            return
        if self._takes_some:
            values = values[self._taken]
        size = math.hypot(*values.ravel().tolist())
        fit = size <= self._usual * self._assembly.nominal[0] and values.any(axis=1).all() and math.isfinite(time)
        if fit and self._record.epochs == 0 and math.isnan(self._record.begin):
            self._record.begin = time
        epoch = self._assembly.pass_through(time, values) if fit else None
        if epoch is not None:
            self._take(epoch)
            if self._ahead:
                self._settle()
            return
        for place, imu in enumerate(self._taken):
            why = self._unfit(imu, time, values[place])
            if why:
                self._leave_out(imu, why, time)
            else:
                self._add(place, time, values[place].copy())
        self._step()

    def _step(self, at_end: bool = False) -> None:
        for epoch in self._assembly.epochs(at_end):
            self._take(epoch)

    def _take(self, epoch: Epoch) -> None:
        if self._timeline is not None:
            self._append(epoch, self._timeline)
        elif self._first is not None:
            self._begin(self._first, epoch)
        elif self.start is not None and epoch.time >= self.start.time:
            self._first = epoch

    def _new_timeline(self, time: Array, increments: Array) -> Timeline:
        """Lay the method out for its first two epochs."""
        assert self.start is not None
        aligned = Aligned(time, increments, (), np.zeros((len(time), len(self._taken)), dtype=bool))
        prepared = batch.lay_out(self.method, self._choice, self._recording, aligned, self.start, gaps=True)
        self._order, self._ended = prepared.order, None
        self._schedule = batch.schedule_of(self.method, self._choice, self._recording, self.start)
        if math.isnan(self._record.interval):
            self._record.interval = float(time[1] - time[0])
        self._record.part = Segment(Windows(self._recording.rig, 1.0 / float(time[1] - time[0])))
        return Timeline(prepared, self.delay)

    def _begin(self, first: Epoch, second: Epoch) -> None:
        increments = np.array([first.increments, second.increments])
        self._timeline = self._new_timeline(np.array([first.time, second.time]), increments)
        self._first = None
        assert self._record.part is not None
        self._record.part.take(first)
        early, self._early = self._early, []
        for event in early:
            self._refuse(self._aid(self._timeline, event))
        self._take(second)

    def _append(self, epoch: Epoch, line: Timeline) -> None:
        """Complete an epoch by what the rig says of it, and let the timeline take it."""
        assert self.start is not None
        rig, interval = self._recording.rig, np.array([epoch.time - line.time])
        increments, present = epoch.increments, np.ones(len(rig.imus), dtype=np.uint8)
        if epoch.missing.any():
            one = Aligned(
                np.array([line.time, epoch.time]),
                np.array([epoch.increments, epoch.increments]),
                (),
                np.array([epoch.missing, epoch.missing]),
            )
            increments = rigid.completed(rig, one, self.start.imu_errors).increments[1]
            present = batch.present_of(self._recording, epoch.missing[None])[0]
        travel = np.zeros((1, 2))
        if self._choice.speed:
            lacking, bias = (present == rigid.NOTHING)[None], self.start.imu_errors[:, :3]
            travel = wheels.travel(rig, self._choice.speed, increments[None], interval, lacking, bias)
        stamp, increments = np.array([epoch.time]), increments[:, self._order]
        assert self._schedule is not None
        due = self._schedule.events(stamp, interval, travel[:, 1])
        queue = events.scheduled(due, stamp, self._recording.options, rig)
        if epoch.missing.all():
            queue = events.merged(self._bridged(epoch.time, increments, line), queue)
        line.append(epoch.time, increments, present[self._order], travel[0], queue)
        if self._is_over(line):
            return
        assert self._record.part is not None
        self._record.part.take(epoch)
        self._record.take(epoch.time, line.outputs.states[line.last], line.outputs.variances[line.last])

    def _is_over(self, line: Timeline) -> bool:
        """Whether the newest state is no number or given up: the run ends with the last one before, and begins anew."""
        states, variances, hopeless_after = line.outputs.states, line.outputs.variances, line.run.hopeless_after
        broken = not math.isfinite(states[line.last].sum() + variances[line.last].sum())
        if not broken and line.time <= hopeless_after:
            return False
        while line.last and not (
            math.isfinite(states[line.last].sum() + variances[line.last].sum()) and line.time <= hopeless_after
        ):
            line.last -= 1
        why = restart.BROKEN if broken else restart.HOPELESS_STATE
        self._search(Pause(line.time, line.time + restart.SETTLED, why))
        return True

    def _bridged(self, time: float, increments: Array, line: Timeline) -> Events:
        """Return the noise of an epoch in which no IMU has data."""
        before = slice(max(line.last - 1, 0), line.last + 1)
        times = np.append(line.inputs.time[before], time)
        missing = np.zeros((len(times), 1), dtype=bool)
        missing[-1] = True
        rows = np.concatenate([line.inputs.increments[before], increments[None]])
        return batch.bridged(self._recording.rig, times, rows, missing, self._recording.options.gnss_snap)

    def _measure(self, sample: Sample, *measurements: Events) -> None:
        """Take measurements of one time and one source: all or none; `sample` is what came."""
        time = float(measurements[0].time[0])
        if not math.isfinite(time + sum(one.value.sum() + one.variance.sum() for one in measurements)):
            self._refuse(NOT_FINITE)
        elif not all((one.variance > 0.0).any() and not (one.variance < 0.0).any() for one in measurements):
            self._refuse(NO_STD)
        elif time > self._assembly.newest + self.delay:
            for _ in self._ahead.hold_measured(Measured(sample, measurements)):
                self._refuse(IN_PAUSE)
        else:
            self._apply(measurements)

    def _apply(self, measurements: tuple[Events, ...]) -> None:
        if self._timeline is None:
            self._early.extend(measurements)
        else:
            for one in measurements:
                refused = self._aid(self._timeline, one)
                if refused:
                    self._refuse(refused)
                    return
            self._is_over(self._timeline)

    def _aid(self, line: Timeline, event: Events) -> str:
        if line.has_event(int(event.kind[0]), float(event.time[0])):
            return DUPLICATED
        if line.insert(event):
            return ""
        return BEFORE_START if line.whole else LATE


def _states(line: Timeline, first: int) -> list[NavigatorState]:
    """Return the states at the epochs of a window from one on."""
    if first > line.last:
        return []
    here = slice(first, line.last + 1)
    time, rows, variances = (
        line.inputs.time[here],
        line.outputs.states[here].copy(),
        line.run.stated(here).copy(),
    )
    time, position, velocity, attitude = line.inputs.time[here], rows[:, 0:3], rows[:, 3:6], rows[:, 6:10]
    track = Trajectory(time, position, velocity, attitude, variances[:, 0:3], variances[:, 3:6], variances[:, 6:12])
    status = status_of(track, line.aided, line.snap)
    return [
        NavigatorState(
            time=float(time[k]),
            position=position[k],
            velocity=velocity[k],
            attitude=attitude[k],
            position_std=np.sqrt(variances[k, 0:3]),
            velocity_std=np.sqrt(variances[k, 3:6]),
            phi_covariance=variances[k, 6:12],
            status=STATUSES[number],
        )
        for k, number in enumerate(status)
    ]


def _or_none(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _residuals(line: Timeline) -> tuple[Array, Array]:
    """Return how far each IMU is from the mean of all, rms over the last second: rad/s and m/s^2, (N,) each."""
    first = int(np.searchsorted(line.inputs.time[: line.last + 1], line.time - HEALTH_WINDOW)) + 1
    here = slice(min(first, line.last), line.last + 1)
    interval = np.diff(line.inputs.time[here.start - 1 : here.stop])
    rates = line.inputs.increments[here] / interval[:, None, None]
    squares = np.mean((rates - rates.mean(axis=2, keepdims=True)) ** 2, axis=0)
    return np.sqrt(squares[:3].mean(axis=0)), np.sqrt(squares[3:].mean(axis=0))
