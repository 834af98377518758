"""Time stamps of a table: numbers in any unit, counters that start again, two columns, dates."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.formats.columns import OpenTable
from polyins.model.gps_time import DAY_S
from polyins.model.recording import Array

if TYPE_CHECKING:
    from polyins.config import FineTime, TimeColumn

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
WRAPPED = 0.5
"""of its range a counter goes back by when it starts again"""
ZONE = re.compile(r"\s*(Z|UTC|GMT|[+-]\d\d(?::?\d\d)?)$", re.IGNORECASE)
TIME_OF_DAY = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?")
DATE = re.compile(r"(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})|(\d{1,2})\.(\d{1,2})\.(\d{4})|(\d{4})(\d\d)(\d\d)(?!\d)")


def stamps(table: OpenTable, time: TimeColumn) -> Array:
    """Return the stamps of all rows, s, shape (T,); raises InputError for cells that hold none."""
    if time.dates:
        seconds = dates(table, time.name)
        if time.fine is None and _times_of_day(seconds):
            seconds = unwrapped(seconds, DAY_S)
        return seconds if time.fine is None else seconds + _fine(table, time.fine)
    (counts,) = table.numbers([time.name])
    if time.wraps_at is not None:
        counts = unwrapped(counts, time.wraps_at)
    seconds = counts * seconds_per_count(time)
    return seconds if time.fine is None else seconds + _fine(table, time.fine)


def seconds_per_count(time: TimeColumn | FineTime) -> float:
    """Return what one of a column of stamps is, s."""
    return SECONDS[time.unit] if time.tick_s is None else time.tick_s


def _fine(table: OpenTable, fine: FineTime) -> Array:
    if fine.dates:
        return dates(table, fine.name)
    (counts,) = table.numbers([fine.name])
    if fine.ticks_per_s is None:
        return counts * seconds_per_count(fine)
    (rate,) = table.numbers([fine.ticks_per_s])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(counts / rate)


def unwrapped(counts: Array, end: float) -> Array:
    """Return what a counter that starts again at `end` would show if it did not, shape (T,)."""
    with np.errstate(invalid="ignore"):
        steps = np.diff(counts, prepend=counts[:1])
        back, ahead = steps < -WRAPPED * end, steps > WRAPPED * end
    turns: NDArray[np.int64] = np.cumsum(back) - np.cumsum(ahead)
    return np.asarray(counts + turns * end)


def dates(table: OpenTable, column: str | int) -> Array:
    """Return dates as seconds since 1970, times of day as seconds since midnight, shape (T,)."""
    texts = table.texts(column)
    found = np.array([_date_or_nan(text) for text in texts])
    for row in np.flatnonzero(np.isnan(found) & (texts != ""))[:1]:
        raise InputError(
            f"{table.source.place(int(row))}: {str(texts[row])!r} is no date; expected one like "
            "2024-05-31 12:00:00.25, 31.05.2024 12:00:00 or 12:00:00"
        )
    return found


def seconds_of_date(text: str) -> float | None:
    """Return seconds since 1970, of a time of day alone seconds since midnight; None of any other text."""
    rest, ahead = text.strip().strip('"'), 0.0
    clock = TIME_OF_DAY.search(rest)
    date = DATE.match(rest)
    if clock is None and date is None:
        return None
    zone = ZONE.search(rest) if clock else None
    if zone is not None and zone[1][0] in "+-":
        digits = zone[1].replace(":", "").ljust(5, "0")
        ahead = float(digits[0] + "1") * (3600.0 * int(digits[1:3]) + 60.0 * int(digits[3:5]))
    seconds = 0.0
    if clock is not None:
        second = float((clock[3] or "0").replace(",", "."))
        seconds = 3600.0 * int(clock[1]) + 60.0 * int(clock[2]) + second
    if date is None:
        return seconds - ahead if clock is not None and clock.start() == 0 else None
    year, month, day = (int(part) for part in _year_first(date))
    try:
        midnight = np.datetime64(f"{year:04d}-{month:02d}-{day:02d}", "s")
    except ValueError:
        return None
    return float(midnight.astype("int64")) + seconds - ahead


def _year_first(date: re.Match[str]) -> tuple[str, str, str]:
    one, two, three = date.group(1, 2, 3), date.group(6, 5, 4), date.group(7, 8, 9)
    return next((a, b, c) for a, b, c in (one, two, three) if a is not None)


def _date_or_nan(text: str) -> float:
    found = seconds_of_date(text)
    return np.nan if found is None else found


def _times_of_day(seconds: Array) -> bool:
    known: NDArray[np.bool_] = np.isfinite(seconds)
    return bool((np.abs(seconds[known]) <= DAY_S).all())
