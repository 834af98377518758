"""Rows that are no data: what is no number, stamps that do not go on, values beyond the range of any sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.checks.stream_checks import GRAVITY_M_S2
from polyins.formats.rows import ImuRows, intervals, without
from polyins.model.findings import LEFT_OUT, Finding
from polyins.model.recording import Array
from polyins.prepare.plausible import Limits

LEAP = 1.0
"""s ahead of the row before: such a stamp is not believed if most rows after it are back"""
FAR = 3600.0
"""s from all other stamps: a few of these at an end of the file are not believed"""
AFTER = 64
"""rows after it that are looked at"""
IMPOSSIBLE = 1e6
"""times the range: no unit that is mistaken for another makes so much of a value"""
APART = 1.0
"""s between rows that are told apart"""
MOST_NAMED = 5
"""stretches of one IMU that are named each by itself"""
CAUSES = {
    "not a number": ("has rows that are not all numbers", "look at its cable and at what logged it"),
    "stamps": ("has stamps that are repeated, go back or leap", "give rate_hz if its rows are even and they are not"),
    "out of range": ("shows values beyond the range of any sensor", "look at its cable, its supply and what logged it"),
    "zeros": ("shows zeros only", "look at its cable and its supply"),
    "frozen": ("repeats the same values", "look at its driver: it repeats what it read last"),
}
"""why rows are left out: what an IMU does, and what to do"""


def without_nonsense(rows: ImuRows, name: str, clock_offset: float) -> tuple[ImuRows, tuple[Finding, ...]]:
    """Leave out rows that are not all numbers and whose stamps do not go on; returns findings that name IMU and spans.

    `clock_offset`, s, puts the times in them on the recording's clock.
    """
    numbers = np.logical_and.reduce([np.isfinite(column) for column in (rows.time, *rows.dtheta.T, *rows.dvel.T)])
    good = numbers.copy()
    good[numbers] = in_order(rows.time[numbers])
    if good.all():
        return rows, ()
    time = _filled(rows.time, good) + clock_offset
    place = f"{rows.source.path}: IMU {name}"
    found = (
        *left_out("not a number", place, time, ~numbers, name),
        *left_out("stamps", place, time, numbers & ~good, name),
    )
    return without(rows, ~good), found


def within_any_range(
    rows: ImuRows, name: str, clock_offset: float, limits: Limits
) -> tuple[ImuRows, tuple[Finding, ...]]:
    """Leave out rows whose values no sensor has, as `without_nonsense`; where the unit is wrong they stay."""
    if len(rows.time) < 2:
        return rows, ()
    steps = intervals(rows.time)
    rate, force = (np.maximum.reduce(list(np.abs(block).T)) / steps for block in (rows.dtheta, rows.dvel))
    fast, hard = rate > limits.rate, force > limits.force
    if not (fast.any() or hard.any()):
        return rows, ()
    if np.sqrt(np.mean(np.minimum(rate, limits.rate) ** 2)) > limits.rms_rate:
        fast = rate > IMPOSSIBLE * limits.rate  # the unit is wrong, which is told elsewhere
    usual = float(np.median(force))
    if not GRAVITY_M_S2[0] <= usual <= max(GRAVITY_M_S2[1], 0.1 * limits.force):
        hard = force > IMPOSSIBLE * limits.force  # likewise
    bad = fast | hard
    found = left_out("out of range", f"{rows.source.path}: IMU {name}", rows.time + clock_offset, bad, name)
    return (without(rows, bad) if bad.any() else rows), found


def in_order(time: Array) -> NDArray[np.bool_]:
    """Return which stamps, (T,), go on: each after those before it, none far ahead that is not followed."""
    good = np.ones(len(time), dtype=bool)
    steps = np.diff(time)
    if ((steps > 0.0) & (steps < FAR)).all():
        return good
    last = -np.inf
    for k, stamp in enumerate(time):
        leap, after = stamp - last, time[k + 1 : k + 1 + AFTER]
        at_end = leap > FAR and len(after) < AFTER <= k
        if leap > LEAP and (at_end or 2 * np.count_nonzero(after < stamp) > len(after)):
            good[k] = False
            continue
        if leap > FAR and k < AFTER:
            good[:k] = False
        good[k] = leap > 0.0
        last = stamp if good[k] else last
    return good


def left_out(cause: str, place: str, time: Array, bad: NDArray[np.bool_], name: str) -> tuple[Finding, ...]:
    """Return findings of the rows in `bad`, (T,): one of each stretch, or one of all where there are many.

    `cause`: of `CAUSES`; `place`: the file and the IMU.
    """
    rows = np.flatnonzero(bad)
    if not len(rows):
        return ()
    parts = np.split(rows, np.flatnonzero(np.diff(time[rows]) > APART) + 1)
    if len(parts) > MOST_NAMED:
        parts = [rows]
    return tuple(_finding(cause, place, time, part, name) for part in parts)


def _finding(cause: str, place: str, time: Array, rows: NDArray[np.intp], name: str) -> Finding:
    begin, end = float(time[max(rows[0] - 1, 0)]), float(time[rows[-1]])
    what, remedy = CAUSES[cause]
    text = f"{place} {what} from {begin:.3f} to {end:.3f} s; {len(rows)} row(s) left out"
    size = float(len(rows))
    return Finding(LEFT_OUT, text, stream=name, from_s=begin, to_s=end, size=size, expected=0.0, remedy=remedy)


def _filled(time: Array, good: NDArray[np.bool_]) -> Array:
    """Return stamps in which those that are not good lie evenly between those that are."""
    if not good.any():
        return np.zeros(len(time))
    rows = np.arange(len(time))
    return np.interp(rows, rows[good], time[good])
