"""Recordings longer than memory: read, aligned, navigated, judged and written stretch by stretch.

The same functions as for a recording in memory work on each stretch, and what the filter remembers lies in the arrays
of its `State`: the trajectory is the same bit for bit. What looks at the whole recording elsewhere looks at its
beginning here: units, axes, the search for a standstill.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.checks import stream_checks
from polyins.config import Config
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.evaluation.figures import Figures
from polyins.evaluation.summary import document
from polyins.files import find
from polyins.formats.columns import PARQUET_MAGIC
from polyins.formats.rows import ImuRows
from polyins.formats.solution_files import SolutionWriter
from polyins.model.methods import Method, find_method
from polyins.model.recording import ImuStream, Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.navigate.batch import Prepared
from polyins.navigate.choice import choose
from polyins.navigate.state import LOG_EVERY, NEXT_LOG, Outputs
from polyins.prepare import alignment, timesync
from polyins.prepare.timesync import Aligned
from polyins.reading import loading
from polyins.reading.imu_file import Extent, ImuFile, Reel
from polyins.reading.imu_stream import as_mounted

STRETCH_S = 60.0
HEAD_S = 300.0
"""the beginning, from which units and axes are checked and the start is found"""
MARGIN_S = 3.0
"""by which the stretches overlap while they are aligned"""
LARGE = 20_000_000
"""rows of all IMUs together: with so many a recording takes gigabytes when it is in memory"""


@dataclass(frozen=True)
class LongRecording:
    """A recording whose IMUs stay in their files."""

    head: Recording
    """with the beginning of the IMUs' streams only"""
    files: tuple[ImuFile, ...]
    extents: tuple[Extent, ...]
    span: tuple[float, float]
    """that all IMUs cover, s"""

    @property
    def rows(self) -> int:
        """Rows of all IMUs."""
        return sum(extent.rows for extent in self.extents)

    def subset(self, indices: Sequence[int]) -> LongRecording:
        """Return the recording with just the IMUs of those indices."""
        files, extents = tuple(self.files[i] for i in indices), tuple(self.extents[i] for i in indices)
        return replace(self, head=self.head.subset(indices), files=files, extents=extents, span=_span(files, extents))


def open_long(settings: loading.Settings, least_rows: int = LARGE) -> LongRecording | None:
    """Open a recording that can be taken in stretches and has that many rows; None for any other.

    It can if it is an array whose IMUs are in Parquet files with stamps. Raises InputError as `load` does.
    """
    config, document, warnings = settings
    if not _can_be_streamed(config, document):
        return None
    if sum(_rows(entry.file) for entry in config.imus) < least_rows:
        return None
    files = tuple(ImuFile(entry) for entry in config.imus)
    extents = tuple(file.extent() for file in files)
    span = _span(files, extents)
    ends = np.array([extent.last for extent in extents])
    if timesync.common_end(ends) > ends.min():
        return None  # one stops long before the others, which go on without it
    streams = tuple(Reel(file).until(span[0] + HEAD_S, span[0]) for file in files)
    notes = [
        note for number in range(len(files)) for note in _checked(files[number], streams[number], number, document)
    ]
    imus = tuple(as_mounted(entry) for entry in config.imus)
    head = loading.assemble(config, document, imus, streams, span)
    warnings = (*warnings, *notes, *head.warnings)
    return LongRecording(replace(head, warnings=warnings, config_text=loading.in_force(config)), files, extents, span)


def run(
    recording: LongRecording,
    folder: Path,
    method: str = "enav-fusion",
    *,
    imu: int = 0,
    stretch_s: float = STRETCH_S,
    progress: Callable[[float], None] | None = None,
) -> dict[str, Any]:
    """Navigate a recording with one method, write its solution into `folder`, and return the `run` document.

    Raises InputError as `batch.run` does, and where a row turns out wrong on the way.
    """
    row = find_method(method)
    if row.for_wheels:
        raise InputError(f"method: {row.name} is for rigs with wheels; expected one for arrays")
    if row.bank == "one":
        recording = recording.subset([imu])
    laid_out, end = _lay_out(row, recording)
    figures = Figures(recording.head.reference, recording.head.outages, recording.head.geodetic)
    begin = clock.perf_counter()
    laid_out.advance(1, 1)
    first_call_s = clock.perf_counter() - begin
    filter_s = 0.0
    with SolutionWriter(folder) as writer:
        for stretch in _whole_logs(
            _epochs(recording, laid_out, end, stretch_s), int(laid_out.plan.settings[LOG_EVERY])
        ):
            begin = clock.thread_time()
            part = _navigate(laid_out, stretch)
            filter_s += clock.thread_time() - begin
            figures.add(part)
            writer.add(part)
            if progress:
                progress(float((stretch.time[-1] - laid_out.start.time) / (end - laid_out.start.time)))
        whole = _whole(part, recording, filter_s, first_call_s)
        writer.finish(whole)
    return document(whole, figures)


def _can_be_streamed(config: Config, document: Document) -> bool:
    # what is measured on a schedule is laid out for the beginning only
    scheduled = config.filter.standstill or (config.odometer and config.odometer.constraint_interval_s)
    return (
        not scheduled
        and not (config.gnss and config.gnss.time_offset)
        and all(
            entry.wheel is None
            and entry.time_offset is None
            and entry.rate_hz is None
            and entry.gyro_range_deg_s is None
            and entry.format in ("auto", "table")
            and (entry.columns is None or entry.columns.time is not None)
            and _is_parquet(entry.file, document, index)
            for index, entry in enumerate(config.imus)
        )
    )


def _is_parquet(path: str, document: Document, index: int) -> bool:
    with document.at(["imus", index, "file"]), find(path).open("rb") as file:
        return file.read(4) == PARQUET_MAGIC


def _rows(path: str) -> int:
    from pyarrow import ArrowException, parquet

    try:
        return int(parquet.read_metadata(find(path)).num_rows)
    except (ArrowException, OSError) as error:
        raise InputError(f"{path}: is not a whole Parquet file ({str(error).splitlines()[0]})") from error


def _span(files: Sequence[ImuFile], extents: Sequence[Extent]) -> tuple[float, float]:
    ends = {file.entry.name: (extent.first, extent.last) for file, extent in zip(files, extents, strict=True)}
    return stream_checks.check_common_span(ends)


def _checked(file: ImuFile, stream: ImuStream, index: int, document: Document) -> tuple[str, ...]:
    """Check the beginning of an IMU's data; what is looked at does not depend on the axes."""
    gyro, accel = file.columns.gyro.unit, file.columns.accel.unit
    rows = ImuRows(file.source, stream.time, stream.dtheta, stream.dvel, gyro_unit=gyro, accel_unit=accel)
    place = document.place(["imus", index, "axes"])
    warnings = stream_checks.check_imu(rows)
    stream_checks.check_upright(file.entry.name, place, file.entry.axes, stream.time, stream.dvel)
    return warnings


def _lay_out(row: Method, recording: LongRecording) -> tuple[Prepared, float]:
    """Find the start in the beginning and lay the run out; returns its end as well, s."""
    head, (first, last) = recording.head, recording.span
    aligned = timesync.align(head.imus, gap_counts=_gap_counts(recording))
    wanted = head.start.time
    if wanted is not None and wanted > aligned.time[-1] - alignment.LEAST_LEFT:
        raise InputError(
            f"start: time {wanted:.3f} s; of a recording this long expected in its first {HEAD_S:g} s,"
            f" {first:.3f} to {aligned.time[-1]:.3f} s"
        )
    start = batch.start_of(row, head, aligned)
    end = last if head.start.end_time is None else min(last, head.start.end_time)
    return _light(
        batch.lay_out(row, choose(row, head.rig), head, aligned.between(start.time, np.inf), start, end=end)
    ), end


def _light(run: Prepared) -> Prepared:
    """Return a run without the data of the beginning, which are not to be held until the end."""
    none = np.empty(0)
    streams = tuple(ImuStream(stream.name, none, none, none) for stream in run.recording.imus)
    first = _part(run.aligned, slice(0, 1))
    outputs = batch.empty_outputs(1, 0, run.outputs.log.shape[3], run.plan, run.outputs.log.shape[2])
    return replace(
        run,
        recording=replace(run.recording, imus=streams),
        aligned=first,
        inputs=run.inputs._replace(time=first.time, increments=first.increments),
        outputs=outputs._replace(event_status=run.outputs.event_status, innovations=run.outputs.innovations),
    )


def _gap_counts(recording: LongRecording) -> list[int]:
    return [len(extent.gaps) for extent in recording.extents]


def _epochs(recording: LongRecording, run: Prepared, end: float, stretch_s: float) -> Iterator[Aligned]:
    """Give the epochs from the start to the end, aligned stretch by stretch."""
    reels = [Reel(file) for file in recording.files]
    before = -np.inf
    for border in _borders(recording, end, stretch_s):
        streams = tuple(reel.until(border + MARGIN_S, border - MARGIN_S) for reel in reels)
        if border > run.start.time:
            aligned = timesync.align(streams, gap_counts=_gap_counts(recording))
            yield aligned.between(max(np.nextafter(before, np.inf), run.start.time), border)
        before = border


def _borders(recording: LongRecording, end: float, stretch_s: float) -> list[float]:
    """Return where stretches end: not near a gap of any IMU, so that both its sides lie within one stretch."""
    gaps = sorted(gap for extent in recording.extents for gap in extent.gaps)
    borders = []
    border = recording.span[0] + max(stretch_s, 4.0 * MARGIN_S)
    while border < end - 2.0 * MARGIN_S:
        for begin, over in gaps:
            if begin - 2.0 * MARGIN_S < border < over + 2.0 * MARGIN_S:
                border = over + 2.0 * MARGIN_S
        borders.append(border)
        border += stretch_s
    return [*(border for border in borders if border < end - 2.0 * MARGIN_S), end]


def _whole_logs(stretches: Iterator[Aligned], log_every: int) -> Iterator[Aligned]:
    """Give stretches that begin with the last epoch of the one before and take whole steps of the log after it."""
    held: Aligned | None = None
    for stretch in stretches:
        held = stretch if held is None else _joined(held, stretch)
        taken = (len(held.time) - 1) // log_every * log_every
        if taken:
            yield _part(held, slice(0, taken + 1))
            held = _part(held, slice(taken, None))
    if held is not None and len(held.time) > 1:
        yield held


def _joined(first: Aligned, second: Aligned) -> Aligned:
    return Aligned(
        np.concatenate([first.time, second.time]),
        np.concatenate([first.increments, second.increments]),
        (),
        np.concatenate([first.missing, second.missing]),
    )


def _part(aligned: Aligned, part: slice) -> Aligned:
    # copies: a view would hold the whole
    return Aligned(aligned.time[part].copy(), aligned.increments[part].copy(), (), aligned.missing[part].copy())


def _navigate(run: Prepared, stretch: Aligned) -> Solution:
    """Take the epochs of a stretch after its first, with the state as the stretch before has left it."""
    epochs = len(stretch.time)
    increments = np.ascontiguousarray(stretch.increments)
    empty = batch.empty_outputs(epochs, 0, run.outputs.log.shape[3], run.plan, run.outputs.log.shape[2])
    outputs: Outputs = empty._replace(event_status=run.outputs.event_status, innovations=run.outputs.innovations)
    inputs = run.inputs._replace(time=stretch.time, increments=increments)
    part = replace(run, aligned=stretch, inputs=inputs, outputs=outputs)
    run.state.scalars[NEXT_LOG] = 0.0
    part.advance(1, epochs)
    return batch.solution_of(part)


def _whole(last: Solution, recording: LongRecording, filter_s: float, first_call_s: float) -> Solution:
    """Return what is known of the whole solution beside its epochs, which are those of the last part."""
    begin, end = recording.span
    warnings = [*recording.head.warnings, *timesync.late_warnings(recording.head.imus)]
    for imu, extent in zip(recording.head.rig.imus, recording.extents, strict=True):
        gaps = [gap for gap in extent.gaps if gap[1] > begin and gap[0] < end]
        if gaps:
            warnings.append(timesync.gap_warning(imu.name, gaps))
    measured = {name: one.until(float(last.time[-1])) for name, one in last.measurements.items()}
    return replace(
        last,
        measurements=measured,
        filter_s=filter_s,
        first_call_s=first_call_s,
        warnings=tuple(warnings),
    )
