"""Which streams files hold, and which of them is what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from polyins.errors import InputError
from polyins.formats.columns import open_table
from polyins.formats.log import Log
from polyins.formats.recognize import data_format, log_format, read_log
from polyins.formats.rows import ImuRows, SensorRows, Track
from polyins.reading.clocks import utc_of_file
from polyins.reading.guess import read_stream, read_table
from polyins.reading.half_imu import HalfImu, joined_columns
from polyins.reading.table_imus import described
from polyins.reading.table_stream import TableStream


@dataclass(frozen=True)
class FoundStream:
    """One stream, and where it is."""

    path: str | Path
    rows: ImuRows | Track | SensorRows
    stream: str = ""
    """its name, in a log"""
    log: Log | None = None
    table: TableStream | None = None

    @property
    def utc_of_zero(self) -> float | None:
        """Unix time at which its stamps are zero, s, where its file tells it; a log gets fixes when they are old."""
        if self.log is None:
            return utc_of_file(self.path)
        return None if self.log.utc_of_zero is None else self.log.utc_of_zero + (self.log.fix_age or 0.0)

    @property
    def place(self) -> str:
        """Its file, and its name in it."""
        return f"{self.path}, {self.stream}" if self.stream else str(self.path)

    def shift_to(self, first: FoundStream) -> float | None:
        """Return what brings its stamps to the clock of the first IMU, s, or None where files do not tell."""
        if self.log is first.log and self.log is not None:
            return 0.0
        zero, base = self.utc_of_zero, first.utc_of_zero
        return None if zero is None or base is None else round(zero - base, 6)

    @property
    def is_estimate(self) -> bool:
        """Whether positions are another system's solution by their format: no measurements."""
        if self.log is not None:
            return self.stream in self.log.references
        return data_format(self.path) == "kf-gins-nav"

    @property
    def is_receiver(self) -> bool:
        """Whether positions are those of a log's receiver, which judge nothing."""
        return self.log is not None and not self.is_estimate and not self.has_attitude

    @property
    def has_attitude(self) -> bool:
        """Whether positions have an attitude beside them."""
        return isinstance(self.rows, Track) and self.rows.attitude is not None


def read_sources(paths: Sequence[str | Path]) -> tuple[list[FoundStream], list[str]]:
    """Return the streams that can be used, and why others are not; raises InputError if no file is readable."""
    found: list[FoundStream] = []
    halves: list[HalfImu] = []
    left_out: list[str] = []
    refused: list[InputError] = []
    for path in paths:
        try:
            if log_format(path) is not None:
                log = read_log(path)
                found += [
                    FoundStream(path, rows, name, log) for name, rows in log.streams.items() if name not in log.unusable
                ]
                left_out += [f"{path}: {name} is not used: {why}" for name, why in log.unusable.items()]
                left_out += [f"{path}: {note}" for note in log.notes]
            elif data_format(path) == "table":
                streams = read_table(path)
                if isinstance(streams, HalfImu):
                    halves.append(streams)
                else:
                    found += [FoundStream(path, one.rows, table=one) for one in streams]
            else:
                found.append(FoundStream(path, read_stream(path)[0]))
        except InputError as error:
            refused.append(error)
    found += _paired(halves, left_out)
    if refused and not found:
        raise refused[0]
    return found, [*left_out, *(f"not used: {error}" for error in refused)]


def _paired(halves: Sequence[HalfImu], left_out: list[str]) -> list[FoundStream]:
    """Return the IMUs of files of a gyro and files of an accelerometer, in their order."""
    gyros, accels = ([half for half in halves if half.what == what] for what in ("gyro", "accel"))
    found = []
    for gyro, accel in zip(gyros, accels, strict=False):
        one = described(open_table(gyro.source.path), *joined_columns(gyro, accel))
        found.append(FoundStream(gyro.source.path, one.rows, table=one))
    for half in (*gyros[len(accels) :], *accels[len(gyros) :]):
        left_out.append(f"{half.source.path}: holds the {half.what} of an IMU alone, and is not used")
    return found


@dataclass(frozen=True)
class Roles:
    """Which of the sources is what; there is at least one IMU."""

    imus: Sequence[FoundStream]
    gnss: FoundStream | None = None
    reference: FoundStream | None = None
    heading: FoundStream | None = None
    odometer: FoundStream | None = None
    height: FoundStream | None = None
    unused: tuple[FoundStream, ...] = ()
    """more positions"""

    @property
    def span(self) -> tuple[float, float]:
        """The times that all IMUs cover, s."""
        times = [one.rows.time for one in self.imus]
        return max(time[0] for time in times), min(time[-1] for time in times)

    @property
    def tracks(self) -> list[FoundStream]:
        """All positions."""
        return [one for one in (self.gnss, self.reference, *self.unused) if one is not None]


def roles(read: Sequence[FoundStream]) -> Roles:
    """Return what is what: the first sensor of each kind, a receiver, and a reference.

    Another system's solution comes last, one with attitude is a reference rather than a receiver's, if there is a
    choice, and positions computed afterwards are better than the log's.
    """
    tracks = [one for one in read if isinstance(one.rows, Track)]
    tracks.sort(key=lambda one: (one.is_estimate, one.has_attitude, one.log is not None))
    if len(tracks) > 2 and tracks[-1].is_estimate and not tracks[1].is_estimate:
        tracks.insert(1, tracks.pop())
    gnss = tracks.pop(0) if tracks and not tracks[0].is_estimate else None
    reference = tracks.pop(0) if tracks and not tracks[0].is_receiver else None
    sensors = {one.rows.kind: one for one in reversed(read) if isinstance(one.rows, SensorRows)}
    return Roles(
        [one for one in read if isinstance(one.rows, ImuRows)],
        gnss,
        reference,
        heading=sensors.get("heading"),
        odometer=sensors.get("odometer"),
        height=sensors.get("height"),
        unused=tuple(tracks),
    )
