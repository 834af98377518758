"""The streams of a table without header: which columns hold what follows from physics, or is asked for.

Stamps rise evenly. Three neighbouring columns whose length is about the same most of the time, and 1 g in some unit,
are a specific force; three next to them whose mean is small beside their range are turn rates.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.formats.columns import OpenTable
from polyins.model.recording import Array
from polyins.model.rig import STANDARD_GRAVITY
from polyins.reading import likely_units as likely
from polyins.reading.doubts import Doubt
from polyins.reading.likely_units import Likely
from polyins.reading.sensor_columns import scaled
from polyins.reading.table_imus import described
from polyins.reading.table_stream import TableStream
from polyins.reading.time_columns import TimeGuess, guessed

MOST_SENSORS = 64
STEADY = 0.35
"""spread of the length of a specific force, relative to it, half of the time"""
LEAST_ROWS = 20
ASKEW = 0.3
"""against threes that do not begin where columns begin"""
UNLIKE = 0.2
"""against the logarithm of how the noise of three axes differs"""
CENTRED = 300.0
"""times the spread of turn rates their mean may be"""
NO_HEADER = Doubt("without a header, the columns are told by their values", "columns")


def streams_of(opened: OpenTable) -> list[TableStream]:
    """Return the IMUs of a table without header; raise InputError that names its columns if values do not tell them."""
    columns = opened.numbers(list(range(1, len(opened.names) + 1)))
    if len(columns) < 7 or len(columns[0]) < LEAST_ROWS:
        raise _untold(opened, columns)
    apart = _groups(columns)
    groups = [rows for _, rows in apart[1]] if apart else [np.arange(len(columns[0]))]
    time = _time(columns, groups, None if apart is None else apart[0])
    if time is None:
        raise _untold(opened, columns)
    used = {*time.column_numbers, *([] if apart is None else [apart[0]])}
    sensors = _sensors(columns, groups, used, time)
    if sensors is None:
        raise _untold(opened, columns)
    found = []
    gyro, accel, turning, force = sensors
    for number, rows in enumerate(groups):
        declared: dict[str, Any] = {
            "time": time.guess.of_rows(rows).column,
            "gyro": {"names": [n + 1 for n in gyro], "unit": turning.unit} | scaled(turning),
            "accel": {"names": [n + 1 for n in accel], "unit": force.unit} | scaled(force),
        }
        if apart is not None:
            declared["only"] = {"name": apart[0] + 1, "equal": apart[1][number][0]}
        found.append(described(opened, declared, [NO_HEADER, time.guess.doubt, force.doubt, turning.doubt]))
    return found


def _untold(opened: OpenTable, columns: list[Array]) -> InputError:
    ranges = (f"{n} {_range(column)}" for n, column in enumerate(columns, 1))
    return InputError(
        f"{opened.path}: has no header, and what its {len(columns)} columns hold ({'; '.join(ranges)}) is not clear; "
        "expected them declared by number, as columns: {time: {name: 1, unit: s}, gyro: {names: [2, 3, 4], "
        "unit: rad/s}, accel: {names: [5, 6, 7], unit: m/s^2}}"
    )


def _range(column: Array) -> str:
    known = column[np.isfinite(column)]
    return f"from {known.min():.6g} to {known.max():.6g}" if len(known) else "empty"


def _groups(columns: list[Array]) -> tuple[int, list[tuple[int, Any]]] | None:
    """Return the column of few whole numbers that tells IMUs apart, and the rows of each number."""
    for n, column in enumerate(columns):
        if not likely.are_whole(column) or not np.isfinite(column).all():
            continue
        values, counts = np.unique(column, return_counts=True)
        changes = float(np.mean(np.diff(column) != 0.0))
        if 2 <= len(values) <= MOST_SENSORS and counts.min() >= 5 and changes > 0.5 and counts.max() < 2 * counts.min():
            return n, [(int(value), np.flatnonzero(column == value)) for value in values]
    return None


class _Stamps:
    """The stamps, and the columns (from 0) that they are made of."""

    def __init__(self, guess: TimeGuess, column_numbers: tuple[int, ...]) -> None:
        self.guess = guess
        self.column_numbers = column_numbers


def _time(columns: list[Array], groups: list[Any], apart: int | None) -> _Stamps | None:
    """Return the column whose numbers rise by even steps, rather than by one, in each group of rows."""
    counter = None
    for n, column in enumerate(columns):
        if n == apart:
            continue
        if (ticks := _with_ticks(columns, n, groups)) is not None:
            return ticks
        found = guessed(n + 1, column[groups[0]] if len(groups) > 1 else column)
        steps = [np.diff(guessed(n + 1, column[rows]).seconds) for rows in groups]
        rising = all(float(np.mean(one > 0.0)) > 0.9 and float(np.mean(one >= 0.0)) > 0.99 for one in steps)
        if not rising or likely.time_unit(found.seconds, (5.0, 2e4)) != "s":
            continue
        if likely.are_whole(column) and bool((np.diff(column) == 1.0).all()):
            counter = counter or n
            continue
        whole = guessed(n + 1, column)
        return _Stamps(whole, (n,))
    return None


def _with_ticks(columns: list[Array], n: int, groups: list[Any]) -> _Stamps | None:
    """Return stamps of whole seconds, ticks since then, and the ticks that a second has, in three columns."""
    if n + 2 >= len(columns):
        return None
    seconds, ticks, rate = columns[n : n + 3]
    if not (likely.are_whole(seconds) and likely.are_whole(ticks) and float(np.median(rate)) > 1e3):
        return None
    even = float(np.ptp(rate)) < 0.05 * float(np.median(rate))
    inside = float(np.mean((ticks >= 0.0) & (ticks < 1.1 * rate)))
    steady = set(np.unique(np.diff(seconds[groups[0]]))) <= {0.0, 1.0}
    if not (even and inside > 0.99 and steady):
        return None
    column = {"name": n + 1, "unit": "s", "fine": {"name": n + 2, "ticks_per_s": n + 3}}
    return _Stamps(TimeGuess(column, seconds + ticks / rate), (n, n + 1, n + 2))


Sensors = tuple[tuple[int, int, int], tuple[int, int, int], Likely, Likely]


def _sensors(columns: list[Array], groups: list[Any], used: set[int], time: _Stamps) -> Sensors | None:
    """Return the columns of gyro and accelerometer, from 0, and their units; None if they are not clear."""
    triples = [(n, n + 1, n + 2) for n in range(len(columns) - 2) if not {n, n + 1, n + 2} & used]
    stamps = time.guess.of_rows(groups[0]).seconds
    steps = np.diff(stamps)
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    found: list[tuple[float, Sensors]] = []
    for accel in triples:
        parts = [np.column_stack([columns[n][rows] for n in accel]) for rows in groups]
        unit = likely.accel_unit(parts[0], step, parts[1:])
        if unit is None or not all(map(_steady, parts)):
            continue
        size = float(np.median([likely.typical_size(part) for part in parts]))
        off = abs(float(np.log(size * _si(unit, step) / STANDARD_GRAVITY)))
        for gyro in triples:
            if abs(gyro[0] - accel[0]) != 3:
                continue
            rates = np.column_stack([columns[n][groups[0]] for n in gyro])
            apart = ASKEW * ((min(gyro[0], accel[0]) - _begin(min(gyro[0], accel[0]), used)) % 3 > 0)
            turning = likely.gyro_unit(rates, parts[0], step, unit)
            unlike = _unlike(rates) + _unlike(parts[0])
            found.append((off + apart + unlike + _off_centre(rates), (gyro, accel, turning, unit)))
    return min(found, key=lambda one: one[0])[1] if found else None


def _begin(column: int, used: set[int]) -> int:
    """Return the first of the columns that lie together with one."""
    while column > 0 and column - 1 not in used:
        column -= 1
    return column


def _unlike(values: Array) -> float:
    """Return how far three axes, shape (T, 3), are from the same noise, as those of one sensor have, from 0 to 1."""
    noise = np.nanstd(np.diff(values, 2, axis=0), axis=0)
    return 1.0 if not noise.min() > 0.0 else min(1.0, UNLIKE * float(np.log(noise.max() / noise.min())))


def _off_centre(values: Array) -> float:
    """Return how far, from 0 to 1, vectors are from turn rates, which lie around zero."""
    middle = np.nanmedian(values, axis=0)
    spread = float(np.nanquantile(np.linalg.norm(values - middle, axis=1), 0.9))
    return min(1.0, float(np.linalg.norm(middle)) / (CENTRED * spread)) if spread > 0.0 else 1.0


def _si(unit: Likely, step: float) -> float:
    return unit.scale * {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "m/s": 1.0 / step if step else np.nan}[unit.unit]


def _steady(vectors: Array) -> bool:
    sizes = np.linalg.norm(vectors, axis=1)
    low, middle, high = np.nanquantile(sizes, [0.25, 0.5, 0.75])
    return bool(middle > 0.0 and (high - low) < STEADY * middle)
