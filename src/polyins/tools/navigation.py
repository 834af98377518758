"""One method over a recording in memory or in its files: navigated, judged and written stretch by stretch.

What the filter remembers lies in its state, so that a trajectory in stretches is that of the whole bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.evaluation.documents import RunDocument
from polyins.evaluation.errors import Errors
from polyins.evaluation.figures import Figures
from polyins.evaluation.summary import document
from polyins.evaluation.verdict import of_measurements
from polyins.formats.solution_files import SolutionWriter
from polyins.model.findings import Finding, notes
from polyins.model.methods import Method, find_method
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.navigate import batch, restart
from polyins.navigate.choice import Choice, choose
from polyins.navigate.restart import Known, Pause
from polyins.prepare.alignment import Start
from polyins.prepare.data_findings import of_data
from polyins.prepare.radii import of_radii
from polyins.prepare.timesync import Aligned
from polyins.reading.long_recording import STRETCH_S, LongRecording
from polyins.report.decimation import kept_for_display

SHOWN_EPOCHS = 8000
"""epochs of a long recording's solution that are kept for the report, at least"""
SHOWN_LOGS = 2000
"""rows of its log of IMU errors, likewise"""


@dataclass(frozen=True)
class Outcome:
    """What one method made of a recording."""

    solution: Solution
    """of a long recording the epochs that a picture needs"""
    errors: Errors | None
    """of those epochs"""
    summary: RunDocument
    """the `run` document"""


def head(recording: Recording | LongRecording) -> Recording:
    """Return the recording without what lies in its files."""
    return recording.head if isinstance(recording, LongRecording) else recording


def run(
    recording: Recording | LongRecording,
    method: str = "enav-fusion",
    *,
    imu: int = 0,
    folders: Mapping[Path, float | None] | None = None,
    stretch_s: float = STRETCH_S,
    progress: Callable[[float], None] | None = None,
) -> Outcome:
    """Navigate with one method, and write the solution into `folders`, each with so many rows a second, or all.

    Raises InputError as `batch.run` does, and for a row that turns out wrong on the way.
    """
    known = head(recording)
    figures = Figures(known.reference, known.outages, known.geodetic)
    shown: list[tuple[Solution, Errors | None]] = []
    with ExitStack() as stack:
        writers = [stack.enter_context(SolutionWriter(*folder)) for folder in (folders or {}).items()]
        for part in _parts(recording, find_method(method), imu, stretch_s, progress):
            errors = figures.add(part)
            for writer in writers:
                writer.add(part)
            if isinstance(recording, LongRecording):
                share = (part.time[-1] - part.time[0]) / (recording.span[1] - recording.span[0])
                part, errors = _thinned(part, errors, float(share))
            shown.append((part, errors))
        solution = Solution.joined([part for part, _ in shown])
        told = solution.findings
        found = replace(solution, findings=(*told, *of_measurements(solution.measurements, told)))
        for writer in writers:
            writer.finish(found)
    judged = [errors for _, errors in shown if errors is not None]
    return Outcome(solution, Errors.joined(judged) if judged else None, document(solution, figures))


def _parts(
    recording: Recording | LongRecording,
    row: Method,
    imu: int,
    stretch_s: float,
    progress: Callable[[float], None] | None,
) -> Iterator[Solution]:
    if isinstance(recording, Recording):
        yield batch.run(recording, row.name, imu=imu, progress=progress)
        return
    choice, of_wheels = choose(row, recording.head.rig, imu), of_radii(recording.head)
    recording, choice = recording.subset(choice.all), choice.renumbered()
    span = min(one.first for one in recording.extents), max(one.last for one in recording.extents)

    def of_part(part: LongRecording, before: Known | None, pause: Pause | None) -> Iterator[tuple[Solution, Known]]:
        part = replace(part, head=restart.begun(part.head, before, pause))
        part.check()
        for solution, known in _stretched(part, row, choice, stretch_s, before):
            if progress:
                progress((known.time - span[0]) / (span[1] - span[0]))
            yield solution, known

    for part in restart.run_parts(recording.parts(recording.pauses()), of_part, LongRecording.rest):
        found = (*part.findings, *(one for one in of_wheels if one not in part.findings))
        yield replace(part, recording_span=span, findings=found)


def _stretched(
    recording: LongRecording, row: Method, choice: Choice, stretch_s: float, before: Known | None
) -> Iterator[tuple[Solution, Known]]:
    """Navigate one part stretch by stretch; `before`: what was known before it."""
    start, end = _extent(recording, row, before)
    run: batch.Prepared | None = None
    silent = _Silences(row, choice, recording.head)
    votes = of_data(recording.head, recording.beginning(), recording.span[1])
    for stretch in _whole_logs(recording.stretches(start.time, end, stretch_s)):
        silent.add(stretch)
        run = _laid_out(row, choice, recording, stretch, start) if run is None else run.at(stretch)
        found = (
            *notes(recording.head.warnings),
            *recording.head.findings,
            *recording.findings,
            *votes,
            *silent.findings(),
        )
        solution, known = batch.navigated(run)
        yield replace(solution, findings=found), known
        if known.ended:
            return
    if run is None:
        raise InputError(f"start: at {start.time:.3f} s, with an end at {end:.3f} s; expected an end after the start")


def _extent(recording: LongRecording, row: Method, before: Known | None) -> tuple[Start, float]:
    """Find the start in the beginning; returns the end of the run as well, s."""
    known = recording.head
    start = batch.start_of(row, known, recording.beginning(), before)
    return start, recording.span[1] if known.start.end_time is None else known.start.end_time


def _laid_out(row: Method, choice: Choice, recording: LongRecording, first: Aligned, start: Start) -> batch.Prepared:
    known = recording.head
    # the data of the beginning are not to be held until the end
    empty = tuple(replace(stream, time=stream.time[:0]) for stream in known.imus)
    return batch.lay_out(row, choice, replace(known, imus=empty), first, start, gaps=any(recording.gaps))


class _Silences:
    """The epochs in which IMUs have no data, and their neighbours, from which it is told what became of them."""

    def __init__(self, row: Method, choice: Choice, recording: Recording) -> None:
        self._row, self._choice, self._recording = row, choice, recording
        self._seen: list[Aligned] = []

    def add(self, stretch: Aligned) -> None:
        some = np.asarray(stretch.missing.any(axis=1))
        if self._recording.rig.has_wheels and some.any():
            near = np.convolve(some, [1, 1, 1], "same") > 0
            self._seen.append(replace(stretch, time=stretch.time[near], missing=stretch.missing[near]))

    def findings(self) -> tuple[Finding, ...]:
        if not self._seen:
            return ()
        time, first = np.unique(np.concatenate([part.time for part in self._seen]), return_index=True)
        missing = np.concatenate([part.missing for part in self._seen])[first]
        aligned, fixes = Aligned(time, np.empty(0), (), missing), self._recording.gnss is not None
        return batch.silences(self._row, self._choice, self._recording, aligned, fixes)


def _whole_logs(stretches: Iterator[Aligned]) -> Iterator[Aligned]:
    """Give stretches that begin with the last epoch of the one before and take whole steps of the log after it."""
    held: Aligned | None = None
    every = 1
    for stretch in stretches:
        if held is None:
            every = batch.log_every(stretch)
        held = stretch if held is None else _joined(held, stretch)
        taken = (len(held.time) - 1) // every * every
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


def _thinned(part: Solution, errors: Errors | None, share: float) -> tuple[Solution, Errors | None]:
    """Keep of a part, which is that share of the whole, what a picture needs: the extremes of every curve."""
    curves = [part.position, part.velocity]
    if errors is not None:
        spread = np.full(part.position.shape, np.nan)
        spread[errors.covered] = errors.position
        curves.append(spread)
    rows = kept_for_display(np.hstack(curves), max(1, round(SHOWN_EPOCHS * share)))
    every = max(1, round(len(part.imu_error_time) / max(SHOWN_LOGS * share, 1.0)))
    logs = np.arange(len(part.imu_error_time))[::-every][::-1]
    if errors is not None:
        covered = errors.covered[rows]
        of = (np.cumsum(errors.covered) - 1)[rows][covered]
        errors = replace(errors.at(of), covered=covered)
    return part.at(rows, logs), errors
