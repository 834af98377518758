"""The file of one IMU, read in order: what is held does not grow with the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polyins.checks import stream_checks
from polyins.checks.faults import without_faults
from polyins.config import ImuColumns, ImuEntry
from polyins.errors import InputError
from polyins.files import find
from polyins.formats import columns, kf_gins, table
from polyins.formats.columns import Column
from polyins.formats.recognize import imu_format
from polyins.formats.rows import ImuRows, RowSource
from polyins.model.recording import Array, ImuStream, usual_interval
from polyins.prepare.timesync import gaps_of
from polyins.reading.imu_stream import in_array_axes

CONTEXT = 64
"""rows before each piece that say what repeats and where an interval begins"""

Pieces = Callable[[str, Sequence[Column]], Iterator[tuple[RowSource, list[Array]]]]


@dataclass(frozen=True)
class StreamExtent:
    """What the stamps of a whole file say, on the recording's clock."""

    first: float
    """s"""
    last: float
    """s"""
    rows: int
    gaps: tuple[tuple[float, float], ...]
    """the last stamp before and the first after each"""
    interval: float
    """the usual one, s"""
    warnings: tuple[str, ...] = ()
    """of rows that the chip did not measure"""


class ImuFile:
    """Increments of one IMU in array axes, from a file in the order of time; raises InputError for any other format."""

    def __init__(self, entry: ImuEntry) -> None:
        self.entry = entry
        self.source = RowSource(str(find(entry.file)))
        self.columns, self._pieces = _format(entry)
        self._cells = table.imu_cells(self.columns, entry.rate_hz)

    def extent(self) -> StreamExtent:
        """Read all rows for their stamps; raise InputError where they do not increase or values are no numbers."""
        first, last, rows, usual = np.nan, np.nan, 0, np.nan
        gaps: list[tuple[float, float]] = []
        warnings: list[str] = []
        for fresh, texts in self._rows():
            time = fresh.time + self.entry.clock_offset_s
            warnings += texts
            if not len(time):
                continue
            if not rows:
                first, usual = time[0], usual_interval(time) if len(time) > 1 else np.nan
            gaps += gaps_of(time if not rows else np.concatenate([[last], time]), usual)
            rows, last = rows + len(time), time[-1]
        if rows < 2:
            raise InputError(f"{self.source.path}: {rows} row(s); expected at least 2")
        return StreamExtent(float(first), float(last), rows, tuple(gaps), float(usual), tuple(warnings))

    def stretches(self) -> Iterator[ImuStream]:
        """Give the rows piece by piece."""
        for rows, _ in self._rows():
            yield in_array_axes(rows, self.entry)

    def _rows(self) -> Iterator[tuple[ImuRows, tuple[str, ...]]]:
        """Give the rows that the chip measured, piece by piece, and warnings of those that it did not."""
        before: list[Array] | None = None
        done = 0
        for source, values in self._pieces(self.source.path, self._cells):
            known = 0 if before is None else len(before[0])
            whole = values if before is None else [np.concatenate([a, b]) for a, b in zip(before, values, strict=True)]
            rows = table.imu_rows(source, whole, self.columns, self.entry.rate_hz, done - known)
            row = (0 if source.first_line else done) - known
            stream_checks.check_finite(source, {"time": rows.time, "gyro": rows.dtheta, "accel": rows.dvel}, row)
            stream_checks.check_order(source, rows.time, first_row=row)
            good, texts = without_faults(rows, self.entry.name, self.entry.clock_offset_s)
            fresh = _after(good, rows.time[known - 1] if known else -np.inf)
            yield fresh, texts if len(fresh.time) < len(rows.time) - known else ()
            done += len(rows.time) - known
            before = [column[-CONTEXT:] for column in whole]


def _after(rows: ImuRows, time: float) -> ImuRows:
    first = int(np.searchsorted(rows.time, time, "right"))
    return replace(rows, time=rows.time[first:], dtheta=rows.dtheta[first:], dvel=rows.dvel[first:])


def can_be_read_in_order(entry: ImuEntry) -> bool:
    """Whether a file has a format whose rows do not depend on one another, and is packed only where it is text."""
    if _kind(entry) == "xsens-dot":
        return False
    parquet = columns.is_parquet(entry.file)
    return not (parquet and find(entry.file).suffix == ".gz")


def _kind(entry: ImuEntry) -> str:
    if entry.format == "auto":
        return "table" if entry.columns else imu_format(entry.file)
    return entry.format


def _format(entry: ImuEntry) -> tuple[ImuColumns, Pieces]:
    if _kind(entry) == "table":
        return entry.columns or table.written_imu_columns(), columns.read_in_order
    return kf_gins.columns_of(entry.file, rates=_kind(entry) == "wheel-ins"), kf_gins.read_in_order


class StretchReader:
    """A stream that is read on: `until` gives a stretch of it, the next one overlapping it."""

    def __init__(self, file: ImuFile) -> None:
        self._ahead: Iterator[ImuStream] = file.stretches()
        self._held: ImuStream | None = None

    def until(self, end: float, keep_from: float) -> ImuStream:
        """Return what is held, up to the first stamp after `end` at least, then let go what is before `keep_from`."""
        while self._held is None or not self._held.time.size or self._held.time[-1] <= end:
            more = next(self._ahead, None)
            if more is None:
                break
            self._held = more if self._held is None else _joined(self._held, more)
        assert self._held is not None
        stretch = _part(self._held, None, int(np.searchsorted(self._held.time, end, "right")))
        kept = _part(self._held, int(np.searchsorted(self._held.time, keep_from)), None)
        self._held = _joined(kept)  # a copy: a part would hold the whole
        return stretch


def _joined(*parts: ImuStream) -> ImuStream:
    def whole(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts])

    return ImuStream(parts[0].name, whole("time"), whole("dtheta"), whole("dvel"))


def _part(stream: ImuStream, first: int | None, last: int | None) -> ImuStream:
    part = slice(first, last)
    return ImuStream(stream.name, stream.time[part], stream.dtheta[part], stream.dvel[part])
