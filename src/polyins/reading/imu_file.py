"""The Parquet file of one IMU, read stretch by stretch: what is held does not grow with the file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from polyins.checks import stream_checks
from polyins.checks.faults import without_faults
from polyins.config import ImuEntry
from polyins.errors import InputError
from polyins.files import find
from polyins.formats import table
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.columns import parquet_places
from polyins.formats.rows import ImuRows, RowSource
from polyins.model.recording import USUAL_OF, Array, ImuStream, usual_interval
from polyins.prepare.timesync import gaps_of
from polyins.reading.imu_stream import in_array_axes

ROWS = 16_384
"""read at once"""
BUFFER_BYTES = 1 << 18
"""of a column; without it a whole row group would be held"""


@dataclass(frozen=True)
class Extent:
    """What the stamps of a whole file say, on the recording's clock."""

    first: float
    """s"""
    last: float
    """s"""
    rows: int
    gaps: tuple[tuple[float, float], ...]
    """the last stamp before and the first after each"""


class ImuFile:
    """Increments of one IMU in array axes, from a Parquet file with stamps, in the order of time."""

    def __init__(self, entry: ImuEntry) -> None:
        self.entry = entry
        self.columns = entry.columns or table.written_imu_columns()
        self.source = RowSource(str(find(entry.file)))
        self.places = parquet_places(self.source.path, table.imu_cells(self.columns))

    def extent(self) -> Extent:
        """Read the stamps alone; raise InputError where they do not increase."""
        first, last, rows, gaps, usual = np.nan, np.nan, 0, [], np.nan
        for time in self._stamps():
            if not rows:
                first, usual = time[0], usual_interval(time)
            known = time if not rows else np.concatenate([[last], time])
            self._check(known, max(rows - 1, 0))
            gaps += gaps_of(known, usual)
            rows, last = rows + len(time), time[-1]
        if rows < 2:
            raise InputError(f"{self.source.path}: {rows} row(s); expected at least 2")
        return Extent(float(first), float(last), rows, tuple(gaps))

    def stretches(self) -> Iterator[ImuStream]:
        """Give the rows batch by batch; raise InputError for values that are not numbers."""
        before: list[Array] | None = None
        done = 0
        for values in self._batches(self.places):
            whole = values if before is None else [np.concatenate([a, b]) for a, b in zip(before, values, strict=True)]
            rows = table.imu_rows(self.source, whole, self.columns)
            skipped = 0 if before is None else 1
            fresh = ImuRows(self.source, rows.time[skipped:], rows.dtheta[skipped:], rows.dvel[skipped:])
            stream_checks.check_finite(self.source, {"gyro": fresh.dtheta, "accel": fresh.dvel}, done)
            for text in without_faults(fresh, self.entry.name, self.entry.clock_offset_s)[1]:
                raise InputError(
                    text.replace("left out", "of a recording this long nothing is left out; expected none")
                )
            yield in_array_axes(fresh, self.entry)
            before = [column[-1:] for column in values]
            done += len(fresh.time)

    def _check(self, time: Array, row: int) -> None:
        stream_checks.check_finite(self.source, {"time": time}, row)
        stream_checks.check_order(self.source, time, first_row=row)

    def _stamps(self) -> Iterator[Array]:
        assert self.columns.time is not None
        unit = table.SECONDS[self.columns.time.unit]
        for (stamps,) in self._batches(self.places[-1:]):
            yield stamps * unit + self.entry.clock_offset_s

    def _batches(self, names: list[str]) -> Iterator[list[Array]]:
        """Give columns, the first time as many rows as tell the usual interval."""
        from pyarrow import ArrowException, chunked_array, float64, parquet

        try:
            file = parquet.ParquetFile(self.source.path, buffer_size=BUFFER_BYTES, pre_buffer=False)
            for batch in file.iter_batches(max(ROWS, USUAL_OF + 1), columns=names, use_threads=False):
                yield [to_numpy(chunked_array([batch.column(name).cast(float64(), safe=False)])) for name in names]
        except (ArrowException, OSError) as error:
            raise InputError(f"{self.source.path}: cannot be read ({str(error).splitlines()[0]})") from error


class Reel:
    """A stream that is wound on: `until` gives a stretch of it, the next one overlapping it."""

    def __init__(self, file: ImuFile) -> None:
        self._ahead: Iterator[ImuStream] = file.stretches()
        self._held: ImuStream | None = None

    def until(self, end: float, keep_from: float) -> ImuStream:
        """Return what is held, up to the first stamp after `end` at least, then let go what is before `keep_from`."""
        while self._held is None or self._held.time[-1] <= end:
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
