"""What wheels give: how far they rolled in each epoch, and when a mean speed is measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from polyins.aiding import kinds
from polyins.model.recording import FilterOptions
from polyins.model.rig import Rig

Array = NDArray[np.float64]

Scheduled = list[tuple[int, int, float]]
"""epoch, kind and first number of the value of each event, in the order in which they are applied"""


def travel(
    rig: Rig, speed: Sequence[Sequence[int]], increments: Array, intervals: Array, missing: NDArray[np.bool_],
    start_bias: Array,
) -> Array:  # fmt: skip
    """Return what the wheels rolled in each interval and where the mean of those that speak is, m; what each rolled.

    Shape (T, 2 + modules); NaN where none, or that one, speaks.
    v = -r w_x, with the rate as the gyro shows it less its bias at the start; chips of a module are averaged.
    `speed`: the modules; `increments` is (T, 6, N), `intervals` (T,), `missing` (T, N), `start_bias` (N, 3).
    """
    total, places, count = np.zeros(len(intervals)), np.zeros(len(intervals)), np.zeros(len(intervals))
    each = []
    for module in speed:
        rolled = np.zeros(len(intervals))
        speaks = np.ones(len(intervals), dtype=bool)
        for i in module:
            wheel = rig.imus[i].wheel
            assert wheel is not None
            rolled -= wheel.radius * (increments[:, 0, i] - start_bias[i, 0] * intervals) / len(module)
            speaks &= ~missing[:, i]
        total += np.where(speaks, rolled, 0.0)
        places += np.where(speaks, rig.imus[module[0]].position[1], 0.0)
        count += speaks
        each.append(np.where(speaks, rolled, np.nan))
    with np.errstate(invalid="ignore", divide="ignore"):
        lateral = np.where(count > 0, places / count, 0.0)
        return np.ascontiguousarray(np.column_stack([np.where(count > 0, total / count, np.nan), lateral, *each]))


def mean_radius(rig: Rig, speed: Sequence[Sequence[int]]) -> float:
    """Return the mean radius of the wheels that give the speed, m; 0 without wheels."""
    wheels = [[rig.imus[i].wheel for i in module] for module in speed]
    return float(np.mean([np.mean([one.radius for one in module if one]) for module in wheels])) if wheels else 0.0


LONGEST = 0.2
"""s: an epoch that is longer ends a pause"""


class Schedule:
    """When a bank measures by itself: its wheels' speed, standstills, where its blocks are to each other, no slip.

    Epochs come in pieces of any length.
    """

    def __init__(self, start: float, options: FilterOptions, *, wheels: bool, several: bool, compared: bool) -> None:
        """`start`: s; `wheels`: whether some give the speed; `several`: whether there are several blocks to compare.

        `compared`: whether the IMUs of a block are compared with their mean.
        """
        self._options = options.rolling
        self._assumed = options.nonholonomic
        self._rest = None if wheels else options.standstill
        self._wheels = wheels
        self._several = several
        self._compared = options.relative_interval if compared else None
        self._last_speed = self._last_point = self._last_assumed = self._last_compared = start
        self._open = False
        if self._rest is not None:
            # the first window begins at once, as long as it is known that a start is one at rest
            self._last_speed = start - self._rest.interval

    @property
    def memory(self) -> tuple[float, float, float, float, bool]:
        """When it last measured speed, reference point and no slip, compared IMUs, s, and whether a window is open."""
        return self._last_speed, self._last_point, self._last_assumed, self._last_compared, self._open

    @memory.setter
    def memory(self, value: tuple[float, float, float, float, bool]) -> None:
        self._last_speed, self._last_point, self._last_assumed, self._last_compared, self._open = value

    def events(self, time: Array, intervals: Array, lateral: Array) -> Scheduled:
        """Return what is due in further epochs: stamps, s, their intervals, and the place of the speed there, (T,)."""
        # an event is at the epoch that is nearest to its time; how long a pause was says nothing of the next epoch
        reach = np.maximum.accumulate(time + 0.5 * np.minimum(intervals, LONGEST))
        found = self._speeds(time, reach, lateral) if self._wheels else []
        if self._several:
            found += self._every(time, reach, "_last_point", self._options.constraint_interval, kinds.REFERENCE_POINT)
        if self._rest is not None:
            found += self._rests(time, reach, self._rest.interval)
        if self._assumed is not None:
            found += self._every(time, reach, "_last_assumed", self._assumed.interval, kinds.ODOMETER)
        if self._compared is not None:
            found += self._every(time, reach, "_last_compared", self._compared, kinds.DEVIATIONS)
        return sorted(found, key=lambda event: event[0])

    def _speeds(self, time: Array, reach: Array, lateral: Array) -> Scheduled:
        found: Scheduled = []
        interval, window = self._options.speed_interval, self._options.speed_window
        k = 0
        while True:
            wanted = self._last_speed + interval - (0.0 if self._open else window)
            k = max(k, int(np.searchsorted(reach, wanted)))
            if k >= len(time):
                return found
            if self._open:
                # the window's rates were corrected by the errors as they still are: they come before the velocity
                if self._options.standstill:
                    found += [(k, kinds.ZERO_RATE, 0.0), (k, kinds.ZERO_VELOCITY, 0.0)]
                found.append((k, kinds.WHEEL_SPEED, 0.0))
                self._last_speed, self._open = float(time[k]), False
            else:
                found.append((k, kinds.WINDOW, float(lateral[k])))
                self._open = True
                k += 1

    def _every(self, time: Array, reach: Array, last: str, interval: float, kind: int) -> Scheduled:
        """Return events of a kind, one each interval after the one whose time the attribute `last` has."""
        found: Scheduled = []
        k = -1
        while (k := max(k + 1, int(np.searchsorted(reach, getattr(self, last) + interval)))) < len(time):
            found.append((k, kind, 0.0))
            setattr(self, last, float(time[k]))
        return found

    def _rests(self, time: Array, reach: Array, interval: float) -> Scheduled:
        """Judge one window after the other; each begins where the one before ends."""
        found: Scheduled = []
        k = -1
        while (k := max(k + 1, int(np.searchsorted(reach, self._last_speed + interval)))) < len(time):
            if self._open:
                found += [(k, kinds.ZERO_RATE, 0.0), (k, kinds.ZERO_VELOCITY, 0.0)]
            found.append((k, kinds.WINDOW, 0.0))
            self._last_speed, self._open = float(time[k]), True
        return found
