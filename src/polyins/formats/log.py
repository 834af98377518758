"""What a reader of a log returns: streams by name, all on the log's one clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from polyins.formats.rows import ImuRows, SensorRows, Track
from polyins.model.axes import Axes
from polyins.model.recording import Array

Clock = Literal["boot", "unix", "gps-week", "local-time", "unknown"]
"""what stamps count from: the start of the system, 1970 in UTC, the begin of the GPS week, 1970 in a time zone that the
log does not tell, or what the log does not tell"""


@dataclass(frozen=True)
class Log:
    """The streams of a log, by the names that the log has for them."""

    clock: Clock
    imus: Mapping[str, ImuRows]
    tracks: Mapping[str, Track]
    sensors: Mapping[str, SensorRows]
    unusable: Mapping[str, str] = field(default_factory=dict)
    """why streams among these are not to be navigated with"""
    utc_of_zero: float | None = None
    """Unix time at which the clock shows zero, s, where the log tells it"""
    upright: bool = False
    """axes of the IMUs, or what `axes` makes of them, are forward, right, down of the vehicle by the format's
    definition"""
    axes: Mapping[str, Axes] = field(default_factory=dict)
    """by IMU, which of its axes point along those that all of the log's share; without: its own"""
    points: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    """by stream, where it is, in the axes that the IMUs share, m"""
    noise: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """by IMU, the random walks that the log states, rad/sqrt(s) and m/s/sqrt(s)"""
    references: frozenset[str] = frozenset()
    """tracks that another system estimated: to be compared with, not measurements"""
    fix_age: float | None = None
    """by which fixes are older than their stamps, s; None: the log does not tell"""
    antenna: tuple[float, float, float] | None = None
    """from the IMUs: forward, right, down, m; None: the log does not tell"""
    notes: tuple[str, ...] = ()
    clock_offsets: Mapping[str, float] = field(default_factory=dict)
    """what was added to the stamps of streams whose sensor has a clock of its own, s"""

    def moved(self, shift: float) -> Log:
        """Return the log on a clock that shows so much more, s."""

        def of(streams: Mapping[str, Any]) -> dict[str, Any]:
            return {name: replace(rows, time=rows.time + shift) for name, rows in streams.items()}

        zero = None if self.utc_of_zero is None else self.utc_of_zero - shift
        streams = of(self.imus), of(self.tracks), of(self.sensors)
        return replace(self, imus=streams[0], tracks=streams[1], sensors=streams[2], utc_of_zero=zero)

    @property
    def streams(self) -> dict[str, ImuRows | Track | SensorRows]:
        """All of them."""
        return {**self.imus, **self.tracks, **self.sensors}


def counted(kinds: Iterable[Any], name_of: Callable[[Any], str]) -> dict[str, int]:
    """Return how many fixes there are of each kind, by name."""
    values, counts = np.unique(np.asarray(list(kinds)), return_counts=True)
    found: dict[str, int] = {}
    for value, count in zip(values, counts, strict=True):
        found[name_of(value)] = found.get(name_of(value), 0) + int(count)
    return found


def fastest(apart: Array) -> float:
    """Return the most of UTC less stamps, s: a fix is stamped late, never early; one a second off tells no UTC yet."""
    return float(apart[np.abs(apart - np.median(apart)) < 1.0].max())
