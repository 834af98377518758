"""What a reader of a log returns: streams by name, all on the log's one clock."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, intervals
from polyins.model.recording import Array

if TYPE_CHECKING:
    from collections.abc import Iterator

Clock = Literal["boot", "unix", "gps-week"]
"""what stamps count from: the start of the system, 1970 in UTC, the begin of the GPS week"""


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
    """axes of the IMUs are forward, right, down of the vehicle by the format's definition"""
    fix_age: float | None = None
    """by which fixes are older than their stamps, s; None: the log does not tell"""
    antenna: tuple[float, float, float] | None = None
    """from the IMUs: forward, right, down, m; None: the log does not tell"""
    notes: tuple[str, ...] = ()

    @property
    def streams(self) -> dict[str, ImuRows | Track | SensorRows]:
        """All of them."""
        return {**self.imus, **self.tracks, **self.sensors}


def needed(module: str, extra: str, path: Path) -> Any:
    """Import the library that a format is read with; raise InputError that says what to install without it."""
    try:
        return import_module(module)
    except ImportError:
        library = module.partition(".")[0]
        raise InputError(f"{path}: is read with {library}; expected pip install 'polyins[{extra}]'") from None


@contextmanager
def damage_named(path: Path, what: str) -> Iterator[None]:
    """Turn what a library raises over a damaged file into an InputError."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # libraries raise whatever they stumble over
        reason = str(error).strip() or type(error).__name__
        raise InputError(f"{path}: cannot be read as {what} ({reason.splitlines()[0]}); is it damaged?") from error


@contextmanager
def silenced() -> Iterator[None]:
    """Keep what a library prints, from Python or from C, off standard output and standard error."""
    with open(os.devnull, "w") as nowhere:
        kept = {number: os.dup(number) for number in (1, 2)}
        try:
            for number in kept:
                os.dup2(nowhere.fileno(), number)
            with redirect_stdout(nowhere), redirect_stderr(nowhere):
                yield
        finally:
            for number, was in kept.items():
                os.dup2(was, number)
                os.close(was)


def rates_to_rows(path: Path, name: str, time: Array, gyro: Array, force: Array) -> ImuRows:
    """Return rows of mean rates, rad/s, and specific forces, m/s^2, shape (T, 3), at their stamps, s."""
    steps = intervals(time)[:, None]
    source = RowSource(f"{path}, {name}")
    return ImuRows(source, time, gyro * steps, force * steps, gyro_unit="rad/s", accel_unit="m/s^2")


def counted(kinds: Iterable[Any], name_of: Callable[[Any], str]) -> dict[str, int]:
    """Return how many fixes there are of each kind, by name."""
    values, counts = np.unique(np.asarray(list(kinds)), return_counts=True)
    found: dict[str, int] = {}
    for value, count in zip(values, counts, strict=True):
        found[name_of(value)] = found.get(name_of(value), 0) + int(count)
    return found


def rising(time: Array) -> NDArray[np.intp]:
    """Return the rows whose stamp is above all before it, shape (K,)."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]])
    return np.flatnonzero(time > before)
