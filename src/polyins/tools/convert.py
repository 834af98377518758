"""From one data file format to another: IMU increments and positions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from polyins.checks import stream_checks
from polyins.errors import InputError
from polyins.files import plain_suffix
from polyins.formats import kf_gins, table
from polyins.formats.rows import ImuRows, Track
from polyins.model.recording import GnssStream, ImuStream
from polyins.reading.guess import Stream, read_stream

SUFFIXES = ".csv, .parquet (tables), .txt (KF-GINS text) or .bin (KF-GINS binary, IMU only)"


def convert(source: str | Path, target: str | Path) -> tuple[str, ...]:
    """Write the IMU increments or the positions of a data file in the format that the target's suffix says.

    The source's format is recognized by content; its columns must be those of a known format or be found by name. Axes
    and clock stay the sensor's. Returns warnings. Raises InputError for sources and suffixes that cannot be converted.
    """
    stream, guesses = read_stream(source)
    if plain_suffix(target) not in (".csv", ".parquet", ".txt", ".bin"):
        raise InputError(f"{target}: has suffix {Path(target).suffix!r}; expected {SUFFIXES}")
    warnings = (*guesses, *_check(stream))
    if isinstance(stream, ImuRows):
        _write_imu(target, stream)
    else:
        _write_track(target, stream)
    return warnings


def _check(stream: Stream) -> tuple[str, ...]:
    if isinstance(stream, ImuRows):
        return stream_checks.check_imu(stream, stream_checks.WHEEL_RATE_RAD_S, stream_checks.FARTHEST_OFF_AXIS_M)
    return stream_checks.check_track(stream, "positions")


def _write_imu(target: str | Path, rows: ImuRows) -> None:
    stream = ImuStream("", rows.time, rows.dtheta, rows.dvel)
    writers = {".txt": kf_gins.write_imu_text, ".bin": kf_gins.write_imu_binary}
    writers.get(plain_suffix(target), table.write_imu)(target, stream)


def _write_track(target: str | Path, track: Track) -> None:
    if track.above_sea:
        raise InputError(f"{track.source.path}: heights are above the sea; expected ellipsoidal ones to convert")
    suffix = plain_suffix(target)
    if suffix == ".bin":
        raise InputError(f"{target}: positions have no binary format; expected {SUFFIXES}")
    if suffix != ".txt":
        table.write_track(target, track)
        return
    if not track.geodetic or track.position_std is None:
        raise InputError(f"{target}: a KF-GINS file holds latitude, longitude and std; {track.source.path} has not all")
    fixes = replace(track, attitude=None)
    stream = GnssStream(fixes.time, fixes.position, track.position_std, fixes.velocity, fixes.velocity_std)
    kf_gins.write_gnss(target, stream)
