"""Rows that are no data: what is no number, stamps that do not go on, values beyond the range of any sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.checks.stream_checks import GRAVITY_M_S2
from polyins.errors import InputError
from polyins.formats.rows import ImuRows, intervals, without
from polyins.model.findings import Finding
from polyins.model.recording import Array
from polyins.prepare.plausible import Limits

LEAP = 1.0
"""s ahead of the row before: such a stamp is not believed if rows after it are back"""
AFTER = 64
"""rows after it that are looked at"""
FEW = 0.01
"""Share of rows beyond the range up to which the unit is not to blame."""
IMPOSSIBLE = 1e6
"""times the range: no unit that is mistaken for another makes so much of a value"""
APART = 1.0
"""s between rows that are told apart"""
MOST_NAMED = 5
"""stretches of one IMU that are named each by itself"""
REMEDIES = {
    "not a number": "look at its cable and at what logged it",
    "stamps": "give rate_hz if its rows are even and its stamps are not",
    "out of range": "look at its cable, its supply and at what logged it",
    "zeros": "look at its cable and its supply",
    "frozen": "look at its driver: it repeats what it read last",
}


def without_nonsense(rows: ImuRows, name: str, clock_offset: float) -> tuple[ImuRows, tuple[Finding, ...]]:
    """Leave out rows that are not all numbers and whose stamps do not go on; returns findings that name IMU and spans.

    `clock_offset`, s, puts the times in them on the recording's clock.
    """
    numbers = np.isfinite(rows.time) & np.isfinite(rows.dtheta).all(axis=1) & np.isfinite(rows.dvel).all(axis=1)
    good = numbers.copy()
    good[numbers] = in_order(rows.time[numbers])
    if good.all():
        return rows, ()
    time = _filled(rows.time, good) + clock_offset
    place = f"{rows.source.path}: IMU {name}"
    found = (
        *left_out("not a number", f"{place} has rows that are not all numbers", time, ~numbers, name),
        *left_out("stamps", f"{place} has stamps that are repeated, go back or leap", time, numbers & ~good, name),
    )
    return without(rows, ~good), found


def within_any_range(
    rows: ImuRows, name: str, clock_offset: float, limits: Limits
) -> tuple[ImuRows, tuple[Finding, ...]]:
    """Leave out rows whose values no sensor has; as `without_nonsense`. Raises InputError for a gyro's wrong unit."""
    if len(rows.time) < 2:
        return rows, ()
    steps = intervals(rows.time)[:, None]
    rate, force = (np.abs(block / steps).max(axis=1) for block in (rows.dtheta, rows.dvel))
    fast, hard = rate > limits.rate, force > limits.force
    if not (fast.any() or hard.any()):
        return rows, ()
    often = np.count_nonzero(fast & (rate < IMPOSSIBLE * limits.rate))
    if often > max(1.0, FEW * len(fast)):
        raise InputError(
            f"{rows.source.place(int(np.argmax(fast)))}: with unit {rows.gyro_unit} the gyro of IMU {name} turns at more "
            f"than {limits.rate:g} rad/s in {often} of {len(fast)} rows; expected what a sensor can measure: is the unit "
            "another?"
        )
    usual = float(np.median(force))
    if not GRAVITY_M_S2[0] <= usual <= max(GRAVITY_M_S2[1], 0.1 * limits.force):
        hard &= force > IMPOSSIBLE * limits.force  # the unit is wrong, which is told elsewhere
    bad = fast | hard
    what = f"{rows.source.path}: IMU {name} shows values beyond the range of any sensor"
    found = left_out("out of range", what, rows.time + clock_offset, bad, name)
    return (without(rows, bad) if bad.any() else rows), found


def in_order(time: Array) -> NDArray[np.bool_]:
    """Return which stamps, (T,), go on: each after those before it, and none that leaps ahead and is not followed."""
    good = np.ones(len(time), dtype=bool)
    steps = np.diff(time)
    if (steps > 0.0).all():
        return good
    last = -np.inf
    for k, stamp in enumerate(time):
        ahead = stamp - last > LEAP and bool((time[k + 1 : k + 1 + AFTER] < stamp).any())
        good[k] = stamp > last and not ahead
        if good[k]:
            last = stamp
    return good


def left_out(kind: str, what: str, time: Array, bad: NDArray[np.bool_], name: str) -> tuple[Finding, ...]:
    """Return findings of the rows in `bad`, (T,): one of each stretch, or one of all where there are many."""
    rows = np.flatnonzero(bad)
    if not len(rows):
        return ()
    parts = np.split(rows, np.flatnonzero(np.diff(time[rows]) > APART) + 1)
    if len(parts) > MOST_NAMED:
        parts = [rows]
    return tuple(_finding(kind, what, time, part, name) for part in parts)


def _finding(kind: str, what: str, time: Array, rows: NDArray[np.intp], name: str) -> Finding:
    begin, end = float(time[max(rows[0] - 1, 0)]), float(time[rows[-1]])
    text = f"{what} from {begin:.3f} to {end:.3f} s; {len(rows)} row(s) left out"
    size = float(len(rows))
    return Finding(kind, text, stream=name, from_s=begin, to_s=end, size=size, expected=0.0, remedy=REMEDIES[kind])


def _filled(time: Array, good: NDArray[np.bool_]) -> Array:
    """Return stamps in which those that are not good are the good ones before them, or after them at the beginning."""
    if not good.any():
        return np.zeros(len(time))
    filled = np.maximum.accumulate(np.where(good, time, -np.inf))
    filled[filled == -np.inf] = time[good][0]
    return np.asarray(filled)
