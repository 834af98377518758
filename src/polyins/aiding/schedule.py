"""When which measurement of a vehicle with wheels is due, and the window over which a speed is taken."""

from __future__ import annotations

import math

from polyins.aiding import wheel_speed
from polyins.aiding.centralized import aid_all
from polyins.aiding.distributed import aid_each
from polyins.aiding.rolling import (
    FILLED,
    G_DT,
    G_DURATION,
    G_KNOWN,
    G_LATERAL,
    G_POINT,
    G_SPEED,
    G_VARIANCE,
    KIND,
    LAST_POINT,
    LAST_SPEED,
    LATERAL,
    OPENED,
    POINT,
    POINT_INTERVAL,
    POINT_VARIANCE,
    RADIUS,
    SPEED,
    SPEED_INTERVAL,
    SPEED_WINDOW,
    STANDSTILL,
    STILL,
    STILL_RATE,
    TRAVEL,
    ZERO_RATE,
    ZERO_RATE_VARIANCE,
    ZERO_VELOCITY,
    ZERO_VELOCITY_VARIANCE,
    Joint,
    Rolling,
)
from polyins.kernels import bank, earth, share, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel

STILL_SPEED = 0.01
"""m/s"""


@scalar_kernel
def _aid(
    kind: float,
    variance: float,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    dt: float,
) -> None:
    rolling.given[KIND] = kind
    for a in range(3):
        rolling.given[G_VARIANCE + a] = variance
        rolling.given[G_KNOWN + a] = groups[-1, share.POSITION + a]
        rolling.given[G_POINT + a] = 0.0
    if joined is None:
        aid_each(blocks, groups, members, measurements, near, rolling, dt)
    else:
        aid_all(blocks, groups, members, measurements, near, rolling, joined, dt)


@scalar_kernel
def _is_at_rest(blocks: Array, members: Array, rolling: Rolling, duration: float) -> bool:
    """Whether no wheel has rolled and no IMU that measures has turned during the window."""
    limit = rolling.settings[STILL_RATE] * duration
    if not abs(rolling.memory[TRAVEL]) < STILL_SPEED * duration:
        return False
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            w, t = blocks[members[s, 0] // LANES], bank.TURNED + members[s, 0] % LANES
            if w[t] ** 2 + w[t + LANES] ** 2 + w[t + 2 * LANES] ** 2 > limit * limit:
                return False
    return True


@scalar_kernel
def _earth_rate_about_axle(merged: Array, near: Array) -> float:
    """Return what a gyro on a wheel measures beside the rate of the wheel over ground, rad/s."""
    if near[0] == 0.0:
        return 0.0
    rate: float = earth.EARTH_RATE_RAD_S * (merged[share.VEHICLE + 1] * near[3] - merged[share.VEHICLE + 7] * near[2])
    return rate


@scalar_kernel
def _end_window(
    now: float,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    dt: float,
) -> None:
    """Update by what the window holds: a speed, or a standstill."""
    memory, given, settings = rolling.memory, rolling.given, rolling.settings
    duration = now - memory[OPENED]
    given[G_DURATION], given[G_DT] = duration, dt
    given[G_SPEED] = memory[TRAVEL] / duration + settings[RADIUS] * _earth_rate_about_axle(groups[-1], near)
    given[G_LATERAL] = memory[LATERAL]
    since = now - memory[LAST_SPEED]
    memory[LAST_SPEED] = now
    still = settings[STANDSTILL] != 0.0 and _is_at_rest(blocks, members, rolling, duration)
    memory[STILL] += since if still else 0.0
    # the window's rates were corrected by the errors as they still are: they come before the velocity
    kind, variance = (ZERO_RATE, settings[ZERO_RATE_VARIANCE]) if still else (SPEED, 0.0)
    if still or math.isfinite(given[G_SPEED]):
        _aid(kind, variance, blocks, groups, members, measurements, near, rolling, joined, dt)
    if still:
        variance = settings[ZERO_VELOCITY_VARIANCE]
        _aid(ZERO_VELOCITY, variance, blocks, groups, members, measurements, near, rolling, joined, dt)


@scalar_kernel
def fill_window(
    k: int, fraction: float, blocks: Array, groups: Array, members: Array, rolling: Rolling, dt: float
) -> None:
    """Add what was travelled in the last `dt` seconds, this fraction of epoch k, while a window is open."""
    memory = rolling.memory
    if memory[FILLED] < 0.0:
        return
    memory[FILLED] += fraction
    memory[TRAVEL] += fraction * rolling.travel[k, 0]
    for s in range(members.shape[0]):
        lent = vehicle.lent_matrix(groups, rolling.lenders[s])
        for i in range(members[s, 0], members[s, 1] if rolling.silent[s] < 0.0 else 0):
            wheel_speed.fill_window(blocks[i // LANES], i % LANES, lent, memory[LATERAL], dt)


@scalar_kernel
def open_window(now: float, lateral: float, blocks: Array, groups: Array, members: Array, rolling: Rolling) -> None:
    """Begin to take a speed."""
    memory = rolling.memory
    memory[FILLED] = memory[TRAVEL] = 0.0
    memory[OPENED], memory[LATERAL] = now, lateral
    for s in range(members.shape[0]):
        lent = vehicle.lent_matrix(groups, rolling.lenders[s])
        for i in range(members[s, 0], members[s, 1] if rolling.silent[s] < 0.0 else 0):
            wheel_speed.open_window(blocks[i // LANES], i % LANES, lent, lateral)


@scalar_kernel
def step(
    k: int,
    now: float,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    dt: float,
    interval: float,
) -> None:
    """Do what is due at epoch k, at time `now`; `dt` is the part of its interval that was navigated last."""
    memory, settings = rolling.memory, rolling.settings
    half = 0.5 * interval
    if memory[FILLED] > 0.0 and now - memory[LAST_SPEED] >= settings[SPEED_INTERVAL] - half:
        _end_window(now, blocks, groups, members, measurements, near, rolling, joined, dt)
        memory[FILLED] = -1.0
    if memory[FILLED] < 0.0 and now - memory[LAST_SPEED] >= settings[SPEED_INTERVAL] - settings[SPEED_WINDOW] - half:
        open_window(now, rolling.travel[k, 1], blocks, groups, members, rolling)
    if members.shape[0] > 1 and now - memory[LAST_POINT] >= settings[POINT_INTERVAL] - half:
        memory[LAST_POINT] = now
        variance = settings[POINT_VARIANCE]
        _aid(POINT, variance, blocks, groups, members, measurements, near, rolling, joined, dt)
