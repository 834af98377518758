"""The line format, version 1: one line of text per sample.

    polyins1,rates,NAME,TIME,INTERVAL,GX,GY,GZ,AX,AY,AZ          s, s, rad/s, m/s^2
    polyins1,increments,NAME,TIME,X,Y,Z,VX,VY,VZ                 s, rad, m/s
    polyins1,gnss,TIME,LATITUDE,LONGITUDE,HEIGHT,SN,SE,SD[,VN,VE,VD,SVN,SVE,SVD]       s, deg, m, m/s
    polyins1,plane,TIME,NORTH,EAST,HEIGHT,SN,SE,SD[,VN,VE,VD,SVN,SVE,SVD]              s, m, m/s
    polyins1,height,TIME,HEIGHT,STD                              s, m
    polyins1,heading,TIME,HEADING,STD                            s, deg
    polyins1,odometer,TIME,SPEED,STD,RIGHT,DOWN                  s, m/s; of no slip the std, or 0

Rates are means over the INTERVAL that ends at TIME, increments belong to the interval since the sample before. IMU data
are in the sensor's axes. A line may end in `*` and two hexadecimal digits: the exclusive or of the bytes before it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import isfinite

import numpy as np

from polyins.formats.nmea import checksum
from polyins.live.source import RefusedError
from polyins.model.rig import DEG
from polyins.navigate.samples import Array, GnssFix, ImuSample, Sample, SensorSample

MAGIC = "polyins1"
LONGEST = 512
"""bytes of a line"""
LONGEST_INTERVAL = 1.0  # s
LARGEST_ANGLE = 2.0 * np.pi  # rad, of one increment
LARGEST_CHANGE = 500.0  # m/s, of one increment
HEIGHTS = (-12e3, 100e3)  # m
LARGEST_STD = 1e4  # m, m/s


def parse(line: bytes) -> Sample:
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


def write(sample: Sample) -> str:
    """Return the line of a sample, without its end; every digit that the numbers have is kept."""
    if isinstance(sample, ImuSample):
        return _joined("increments", sample.imu, sample.time, *sample.dtheta, *sample.dvel)
    if isinstance(sample, SensorSample):
        unit = DEG if sample.kind == "heading" else 1.0
        return _joined(sample.kind, sample.time, sample.value / unit, *(sample.std / unit))
    assert sample.position_std is not None
    values = [*sample.position_std]
    if sample.velocity is not None and sample.velocity_std is not None:
        values += [*sample.velocity, *sample.velocity_std]
    if not sample.geodetic:
        return _joined("plane", sample.time, *sample.position, *values)
    return _joined("gnss", sample.time, *(sample.position / [DEG, DEG, 1.0]), *values)


def _joined(kind: str, *fields: str | float) -> str:
    return ",".join([MAGIC, kind, *(one if isinstance(one, str) else repr(float(one)) for one in fields)])


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


def _increments(fields: list[str]) -> ImuSample:
    time, *values = _numbers(fields[1:], 7)
    return imu_epoch(fields[0], time, np.array(values[:3]), np.array(values[3:]))


def _rates(fields: list[str]) -> ImuSample:
    time, interval, *values = _numbers(fields[1:], 8)
    if not 0.0 < interval <= LONGEST_INTERVAL:
        raise RefusedError("implausible")
    return imu_epoch(fields[0], time, np.array(values[:3]) * interval, np.array(values[3:]) * interval)


def imu_epoch(name: str, time: float, dtheta: Array, dvel: Array) -> ImuSample:
    """Return the sample; raises RefusedError for increments that no vehicle makes."""
    if np.abs(dtheta).max() > LARGEST_ANGLE or np.abs(dvel).max() > LARGEST_CHANGE:
        raise RefusedError("implausible")
    return ImuSample(name, time, dtheta, dvel)


def _geodetic(fields: list[str]) -> GnssFix:
    time, latitude, longitude, height, *rest = _numbers(fields, 7, 13)
    return _fix(time, geodetic_position(latitude, longitude, height), rest, True)


def geodetic_position(latitude_deg: float, longitude_deg: float, height: float) -> Array:
    """Return latitude, longitude (rad), height (m); raises RefusedError for what is nowhere near the ground."""
    if not isfinite(latitude_deg + longitude_deg + height):
        raise RefusedError("non-finite")
    if abs(latitude_deg) > 90.0 or abs(longitude_deg) > 360.0 or not HEIGHTS[0] < height < HEIGHTS[1]:
        raise RefusedError("implausible")
    return np.array([latitude_deg * DEG, longitude_deg * DEG, height])


def _plane(fields: list[str]) -> GnssFix:
    time, *values = _numbers(fields, 7, 13)
    return _fix(time, np.array(values[:3]), values[3:], False)


def _fix(time: float, position: Array, rest: list[float], geodetic: bool) -> GnssFix:
    std = np.array(rest[:3])
    velocity, velocity_std = (np.array(rest[3:6]), np.array(rest[6:9])) if len(rest) > 3 else (None, None)
    for spread in (std, velocity_std):
        if spread is not None and (spread.min() <= 0.0 or spread.max() > LARGEST_STD):
            raise RefusedError("implausible")
    return GnssFix(time, position, std, velocity, velocity_std, geodetic)


def _sensor(kind: str, count: int, unit: float, fields: list[str]) -> SensorSample:
    time, value, *std = _numbers(fields, 2 + count)
    if std[0] <= 0.0 or min(std) < 0.0 or max(std) > LARGEST_STD:
        raise RefusedError("implausible")
    return SensorSample(kind, time, value * unit, np.array(std) * unit)


_PARSERS: dict[str, Callable[[list[str]], Sample]] = {
    "increments": _increments,
    "rates": _rates,
    "gnss": _geodetic,
    "plane": _plane,
    "height": partial(_sensor, "height", 1, 1.0),
    "heading": partial(_sensor, "heading", 1, DEG),
    "odometer": partial(_sensor, "odometer", 3, 1.0),
}
