"""What a reader of a log returns: streams by name, all on the log's one clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, intervals
from polyins.model.axes import Axes
from polyins.model.recording import Array

if TYPE_CHECKING:
    from collections.abc import Iterator

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


def needed(module: str, extra: str, path: str | Path, use: str = "read") -> Any:
    """Import the library that a format needs; raise InputError that says what to install without it."""
    try:
        return import_module(module)
    except ImportError:
        library = module.partition(".")[0]
        raise InputError(f"{path}: is {use} with {library}; expected pip install 'polyins[{extra}]'") from None


@contextmanager
def damage_named(path: Path, what: str, remedy: str = "") -> Iterator[None]:
    """Turn what a library raises over a damaged file into an InputError; `remedy`: what could mend it."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # libraries raise whatever they stumble over
        reason = str(error).strip() or type(error).__name__
        raise InputError(
            f"{path}: cannot be read as {what} ({reason.splitlines()[0]}); is it damaged?{remedy}"
        ) from error


def rates_to_rows(path: Path, name: str, time: Array, gyro: Array, force: Array) -> ImuRows:
    """Return rows of mean rates, rad/s, and specific forces, m/s^2, shape (T, 3), at their stamps, s."""
    steps = intervals(time)[:, None]
    source = RowSource(f"{path}, {name}")
    return ImuRows(source, time, gyro * steps, force * steps, gyro_unit="rad/s", accel_unit="m/s^2")


@contextmanager
def heard() -> Iterator[list[str]]:
    """Give a list that what a library prints inside becomes one note of: standard output is not the library's."""
    notes: list[str] = []
    said = StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        yield notes
    lines = list(dict.fromkeys(line.strip() for line in said.getvalue().splitlines() if line.strip()))
    if lines:
        more = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
        notes.append(f"its library says: {lines[0]}{more}")


def joined_rates(path: Path, name: str, gyro: Array, force: Array) -> ImuRows:
    """Return rows at the gyro's stamps, where the accelerometer has one within an interval.

    `gyro`: s, and rad/s, shape (T, 4); `force`: s, and m/s^2, shape (K, 4); stamps rise.
    """
    interval = float(np.median(np.diff(gyro[:, 0]))) if len(gyro) > 1 else 0.0
    later = np.clip(np.searchsorted(force[:, 0], gyro[:, 0]), 1, len(force) - 1)
    away = np.minimum(np.abs(force[later, 0] - gyro[:, 0]), np.abs(force[later - 1, 0] - gyro[:, 0]))
    kept = gyro[away <= interval]
    forces = np.column_stack([np.interp(kept[:, 0], force[:, 0], axis) for axis in force[:, 1:].T])
    return rates_to_rows(path, name, kept[:, 0], kept[:, 1:], forces)


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


def rising(time: Array) -> NDArray[np.intp]:
    """Return the rows whose stamp is above all before it, shape (K,)."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]])
    return np.flatnonzero(time > before)
