"""One run on live samples: start, navigate, pass states on, keep checkpoints."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np

from polyins.evaluation.documents import CoverageFigures
from polyins.evaluation.verdict import counted, coverage, of_live
from polyins.files import write_bytes
from polyins.live.sinks import Outlet
from polyins.live.snapshot import Snapshot
from polyins.model.findings import TRUST, Finding, Level, Verdict
from polyins.navigate.samples import Array, ImuSample, Sample, SensorSample
from polyins.navigate.starter import Starter, after_start
from polyins.prepare.alignment import Start

if TYPE_CHECKING:
    from polyins.navigate.navigator import ImuHealth, Navigator, NavigatorState

SILENT_GNSS = 2.0
"""s without a fix that are dead reckoning; at least, and 2.5 times the usual interval"""
JUDGED_EVERY, JUDGED_SHARE = 5.0, 0.01
"""s of data between two verdicts that are told under way, and of a long run at least that share of it"""
LONGEST_LAG = 1.0
"""s by which a state is taken to follow the stamp of what has come"""


class Checkpoints:
    """The navigator in a file, whole at any time, and what the session has to know besides."""

    def __init__(self, folder: Path, every: float) -> None:
        """`every`: s of data between two; infinite: none."""
        self.path = folder / "checkpoint.npz"
        self.origin_path = folder / "origin.npy"
        self.every = every
        self.due = float("-inf")
        self.count = 0

    def offer(self, navigator: Navigator, time: float) -> None:
        """Save the navigator if it is due."""
        if time >= self.due:
            if self.due > float("-inf"):
                navigator.save(self.path)
                self.count += 1
            self.due = time + self.every


class Session:
    """Takes samples in the order of their arrival."""

    def __init__(
        self,
        starter: Starter,
        begin: Callable[[Start], Navigator],
        outlets: Sequence[Outlet],
        checkpoints: Checkpoints | None = None,
    ) -> None:
        self.starter = starter
        self.begin = begin
        self.outlets = outlets
        self.checkpoints = checkpoints
        self.index = {imu.name: i for i, imu in enumerate(starter.blank.rig.imus)}
        self.navigator: Navigator | None = None
        self.start: Start | None = None
        self.origin: Array | None = None
        self.samples: Counter[str] = Counter()
        """what the navigator took, by IMU, fixes as GNSS, and by kind of sensor"""
        self.fix_times: deque[float] = deque(maxlen=6)
        self.due = float("-inf")
        """s: a state is looked at when a stamp has come that far"""
        self.last: Snapshot | None = None
        self.level, self.judged_until = TRUST, float("-inf")
        """of the last verdict, and until when it is told, s"""

    def resume(self, navigator: Navigator, origin: Array) -> None:
        """Go on with a navigator from a checkpoint instead of looking for a start."""
        self.navigator, self.origin = navigator, origin
        navigator.caught_up = self._caught_up
        if navigator.state is not None:
            self.fix_times.append(navigator.state.time)  # what it knows, a fix would have said

    def take(self, sample: Sample) -> None:
        """Take the next sample."""
        if self.navigator is not None:
            self._feed(sample)
        elif (found := self.starter.take(sample)) is not None:
            self._begin(*found)

    def _begin(self, start: Start, collected: list[Sample]) -> None:
        self.start, self.navigator = start, self.begin(start)
        self.navigator.caught_up = self._caught_up
        self.navigator.record.begin = self.starter.oldest
        self.navigator.record.findings += self.starter.findings
        self.fix_times.append(start.time)  # what the start knows, a fix would have said
        for one in after_start(start, collected):
            self._feed(one)

    def finish(self) -> None:
        """Let the navigator take what still waits, and pass the last state on."""
        if self.navigator is None and (found := self.starter.finish()) is not None:
            self._begin(*found)
        if self.navigator is None:
            return
        self.navigator.flush()
        state = self.navigator.state
        if state is not None and (self.last is None or state.time > self.last.state.time):
            self._pass_on(state, last=True)
        if self.checkpoints is not None and self.checkpoints.every < float("inf") and not self.navigator.waits_for:
            self.navigator.save(self.checkpoints.path)

    def _feed(self, sample: Sample) -> None:
        assert self.navigator is not None
        refused = sum(self.navigator.counts.values())
        if isinstance(sample, ImuSample):
            self.navigator.imu(sample.time, sample.dtheta, sample.dvel, self.index[sample.imu])
        elif isinstance(sample, SensorSample):
            self.navigator.aid(sample.kind, sample.time, sample.value, sample.std)
        else:
            assert sample.position_std is not None
            self.navigator.gnss(sample.time, sample.position, sample.position_std, sample.velocity, sample.velocity_std)
        # when a state is passed on depends on what was taken, never on what was refused
        if sum(self.navigator.counts.values()) == refused:
            self._taken(sample)

    def _taken(self, sample: Sample) -> None:
        if isinstance(sample, ImuSample):
            self.samples[sample.imu] += 1
        elif isinstance(sample, SensorSample):
            self.samples[sample.kind] += 1
        else:
            self.samples["GNSS"] += 1
            self.fix_times.append(sample.time)
        self._caught_up(sample)

    def _caught_up(self, sample: Sample) -> None:
        if sample.time >= self.due:
            self._look(sample.time)

    def _look(self, time: float) -> None:
        assert self.navigator is not None
        state = self.navigator.state
        if state is None or (self.last is not None and state.time <= self.last.state.time):
            return
        self._pass_on(state)
        if self.checkpoints is not None:
            self.checkpoints.offer(self.navigator, state.time)
        lag = min(max(0.0, time - state.time), LONGEST_LAG)
        self.due = lag + min((outlet.due for outlet in self.outlets), default=state.time + 1.0)

    def _pass_on(self, state: NavigatorState, last: bool = False) -> None:
        if self.origin is None:
            self.origin = np.array(state.position)
            if self.checkpoints is not None:
                _keep_origin(self.checkpoints.origin_path, self.origin)
        geodetic = self.starter.blank.geodetic
        self.last = Snapshot(state, self.origin, geodetic, self._dead_reckoning(state.time))
        for outlet in self.outlets:
            if last:
                outlet.due = float("-inf")
            outlet.offer(self.last)

    def _dead_reckoning(self, time: float) -> bool:
        times = sorted(self.fix_times)
        if not times:
            return True
        usual = median(np.diff(times)) if len(times) > 1 else 0.0
        return bool(time - times[-1] > max(SILENT_GNSS, 2.5 * usual))

    def report(self) -> dict[str, Any]:
        """Return how it goes: state, health of each IMU, age of the last fix."""
        missing = self.starter.why if self.navigator is None else self.navigator.waits_for
        if self.navigator is None or self.last is None or missing:
            return {"status": f"looking for a start: {missing}"}
        return {
            "verdict": self._level(self.last.state.time),
            "status": "dead reckoning" if self.last.dead_reckoning else "navigating",
            "state": self.last.row,
            "imus": [_health(one) for one in self.navigator.health],
            "fix_age_s": self.last.state.time - max(self.fix_times) if self.fix_times else None,
        }

    def judged(self, findings: Sequence[Finding]) -> Verdict:
        """Return the verdict on the run so far; `findings`: of its configuration."""
        findings = (*findings, *self.starter.refusals.findings())
        if self.navigator is not None and self.navigator.record.epochs:
            return of_live(self.navigator, findings)
        text = f"no start was found: {self.starter.why if self.navigator is None else self.navigator.waits_for}"
        return Verdict((*findings, Finding("start", text, "serious")))

    @property
    def coverage(self) -> CoverageFigures | None:
        """From when to when there are states; None without any."""
        if self.navigator is None or not self.navigator.record.epochs:
            return None
        return coverage(self.navigator.span, counted(self.navigator))

    def _level(self, time: float) -> Level:
        """Return the level of the verdict, which is looked at now and then: it takes as long as the run is long."""
        if time >= self.judged_until:
            begin = time if self.navigator is None else self.navigator.record.first
            self.level = self.judged(()).level
            self.judged_until = time + max(JUDGED_EVERY, JUDGED_SHARE * (time - begin))
        return self.level

    def refused(self) -> Counter[str]:
        """Return what starter and navigator refused, by kind."""
        counts = Counter(self.starter.counts)
        if self.navigator is not None:
            counts.update(self.navigator.counts)
        return counts


def _keep_origin(path: Path, origin: Array) -> None:
    import io

    content = io.BytesIO()
    np.save(content, origin)
    write_bytes(path, content.getvalue())


def _health(one: ImuHealth) -> dict[str, Any]:
    return {
        "name": one.name,
        "rate_hz": one.rate_hz,
        "gyro_residual_deg_s": None if one.gyro_residual is None else float(np.degrees(one.gyro_residual)),
        "accel_residual_m_s2": one.accel_residual,
        "last_time_s": one.last_time,
        "silent": one.silent,
    }
