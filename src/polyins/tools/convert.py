"""From one data file format to another: IMU increments, positions, and what other sensors show."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from polyins.checks import stream_checks
from polyins.errors import InputError
from polyins.files import find, new_file, plain_suffix, whole_folder
from polyins.formats import kf_gins, written_table
from polyins.formats.log import Log
from polyins.formats.recognize import log_format, read_log
from polyins.formats.rows import ImuRows, SensorRows, Track
from polyins.model.recording import GnssStream, ImuStream
from polyins.reading.guess import Stream, read_stream

SUFFIXES = ".csv, .parquet (tables), .txt (KF-GINS text) or .bin (KF-GINS binary, IMU only)"
TABLES = (".csv", ".parquet")


def convert(source: str | Path, target: str | Path, stream: str | None = None) -> tuple[str, ...]:
    """Write the data of a file in the format that the target's suffix says, or of a log into a folder without one.

    The source's format is recognized by content; its columns must be those of a known format or be found by name. Axes
    and clock stay the sensor's. A folder has a Parquet file for each stream. `stream`: the one of a log that is taken.
    Returns warnings. Raises InputError for what cannot be converted, and if the target exists.
    """
    target, suffix = new_file(target), plain_suffix(target)
    log = read_log(source) if log_format(source) is not None else None
    if stream is not None and log is None:
        raise InputError(f"--stream {stream}: {find(source)} holds one stream; expected a log of several")
    if suffix == "" and log is not None and stream is None:
        return _write_all(log, source, target)
    if suffix not in (*TABLES, ".txt", ".bin"):
        folder = ", or a name without suffix for a folder with all streams" if log is not None else ""
        raise InputError(f"{target}: has suffix {target.suffix!r}; expected {SUFFIXES}{folder}")
    if log is None:
        return _write_one(target, *read_stream(source))
    name = _chosen(log, source, stream)
    return _write_one(target, log.streams[name], (), log.utc_of_zero)


def _chosen(log: Log, source: str | Path, stream: str | None) -> str:
    """Return the name of the stream that is asked for, or of the only one."""
    named = ", ".join(log.streams) or "no stream"
    if stream is None and len(log.streams) != 1:
        raise InputError(
            f"{find(source)}: holds {named}; expected one stream by --stream, or OUT without suffix for a folder of all"
        )
    if stream is not None and stream not in log.streams:
        raise InputError(f"--stream {stream}: is not in {find(source)}; expected one of {named}")
    return stream or next(iter(log.streams))


def _write_all(log: Log, source: str | Path, folder: Path) -> tuple[str, ...]:
    """Write a Parquet file for each stream; those that cannot be right are left out, with a warning."""
    warnings: list[str] = []
    with whole_folder(folder) as beside:
        for name, rows in log.streams.items():
            file = beside / f"{_file_name(name)}.parquet"
            if file.exists():
                raise InputError(f"{find(source)}: {name} has the file name of another stream; expected it by --stream")
            try:
                warnings += _write_one(file, rows, (), log.utc_of_zero)
            except InputError as error:
                warnings.append(f"{name} is left out: {log.unusable.get(name, error)}")
        if not any(beside.iterdir()):
            raise InputError(f"{find(source)}: no stream can be converted; {'; '.join(warnings) or 'there is none'}")
    return tuple(warnings)


def _file_name(stream: str) -> str:
    """Return the name of a stream as that of a file: `imu-data` of `/imu/data`, `GPS-0` of `GPS[0]`."""
    return re.sub(r"[^\w.]+", "-", stream).strip("-.") or "stream"


def _write_one(
    target: Path, rows: Stream | SensorRows, warnings: tuple[str, ...], utc_of_zero: float | None = None
) -> tuple[str, ...]:
    """Check and write one stream; returns the warnings before and those of the check."""
    if isinstance(rows, SensorRows):
        if plain_suffix(target) not in TABLES:
            raise InputError(
                f"{target}: what a sensor of {rows.kind} shows has no such format; expected .csv, .parquet"
            )
        written_table.write_sensor(target, rows, utc_of_zero)
        return warnings
    warnings = (*warnings, *_check(rows))
    write: Callable[..., None] = _write_imu if isinstance(rows, ImuRows) else _write_track
    write(target, rows, utc_of_zero)
    return warnings


def _check(stream: Stream) -> tuple[str, ...]:
    if isinstance(stream, ImuRows):
        return stream_checks.check_imu(stream, stream_checks.WHEEL_RATE_RAD_S, stream_checks.FARTHEST_OFF_AXIS_M)
    return stream_checks.check_track(stream, "positions")


def _write_imu(target: Path, rows: ImuRows, utc_of_zero: float | None) -> None:
    stream = ImuStream("", rows.time, rows.dtheta, rows.dvel)
    writers = {".txt": kf_gins.write_imu_text, ".bin": kf_gins.write_imu_binary}
    if (write := writers.get(plain_suffix(target))) is not None:
        write(target, stream)
    else:
        written_table.write_imu(target, stream, utc_of_zero)


def _write_track(target: Path, track: Track, utc_of_zero: float | None) -> None:
    suffix = plain_suffix(target)
    if suffix == ".bin":
        raise InputError(f"{target}: positions have no binary format; expected {SUFFIXES}")
    if suffix in TABLES:
        written_table.write_track(target, track, utc_of_zero)
        return
    if track.above_sea:
        raise InputError(f"{track.source.path}: heights are above the sea, KF-GINS has ellipsoidal ones; expected .csv")
    if not track.geodetic or track.position_std is None:
        raise InputError(f"{target}: a KF-GINS file holds latitude, longitude and std; {track.source.path} has not all")
    fixes = replace(track, attitude=None)
    stream = GnssStream(fixes.time, fixes.position, track.position_std, fixes.velocity, fixes.velocity_std)
    kf_gins.write_gnss(target, stream)
