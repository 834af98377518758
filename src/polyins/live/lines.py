"""The line format, version 1: one line of text per epoch.

    polyins1,rates,NAME,TIME,INTERVAL,GX,GY,GZ,AX,AY,AZ          s, s, rad/s, m/s^2
    polyins1,increments,NAME,TIME,X,Y,Z,VX,VY,VZ                 s, rad, m/s
    polyins1,gnss,TIME,LATITUDE,LONGITUDE,HEIGHT,SN,SE,SD[,VN,VE,VD,SVN,SVE,SVD]       s, deg, m, m/s
    polyins1,plane,TIME,NORTH,EAST,HEIGHT,SN,SE,SD[,VN,VE,VD,SVN,SVE,SVD]              s, m, m/s
    polyins1,height,TIME,HEIGHT,STD                              s, m
    polyins1,heading,TIME,HEADING,STD                            s, deg
    polyins1,odometer,TIME,SPEED,STD,RIGHT,DOWN                  s, m/s; of no slip the std, or 0

Rates are means over the INTERVAL that ends at TIME, increments belong to the interval since the epoch before. IMU data
are in the sensor's axes. A line may end in `*` and two hexadecimal digits: the exclusive or of the bytes before it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from math import isfinite
from operator import xor

import numpy as np

from polyins.live.events import Array, Epoch, GnssEpoch, ImuEpoch, RefusedError, SensorEpoch
from polyins.model.rig import DEG

MAGIC = "polyins1"
LONGEST = 512
"""bytes of a line"""
LONGEST_INTERVAL = 1.0  # s
LARGEST_ANGLE = 2.0 * np.pi  # rad, of one increment
LARGEST_CHANGE = 500.0  # m/s, of one increment
HEIGHTS = (-12e3, 100e3)  # m
LARGEST_STD = 1e4  # m, m/s


def parse(line: bytes) -> Epoch:
    """Return what a line says; raises RefusedError with the kind of what is wrong with it."""
    if len(line) > LONGEST:
        raise RefusedError("oversized")
    try:
        head, kind, *fields = _without_checksum(line).decode("ascii").split(",")
    except ValueError:
        raise RefusedError("malformed") from None
    if head != MAGIC:
        raise RefusedError("other version" if head.startswith("polyins") else "malformed")
    try:
        return _PARSERS[kind](fields)
    except (KeyError, IndexError, ValueError):
        raise RefusedError("malformed") from None


def write(epoch: Epoch) -> str:
    """Return the line of an epoch, without its end; every digit that the numbers have is kept."""
    if isinstance(epoch, ImuEpoch):
        return _joined("increments", epoch.imu, epoch.time, *epoch.dtheta, *epoch.dvel)
    if isinstance(epoch, SensorEpoch):
        unit = DEG if epoch.kind == "heading" else 1.0
        return _joined(epoch.kind, epoch.time, epoch.value / unit, *(epoch.std / unit))
    assert epoch.position_std is not None
    values = [*epoch.position_std]
    if epoch.velocity is not None and epoch.velocity_std is not None:
        values += [*epoch.velocity, *epoch.velocity_std]
    if not epoch.geodetic:
        return _joined("plane", epoch.time, *epoch.position, *values)
    return _joined("gnss", epoch.time, *(epoch.position / [DEG, DEG, 1.0]), *values)


def _joined(kind: str, *fields: str | float) -> str:
    return ",".join([MAGIC, kind, *(one if isinstance(one, str) else repr(float(one)) for one in fields)])


def checksum(line: bytes) -> int:
    """Return the exclusive or of all bytes."""
    return reduce(xor, line, 0)


def _without_checksum(line: bytes) -> bytes:
    line = line.strip()
    if line[-3:-2] != b"*":
        return line
    if checksum(line[:-3]) != int(line[-2:], 16):
        raise RefusedError("checksum")
    return line[:-3]


def _numbers(fields: list[str], *counts: int) -> list[float]:
    if len(fields) not in counts:
        raise RefusedError("malformed")
    numbers = [float(field) for field in fields]
    if not all(map(isfinite, numbers)):
        raise RefusedError("non-finite")
    return numbers


def _increments(fields: list[str]) -> ImuEpoch:
    time, *values = _numbers(fields[1:], 7)
    return imu_epoch(fields[0], time, np.array(values[:3]), np.array(values[3:]))


def _rates(fields: list[str]) -> ImuEpoch:
    time, interval, *values = _numbers(fields[1:], 8)
    if not 0.0 < interval <= LONGEST_INTERVAL:
        raise RefusedError("implausible")
    return imu_epoch(fields[0], time, np.array(values[:3]) * interval, np.array(values[3:]) * interval)


def imu_epoch(name: str, time: float, dtheta: Array, dvel: Array) -> ImuEpoch:
    """Return the epoch; raises RefusedError for increments that no vehicle makes."""
    if np.abs(dtheta).max() > LARGEST_ANGLE or np.abs(dvel).max() > LARGEST_CHANGE:
        raise RefusedError("implausible")
    return ImuEpoch(name, time, dtheta, dvel)


def _geodetic(fields: list[str]) -> GnssEpoch:
    time, latitude, longitude, height, *rest = _numbers(fields, 7, 13)
    return _fix(time, geodetic_position(latitude, longitude, height), rest, True)


def geodetic_position(latitude_deg: float, longitude_deg: float, height: float) -> Array:
    """Return latitude, longitude (rad), height (m); raises RefusedError for what is nowhere near the ground."""
    if not isfinite(latitude_deg + longitude_deg + height):
        raise RefusedError("non-finite")
    if abs(latitude_deg) > 90.0 or abs(longitude_deg) > 360.0 or not HEIGHTS[0] < height < HEIGHTS[1]:
        raise RefusedError("implausible")
    return np.array([latitude_deg * DEG, longitude_deg * DEG, height])


def _plane(fields: list[str]) -> GnssEpoch:
    time, *values = _numbers(fields, 7, 13)
    return _fix(time, np.array(values[:3]), values[3:], False)


def _fix(time: float, position: Array, rest: list[float], geodetic: bool) -> GnssEpoch:
    std = np.array(rest[:3])
    velocity, velocity_std = (np.array(rest[3:6]), np.array(rest[6:9])) if len(rest) > 3 else (None, None)
    for spread in (std, velocity_std):
        if spread is not None and (spread.min() <= 0.0 or spread.max() > LARGEST_STD):
            raise RefusedError("implausible")
    return GnssEpoch(time, position, std, velocity, velocity_std, geodetic)


def _sensor(kind: str, count: int, unit: float, fields: list[str]) -> SensorEpoch:
    time, value, *std = _numbers(fields, 2 + count)
    if std[0] <= 0.0 or min(std) < 0.0 or max(std) > LARGEST_STD:
        raise RefusedError("implausible")
    return SensorEpoch(kind, time, value * unit, np.array(std) * unit)


_PARSERS: dict[str, Callable[[list[str]], Epoch]] = {
    "increments": _increments,
    "rates": _rates,
    "gnss": _geodetic,
    "plane": _plane,
    "height": partial(_sensor, "height", 1, 1.0),
    "heading": partial(_sensor, "heading", 1, DEG),
    "odometer": partial(_sensor, "odometer", 3, 1.0),
}
