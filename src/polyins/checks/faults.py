"""Rows that a chip did not measure: values that it repeats, rows of zeros, rates held at the end of a range.

Two samples of a chip differ at least by its noise. Where all six values repeat exactly for long it has frozen. Data
without noise, as they are simulated, repeat on any straight stretch, so nothing is concluded from those.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from polyins.checks.no_data import left_out
from polyins.errors import ImplausibleError, InputError
from polyins.formats.rows import ImuRows, intervals, without
from polyins.model.findings import LEFT_OUT, Finding
from polyins.model.recording import Array, ImuStream

LONGEST_REPEAT = 10
"""samples; of a slower chip whose samples are written several times, so many of its own"""
SAME = 1e-9
"""of the largest value, rad/s or m/s^2: less is rounding, from an increment to a rate and back"""
ROUGH = 0.5
"""A difference over that of the order below: 1.7 and more of white noise, the turn per sample of what only turns."""
DIGITS = 1e-6
"""of the largest value: less is how it was written"""
LEAST_CLIPPED = 5
"""samples in a row at exactly the largest value"""
LEAST_SAMPLES = 50
"""that two sensors do not share by chance"""
LEAST_STEPS = 10.0
"""usual steps from zero to the largest value; less is coarse resolution"""
NAMES = ("gyro x", "gyro y", "gyro z", "accelerometer x", "accelerometer y", "accelerometer z")


def without_faults(rows: ImuRows, name: str, clock_offset: float) -> tuple[ImuRows, tuple[Finding, ...]]:
    """Leave out the rows that the chip did not measure; returns findings that name the IMU and the spans.

    `clock_offset`, s, puts the stamps in them on the recording's clock.
    """
    if len(rows.time) < 2:
        return rows, ()
    time, place = rows.time + clock_offset, f"{rows.source.path}: IMU {name}"
    zeros, frozen = _zeros(rows), _frozen(rows)
    found = (
        *left_out("zeros", place, time, zeros, name),
        *left_out("frozen", place, time, frozen & ~zeros, name),
    )
    bad = zeros | frozen
    return (without(rows, bad) if bad.any() else rows), found


def alive(streams: Sequence[ImuStream]) -> tuple[list[int], tuple[Finding, ...]]:
    """Return the indices of the IMUs that show something, and findings of those that a run goes on without.

    One that shows the same values throughout is dead if another one does not: without noise all may, at rest. Raises
    InputError if none shows anything.
    """
    there = [not _is_constant(stream) for stream in streams]
    if not any(there):
        there = [len(stream.time) > 1 and bool(stream.dvel.any()) for stream in streams]
    if not any(there):
        names = ", ".join(stream.name for stream in streams)
        raise InputError(f"IMU {names}: no data, or the same values throughout; expected one that measures")
    kept = [i for i, one in enumerate(there) if one]
    return kept, tuple(_dead(stream) for stream, one in zip(streams, there, strict=True) if not one)


def _is_constant(stream: ImuStream) -> bool:
    values = np.hstack([stream.dtheta, stream.dvel]) / np.maximum(intervals(stream.time), np.finfo(float).tiny)[:, None]
    return len(values) < 2 or not _changes(values)[1:].any()


def _dead(stream: ImuStream) -> Finding:
    why = "has no data" if len(stream.time) < 2 else "shows the same values throughout"
    span = (float(stream.time[0]), float(stream.time[-1])) if len(stream.time) else (None, None)
    return Finding(
        LEFT_OUT,
        f"IMU {stream.name} {why}; the run goes on without it",
        stream=stream.name,
        from_s=span[0],
        to_s=span[1],
        size=why,
        remedy="look at its cable, its supply and its file",
    )


def clipped(rows: ImuRows, name: str, clock_offset: float, gyro: bool = True) -> tuple[Finding, ...]:
    """Return findings of values that stay at exactly the largest one, in sensor axes.

    `gyro`: of gyros, too; not needed where their range is known.
    """
    rates = _rates(rows)
    found = []
    for k in range(0 if gyro else 3, 6):
        size = np.abs(rates[:, k])
        largest = size.max()
        runs = [run for run in _runs(size >= (1.0 - SAME) * largest) if run[1] - run[0] >= LEAST_CLIPPED]
        if not runs:
            continue
        distinct = rates[np.diff(rates[:, k], prepend=np.nan) != 0.0, k]
        if not is_rough(distinct[:, None], 3, DIGITS * largest):
            continue
        if largest < LEAST_STEPS * np.median(np.abs(np.diff(distinct))):
            continue
        value, unit = (float(np.degrees(largest)), "deg/s") if k < 3 else (float(largest), "m/s^2")
        begin, end = (float(rows.time[row] + clock_offset) for row in (runs[0][0], runs[-1][1] - 1))
        imu = f"IMU {name}" if name else "the IMU"
        text = (
            f"{rows.source.path}: {NAMES[k]} of {imu} stays at exactly {value:.4g} {unit}, its largest value, "
            f"{len(runs)} time(s), first at {begin:.3f} s: is that the end of its range?"
        )
        remedy = "gyro_range_deg_s leaves such rows out" if k < 3 else ""
        found.append(Finding("saturation", text, "note", name, NAMES[k], begin, end, value, remedy=remedy))
    return tuple(found)


def check_distinct(streams: Sequence[ImuStream]) -> None:
    """Raise InputError if two IMUs show the same samples throughout, which two sensors never do."""
    for i, one in enumerate(streams):
        for other in streams[i + 1 :]:
            if are_copies(one, other):
                raise ImplausibleError(
                    "twice", f"IMU {one.name} and IMU {other.name}: their samples are identical; expected two sensors"
                )


def are_copies(one: ImuStream, other: ImuStream) -> bool:
    """Whether two IMUs show the same samples throughout, with noise that no two sensors share."""
    same = len(one.time) == len(other.time) and len(one.time) >= LEAST_SAMPLES
    if not same or not (np.array_equal(one.dtheta, other.dtheta) and np.array_equal(one.dvel, other.dvel)):
        return False
    distinct = one.dtheta[np.diff(one.dtheta[:, 0], prepend=np.nan) != 0.0]
    return is_rough(distinct, 1, 0.0)


def _rates(rows: ImuRows) -> Array:
    return np.hstack([rows.dtheta, rows.dvel]) / intervals(rows.time)[:, None]


def _zeros(rows: ImuRows) -> NDArray[np.bool_]:
    """Return which rows are zero throughout, which no accelerometer on earth shows; the first begins no interval."""
    zero = np.asarray((np.hstack([rows.dtheta, rows.dvel]) == 0.0).all(axis=1))
    zero[0] = False
    return zero if not zero[1:].all() else np.zeros_like(zero)


def _frozen(rows: ImuRows) -> NDArray[np.bool_]:
    """Return which rows repeat those before them for longer than a chip's own samples do."""
    rates = _rates(rows)
    equal = np.logical_and.reduce([np.diff(column) == 0.0 for column in (*rows.dtheta.T, *rows.dvel.T)])
    first = _changes(rates)
    first[1:] &= ~equal
    frozen = np.zeros(len(first), dtype=bool)
    begins = np.flatnonzero(first)
    lengths = np.diff(begins, append=len(first))
    long = np.flatnonzero(lengths > LONGEST_REPEAT * np.median(lengths))
    if not long.size or not is_rough(rates[first], 1, SAME * float(np.abs(rates).max())):
        return frozen
    for k in long:
        frozen[begins[k] + 1 : begins[k] + lengths[k]] = True
    return frozen


def _changes(rates: Array) -> NDArray[np.bool_]:
    """Return which rows differ from the one before, shape (T,)."""
    largest = np.repeat([max(1.0, float(np.abs(part).max())) for part in np.hsplit(rates, 2)], 3)
    moved = [np.abs(np.diff(column)) > SAME * most for column, most in zip(rates.T, largest, strict=True)]
    return np.concatenate([[True], np.logical_or.reduce(moved)])


def is_rough(distinct: Array, order: int, least: float) -> bool:
    """Return whether any channel has noise, from rows that all differ, by its differences of that order and the next.

    Motion makes less of higher ones, the digits that a file has make more.
    """
    if len(distinct) < order + 2:
        return False
    lower, higher = (np.median(np.abs(np.diff(distinct, n, axis=0)), axis=0) for n in (order, order + 1))
    return bool(np.any((lower > least) & (higher > ROUGH * lower)))


def _runs(where: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first row and the one after the last of each stretch in which `where` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    return [(int(begin), int(end)) for begin, end in zip(edges[::2], edges[1::2], strict=True)]
