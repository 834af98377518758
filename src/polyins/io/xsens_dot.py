"""Recordings of the Xsens (Movella) DOT as its own software exports them.

Acceleration in m/s^2 and angular rate in deg/s, each the mean over the interval that ends at the stamp; axes x forward,
y left, z up on the sensor. A stamp is `SampleTimeFine` (us) or `time` (s).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.io.columns import layout, read_columns
from polyins.io.files import read_bytes
from polyins.io.rows import ImuRows, Source, intervals
from polyins.recording import Array
from polyins.rig import DEG

VALUES = ("Gyr_X", "Gyr_Y", "Gyr_Z", "Acc_X", "Acc_Y", "Acc_Z")
GYRO_RANGE_DEG_S = 2100.0
ACCEL_RANGE_M_S2 = 170.0
TINY = 1e-12
"""Below this a value that is not zero is a damaged one: the sensor's steps are coarser by many orders."""
LONGEST_BRIDGE = 3
COUNTER_RANGE = 2**32


def read_imu(path: str | Path, rate_hz: float | None = None) -> ImuRows:
    """Read one sensor's export; with `rate_hz` the time is row number / rate and the stamps are ignored.

    Damaged rows (text, NaN, out of range) are bridged by interpolation, up to 3 in a row, each with a warning; a first
    row of zeros, which the sensor writes before its first sample, is left out with a warning. Raises InputError for
    missing columns and longer damage.
    """
    stamp = None if rate_hz else _stamp_column(path)
    wanted = [*VALUES, *([stamp] if stamp else [])]
    source, columns = read_columns(path, wanted, header_has="Gyr_X", text_is_nan=True)
    values = np.column_stack(columns[:6])
    time = np.arange(len(values)) / rate_hz if rate_hz else _seconds(columns[6], stamp or "")
    values, warnings = _bridged(source, time, values)
    steps = intervals(time)[:, None]
    start = 0
    if len(values) and not values[0].any():
        start = 1
        warnings.append(f"{source.place(0)}: all values are zero; left out, the sensor begins with such a row")
    return ImuRows(
        Source(source.path, (source.first_line or 1) + start),
        time[start:],
        (values[:, :3] * DEG * steps)[start:],
        (values[:, 3:] * steps)[start:],
        gyro_unit="deg/s",
        accel_unit="m/s^2",
        warnings=tuple(warnings),
    )


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


def _bridged(source: Source, time: Array, values: Array) -> tuple[Array, list[str]]:
    """Interpolate across damaged rows."""
    limits = np.array(3 * [GYRO_RANGE_DEG_S] + 3 * [ACCEL_RANGE_M_S2])
    with np.errstate(invalid="ignore"):
        size = np.abs(values)
        fine = np.isfinite(values) & (size <= limits) & ((size >= TINY) | (size == 0.0))
    damaged = np.flatnonzero(~fine.all(axis=1))
    warnings = []
    for run in np.split(damaged, np.flatnonzero(np.diff(damaged) > 1) + 1) if len(damaged) else []:
        names = ", ".join(np.array(VALUES)[~fine[run].all(axis=0)])
        if len(run) > LONGEST_BRIDGE:
            raise InputError(
                f"{source.place(int(run[0]))}: {len(run)} rows in a row without a valid {names}; "
                f"expected at most {LONGEST_BRIDGE}, which are interpolated"
            )
        warnings.append(f"{source.place(int(run[0]))}: {len(run)} row(s) without a valid {names}; interpolated")
    if len(damaged) == len(values):
        raise InputError(f"{source.path}: no valid row of Acc and Gyr; expected at least one")
    for axis in range(6) if len(damaged) else ():
        good = fine[:, axis]
        values[~good, axis] = np.interp(time[~good], time[good], values[good, axis])
    return values, warnings
