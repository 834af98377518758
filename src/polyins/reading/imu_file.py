"""The file of one IMU, read in order: what is held does not grow with the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polyins.checks.no_data import AFTER, LEAP
from polyins.config import ImuColumns, ImuEntry
from polyins.files import find
from polyins.formats import columns, kf_gins, table, written_table
from polyins.formats.column_place import Column
from polyins.formats.recognize import imu_format
from polyins.formats.rows import ImuRows, RowSource
from polyins.formats.stamps import seconds_per_count
from polyins.model.findings import LEFT_OUT, Finding
from polyins.model.recording import Array, ImuStream, usual_interval
from polyins.prepare.timesync import gaps_of
from polyins.reading.imu_stream import in_array_axes, measured

CONTEXT = 64
"""rows before each piece that say what repeats and where an interval begins"""
SAMPLED = 8
"""rows of each piece that tell whether the IMU shows anything"""

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
    sample: ImuStream
    """a few rows from all over the file, in array axes"""
    findings: tuple[Finding, ...] = ()
    """of rows that show nothing of the motion"""


class ImuFile:
    """Increments of one IMU in array axes, from a file in the order of time; raises InputError for any other format."""

    def __init__(self, entry: ImuEntry, *, alone: bool) -> None:
        """`alone`: there is no other IMU that could go on without this one."""
        self.entry = entry
        self.alone = alone
        self.source = RowSource(str(find(entry.file)))
        self.columns, self._pieces = _format(entry)
        self._cells = table.imu_cells(self.columns, entry.rate_hz)

    def extent(self) -> StreamExtent:
        """Read all rows for their stamps; raise InputError as `imu_stream.read_imu` does."""
        first, last, rows, usual = np.nan, np.nan, 0, np.nan
        gaps: list[tuple[float, float]] = []
        found: list[Finding] = []
        sample = _nothing(self.entry.name)
        for fresh, findings in self._rows():
            time = self.entry.clock.common(fresh.time)
            found += findings
            if not len(time):
                continue
            if not rows:
                first, usual = time[0], usual_interval(time) if len(time) > 1 else np.nan
            gaps += gaps_of(time if not rows else np.concatenate([[last], time]), usual)
            rows, last = rows + len(time), time[-1]
            sample = _joined(sample, _part(in_array_axes(fresh, self.entry), 0, SAMPLED))
        return StreamExtent(float(first), float(last), rows, tuple(gaps), float(usual), sample, tuple(found))

    def stretches(self) -> Iterator[ImuStream]:
        """Give the rows piece by piece."""
        for rows, _ in self._rows():
            yield in_array_axes(rows, self.entry)

    def _rows(self) -> Iterator[tuple[ImuRows, tuple[Finding, ...]]]:
        """Give the rows that show something of the motion, piece by piece, and findings of those that do not."""
        before: list[Array] | None = None
        done, last = 0, -np.inf
        for source, values in self._whole_pieces():
            known = 0 if before is None else len(before[0])
            whole = values if before is None else [np.concatenate([a, b]) for a, b in zip(before, values, strict=True)]
            rows = table.imu_rows(source, whole, self.columns, self.entry.rate_hz, done - known)
            row = (0 if source.first_line else done) - known
            good, found = measured(rows, self.entry, alone=self.alone, first_row=row)
            fresh = _after(good, last)
            lines = tuple(Finding(LEFT_OUT, text, stream=self.entry.name) for text in source.warnings)
            yield fresh, (*lines, *(found if len(fresh.time) < len(rows.time) - known else ()))
            done, last = done + len(rows.time) - known, fresh.time[-1] if len(fresh.time) else last
            before = [column[-CONTEXT:] for column in whole]

    def _whole_pieces(self) -> Iterator[tuple[RowSource, list[Array]]]:
        """Give pieces that do not end soon after a leap of the stamps: what follows tells whether to believe it."""
        held: tuple[RowSource, list[Array]] | None = None
        for source, values in self._pieces(self.source.path, self._cells):
            piece = (source, values)
            if held is not None:
                piece = held[0], [np.concatenate([a, b]) for a, b in zip(held[1], values, strict=True)]
            held = piece if self._ends_after_leap(piece[1]) else None
            if held is None:
                yield piece
        if held is not None:
            yield held

    def _ends_after_leap(self, values: list[Array]) -> bool:
        if self.entry.rate_hz or self.columns.time is None:
            return False
        steps = np.diff(values[-1][-AFTER - 1 :]) * seconds_per_count(self.columns.time)
        return bool((steps > LEAP).any())


def _after(rows: ImuRows, time: float) -> ImuRows:
    first = int(np.searchsorted(rows.time, time, "right"))
    return replace(rows, time=rows.time[first:], dtheta=rows.dtheta[first:], dvel=rows.dvel[first:])


def can_be_read_in_order(entry: ImuEntry) -> bool:
    """Whether a file has a format whose rows do not depend on one another, and is packed only where it is text."""
    if _kind(entry) in ("xsens-dot", "log") or (entry.columns is not None and not _row_by_row(entry.columns)):
        return False
    parquet = columns.is_parquet(entry.file)
    return not (parquet and find(entry.file).suffix == ".gz")


def _row_by_row(columns: ImuColumns) -> bool:
    """Whether a row of the table is one of the IMU's, and its stamp one number that depends on no other row."""
    time = columns.time
    plain = time is None or not (time.dates or time.fine or time.wraps_at)
    return plain and columns.only is None and not columns.accel.apart


def _kind(entry: ImuEntry) -> str:
    if entry.format == "auto":
        return "table" if entry.columns else imu_format(entry.file)
    return entry.format


def _format(entry: ImuEntry) -> tuple[ImuColumns, Pieces]:
    if _kind(entry) == "table":
        return entry.columns or written_table.written_imu_columns(), columns.read_in_order
    return kf_gins.columns_of(entry.file, rates=_kind(entry) == "wheel-ins"), kf_gins.read_in_order


class StretchReader:
    """A stream that is read on: `until` gives a stretch of it, the next one overlapping it."""

    def __init__(self, file: ImuFile) -> None:
        self._name = file.entry.name
        self._ahead: Iterator[ImuStream] = file.stretches()
        self._held: ImuStream | None = None

    def skip(self, begin: float) -> None:
        """Let go what is not after a time, s."""
        while self._held is None or not self._held.time.size or self._held.time[-1] <= begin:
            self._held = next(self._ahead, None)
            if self._held is None:
                return
        self._held = _joined(_part(self._held, int(np.searchsorted(self._held.time, begin, "right")), None))

    def until(self, end: float, keep_from: float) -> ImuStream:
        """Return what is held, up to the first stamp after `end` at least, then let go what is before `keep_from`."""
        while self._held is None or not self._held.time.size or self._held.time[-1] <= end:
            more = next(self._ahead, None)
            if more is None:
                break
            self._held = more if self._held is None else _joined(self._held, more)
        if self._held is None:
            return _nothing(self._name)
        stretch = _part(self._held, None, int(np.searchsorted(self._held.time, end, "right")))
        kept = _part(self._held, int(np.searchsorted(self._held.time, keep_from)), None)
        self._held = _joined(kept)  # a copy: a part would hold the whole
        return stretch


def _nothing(name: str) -> ImuStream:
    return ImuStream(name, np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


def _joined(*parts: ImuStream) -> ImuStream:
    def whole(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts])

    return ImuStream(parts[0].name, whole("time"), whole("dtheta"), whole("dvel"))


def _part(stream: ImuStream, first: int | None, last: int | None) -> ImuStream:
    part = slice(first, last)
    return ImuStream(stream.name, stream.time[part], stream.dtheta[part], stream.dvel[part])
