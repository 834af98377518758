"""What is in a file: streams, rates, gaps, spans, and what looks wrong, ready for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polyins.checks.faults import clipped
from polyins.checks.stream_checks import FARTHEST_OFF_AXIS_M, GAP_INTERVALS, WHEEL_RATE_RAD_S, check_imu, check_track
from polyins.errors import InputError
from polyins.files import find
from polyins.formats.log import Log
from polyins.formats.recognize import data_format, log_format, read_log
from polyins.formats.rows import ImuRows, SensorRows, Track
from polyins.model.recording import Array
from polyins.model.rig import DEG
from polyins.reading.guess import Stream, read_rows, read_table
from polyins.reading.half_imu import HalfImu
from polyins.reading.table_stream import stream_name

Facts = dict[str, Any]
LARGE = 1e8
"""from which on numbers are written with all digits before the point: Unix time"""


def inspect(path: str | Path) -> Facts:
    """Describe a data file, or a configuration with all its streams.

    Data that could not be navigated with (NaN, unsorted stamps) are described, not refused. Raises InputError if the
    file cannot be read at all.
    """
    kind = data_format(path)
    if kind == "configuration":
        return _describe_configuration(path)
    if log_format(path) is not None:
        return _describe_log(path, kind)
    if kind == "table":
        return _describe_table(path)
    stream = read_rows(path, kind)
    return {**describe(stream), "format": kind, **_problems(stream, ())}


def inspect_each(paths: Sequence[str | Path]) -> list[Facts]:
    """Describe several files; of one that cannot be read at all the kind is unknown, and the problem says why."""
    found: list[Facts] = []
    for path in paths:
        try:
            found.append(inspect(path))
        except InputError as error:
            found.append({"file": str(path), "kind": "unknown", "problems": [str(error)], "warnings": []})
    return found


def describe(stream: Stream) -> Facts:
    """Describe one stream: rows, span, rate, gaps, stamps, NaN, and what its values say."""
    facts = {"file": stream.source.path, "kind": "imu" if isinstance(stream, ImuRows) else "positions"}
    return {**facts, **_timing(stream.time), **(_imu(stream) if isinstance(stream, ImuRows) else _positions(stream))}


def _describe_table(path: str | Path) -> Facts:
    found = read_table(path)
    if isinstance(found, HalfImu):
        kind = f"{found.what} alone"
        facts: Facts = {"file": found.source.path, "kind": kind, **_timing(found.time), "format": "table"}
        other = "accelerometer" if found.what == "gyro" else "gyro"
        return {**facts, "problems": [], "warnings": [f"{found.source.path}: is one IMU with the file of the {other}"]}
    if len(found) == 1:
        one = found[0]
        return {**describe(one.rows), "format": "table", **_problems(one.rows, one.guesses)}
    return {
        "file": str(find(path)),
        "kind": "table",
        "format": "table",
        "streams": [
            {"stream": stream_name(found, n), **describe(one.rows), **_problems(one.rows, one.guesses)}
            for n, one in enumerate(found)
        ],
        "problems": [],
        "warnings": [],
    }


def _describe_log(path: str | Path, kind: str) -> Facts:
    log = read_log(path)
    return {
        "file": str(find(path)),
        "kind": "log",
        "format": kind,
        "clock": log.clock,
        "utc_of_zero_s": log.utc_of_zero,
        "fix_age_s": log.fix_age,
        "streams": [_describe_stream(log, name) for name in log.streams],
        "problems": [] if log.streams else ["holds neither IMU data nor positions"],
        "warnings": list(log.notes),
    }


def _describe_stream(log: Log, name: str) -> Facts:
    """Say what a stream of a log holds, and what it is good for."""
    rows, why_not = log.streams[name], log.unusable.get(name)
    facts: Facts = {"kind": rows.kind, **_timing(rows.time)} if isinstance(rows, SensorRows) else describe(rows)
    problems = {} if isinstance(rows, SensorRows) else _problems(rows, ())
    moved = log.clock_offsets.get(name)
    return {
        "stream": name,
        **facts,
        "added_to_stamps_s": moved,
        "usable": why_not is None,
        "not_used": why_not,
        **problems,
    }


def listing(facts: Facts, indent: str = "") -> str:
    """Return facts as indented lines for a reader; what is not known is left out."""
    lines = []
    for key, value in facts.items():
        items = value if isinstance(value, list) and value and isinstance(value[0], dict) else [value]
        for item in items:
            if isinstance(item, dict):
                lines += [f"{indent}{key}:", listing(item, indent + "  ")]
            elif item not in (None, []):
                lines.append(f"{indent}{key}: {_in_words(item)}")
    return "\n".join(lines)


def _in_words(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_in_words(item) for item in value)
    if isinstance(value, float):
        return f"{value:.10g}" if abs(value) < LARGE else f"{value:.6f}"
    return str(value)


def _problems(stream: Stream, guesses: tuple[str, ...]) -> Facts:
    """Say what `load` would refuse or warn of."""
    try:
        if isinstance(stream, ImuRows):
            found = check_imu(stream, WHEEL_RATE_RAD_S, FARTHEST_OFF_AXIS_M)
            at_end = clipped(stream, "", 0.0, gyro=stream.gyro_range_deg_s is None)
            found = (*found, *(one.sentence for one in at_end))
        else:
            found = check_track(stream, "positions")
    except InputError as error:
        return {"problems": [str(error)], "warnings": [*guesses, *stream.warnings]}
    return {"problems": [], "warnings": [*guesses, *found]}


def _describe_configuration(path: str | Path) -> Facts:
    from polyins.config import kf_gins_configuration, wheel_ins_configuration
    from polyins.config.yaml_document import read_yaml
    from polyins.reading.loading import load

    recording = load(path)
    gnss, reference = recording.gnss, recording.reference
    document = read_yaml(path)
    programs = {"wheel-ins": wheel_ins_configuration, "kf-gins": kf_gins_configuration}
    return {
        "file": str(find(path)),
        "kind": "configuration",
        "format": next((name for name, program in programs.items() if program.recognizes(document)), "polyins"),
        "name": recording.name,
        "geodetic": recording.geodetic,
        "imus": [
            {"name": stream.name, **_timing(stream.time), **_motion(stream.time, stream.dtheta, stream.dvel)}
            for stream in recording.imus
        ],
        "gnss": _timing(gnss.time) if gnss else None,
        "reference": _timing(reference.time) if reference else None,
        "outages": [list(outage) for outage in recording.outages],
        "warnings": list(recording.sentences),
    }


def _timing(time: Array) -> Facts:
    steps = np.diff(time[np.isfinite(time)])
    usual = float(np.median(steps)) if len(steps) else np.nan
    gaps = np.flatnonzero(steps > GAP_INTERVALS * usual) if usual > 0 else np.array([], dtype=int)
    worst = gaps[np.argmax(steps[gaps])] if len(gaps) else None
    return {
        "rows": len(time),
        "begin_s": _stamp(time[0]) if len(time) else None,
        "end_s": _stamp(time[-1]) if len(time) else None,
        "duration_s": _number(time[-1] - time[0]) if len(time) else None,
        "rate_hz": _number(1.0 / usual) if usual > 0 else None,
        "gaps": {
            "count": len(gaps),
            "largest_s": None if worst is None else _number(steps[worst]),
            "at_s": None if worst is None else _stamp(time[worst]),
        },
        "repeated_stamps": int(np.sum(steps == 0.0)),
        "unsorted_stamps": int(np.sum(steps < 0.0)),
    }


def _imu(rows: ImuRows) -> Facts:
    values = np.column_stack([rows.dtheta, rows.dvel])
    return {
        "units": {"gyro": rows.gyro_unit, "accel": rows.accel_unit},
        "nan_values": int(np.sum(~np.isfinite(values))),
        **_motion(rows.time, rows.dtheta, rows.dvel),
    }


def _motion(time: Array, dtheta: Array, dvel: Array) -> Facts:
    """Say what the mean specific force and rate are; the axis that gravity is on points up at rest."""
    fine = np.isfinite(dtheta).all(axis=1) & np.isfinite(dvel).all(axis=1) & np.isfinite(time)
    duration = float(np.median(np.diff(time[fine]))) * int(fine.sum()) if fine.sum() > 1 else np.nan
    if not duration > 0:
        return {"accel_mean_m_s2": None, "accel_norm_m_s2": None, "gravity_axis": None, "gyro_mean_deg_s": None}
    force = dvel[fine].sum(axis=0) / duration
    strongest = int(np.argmax(np.abs(force)))
    return {
        "accel_mean_m_s2": [_number(value) for value in force],
        "accel_norm_m_s2": _number(np.linalg.norm(force)),
        "gravity_axis": ("+" if force[strongest] > 0 else "-") + "xyz"[strongest],
        "gyro_mean_deg_s": [_number(value) for value in dtheta[fine].sum(axis=0) / duration / DEG],
    }


def _positions(track: Track) -> Facts:
    first = track.position[0] / ([DEG, DEG, 1.0] if track.geodetic else 1.0) if len(track.time) else np.full(3, np.nan)
    std = track.position_std
    names = ("latitude_deg", "longitude_deg") if track.geodetic else ("north_m", "east_m")
    return {
        "geodetic": track.geodetic,
        "heights": _heights(track),
        "first": {name: _number(value) for name, value in zip((*names, "height_m"), first, strict=True)},
        "median_std_m": None if std is None else [_number(value) for value in np.median(std, axis=0)],
        "velocity": track.velocity is not None,
        "attitude": track.attitude is not None,
        "quality": track.quality or None,
        "nan_values": int(np.sum(~np.isfinite(track.position))),
    }


def _heights(track: Track) -> str:
    if not track.geodetic:
        return "local"
    if not track.datum_known:
        return "unknown"
    return "sea-level" if track.above_sea else "ellipsoidal"


def _number(value: Any) -> float | None:
    """Return a number that JSON knows, to 12 digits."""
    return float(f"{float(value):.12g}") if np.isfinite(value) else None


def _stamp(value: Any) -> float | None:
    """Return a stamp that JSON knows, to 1 ns: Unix time needs more digits than other numbers."""
    return round(float(value), 9) if np.isfinite(value) else None
