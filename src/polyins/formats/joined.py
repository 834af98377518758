"""Turn rates and specific forces as one IMU, also of sensors that have stamps of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.formats.rows import ImuRows, RowSource, intervals
from polyins.model.recording import Array, usual_interval
from polyins.prepare.timesync import GAP


def rates_to_rows(path: Path, name: str, time: Array, gyro: Array, force: Array) -> ImuRows:
    """Return rows of mean rates, rad/s, and specific forces, m/s^2, shape (T, 3), at their stamps, s."""
    steps = intervals(time)[:, None]
    source = RowSource(f"{path}, {name}")
    return ImuRows(source, time, gyro * steps, force * steps, gyro_unit="rad/s", accel_unit="m/s^2")


def joined_rates(path: Path, name: str, gyro: Array, force: Array) -> ImuRows:
    """Return rows at the gyro's stamps, where the accelerometer's samples are around them.

    `gyro`: s, and rad/s, shape (T, 4); `force`: s, and m/s^2, shape (K, 4); stamps rise.
    """
    values, known = at_stamps(force[:, 0], force[:, 1:], gyro[:, 0])
    return rates_to_rows(path, name, gyro[known, 0], gyro[known, 1:], values[known])


def at_stamps(time: Array, values: Array, stamps: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return samples at other stamps, shape (T, 3), and which of these lie between two that are no gap apart.

    `time`: of the samples, rising, shape (K,); `values`: shape (K, 3). Between samples they change evenly; the first
    and the last stand for an interval before and after them as well.
    """
    if len(time) < 2:
        return np.full((len(stamps), 3), np.nan), np.zeros(len(stamps), dtype=bool)
    found = np.column_stack([np.interp(stamps, time, axis) for axis in values.T])
    after = np.clip(np.searchsorted(time, stamps), 1, len(time) - 1)
    step = usual_interval(time)
    near = (np.diff(time)[after - 1] <= GAP * step) | np.isin(stamps, time)
    return found, near & (stamps >= time[0] - step) & (stamps <= time[-1] + step)
