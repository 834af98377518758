"""Recordings longer than memory: their IMUs stay in their files and are aligned stretch by stretch.

What looks at the whole recording elsewhere looks at its beginning here: units, axes, the search for a start.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from polyins.checks import faults, stream_checks, wheel_checks
from polyins.checks.vouched import vouched
from polyins.config import Config
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.files import find_named
from polyins.formats.columns import is_parquet
from polyins.formats.rows import ImuRows
from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, Recording, usual_interval
from polyins.navigate.restart import Pause, borders, common_pauses, hopeless, part_of
from polyins.prepare import timesync
from polyins.prepare.timesync import Aligned, Whole
from polyins.reading import clocks, loading, usable
from polyins.reading.imu_file import ImuFile, StreamExtent, StretchReader, can_be_read_in_order
from polyins.reading.imu_stream import as_mounted

STRETCH_S = 30.0
HEAD_S = 300.0
HEAD_ROWS = 1_000_000
"""of all IMUs together: so much of the beginning, or HEAD_S, tells units, axes and the start"""
AROUND_START_S = 60.0
"""of the beginning after a start that is given"""
MOST_HEAD_ROWS = 20_000_000
"""up to a start that is given"""
CHECKED_S = 30.0
"""of an IMU that begins later, which tell its units and axes"""
MARGIN_S = 3.0
"""by which the stretches overlap while they are aligned"""
LEAST_FIRST_S = 10.0
"""of the first stretch, whose epochs tell the rate"""
LARGE = 3_000_000
"""rows of all IMUs together: with so many a recording takes nearly a gigabyte when it is in memory"""
BYTES_OF_ROW = 40
"""of a file, seldom less: tells without reading it that it cannot have many rows"""


@dataclass(frozen=True)
class LongRecording:
    """A recording whose IMUs stay in their files."""

    head: Recording
    """with the beginning of the IMUs' streams only"""
    files: tuple[ImuFile, ...]
    extents: tuple[StreamExtent, ...]
    span: tuple[float, float]
    """that all IMUs cover, s"""
    within: tuple[float, float] = (-np.inf, np.inf)
    """s: what is later than the first and not than the second belongs to it"""

    @property
    def rows(self) -> int:
        """Rows of all IMUs."""
        return sum(extent.rows for extent in self.extents)

    @property
    def gaps(self) -> list[list[tuple[float, float]]]:
        """Where each IMU has no data within the span, s, s, its ends included if others go on without it."""
        return [
            ([(self.span[0], one.first)] if one.first - self.span[0] > timesync.LATE else []) + self._later_gaps(one)
            for one in self.extents
        ]

    def _later_gaps(self, of: StreamExtent) -> list[tuple[float, float]]:
        begin, end = self.span
        known = [gap for gap in of.gaps if gap[1] > begin and gap[0] < end]
        return known + ([(max(of.last, begin), end)] if end - of.last > timesync.LATE else [])

    def subset(self, indices: Sequence[int]) -> LongRecording:
        """Return the recording with just the IMUs of those indices."""
        files, extents = tuple(self.files[i] for i in indices), tuple(self.extents[i] for i in indices)
        return replace(self, head=self.head.subset(indices), files=files, extents=extents, span=_span(files, extents))

    def pauses(self) -> list[Pause]:
        """Return where no IMU has data for hopelessly long, see `restart`."""
        edges = [[(-np.inf, one.first), *one.gaps, (one.last, np.inf)] for one in self.extents]
        return common_pauses(edges, hopeless(self.head.rig.has_wheels))

    def parts(self, found: Sequence[Pause]) -> Iterator[tuple[Pause | None, LongRecording]]:
        """Give the parts between pauses, each with the one before it."""
        for pause, begin, end in borders(found):
            yield pause, self._between(begin, end, pause)

    def rest(self, pause: Pause) -> LongRecording:
        """Return what is left of it after a state that is no number."""
        return self._between(float(np.nextafter(pause.end, -np.inf)), self.within[1], pause)

    def _between(self, begin: float, end: float, pause: Pause | None) -> LongRecording:
        streams = self.head.imus if pause is None else tuple(self._beginning_after(begin, pause.end))
        head = part_of(replace(self.head, imus=streams), begin, end, pause)
        extents = tuple(map(partial(_extent_within, begin, end), self.extents, head.imus))
        there = [one for one in extents if one.first <= one.last]
        span = _common(there, wait=not self._bridge) if there else (begin, end)
        return replace(self, head=head, extents=extents, span=span, within=(begin, end))

    def check(self) -> None:
        """Raise InputError if the IMUs have less than two seconds in common."""
        timesync.check_common([file.entry.name for file in self.files], self._whole, wait=not self._bridge)

    def _beginning_after(self, begin: float, first: float) -> Iterator[ImuStream]:
        """Give the streams of the IMUs from a time on for as long as a start takes, s."""
        rate = sum(1.0 / extent.interval for extent in self.extents)
        for file in self.files:
            reader = StretchReader(file)
            reader.skip(begin)
            yield reader.until(first + max(HEAD_S, HEAD_ROWS / rate), begin)

    def beginning(self) -> Aligned:
        """Return the beginning of the IMUs on one time base."""
        return timesync.align(self.head.imus, self._bridge, self._whole)

    def stretches(self, begin: float, end: float, stretch_s: float = STRETCH_S) -> Iterator[Aligned]:
        """Give the epochs from begin to end, s, aligned stretch by stretch."""
        readers = [StretchReader(file) for file in self.files]
        for reader in readers:
            reader.skip(self.within[0])
        before = -np.inf
        for border in self._borders(end, stretch_s):
            if begin < border < min(begin + LEAST_FIRST_S, end):
                continue
            streams = tuple(
                reader.until(min(border + MARGIN_S, self.within[1]), border - MARGIN_S) for reader in readers
            )
            if border > begin:
                aligned = timesync.align(streams, self._bridge, self._whole)
                yield aligned.between(max(np.nextafter(before, np.inf), begin), border)
            before = border

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Say which IMUs begin late or have gaps."""
        names, gaps = [file.entry.name for file in self.files], map(self._later_gaps, self.extents)
        late = timesync.late_beginnings(names, self._whole.begins, wait=not self._bridge)
        return (*late, *(timesync.gap_finding(name, known) for name, known in zip(names, gaps, strict=True) if known))

    @property
    def _bridge(self) -> bool:
        return not self.head.rig.has_wheels

    @property
    def _whole(self) -> Whole:
        of = self.extents
        begins, ends, intervals = np.array([(one.first, one.last, one.interval) for one in of]).T
        return Whole(tuple(len(one.gaps) for one in of), begins, ends, intervals)

    def _borders(self, end: float, stretch_s: float) -> list[float]:
        """Return where stretches end: not near a gap or an end of any IMU, whose both sides lie within one stretch."""
        gaps = sorted(
            [gap for one in self.extents for gap in ((one.first, one.first), *one.gaps, (one.last, one.last))]
        )
        borders = []
        border = self.span[0] + max(stretch_s, 4.0 * MARGIN_S)
        while border < end - 2.0 * MARGIN_S:
            for begin, over in gaps:
                if begin - 2.0 * MARGIN_S < border < over + 2.0 * MARGIN_S:
                    border = over + 2.0 * MARGIN_S
            borders.append(border)
            border += stretch_s
        return [*(border for border in borders if border < end - 2.0 * MARGIN_S), end]


def open_long(settings: loading.Settings, least_rows: int = LARGE) -> LongRecording | None:
    """Open a recording that can be taken in stretches and has that many rows; None for any other.

    It can unless a clock offset is estimated, a gyro's range is given, or the format repairs rows by their neighbours.
    Raises InputError as `load` does.
    """
    config, document = settings.config, settings.document
    if not _can_be_streamed(config, document):
        return None
    if sum(_rows_at_most(entry.file) for entry in config.imus) < least_rows:
        return None
    alone = len(config.imus) == 1
    files = tuple(ImuFile(entry, alone=alone) for entry in config.imus)
    extents = tuple(file.extent() for file in files)
    if sum(extent.rows for extent in extents) < least_rows:
        return None
    notes = wheel_checks.check_settings(config, document)
    known = config
    alive, dead = faults.alive([extent.sample for extent in extents])
    config, files, extents = _of_imus(alive, config, files, extents)
    kept, apart = usable.overlapping(config.imus, [(extent.first, extent.last) for extent in extents])
    config, files, extents = _of_imus(kept, config, files, extents)
    places = [alive[i] for i in kept]
    span = _span(files, extents)
    until = _head_end(config, document, extents, span)
    streams = tuple(StretchReader(file).until(until, span[0]) for file in files)
    beginnings = [
        StretchReader(file).until(max(until, extent.first + CHECKED_S), extent.first)
        for file, extent in zip(files, extents, strict=True)
    ]
    checked = [text for both in zip(files, beginnings, strict=True) for text in _checked(*both, config.checks.accept)]
    notes += loading.one_by_kind(checked)
    with vouched(config.checks.accept, notes):
        faults.check_distinct(streams)
    findings = (*dead, *apart, *(finding for extent in extents for finding in extent.findings))
    kept, fallen = usable.upright(config.imus, places, beginnings, document, config.checks.accept)
    if fallen:
        config, files, extents = _of_imus(kept, config, files, extents)
        span, streams = _span(files, extents), tuple(streams[i] for i in kept)
    imus = tuple(as_mounted(entry) for entry in config.imus)
    head = loading.assemble(config, document, imus, streams, span)
    warnings = (*settings.warnings, *notes, *head.warnings)
    findings = (*findings, *fallen, *settings.findings)
    text = loading.in_force(known)
    return LongRecording(replace(head, warnings=warnings, findings=findings, config_text=text), files, extents, span)


def _of_imus(
    indices: Sequence[int], config: Config, files: Sequence[ImuFile], extents: Sequence[StreamExtent]
) -> tuple[Config, tuple[ImuFile, ...], tuple[StreamExtent, ...]]:
    kept = config.model_copy(update={"imus": tuple(config.imus[i] for i in indices)})
    return kept, tuple(files[i] for i in indices), tuple(extents[i] for i in indices)


def _extent_within(begin: float, end: float, whole: StreamExtent, beginning: ImuStream) -> StreamExtent:
    """Return the extent of what lies after a time and up to another, s, of which the beginning is given."""
    gaps = tuple(gap for gap in whole.gaps if gap[0] > begin and gap[1] <= end)
    if not beginning.time.size:
        return replace(whole, first=np.inf, last=-np.inf, gaps=gaps)
    last = next((gap[0] for gap in whole.gaps if gap[0] <= end < gap[1]), whole.last)
    interval = usual_interval(beginning.time) if beginning.time.size > 1 else whole.interval
    return replace(whole, first=float(beginning.time[0]), last=last, gaps=gaps, interval=interval)


def _common(extents: Sequence[StreamExtent], *, wait: bool) -> tuple[float, float]:
    """Return when the IMUs begin and end together, s."""
    begins, ends = np.array([(one.first, one.last) for one in extents]).T
    return float(begins.max()) if wait else timesync.common_begin(begins), timesync.common_end(ends)


def _head_end(config: Config, document: Document, extents: Sequence[StreamExtent], span: tuple[float, float]) -> float:
    """Return up to which time the beginning of the IMUs is held, s."""
    rate = sum(1.0 / extent.interval for extent in extents)
    until = span[0] + max(HEAD_S, HEAD_ROWS / rate)
    for key in ("time_s", "static_interval_s"):
        value = getattr(config.start, key)
        if value is None:
            continue
        until = max(until, float(np.max(value)) + AROUND_START_S)
        if (until - span[0]) * rate > MOST_HEAD_ROWS and until < span[1]:
            latest = span[0] + MOST_HEAD_ROWS / rate - AROUND_START_S
            raise document.error(["start", key], f"is late in a recording this long; expected at most {latest:.0f} s")
    return until


def _can_be_streamed(config: Config, document: Document) -> bool:
    for index, entry in enumerate(config.imus):
        with document.at(["imus", index, "file"]):
            find_named(entry.file)
    return not clocks.to_be_found(config) and all(
        entry.gyro_range_deg_s is None
        and (entry.rate_hz or entry.columns is None or entry.columns.time is not None)
        and can_be_read_in_order(entry)
        for entry in config.imus
    )


def _rows_at_most(path: str) -> int:
    found = find_named(path)
    if found.suffix != ".gz" and is_parquet(found):
        from pyarrow import ArrowException, parquet

        try:
            return int(parquet.read_metadata(found).num_rows)
        except (ArrowException, OSError) as error:
            raise InputError(f"{path}: is not a whole Parquet file ({str(error).splitlines()[0]})") from error
    packed = 5 if found.suffix == ".gz" else 1
    return packed * found.stat().st_size // BYTES_OF_ROW


def _span(files: Sequence[ImuFile], extents: Sequence[StreamExtent]) -> tuple[float, float]:
    ends = {file.entry.name: (extent.first, extent.last) for file, extent in zip(files, extents, strict=True)}
    return stream_checks.check_common_span(ends, wait=any(file.entry.wheel for file in files))


def _checked(file: ImuFile, stream: ImuStream, accept: Collection[str]) -> tuple[str, ...]:
    """Check the beginning of an IMU's data; what is looked at does not depend on the axes."""
    gyro, accel, wheel = file.columns.gyro.unit, file.columns.accel.unit, file.entry.wheel
    rows = ImuRows(file.source, stream.time, stream.dtheta, stream.dvel, gyro_unit=gyro, accel_unit=accel)
    if wheel is not None:
        return stream_checks.check_imu(rows, stream_checks.WHEEL_RATE_RAD_S, wheel.radius_m, accept)
    return stream_checks.check_imu(rows, accept=accept)
