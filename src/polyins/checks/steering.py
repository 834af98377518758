"""Which wheels yaw otherwise than the vehicle they belong to: the steered ones.

A wheel's IMU sees the vehicle's yaw in its two axes in the wheel, turned by the wheel's angle. Turned back by the angle
that the gyro itself counts and averaged, what is left is the yaw rate and an angle that drifts slowly; its size is
compared.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.formats.rows import intervals
from polyins.model.recording import ImuStream
from polyins.model.rig import DEG, Imu

Array = NDArray[np.float64]

AVERAGE_S = 0.5
GRID_S = 0.1
REST_RAD_S = 0.15
"""of a wheel at rest, its bias included"""
LEAST_REST_S = 1.0
LEAST_DIFFERENCE_RAD_S = 0.25 * DEG
RELATIVE_DIFFERENCE = 0.1
"""of the rms yaw rate, allowed besides"""


def yaw_differences(imus: list[Imu], streams: list[ImuStream]) -> dict[str, str]:
    """Return the wheels whose yaw rate differs, and the IMU that it differs from, by name.

    The comparison is with an IMU on the body, else with the wheel that yaws least: a steered one yaws more. It needs a
    second at rest and is left out otherwise.
    """
    begin, end = max(stream.time[0] for stream in streams), min(stream.time[-1] for stream in streams)
    grid = np.arange(begin, end, GRID_S)
    rest = _at_rest(imus, streams, grid)
    if np.sum(rest) * GRID_S < LEAST_REST_S:
        return {}
    moving = ~rest
    yaw = {imu.name: _yaw_rate(imu, stream, grid, rest)[moving] for imu, stream in zip(imus, streams, strict=True)}
    body = [imu.name for imu in imus if imu.wheel is None]
    known = body[0] if body else min(yaw, key=lambda name: _rms(yaw[name]))
    allowed = LEAST_DIFFERENCE_RAD_S + RELATIVE_DIFFERENCE * _rms(yaw[known])
    wheels = [imu.name for imu in imus if imu.wheel is not None]
    return {name: known for name in wheels if _rms(yaw[name] - yaw[known]) > allowed}


def _at_rest(imus: list[Imu], streams: list[ImuStream], grid: Array) -> NDArray[np.bool_]:
    """Return at which instants no wheel turns, shape as `grid`."""
    rest = np.ones(len(grid), dtype=bool)
    for imu, stream in zip(imus, streams, strict=True):
        if imu.wheel is not None:
            spin = _averaged(stream.dtheta[:, 0] / intervals(stream.time), stream)
            rest &= np.abs(np.interp(grid, stream.time, spin)) < REST_RAD_S
    return rest


def _yaw_rate(imu: Imu, stream: ImuStream, grid: Array, rest: NDArray[np.bool_]) -> Array:
    """Return the size of the yaw rate on the grid, rad/s, less the bias at rest."""
    rate = stream.dtheta / intervals(stream.time)[:, None]
    still = np.interp(stream.time, grid, rest.astype(float)) == 1.0
    rate = rate - rate[still].mean(axis=0)
    if imu.wheel is None:
        return np.abs(np.interp(grid, stream.time, _averaged(rate[:, 2], stream)))
    turned = (rate[:, 1] + 1j * rate[:, 2]) * np.exp(1j * np.cumsum(rate[:, 0] * intervals(stream.time)))
    size = np.hypot(_averaged(turned.real, stream), _averaged(turned.imag, stream))
    return np.asarray(np.interp(grid, stream.time, size))


def _averaged(values: Array, stream: ImuStream) -> Array:
    """Return the moving average, the ends mirrored."""
    count = max(1, round(AVERAGE_S * stream.rate_hz))
    before = count // 2
    total = np.cumsum(np.pad(values, (before + 1, count - 1 - before), mode="symmetric"))
    return np.asarray((total[count:] - total[:-count]) / count)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0
