"""Whether a solution can be trusted, judged without a reference from what the filter saw of its own measurements.

A standard deviation is a promise: where innovations are three times larger than stated it is not kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.documents import CoverageFigures
from polyins.evaluation.figures import Epochs, Figures
from polyins.evaluation.outages import partly_covered
from polyins.evaluation.receiver import of_receiver
from polyins.evaluation.wheels import of_wheels
from polyins.model.comparisons import answered
from polyins.model.findings import Finding, Severity, Verdict
from polyins.model.solution import Innovations, Solution

if TYPE_CHECKING:
    from polyins.navigate.navigator import Navigator

Array = NDArray[np.float64]

DELAY = "delay"
"""kind of the finding that a clock is late"""
DOUBTFUL, USELESS = 3.0, 10.0
"""how many times larger than stated an error may be before it is doubted, and before it is not to be used"""
LEAST = 20
"""measurements from which a kind is judged"""
PART = 10
"""parts of a run of which the worst is judged: a fault need not last"""
REJECTED_DOUBT, REJECTED_SERIOUS = 0.2, 0.7
"""share of measurements that the gate did not take as they are"""
LEAST_COVERAGE = 0.99
NEGLIGIBLE_SHARE = 0.01
NEGLIGIBLE_S = 1.0
"""A reference may lack less than this of the epochs, and less than this of the time, without a word."""


@dataclass(frozen=True)
class _Statistics:
    """Of the measurements of one kind."""

    ratio: float
    """how many times larger than stated innovations are, by their median square"""
    worst: float
    """the same, of the worst part"""
    worst_from: float
    worst_to: float
    rejected: float
    """share"""


def verdict(solution: Solution, figures: Figures) -> Verdict:
    """Return what is to be said of a solution; of it only what has no row per epoch is looked at."""
    left_out = solution.exclusions
    told = (*answered(solution.findings, left_out), *(one.finding for one in left_out))
    known = (*told, *of_measurements(solution.measurements, told))
    return Verdict((*known, *_of_epochs(solution.recording_span, figures.epochs), *_of_reference(figures)))


def of_live(navigator: Navigator, findings: Sequence[Finding] = ()) -> Verdict:
    """Return what is to be said of what a navigator has done so far; `findings`: of its configuration."""
    left_out = navigator.exclusions
    told = (*answered((*findings, *navigator.findings), left_out), *(one.finding for one in left_out))
    known = (*told, *of_measurements(navigator.measurements, told))
    return Verdict((*known, *_of_epochs(navigator.span, counted(navigator))))


def counted(navigator: Navigator) -> Epochs:
    """Return how many epochs a navigator has taken so far."""
    record = navigator.record
    return Epochs(record.first, record.last, record.epochs, record.interval, record.broken)


def of_measurements(measurements: Mapping[str, Innovations], told: Sequence[Finding] = ()) -> tuple[Finding, ...]:
    """Return what the innovations of a run, by kind, say of it beside what the data have told.

    A filter takes part of a delay for errors of its state: the innovations know it less well than the data.
    """
    late = {finding.stream for finding in told if finding.kind == DELAY}
    return tuple(
        finding
        for kind, measured in measurements.items()
        for finding in (*of_wheels(kind, measured), *_of_kind(kind, measured.used()))
        if finding.kind != DELAY or kind not in late
    )


def _of_epochs(span: tuple[float, float] | None, epochs: Epochs) -> Iterator[Finding]:
    if epochs.broken:
        text = f"the solution is not finite at {epochs.broken} of {epochs.count} epochs: it diverged"
        yield Finding("not finite", text, "serious", from_s=epochs.first, to_s=epochs.last, size=epochs.broken)
    share = coverage(span, epochs)["of_recording"]
    if share is not None and share < LEAST_COVERAGE:
        yield Finding(
            "coverage",
            f"the solution covers {100.0 * share:.0f} % of the recording, {epochs.first:.1f} to {epochs.last:.1f} s",
            from_s=epochs.first,
            to_s=epochs.last,
            size=share,
            expected=1.0,
        )


def coverage(span: tuple[float, float] | None, epochs: Epochs) -> CoverageFigures:
    """Return from when to when there is a solution, and which share of a recording of that span, s, if it is known."""
    known = span is not None and span[1] > span[0]
    share = min(1.0, (epochs.duration + epochs.interval) / (span[1] - span[0])) if span is not None and known else None
    return {"from_s": epochs.first, "to_s": epochs.last, "of_recording": share}


def _of_reference(figures: Figures) -> Iterator[Finding]:
    """Say what of the solution the reference cannot judge."""
    epochs, errors = figures.epochs, figures.errors
    if errors is None:
        return
    share = epochs.uncovered / max(epochs.count, 1)
    # streams hardly ever begin and end together
    if share > NEGLIGIBLE_SHARE and share * epochs.duration >= NEGLIGIBLE_S:
        text = (
            f"reference: covers {epochs.count - epochs.uncovered} of {epochs.count} epochs; "
            f"{epochs.uncovered} are left out of the errors"
        )
        yield Finding("reference", text, stream="reference", size=share, expected=0.0)
    for begin, end in partly_covered(errors, figures.outages, epochs.interval):
        text = (
            f"outage {begin:.3f} s to {end:.3f} s: solution and reference do not cover all of it; its maximum may be"
            " larger"
        )
        yield Finding("reference", text, stream="reference", from_s=begin, to_s=end)


def _of_kind(kind: str, measured: Innovations) -> Iterator[Finding]:
    if measured.change is not None:
        yield from of_receiver(kind, measured)
    resets = int(np.count_nonzero(measured.reset))
    if resets:
        when = measured.time[measured.reset]
        yield Finding(
            "reset",
            f"{kind}: {resets} reset(s) of the state to it, the first at {when[0]:.2f} s",
            "doubt",
            stream=kind,
            from_s=float(when[0]),
            to_s=float(when[-1]),
            size=resets,
            expected=0,
            remedy="what lies before each is off by as much as the state moved",
        )
    if measured.time.size < LEAST:
        return
    of = _statistics(measured)
    severity = _severity(of.worst)
    if severity is not None:
        axis = _worst_axis(measured, of)
        yield Finding(
            "innovations",
            f"{kind}: innovations are {of.worst:.1f} times as large as stated from {of.worst_from:.1f} to"
            f" {of.worst_to:.1f} s, {of.ratio:.1f} times over all",
            severity,
            stream=kind,
            axis=axis,
            from_s=of.worst_from,
            to_s=of.worst_to,
            size=of.worst,
            expected=1.0,
            remedy="look at its std, its clock and its lever arm, and at the noise figures of the IMUs",
        )
    if of.rejected > REJECTED_DOUBT:
        when = measured.time[~measured.accepted]
        yield Finding(
            "rejected",
            f"{kind}: {100.0 * of.rejected:.0f} % of {measured.time.size} measurements were rejected",
            "serious" if of.rejected > REJECTED_SERIOUS else "doubt",
            stream=kind,
            from_s=float(when[0]),
            to_s=float(when[-1]),
            size=of.rejected,
            expected=0.0,
        )


def _severity(ratio: float) -> Severity | None:
    return "serious" if ratio > USELESS else "doubt" if ratio > DOUBTFUL else None


def _statistics(measured: Innovations) -> _Statistics:
    from scipy.special import gammaincinv  # the quantile of scipy.stats, whose import takes longer than a short run

    medians = 2.0 * gammaincinv(np.maximum(measured.rows, 1) / 2, 0.5)  # of chi-square
    scaled = measured.nis / medians
    parts = np.array_split(np.arange(scaled.size), max(1, min(PART, scaled.size // LEAST)))
    by_part = np.array([np.sqrt(np.median(scaled[part])) for part in parts])
    worst = parts[int(np.argmax(by_part))]
    return _Statistics(
        ratio=float(np.sqrt(np.median(scaled))),
        worst=float(by_part.max()),
        worst_from=float(measured.time[worst[0]]),
        worst_to=float(measured.time[worst[-1]]),
        rejected=float(np.mean(~measured.accepted)),
    )


def _worst_axis(measured: Innovations, of: _Statistics) -> str | None:
    """Return the axis along which the innovations of the worst part are largest."""
    inside = (measured.time >= of.worst_from) & (measured.time <= of.worst_to)
    with np.errstate(invalid="ignore", divide="ignore"):
        scaled = np.where(measured.std > 0.0, measured.residual / measured.std, 0.0)[inside]
    return measured.axes[int(np.argmax(np.mean(scaled**2, axis=0)))] if measured.axes else None
