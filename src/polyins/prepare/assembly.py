"""Samples of several IMUs, in the order in which they arrive, into epochs on the clock of the first.

The live counterpart of `timesync.align`: what comes out does not depend on the order of arrival, as long as nothing
arrives later than the epoch that waited for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.kernels.resample import Waiting, assemble, covered_until
from polyins.model.recording import usual_interval
from polyins.prepare.timesync import GAP

Array = NDArray[np.float64]

KNOWN_AFTER = 16
"""Samples from which the rate of an IMU is known."""
USUAL = 1.5
"""An interval longer than this many nominal ones may hold a sample that is still on its way."""
LONGEST_BEGIN = 2.0
"""s, of data of some IMUs, after which the others are not waited for any longer"""
FUTURE = 1.0
"""s ahead of everything else: such a stamp is not believed, unless its IMU goes on from there for as long"""

KEPT = ("stamps", "values", "first", "last", "before", "ends", "nominal", "silent")

DUPLICATED, LATE, FUTURE_STAMPED = "duplicated", "late", "future-stamped"


@dataclass(frozen=True)
class Epoch:
    """What all IMUs measured in one interval."""

    time: float
    """s, its end"""
    increments: Array
    """dtheta (rad) and dvel (m/s), shape (6, N)"""
    missing: NDArray[np.bool_]
    """where an IMU has a gap, shape (N,); what stands there is bridged, or zero"""


@dataclass
class _Leap:
    """Samples of one IMU from which its clock seems to have gone on elsewhere."""

    begin: float = math.inf
    end: float = math.inf


@dataclass
class Assembly:
    """The samples that wait; see `timesync.align` for what is made of gaps."""

    count: int
    wait: float
    """s, of data, for a sample that is missing"""
    bridge: bool
    """give an IMU in a gap the mean of the others, and all in one the mean of the rates on both sides"""
    now: float = -math.inf
    """s, the end of the last epoch"""
    newest: float = -math.inf
    """s, of all samples"""
    stamps: Array = field(init=False)
    values: Array = field(init=False)
    first: NDArray[np.int64] = field(init=False)
    last: NDArray[np.int64] = field(init=False)
    before: Array = field(init=False)
    """s, where the first waiting sample of each IMU begins"""
    ends: Array = field(init=False)
    """s, of the newest sample of each IMU"""
    nominal: Array = field(init=False)
    """s, the usual interval of each IMU; NaN as long as it is not known"""
    silent: NDArray[np.bool_] = field(init=False)
    """IMUs that have not been there for the last epoch, and are not waited for"""
    even: bool = False
    """whether nothing waits and all IMUs ended their last sample with the last epoch"""
    behind: int = 0
    """IMUs that are not silent and have nothing after `now`"""
    patience: float = 0.0
    """s, of data, for which an epoch waits"""
    held: list[tuple[float, float]] = field(default_factory=list)
    """end and length of epochs without any data, which are bridged from both sides, s"""
    seen: tuple[Array, float] | None = None
    """increments, shape (6, N), of the last epoch with data, and its length"""

    def __post_init__(self) -> None:
        room = 32 * KNOWN_AFTER
        self.stamps = np.zeros((self.count, room))
        self.values = np.zeros((self.count, room, 6))
        self.first = np.zeros(self.count, dtype=np.int64)
        self.last = np.zeros(self.count, dtype=np.int64)
        self.before = np.full(self.count, -math.inf)
        self.ends = np.full(self.count, -math.inf)
        self.nominal = np.full(self.count, math.nan)
        self.covered = np.full(self.count, -math.inf)
        self.silent = np.zeros(self.count, dtype=bool)
        self._leaps = [_Leap() for _ in range(self.count)]
        self._nothing_missing = np.zeros(self.count, dtype=bool)

    def add(self, i: int, time: float, values: Array) -> str:
        """Let a sample, (6,), of IMU i wait; return why it cannot be taken, or nothing."""
        end = self.ends[i]
        if time > self.newest + FUTURE and self.newest > -math.inf and not self._leapt(i, time):
            return FUTURE_STAMPED
        self._leaps[i].end = math.inf
        if time < self.newest - FUTURE and self.now == -math.inf:
            self._forget()
            end = -math.inf
        if time <= end:
            return self._insert(i, time, values)
        if self.last[i] == self.stamps.shape[1]:
            self._make_room()
        self.even = False
        k = self.last[i]
        self.stamps[i, k] = time
        self.values[i, k] = values
        self.last[i] = k + 1
        if end <= self.now < time and not self.silent[i]:
            self.behind -= 1
        self.ends[i] = time
        self.silent[i] = False
        if time > self.newest:
            self.newest = time
        return ""

    def pass_through(self, time: float, values: Array) -> Epoch | None:
        """Return the epoch of samples of all IMUs with one stamp, (N, 6), if nothing waits and nothing is missing."""
        interval = time - self.now
        if not self.even or self.held or not 0.0 < interval <= USUAL * self.nominal[0]:
            return None
        self.now = self.newest = time
        self.before[:] = time
        self.ends[:] = time
        self.behind = self.count
        increments = values.T
        self.seen = (increments, interval)
        return Epoch(time, increments, self._nothing_missing)

    def epochs(self, at_end: bool = False) -> Iterator[Epoch]:
        """Yield the epochs that wait for nothing any longer; `at_end`, all for which all IMUs have data."""
        if self.now == -math.inf and not self._begin(at_end):
            return
        if self.behind and not at_end and self.newest < self.now + self.patience:
            return
        while (end := self._next_end(at_end)) is not None:
            yield from self._take(end)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all that is needed to go on, for a file."""
        found: dict[str, NDArray[Any]] = {name: getattr(self, name) for name in KEPT}
        found |= {"clock": np.array([self.now, self.newest]), "held": np.array(self.held)}
        found["leaps"] = np.array([(leap.begin, leap.end) for leap in self._leaps])
        if self.seen is not None:
            found |= {"increments": self.seen[0], "interval": np.array(self.seen[1])}
        return found

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Become the assembly whose arrays these are."""
        for name in KEPT:
            setattr(self, name, arrays[name].copy())
        self.now, self.newest = (float(time) for time in arrays["clock"])
        self.held = [(float(end), float(length)) for end, length in arrays["held"]]
        self._leaps = [_Leap(float(begin), float(end)) for begin, end in arrays["leaps"]]
        if "increments" in arrays:
            self.seen = (arrays["increments"], float(arrays["interval"]))
        if self.now > -math.inf:
            self._look()

    def _leapt(self, i: int, time: float) -> bool:
        """Whether IMU i has gone on for long at stamps which at first were too far ahead."""
        leap = self._leaps[i]
        steady = 0.0 < time - leap.end < FUTURE
        if not steady:
            leap.begin = time
        leap.end = time
        return steady and time - leap.begin > FUTURE

    def _insert(self, i: int, time: float, values: Array) -> str:
        """Put a sample before others that came earlier."""
        if time <= max(self.before[i], self.now):
            return DUPLICATED if time == self.before[i] else LATE
        first, last = self.first[i], self.last[i]
        k = first + int(np.searchsorted(self.stamps[i, first:last], time))
        if k < last and self.stamps[i, k] == time:
            return DUPLICATED
        if last == self.stamps.shape[1]:
            shift = self._make_room()[i]
            k, last = k - shift, last - shift
        self.stamps[i, k + 1 : last + 1] = self.stamps[i, k:last].copy()
        self.values[i, k + 1 : last + 1] = self.values[i, k:last].copy()
        self.stamps[i, k], self.values[i, k] = time, values
        self.last[i] = last + 1
        return ""

    def _forget(self) -> None:
        """Begin anew: what waits was stamped with a time that is still far off."""
        self.first[:] = self.last[:] = 0
        self.ends[:] = self.newest = -math.inf

    def _make_room(self) -> NDArray[np.int64]:
        """Move what waits to the front, with more room where that is not enough; return by how much."""
        shift = self.first.copy()
        for i in range(self.count):
            here = slice(self.first[i], self.last[i])
            waiting = self.last[i] - self.first[i]
            if self.first[i] > KNOWN_AFTER:
                self.nominal[i] = usual_interval(self.stamps[i, : self.first[i]])
            self.stamps[i, :waiting] = self.stamps[i, here].copy()
            self.values[i, :waiting] = self.values[i, here].copy()
        self.last -= shift
        self.first[:] = 0
        if 2 * self.last.max() > self.stamps.shape[1]:
            self.stamps = np.concatenate([self.stamps, np.zeros_like(self.stamps)], axis=1)
            self.values = np.concatenate([self.values, np.zeros_like(self.values)], axis=1)
        return shift

    def _begin(self, at_end: bool) -> bool:
        """Choose where the first epoch begins: where all IMUs have data."""
        waiting = self.last > self.first
        if not waiting.any():
            return False
        begin = self.stamps[waiting, 0].min()
        known = (self.last >= KNOWN_AFTER).all() and self.newest - begin > self.wait
        if not known and not at_end and self.newest - begin < LONGEST_BEGIN:
            return False
        for i, last in enumerate(self.last):
            self.nominal[i] = usual_interval(self.stamps[i, :last]) if last > 1 else math.nan
        if np.isnan(self.nominal).all():
            return False
        self.nominal[np.isnan(self.nominal)] = np.nanmax(self.nominal)
        self.before[waiting] = self.stamps[waiting, 0] - self.nominal[waiting]
        lead = int(np.flatnonzero(waiting)[0])
        stamps = self.stamps[lead, : self.last[lead]]
        earlier = stamps[stamps < self.stamps[waiting, 0].max()]
        self.now = float(earlier[-1] if len(earlier) else self.before[lead])
        self._look()
        return True

    def _next_end(self, at_end: bool) -> float | None:
        """Return where the next epoch ends, or None as long as that or its data may still come."""
        end = self._next_stamp(0, 0.0)
        nominal = self.nominal[0]
        if end - self.now > USUAL * nominal:
            if not at_end and self.newest < self.now + nominal + self.patience:
                return None
            if end - self.now > GAP * nominal:
                end = self._stamp_in_gap(end)
        if end == math.inf:
            return None
        if at_end:
            return None if (self.ends < end)[~self.silent].any() else end
        if self.newest < end + self.patience:
            covered_until(self.stamps, self.first, self.last, self.before, USUAL * self.nominal, self.covered)
            if (self.covered < end)[~self.silent].any():
                return None
        return end

    def _look(self) -> None:
        """Take note of who is there and how long to wait for the others."""
        self.behind = int(np.count_nonzero((self.ends <= self.now) & ~self.silent))
        self.even = bool((self.first == self.last).all() and (self.before == self.now).all())
        self.patience = max(self.wait, (GAP + USUAL) * float(self.nominal.max()))

    def _next_stamp(self, i: int, margin: float) -> float:
        first, last = self.first[i], self.last[i]
        while first < last and self.stamps[i, first] <= self.now + margin:
            first += 1
        return float(self.stamps[i, first]) if first < last else math.inf

    def _stamp_in_gap(self, end: float) -> float:
        """Return the next stamp of another IMU in a gap of the first one, which ends at `end`."""
        half = 0.5 * self.nominal[0]
        others = [self._next_stamp(i, half) for i in range(1, self.count)]
        inside = [stamp for stamp in others if stamp < end - half]
        for i, stamp in enumerate(others, 1):
            if stamp in inside and stamp - self.now <= GAP * self.nominal[i]:
                return stamp
        return min(inside, default=end)

    def _take(self, end: float) -> Iterator[Epoch]:
        increments, missing = np.empty((self.count, 6)), np.empty(self.count, dtype=bool)
        begin, self.now = self.now, end
        self.silent = self.ends < end
        waiting = Waiting(self.stamps, self.values, self.first, self.last, self.before)
        assemble(waiting, GAP * self.nominal, begin, end, increments, missing)
        self._look()
        increments = np.ascontiguousarray(increments.T)
        if not missing.any():
            yield from self._bridged(end - begin, Epoch(end, increments, missing))
        elif not self.bridge:
            increments[:, missing] = 0.0
            yield Epoch(end, increments, missing)
        elif missing.all():
            self.held.append((end, end - begin))
        else:
            increments[:, missing] = increments[:, ~missing].mean(axis=1, keepdims=True)
            yield from self._bridged(end - begin, Epoch(end, increments, missing))

    def _bridged(self, interval: float, epoch: Epoch) -> Iterator[Epoch]:
        """Yield the epochs without data, by the mean of the rates before and after them, and then this one."""
        if self.held:
            rates = epoch.increments / interval
            before = rates if self.seen is None else self.seen[0] / self.seen[1]
            nothing = np.ones(self.count, dtype=bool)
            for end, length in self.held:
                yield Epoch(end, 0.5 * (before + rates) * length, nothing)
            self.held.clear()
        self.seen = (epoch.increments, interval)
        yield epoch
