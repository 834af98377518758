"""Faults of a receiver of positions, and of its clock."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from polyins.model.gps_time import WEEK_S
from polyins.model.recording import Recording
from polyins.studies.robustness.fault import Array, Draw, Fault, Mask, during, fixes, moved, with_fixes, with_gnss

OFF = ("jump", "reset", "rejected")
DELAY = ("delay", "clock")
PLACE = ("place", "jump")
UNITS = ("units",)
FOOT = 0.3048


def _jump(recording: Recording, draw: Draw, *, sizes: tuple[float, float], length: float) -> Recording:
    return moved(recording, during(recording, draw.at, length), draw.between(*sizes) * draw.direction())


def _wander(recording: Recording, draw: Draw, *, rates: tuple[float, float], length: float) -> Recording:
    where = during(recording, draw.at, length)
    since = fixes(recording).time[where] - draw.at
    return moved(recording, where, np.outer(draw.between(*rates) * since, draw.direction()))


def _std(recording: Recording, _: Draw, *, factor: float) -> Recording:
    return with_gnss(recording, position_std=fixes(recording).position_std * factor)


def _std_is(recording: Recording, draw: Draw, *, value: float, length: float = np.inf) -> Recording:
    std = fixes(recording).position_std.copy()
    std[during(recording, draw.at, length)] = value
    return with_gnss(recording, position_std=std)


def _noise(recording: Recording, draw: Draw, *, sizes: tuple[float, float], length: float) -> Recording:
    where = during(recording, draw.at if np.isfinite(length) else -np.inf, length if np.isfinite(length) else np.inf)
    return moved(recording, where, draw.rng.normal(0.0, draw.between(*sizes), (int(where.sum()), 3)))


def _repeat(recording: Recording, draw: Draw, *, length: float) -> Recording:
    where = during(recording, draw.at, length)
    position = fixes(recording).position.copy()
    position[where] = position[int(np.argmax(where)) - 1]
    return with_gnss(recording, position=position)


def _values(
    recording: Recording, draw: Draw, *, length: float, change: Callable[[Array], Array], always: bool = False
) -> Recording:
    """Change the positions of some fixes, shape (M, 3), rad and m."""
    where = during(recording, -np.inf if always else draw.at, np.inf if always else length)
    position = fixes(recording).position.copy()
    position[where] = change(position[where])
    return with_gnss(recording, position=position)


def _constant(position: Array, *, values: tuple[float | None, ...]) -> Array:
    for k, value in enumerate(values):
        if value is not None:
            position[:, k] = value
    return position


def _swapped(position: Array) -> Array:
    return position[:, [1, 0, 2]]


def _times(position: Array, *, factor: float) -> Array:
    return position * [1.0, 1.0, factor]


def _angles_times(position: Array, *, factor: float) -> Array:
    return position * [factor, factor, 1.0]


def _late(recording: Recording, draw: Draw, *, by: float, always: bool) -> Recording:
    time = fixes(recording).time
    return with_gnss(recording, time=np.where((time >= draw.at) | always, time + by, time))


def _exchanged(recording: Recording, draw: Draw) -> Recording:
    stream, row = fixes(recording), int(np.argmax(fixes(recording).time >= draw.at))
    order = np.arange(len(stream.time))
    order[[row, row + 1]] = order[[row + 1, row]]
    return with_gnss(recording, time=stream.time[order], position=stream.position[order])


def _repeated_stamp(recording: Recording, draw: Draw) -> Recording:
    time = fixes(recording).time.copy()
    row = int(np.argmax(time >= draw.at))
    time[row] = time[row - 1]
    return with_gnss(recording, time=time)


def _gone(recording: Recording, draw: Draw) -> Recording:
    kept: Mask = ~during(recording, draw.at)
    return with_fixes(recording, kept)


def _is(*values: float | None) -> Callable[[Array], Array]:
    return partial(_constant, values=values)


def _gnss(name: str, inject: Callable[[Recording, Draw], Recording], kinds: tuple[str, ...], *words: str) -> Fault:
    return Fault(name, "gnss", inject, kinds, words)


def _clock(name: str, by: float, always: bool) -> Fault:
    return Fault(name, "clock", partial(_late, by=by, always=always), DELAY, ("clock", "late", "week"))


NEAR_ZERO = np.radians(1e-7)

FAULTS = (
    *(
        _gnss(f"jump of {low:g} to {high:g} m for {length:g} s", partial(_jump, sizes=(low, high), length=length), OFF)
        for low, high in ((2.0, 5.0), (7.0, 15.0), (50.0, 150.0))
        for length in (1.0, 5.0, 18.0)
    ),
    *(
        _gnss(f"jump of {low:g} to {high:g} m for good", partial(_jump, sizes=(low, high), length=np.inf), OFF)
        for low, high in ((2.0, 5.0), (7.0, 15.0), (50.0, 150.0))
    ),
    _gnss("wanders off by 0.1 to 0.3 m/s for 60 s", partial(_wander, rates=(0.1, 0.3), length=60.0), OFF),
    _gnss("std too small by 100", partial(_std, factor=0.01), ("noise", "innovations", *OFF), "std"),
    _gnss("std too large by 100", partial(_std, factor=100.0), ("too modest",), "std"),
    _gnss("noise 1 m, for good", partial(_noise, sizes=(0.7, 1.5), length=np.inf), ("noise",)),
    _gnss("noise 3 m, for 60 s", partial(_noise, sizes=(2.0, 5.0), length=60.0), ("noise",)),
    _gnss("std zero", partial(_std_is, value=0.0), (), "std"),
    _gnss("std negative", partial(_std_is, value=-1.0), (), "std"),
    _gnss("std 1e-12", partial(_std_is, value=1e-12), ("noise", *OFF), "std"),
    _gnss("std 1e30", partial(_std_is, value=1e30), (), "std"),
    _gnss("repeated position for 5 s", partial(_repeat, length=5.0), ("frozen",)),
    _gnss("repeated position for 10 s", partial(_repeat, length=10.0), ("frozen",)),
    _gnss("repeated stamp", _repeated_stamp, (), "repeated"),
    _gnss("two fixes in wrong order", _exchanged, (), "increasing"),
    _gnss(
        "latitude and longitude swapped", partial(_values, length=np.inf, change=_swapped, always=True),
        (), "latitude",
    ),
    _gnss("latitude and longitude swapped for 5 s", partial(_values, length=5.0, change=_swapped), PLACE, "latitude"),
    _gnss("height in feet for 10 s", partial(_values, length=10.0, change=partial(_times, factor=1.0 / FOOT)), UNITS),
    _gnss("angles 1e-7 deg for 5 s", partial(_values, length=5.0, change=_is(NEAR_ZERO, NEAR_ZERO, None)), ("place",)),
    _gnss("angles times 1e7 for 5 s", partial(_values, length=5.0, change=partial(_angles_times, factor=1e7)),
          PLACE, "latitude"),
    _gnss("height in mm for 5 s", partial(_values, length=5.0, change=partial(_times, factor=1e3)), UNITS, "height"),
    _gnss("NaN in one fix", partial(_values, length=1.0, change=_is(np.nan, np.nan, np.nan)), (), "number"),
    _gnss("NaN for 10 s", partial(_values, length=10.0, change=_is(np.nan, np.nan, np.nan)), (), "number"),
    _gnss("(0, 0) in one fix", partial(_values, length=1.0, change=_is(0.0, 0.0, None)), PLACE, "latitude"),
    _gnss("(0, 0, 0) in one fix", partial(_values, length=1.0, change=_is(0.0, 0.0, 0.0)), PLACE, "latitude"),
    _gnss("latitude 91", partial(_values, length=1.0, change=_is(np.radians(91.0), None, None)), PLACE, "latitude"),
    _gnss("height 1e6 in one fix", partial(_values, length=1.0, change=_is(None, None, 1e6)), PLACE, "height"),
    _gnss("height 1e30 for 10 s", partial(_values, length=10.0, change=_is(None, None, 1e30)), PLACE, "height"),
    _gnss("gone", _gone, ("outage",)),
    _clock("fixes 0.2 s late", 0.2, True),
    _clock("fixes 1 s late", 1.0, True),
    _clock("fixes 18 s late", 18.0, True),
    _clock("fixes 18 s early", -18.0, True),
    _clock("from then on 18 s late", 18.0, False),
    _clock("from then on 1 s late", 1.0, False),
    _clock("week rolls over", WEEK_S, False),
    _clock("week rolls back", -WEEK_S, False),
    _clock("a week late", WEEK_S, True),
)  # fmt: skip
