"""Export of a solution: the table of formats, and what is said before a file is written."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import IO, Any, Literal, cast

import numpy as np

from polyins.errors import InputError
from polyins.files import new_file, whole
from polyins.model.gps_time import EARLIEST_UNIX_S, utc_of_week
from polyins.model.solution import Solution
from polyins.model.status import ALIGNING, ATTITUDE_ONLY, NOT_TO_BE_USED
from polyins.reading.position_stream import thinned
from polyins.tools.export.trace import Trace, trace_of

Datum = Literal["the sea", "the ellipsoid"]


@dataclass(frozen=True)
class ExportFormat:
    """A format that a solution is written in."""

    name: str
    title: str
    writer: str
    """module of this folder, and function"""
    geodetic: bool = False
    """it holds latitude and longitude only"""
    utc: Literal["", "told", "needed"] = ""
    """whether it holds times of day: where they are known, or nothing else"""
    above: Datum | None = None
    """what its heights count from; None: it says so, or they do not matter"""
    otherwise: str = ""
    """what becomes of heights that are not known above that"""


EXPORTS: tuple[ExportFormat, ...] = (
    ExportFormat("tum", "TUM trajectory", "poses:write_tum"),
    ExportFormat("kitti", "KITTI poses", "poses:write_kitti"),
    ExportFormat("kml", "KML", "kml:write", True, "needed", "the sea", "the track lies on the ground"),
    ExportFormat("geojson", "GeoJSON", "geojson:write", True, "told", "the ellipsoid", "coordinates are without them"),
    ExportFormat("gpx", "GPX 1.1", "gpx:write", True, "needed", "the sea", "elevations are left out"),
    ExportFormat("nmea", "NMEA 0183", "nmea:write", True, "needed", "the sea", "heights are left out"),
    ExportFormat("mcap", "MCAP of ROS 2", "mcap:write", False, "told", "the ellipsoid", "fixes are without altitude"),
    ExportFormat("pos", "RTKLIB .pos", "pos:write", True, "needed"),
    ExportFormat("csv", "CSV", "csv:write"),
)


@dataclass(frozen=True)
class ExportOptions:
    """What is exported, and what no file tells."""

    rate_hz: float | None = None
    """rows a second; None: all"""
    columns: tuple[str, ...] = ()
    """of a CSV file; empty: all"""
    utc_of_zero: str | None = None
    """UTC at which `time_s` is zero, as 2024-05-01T12:00:00Z, or `week N` of GPS; None: what the recording tells"""
    geoid_height_m: float | None = None
    """of the geoid above the ellipsoid at the place"""


def export(solution: Solution, path: str | Path, to: str, options: ExportOptions = ExportOptions()) -> tuple[str, ...]:
    """Write a solution for another program, `to` one of tum, kitti, kml, geojson, gpx, nmea, mcap, pos, csv.

    Returns what there is to say of the file. Raises InputError if the format has no place for the solution, UTC or what
    heights count from is needed and not known, and if the file exists.
    """
    return write(trace_of(solution), path, to, options)


def write(trace: Trace, path: str | Path, to: str, options: ExportOptions) -> tuple[str, ...]:
    """Write rows of a solution; see `export`."""
    known = {one.name: one for one in EXPORTS}
    if to not in known:
        raise InputError(f"--to {to}: is no format; expected one of {', '.join(known)}")
    form = known[to]
    if options.columns and to != "csv":
        raise InputError(f"--columns: given with --to {to}; expected it with csv")
    if form.geodetic and not trace.geodetic:
        raise InputError(
            f"{trace.source}: positions are on a local plane, {form.title} holds latitude and longitude; expected --to "
            f"{', '.join(one.name for one in EXPORTS if not one.geodetic)}"
        )
    path = new_file(path)
    trace, notes = _placed(trace, form, options)
    notes += [f"{trace.source}: {one['text']}" for one in trace.findings if one["severity"] == "serious"]
    if to != "csv":
        trace, texts = _usable(trace)
        notes += texts
    if options.rate_hz is not None:
        trace = trace.at(thinned(trace["time_s"], options.rate_hz))
    writer = _writer(form)
    with whole(path) as beside, _opened(beside, packed=path.suffix == ".gz") as file:
        (partial(writer, names=options.columns) if to == "csv" else writer)(file, trace)
    return tuple(notes)


def _opened(path: Path, *, packed: bool) -> IO[bytes]:
    return cast(IO[bytes], gzip.open(path, "wb") if packed else path.open("wb"))


def _writer(form: ExportFormat) -> Callable[..., Any]:
    module, _, function = form.writer.partition(":")
    found: Callable[..., Any] = getattr(import_module(f"polyins.tools.export.{module}"), function)
    return found


def _placed(trace: Trace, form: ExportFormat, options: ExportOptions) -> tuple[Trace, list[str]]:
    """Settle what clock and heights count from; raises InputError where a format needs what is not known."""
    notes = []
    utc = trace.utc_of_zero
    if options.utc_of_zero is not None:
        utc = utc_of(options.utc_of_zero, float(trace["time_s"][0]))
    elif form.utc and utc is None and trace["time_s"][0] > EARLIEST_UNIX_S:
        utc = 0.0
        begin = datetime.fromtimestamp(float(trace["time_s"][0]), UTC)
        notes.append(f"{trace.source}: stamps are taken for Unix time, which begins at {begin:%Y-%m-%d %H:%M:%S} UTC")
    if form.utc == "needed" and utc is None:
        raise InputError(
            f"{trace.source}: nothing tells UTC, which {form.title} needs; expected --utc-of-zero with when time_s is "
            "zero, as 2024-05-01T12:00:00Z, or 'week N' of GPS"
        )
    if form.name == "mcap" and utc is None:
        notes.append(f"{trace.source}: nothing tells UTC; stamps are the recording's own")
    trace = replace(trace, utc_of_zero=utc, geoid_height=options.geoid_height_m)
    if form.above is not None and trace.geodetic:
        notes += _heights_said(trace, form, form.above)
    return trace, notes


def _heights_said(trace: Trace, form: ExportFormat, above: Datum) -> list[str]:
    """Say what becomes of heights that do not count from what those of the format do."""
    if (trace.above_sea if above == "the sea" else trace.above_ellipsoid) is not None:
        return []
    if trace.heights == "unknown":
        return [f"{trace.source}: what heights count from is not known; {form.otherwise}"]
    own = "the ellipsoid" if trace.heights == "ellipsoidal" else "the sea"
    remedy = "--geoid-height M converts them"
    return [f"{trace.source}: heights are above {own}, {form.title} has them above {above}; {form.otherwise}; {remedy}"]


def utc_of(text: str, first: float) -> float:
    """Return the Unix time at which a clock shows zero, s, of a date or a GPS week; `first`: a stamp of it, s."""
    if found := re.fullmatch(r"week (\d{1,4})", text.strip()):
        return float(utc_of_week(np.array([float(found[1])]), np.array([first]))[0]) - first
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        date = None
    if date is None or date.tzinfo is None:
        raise InputError(f"--utc-of-zero {text}: expected a time with its zone, as 2024-05-01T12:00:00Z, or 'week N'")
    return date.timestamp()


def _usable(trace: Trace) -> tuple[Trace, list[str]]:
    """Leave out rows that are not to be used, and say how many are worth less than they look."""
    position = trace.position if trace.geodetic else trace.east_north_up
    usable = (trace.status != NOT_TO_BE_USED) & np.isfinite(position).all(axis=1)
    usable &= np.isfinite(trace.attitude).all(axis=1)
    notes = []
    if not usable.any():
        raise InputError(f"{trace.source}: no row is to be used")
    if not usable.all():
        notes.append(f"{trace.source}: {np.sum(~usable)} rows are not to be used and left out")
        trace = trace.at(usable)
    for status, text in ((ALIGNING, "the heading"), (ATTITUDE_ONLY, "the position")):
        if count := int(np.sum(trace.status == status)):
            notes.append(f"{trace.source}: {text} of {count} rows is not known")
    return trace, notes
