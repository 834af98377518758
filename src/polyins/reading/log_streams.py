"""One stream of a log, by the name that the configuration gives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from polyins.errors import InputError
from polyins.formats.log import Log
from polyins.formats.recognize import log_format, read_log
from polyins.formats.rows import ImuRows, SensorRows, Track

Rows = TypeVar("Rows", ImuRows, Track, SensorRows)


def imu_of(path: str, stream: str) -> ImuRows:
    """Return the rows of an IMU; raises InputError for a name that is not there, or one that is not to be used."""
    log = read_log(path)
    return _chosen(path, stream, log.imus, log)


def track_of(path: str, stream: str) -> Track:
    """Return positions; raises InputError as `imu_of` does."""
    log = read_log(path)
    return _chosen(path, stream, log.tracks, log)


def sensor_of(path: str, stream: str, kind: str) -> SensorRows:
    """Return the rows of a sensor of that kind; raises InputError as `imu_of` does.

    The speed over ground of a receiver is an odometer's where it is named: of a vehicle that does not slip.
    """
    log = read_log(path)
    kinds = {kind, "speed"} if kind == "odometer" and stream else {kind}
    return _chosen(path, stream, {name: rows for name, rows in log.sensors.items() if rows.kind in kinds}, log)


def is_log(path: str, stream: str) -> bool:
    """Whether a file holds several streams; raises InputError if one is named of a file that does not."""
    found = log_format(path) is not None
    if stream and not found:
        raise InputError(f"{path}: holds one stream; expected no stream to be named")
    return found


def _chosen(path: str, stream: str, among: Mapping[str, Rows], log: Log) -> Rows:
    usable = [name for name in among if name not in log.unusable]
    if not stream and len(usable) == 1:
        stream = usable[0]
    if stream in among and stream in log.unusable:
        raise InputError(f"{path}: {stream} is not to be used: {log.unusable[stream]}")
    if stream not in among:
        said = repr(stream) if stream else "no stream"
        raise InputError(f"{path}: {said} is named; expected one of {', '.join(usable) or 'nothing, there is none'}")
    return among[stream]
