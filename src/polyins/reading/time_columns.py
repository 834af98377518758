"""Which columns of a table hold the stamps, in which unit, and whether they are counters that start again."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.config import TimeColumn
from polyins.errors import InputError
from polyins.formats.columns import OpenTable
from polyins.formats.stamps import SECONDS, seconds_of_date, stamps, unwrapped
from polyins.model.recording import Array
from polyins.reading import column_names as said
from polyins.reading import likely_units as likely
from polyins.reading.column_names import named, parsed, sensor_axis
from polyins.reading.doubts import Doubt

RANGES = (604800.0, 604800e3, 2.0**16, 2.0**24, 2.0**31, 2.0**32, 2.0**31 / 1000, 2.0**32 / 1000, 60.0, 3600.0, 1e9)
"""counts at which counters start again; those of seconds with fractions among them"""
FIRST_COLUMNS = 3
LEAST_ROWS = 20
RATES_HZ = (likely.SLOWEST_FIX_HZ, likely.LIKELY_RATES_HZ[1])
SECONDS_NAME = r"(?P<of>.*?)(seconds|secs|sec|s)"


@dataclass(frozen=True)
class TimeGuess:
    """The section `time` of the columns, what it comes to, and why to check it."""

    column: dict[str, Any]
    seconds: Array
    """shape (T,)"""
    doubt: Doubt | None = None
    counts: Array | None = field(default=None, compare=False)
    """of a single column whose unit no name says"""

    def of_rows(self, rows: Any) -> TimeGuess:
        """Return the stamps of some rows, whose rate may tell another unit."""
        if self.counts is None:
            return replace(self, seconds=self.seconds[rows])
        return guessed(self.column["name"], self.counts[rows])

    def at_rates(self, rates: tuple[float, float]) -> TimeGuess:
        """Return the stamps of rows that come at such rates, Hz."""
        return self if self.counts is None else guessed(self.column["name"], self.counts, rates)


def time_column(opened: OpenTable) -> TimeGuess | None:
    """Return the stamps that the names of columns tell, or None."""
    two = _in_two_columns(opened)
    if two is not None:
        return _read(opened, two)
    names = [
        *named(opened.names, said.TIME, "|".join(said.TIME_UNITS)),
        *named(opened.names, rf".*_({said.TIME_BEHIND})"),
    ]
    for name in dict.fromkeys(names):
        if _holds_dates(opened, name):
            return _read(opened, _with_time_of_day(opened, name, names))
        counts = _numbers(opened, name)
        if counts is None or not np.isfinite(counts).any():
            continue
        found = guessed(name, counts)
        if len(counts) < 2 or (np.diff(found.seconds) > 0.0).any():
            return found
    return _unnamed(opened)


def _unnamed(opened: OpenTable) -> TimeGuess | None:
    """Return one of the first columns as stamps if its numbers rise evenly, whatever it is called."""
    for name in [name for name in opened.names[:FIRST_COLUMNS] if name]:
        counts = _numbers(opened, name)
        if counts is None or len(counts) < LEAST_ROWS or sensor_axis(name) is not None:
            continue
        found = guessed(name, counts)
        steps = np.diff(found.seconds)
        if (steps > 0.0).all() and np.median(np.abs(steps - np.median(steps))) < 0.2 * np.median(steps):
            return replace(found, doubt=Doubt(f"the stamps are taken to be in {name}, which rises evenly", "stamps"))
    return None


def guessed(name: str | int, counts: Array, rates: tuple[float, float] = likely.LIKELY_RATES_HZ) -> TimeGuess:
    """Return the stamps of a column of numbers, by its name and by the rate that they make."""
    column: dict[str, Any] = {"name": name}
    end = wraps_at(counts)
    whole = counts if end is None else unwrapped(counts, end)
    stated = said.time_unit_of(name) if isinstance(name, str) else None
    unit = stated or likely.time_unit(whole, rates) or likely.time_unit(whole, RATES_HZ)
    doubt = None
    if stated is not None and not _likely(whole, stated):
        other = likely.time_unit(whole, likely.LIKELY_RATES_HZ)
        text = f"stamps of {name} make an unlikely rate in {stated}" + (f"; is it {other}?" if other else "")
        doubt = Doubt(text, "stamps")
    column["unit"] = unit or "s"
    if end is not None:
        column["wraps_at"] = end
    return TimeGuess(column, whole * SECONDS[unit or "s"], doubt, None if stated else counts)


def _likely(counts: Array, unit: str) -> bool:
    steps = np.diff(counts)
    steps = steps[steps > 0.0]
    return not len(steps) or RATES_HZ[0] <= 1.0 / (float(np.median(steps)) * SECONDS[unit]) <= RATES_HZ[1] * 4


def wraps_at(counts: Array) -> float | None:
    """Return the count at which a counter starts again, if it does: it goes from the end of a range to its begin."""
    known = counts[np.isfinite(counts)]
    steps = np.diff(known)
    back = np.flatnonzero(steps < 0.0)
    if not len(back) or len(back) > 0.01 * len(known) + 1:
        return None
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    for end in sorted(RANGES):
        if known.max() >= end or known.min() < 0.0:
            continue
        ahead = steps[back] + end
        if (steps[back] < -0.5 * end).all() and (ahead > 0.0).all() and float(np.median(ahead)) <= 100.0 * usual:
            return end
    return None


def _numbers(opened: OpenTable, name: str) -> Array | None:
    try:
        return opened.numbers([name])[0]
    except InputError:
        return None


def _read(opened: OpenTable, column: dict[str, Any]) -> TimeGuess:
    return TimeGuess(column, stamps(opened, TimeColumn.model_validate(column)))


def _in_two_columns(opened: OpenTable) -> dict[str, Any] | None:
    """Return seconds and what is beyond them, where two columns have such names."""
    plain = {parsed(name).plain: name for name in opened.names if name}
    for one, name in plain.items():
        match = re.fullmatch(SECONDS_NAME, one)
        for other, fine in plain.items() if match else ():
            of = match["of"] if match else ""
            unit = said.TIME_UNITS.get(other.removeprefix(of).strip("_")) if other.startswith(of) else None
            if unit not in (None, "s") and _is_rest(opened, name, fine, str(unit)):
                return {"name": name, "unit": "s", "fine": {"name": fine, "unit": unit}}
    return None


def _is_rest(opened: OpenTable, coarse: str, fine: str, unit: str) -> bool:
    whole, rest = _numbers(opened, coarse), _numbers(opened, fine)
    if whole is None or rest is None:
        return False
    small = (rest[np.isfinite(rest)] * SECONDS[unit] < 1.0).all()
    return bool(likely.are_whole(whole) and small and np.isfinite(rest).any())


def _holds_dates(opened: OpenTable, name: str) -> bool:
    counts = _numbers(opened, name)
    if counts is not None:
        return False
    texts: NDArray[np.str_] = opened.texts(name)
    return any(text and seconds_of_date(str(text)) is not None for text in texts[:20])


def _with_time_of_day(opened: OpenTable, name: str, names: Sequence[str]) -> dict[str, Any]:
    """Return dates; those of a day alone with the column of the time of day."""
    texts = opened.texts(name)
    if not any(":" in str(text) for text in texts[:20]):
        for other in names:
            if other != name and any(":" in str(text) for text in opened.texts(other)[:20]):
                return {"name": name, "dates": True, "fine": {"name": other, "dates": True}}
    return {"name": name, "dates": True}
