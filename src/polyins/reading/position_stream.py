"""GNSS and reference as configured: files read, checked, heights above the ellipsoid, on the recording's clock."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polyins.checks import stream_checks
from polyins.config import GeodeticPoint, GnssEntry, ReferenceEntry
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.files import find_named
from polyins.formats import geoid, kf_gins, rtklib, table
from polyins.formats.recognize import track_format
from polyins.formats.rows import Track
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, GnssStream, Heights, Reference
from polyins.model.rig import DEG, check_lever_arm
from polyins.reading.log_streams import track_of

Span = tuple[float, float]


def _track(
    entry: GnssEntry | ReferenceEntry, section: str, document: Document, accept: Collection[str] = ()
) -> tuple[Track, list[str]]:
    """Read and check positions, heights above the ellipsoid, stamps on the recording's clock."""
    with document.at([section, "file"]):
        find_named(entry.file)
    kind: str = entry.format
    if kind == "auto":
        kind = "table" if entry.columns else track_format(entry.file)
    if entry.columns and kind != "table":
        raise document.error([section, "columns"], f"given with format {kind}; expected columns with format table only")
    if kind == "log":
        track = track_of(entry.file, entry.stream)
    elif entry.stream:
        raise document.error([section, "stream"], "is given; expected it of a log with several only")
    else:
        track = _file_track(entry, kind)
    warnings = list(stream_checks.check_track(track, section, accept))
    track = replace(track, time=entry.clock.common(track.time))
    raised = _above_ellipsoid(track, entry, section, document)
    if raised is not track and entry.geoid_height_m is None:
        by = float(np.median(raised.position[:, 2] - track.position[:, 2]))
        warnings.append(
            f"{track.source.path}: heights above the sea are brought above the ellipsoid by {geoid.MODEL}, {by:.1f} m "
            "there, which is good to a metre; geoid_height_m takes its place"
        )
    return raised, warnings


def _file_track(entry: GnssEntry | ReferenceEntry, kind: str) -> Track:
    readers = {"kf-gins": kf_gins.read_gnss, "kf-gins-nav": kf_gins.read_nav, "rtklib-pos": rtklib.read_gnss}
    return readers[kind](entry.file) if kind in readers else table.read_track(entry.file, entry.columns)


def _above_ellipsoid(track: Track, entry: GnssEntry | ReferenceEntry, section: str, document: Document) -> Track:
    """Convert heights above the sea, or refuse them."""
    if entry.height == "ellipsoidal" and track.above_sea:
        raise document.error(
            [section, "height"],
            f"heights in {track.source.path} are above the sea; expected height: sea-level with geoid_height_m, or "
            "as-given to have the solution's above the sea",
        )
    shift = height_shift(entry, track.position, track.geodetic, track.above_sea)
    if shift is None:
        raise document.error(
            [section, "height"],
            "sea-level heights need geoid_height_m; expected the height of the geoid above the ellipsoid at the "
            "place, m, or a grid of it (pip install 'polyins[geoid]', from Python 3.12 on)",
        )
    if not np.any(shift):
        return track
    return replace(track, position=track.position + np.multiply.outer(shift, np.array([0.0, 0.0, 1.0])))


def height_shift(
    entry: GnssEntry | ReferenceEntry, position: Array, geodetic: bool, above_sea: bool
) -> Array | float | None:
    """Return what to add to heights to have them above the ellipsoid, m, of all or each; None: it is not known.

    `position`: shape (..., 3); `geodetic`: it is; `above_sea`: whoever gives it says so, else the configuration may.
    """
    if entry.height == "as-given" or not geodetic or not (above_sea or entry.height == "sea-level"):
        return 0.0
    return geoid.heights(position) if entry.geoid_height_m is None else entry.geoid_height_m


def _heights(track: Track, entry: GnssEntry | ReferenceEntry) -> Heights:
    """Return what the heights of a track that is read count from."""
    if not track.geodetic or entry.height != "as-given":
        return "ellipsoidal"
    return "sea-level" if track.above_sea else "unknown"


class ConfiguredGnss(NamedTuple):
    """GNSS as it is read."""

    stream: GnssStream
    geodetic: bool
    heights: Heights
    """what geodetic ones count from"""
    notes: list[str]


def read_gnss(entry: GnssEntry, document: Document, span: Span, accept: Collection[str] = ()) -> ConfiguredGnss:
    """Read the fixes. `span`: of the IMUs, s.

    Raises InputError for data and settings that cannot be right.
    """
    track, warnings = _track(entry, "gnss", document, accept)
    std = track.position_std
    if entry.position_std_m is not None:
        std = np.tile(entry.position_std_m, (len(track.time), 1))
    if std is None:
        raise document.error(["gnss"], f"{track.source.path} has no position std; expected position_std_m")
    stream_checks.check_std(track.source, std)
    warnings += stream_checks.check_within(track.source, "GNSS", track.time, span)
    heights = _heights(track, entry)
    if heights != "ellipsoidal":
        datum = "the sea" if track.above_sea else "what those of the file are above, which is not known here"
        warnings.append(f"{track.source.path}: heights of the solution are above {datum}")
    track = _converted(track, entry, document)
    kept = thinned(track.time, entry.rate_hz) if entry.rate_hz else np.arange(len(track.time))
    velocity, velocity_std = track.velocity, track.velocity_std
    if velocity is None or velocity_std is None:
        if velocity is not None:
            warnings.append(f"{track.source.path}: GNSS velocity has no std and is not used")
        velocity = velocity_std = None
    stream = GnssStream(track.time, track.position, std, velocity, velocity_std).at(kept)
    return ConfiguredGnss(stream, track.geodetic, heights, warnings)


def _converted(track: Track, entry: GnssEntry, document: Document) -> Track:
    """Convert geodetic positions to a local plane, if the entry gives its origin."""
    origin = entry.plane_origin
    if origin is None:
        return track
    if not track.geodetic:
        raise document.error(
            ["gnss", "plane_origin"], "given for positions in metres; expected it with latitude and longitude only"
        )
    return replace(track, position=on_plane(track.position, origin), geodetic=False)


def on_plane(position: Array, origin: GeodeticPoint) -> Array:
    """Return geodetic positions, (M, 3), as north, east and height from an origin, m."""
    point = np.array([origin.latitude_deg * DEG, origin.longitude_deg * DEG, origin.height_m])
    return np.asarray(displacement(position, point, True) * [1.0, 1.0, -1.0])


def thinned(time: Array, rate_hz: float) -> NDArray[np.intp]:
    """Return the indices of the first stamp in each period of 1 / rate."""
    slack = 0.1 * np.median(np.diff(time)) if len(time) > 1 else 0.0
    period = np.floor((time - time[0] + slack) * rate_hz)
    return np.flatnonzero(np.diff(period, prepend=-1.0) > 0)


def read_reference(entry: ReferenceEntry, document: Document, span: Span) -> tuple[Reference, bool, list[str]]:
    """Read the reference; returns it, whether it is geodetic, and warnings. `span`: of the IMUs, s.

    Raises InputError for data and settings that cannot be right.
    """
    track, warnings = _track(entry, "reference", document)
    if entry.position_lag_s:
        track = _at_position_times(track, entry.position_lag_s)
    if len(track.time) < 2:
        raise InputError(f"{track.source.path}: {len(track.time)} row of reference; expected at least two")
    warnings += stream_checks.check_within(track.source, "reference", track.time, span)
    with document.at(["reference", "point_m"]):
        check_lever_arm("point", np.array(entry.point_m))
    point, heights = np.array(entry.point_m), _heights(track, entry)
    reference = Reference(track.time, track.position, track.velocity, track.attitude, point, heights)
    return reference, track.geodetic, warnings


def _at_position_times(track: Track, lag: float) -> Track:
    """Interpolate the attitude to the instants of the positions, which are `lag` seconds after it in each row."""
    time = track.time + lag
    if track.attitude is None:
        return replace(track, time=time)
    inside = (time >= track.time[0]) & (time <= track.time[-1])
    angles = np.unwrap(track.attitude, axis=0)
    attitude = np.column_stack([np.interp(time[inside], track.time, angle) for angle in angles.T])
    return replace(
        track,
        time=time[inside],
        position=track.position[inside],
        velocity=None if track.velocity is None else track.velocity[inside],
        attitude=(attitude + np.pi) % (2 * np.pi) - np.pi,
    )
