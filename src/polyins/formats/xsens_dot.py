"""Recordings of the Xsens (Movella) DOT as its own software exports them.

Acceleration in m/s^2 and angular rate in deg/s, each the mean over the interval that ends at the stamp; axes x forward,
y left, z up on the sensor. A stamp is `SampleTimeFine` (us) or `time` (s).

The exports have damage of two kinds. Of a pair of rows the first is late by an interval, so that its means come out
halved, and the second has its stamp and no values. And single rows hold noise bits instead of the rates: NaN, 1e-40,
1e30 or, seldom, numbers of a believable size.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import read_bytes
from polyins.formats.columns import layout, read_columns
from polyins.formats.rows import LONGEST_BRIDGE, ImuRows, RowSource, intervals, without
from polyins.model.recording import Array
from polyins.model.rig import DEG

Mask = NDArray[np.bool_]

VALUES = ("Gyr_X", "Gyr_Y", "Gyr_Z", "Acc_X", "Acc_Y", "Acc_Z")
FULL_SCALE_DEG_S = 2000.0
GYRO_LIMIT_DEG_S = 2100.0
ACCEL_LIMIT_M_S2 = 170.0
LIMITS = np.array(3 * [GYRO_LIMIT_DEG_S] + 3 * [ACCEL_LIMIT_M_S2])
TINY = np.array(3 * [1e-6] + 3 * [1e-12])
"""Below this a value that is not zero is damage: the sensor's steps are coarser by orders."""
JUMP_DEG_S = 60.0
"""A rate that far off the mean of its neighbours is damage if it is alone with it."""
ALONE = 10.0
"""so many times farther off than the rates around it are from each other; shocks and vibration ring"""
COUNTER_RANGE = 2**32
SHORTEST_S = 1e-3
"""between rows, several times faster than the sensor"""
STAMP_SLACK = 0.1
"""of an interval"""
NAMED_ROWS = 6


def read_imu(path: str | Path, rate_hz: float | None = None) -> ImuRows:
    """Read one sensor's export; with `rate_hz` the time is row number / rate and the stamps are ignored.

    Damaged rows are repaired, up to 3 in a row, by interpolation; more of them in a row are left out, which is a gap; a
    first row of zeros, which the sensor writes before its first sample, is left out. Each is a warning. Raises
    InputError for missing columns, and if more than half of the rows are damaged.
    """
    stamp = None if rate_hz else _stamp_column(path)
    wanted = [*VALUES, *([stamp] if stamp else [])]
    source, columns = read_columns(path, wanted, header_has="Gyr_X", text_is_nan=True)
    values = np.column_stack(columns[:6])
    time = np.arange(len(values)) / rate_hz if rate_hz else _seconds(columns[6], stamp or "")
    if stamp == "SampleTimeFine" and len(time) > 1 and (usual := float(np.nanmedian(np.diff(time)))) < SHORTEST_S:
        raise InputError(
            f"{source.path}: SampleTimeFine in us makes steps of {usual:.2g} s; expected those of a DOT (120 Hz at "
            "most): is it an export of MT Manager, with ticks of 1e-4 s and rad/s?"
        )
    warnings = []
    if len(values) and not values[0].any():
        warnings.append(f"{source.place(0)}: all values are zero; left out, the sensor begins with such a row")
        source, time, values = RowSource(source.path, (source.first_line or 1) + 1), time[1:], values[1:]
    time, values = _late_rows_in_place(time, values)
    damaged = _damaged(values)
    bad = damaged[:, 0] | damaged[:, 3]
    lost = _runs_longer(bad, LONGEST_BRIDGE)
    warnings += _report(source, bad, lost)
    values = _interpolated(time, values, damaged)
    steps = intervals(time)[:, None]
    rows = ImuRows(
        source,
        time,
        values[:, :3] * DEG * steps,
        values[:, 3:] * steps,
        gyro_unit="deg/s",
        accel_unit="m/s^2",
        gyro_range_deg_s=FULL_SCALE_DEG_S,
        warnings=tuple(warnings),
    )
    return without(rows, lost) if lost.any() else rows


def _stamp_column(path: str | Path) -> str:
    names = layout(path, read_bytes(path), "Gyr_X").names
    for name in ("SampleTimeFine", "time", "Time"):
        if name in names:
            return name
    raise InputError(f"{path}: no column SampleTimeFine or time; expected one, or rate_hz in the configuration")


def _seconds(stamps: Array, column: str) -> Array:
    if column != "SampleTimeFine":
        return stamps
    # The counter of microseconds has 32 bits and starts again from zero every 71.6 minutes.
    turns = np.cumsum(np.diff(stamps, prepend=stamps[:1]) < -COUNTER_RANGE / 2)
    return (stamps + turns * COUNTER_RANGE) * 1e-6


def _late_rows_in_place(time: Array, values: Array) -> tuple[Array, Array]:
    """Put the first row of each damaged pair where it belongs, between its neighbours, and double its means."""
    step = np.diff(time)
    usual = float(np.median(step)) if len(step) else np.nan
    empty = np.isfinite(values).sum(axis=1) < values.shape[1]
    double = np.abs(step[:-1] - 2.0 * usual) <= STAMP_SLACK * usual
    late = np.flatnonzero(double & (step[1:] == 0.0) & empty[2:]) + 1
    time, values = time.copy(), values.copy()
    time[late] -= usual
    values[late] *= 2.0
    return time, values


def _damaged(values: Array) -> Mask:
    """Return which values are damage, shape (T, 6); a row's rates are damaged all three, its accelerations too."""
    with np.errstate(invalid="ignore"):
        size = np.abs(values)
        bad = ~np.isfinite(values) | (size > LIMITS) | ((size < TINY) & (size != 0.0))
    bad[:, :3] |= _alone(np.where(bad[:, :3], np.nan, values[:, :3]))
    whole = np.column_stack([bad[:, :3].any(axis=1), bad[:, 3:].any(axis=1)])
    return np.repeat(whole, 3, axis=1)


def _alone(rates: Array) -> Mask:
    """Return which rates (deg/s, shape (T, 3)) stand out from a quiet neighbourhood of three rows on both sides."""
    found = np.zeros(rates.shape, dtype=bool)
    if len(rates) < 7:
        return found
    step = np.abs(np.diff(rates, axis=0))
    across = np.abs(rates[4:-2] - rates[2:-4])
    around = np.max([step[0:-5], step[1:-4], across, step[4:-1], step[5:]], axis=0)
    off = np.abs(rates[3:-3] - 0.5 * (rates[4:-2] + rates[2:-4]))
    found[3:-3] = (off > JUMP_DEG_S) & (off > ALONE * around)
    return found


def _runs_longer(bad: Mask, length: int) -> Mask:
    """Return which rows belong to a run of more than `length` bad ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], bad, [False]]).astype(int)))
    found = np.zeros(len(bad), dtype=bool)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        found[begin:end] = end - begin > length
    return found


def _report(source: RowSource, bad: Mask, lost: Mask) -> list[str]:
    if 2 * np.sum(bad) > len(bad):
        raise InputError(f"{source.path}: {np.sum(bad)} of {len(bad)} rows without valid Acc and Gyr; expected few")
    texts = []
    for rows, fate in ((bad & ~lost, "repaired from its neighbours"), (lost, "left out, a gap")):
        where = np.flatnonzero(rows)
        if len(where):
            lines = ", ".join(str((source.first_line or 1) + int(row)) for row in where[:NAMED_ROWS])
            more = ", ..." if len(where) > NAMED_ROWS else ""
            texts.append(f"{source.path}: {len(where)} destroyed row(s) {fate}: line {lines}{more}")
    return texts


def _interpolated(time: Array, values: Array, damaged: Mask) -> Array:
    for axis in range(6) if damaged.any() else ():
        good, bad = np.flatnonzero(~damaged[:, axis]), np.flatnonzero(damaged[:, axis])
        values[bad, axis] = np.interp(time[bad], time[good], values[good, axis])
    return values
