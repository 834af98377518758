"""Start and outages as configured, checked against the time that the data cover."""

from __future__ import annotations

import numpy as np

from polyins.config import Config, OutageSchedule, StartEntry
from polyins.config.units import read
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.model.recording import GnssStream, StartOptions
from polyins.prepare.timesync import LATE

Span = tuple[float, float]


def start_options(start: StartEntry, document: Document, span: Span) -> tuple[StartOptions, list[str]]:
    """Convert the start section to SI; returns it and warnings. `span`: of the IMUs, s.

    Raises InputError for times outside the data.
    """
    still = start.static_interval_s
    if still is not None:
        # one IMU that begins a little later than the others, or ends before them, shortens it
        start = start.model_copy(update={"static_interval_s": (_within(still[0], span), _within(still[1], span))})
    _check_times(start, document, span)
    warnings = []
    if start.end_time_s is not None and start.end_time_s > span[1]:
        place = document.place(["start", "end_time_s"])
        warnings.append(f"{place}: is {start.end_time_s:.3f}; the data end at {span[1]:.3f} s")
    position = start.position and start.position.coordinates()
    return read(start, StartOptions, position=position), warnings


def _within(time: float, span: Span) -> float:
    nearest = min(max(time, span[0]), span[1])
    return nearest if abs(nearest - time) < LATE else time


def _check_times(start: StartEntry, document: Document, span: Span) -> None:
    covered = f"within the data, {span[0]:.3f} to {span[1]:.3f} s"
    begin = span[0] if start.time_s is None else start.time_s
    still = start.static_interval_s
    if not span[0] <= begin < span[1]:
        raise document.error(["start", "time_s"], f"is {begin:.3f}; expected a time {covered}")
    if start.end_time_s is not None and start.end_time_s <= begin:
        raise document.error(
            ["start", "end_time_s"], f"is {start.end_time_s:.3f}; expected a time after the start, {begin:.3f} s"
        )
    if still is not None and not span[0] <= still[0] < still[1] <= span[1]:
        raise document.error(["start", "static_interval_s"], f"is {list(still)}; expected [from, to] {covered}")


def outage_intervals(config: Config, document: Document, span: Span, gnss: GnssStream | None) -> tuple[Span, ...]:
    """Return the outages in order; a schedule gives the whole ones within the GNSS and IMU data.

    Raises InputError for outages without GNSS, outside the data, overlapping, or that end before they begin.
    """
    if not config.outages:
        return ()
    with document.at(["outages"]):
        if gnss is None:
            raise InputError("given without gnss; expected both or neither")
        if isinstance(config.outages, OutageSchedule):
            first_fix = float(gnss.time[gnss.time >= span[0]][0])
            begin = first_fix if config.start.time_s is None else config.start.time_s
            end_time = np.inf if config.start.end_time_s is None else config.start.end_time_s
            return _scheduled(config.outages, begin, min(span[1], float(gnss.time[-1]), end_time))
        outages = sorted(config.outages)
        _check_outages(outages, span)
    return tuple(outages)


def _check_outages(outages: list[Span], span: Span) -> None:
    """`outages` is in order of time."""
    covered = f"within the data, {span[0]:.3f} to {span[1]:.3f} s"
    previous_end = -np.inf
    for a, b in outages:
        if not a < b:
            raise InputError(f"[{a:g}, {b:g}] ends before it begins; expected [from, to]")
        if a < span[0] or b > span[1]:
            raise InputError(f"[{a:g}, {b:g}] is outside the data; expected times {covered}")
        if a < previous_end:
            raise InputError(f"[{a:g}, {b:g}] overlaps the outage before; expected outages apart")
        previous_end = b


def _scheduled(schedule: OutageSchedule, begin: float, end: float) -> tuple[Span, ...]:
    outages = schedule.intervals(begin, end)
    if not outages:
        raise InputError(
            f"no outage of {schedule.length_s:g} s fits after {schedule.first_begin(begin):.3f} s; expected it to end "
            f"with the data, at {end:.3f} s"
        )
    return outages
