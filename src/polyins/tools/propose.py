"""A commented configuration proposed for recordings that nobody has described yet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polyins.checks.stream_checks import upright_axes
from polyins.errors import InputError
from polyins.formats.recognize import data_format
from polyins.formats.rows import ImuRows, Track
from polyins.reading.guess import guess_columns, read_stream
from polyins.tools.inspect import describe

CHECK = "# CHECK:"
TRACK_FORMATS = {"kf-gins-gnss": "kf-gins"}


def propose(paths: Sequence[str | Path]) -> str:
    """Return polyins YAML for the recordings in these files.

    What was guessed, and what files cannot tell, is marked `CHECK:`. Raises InputError if no file holds IMU data or
    one holds nothing that is known.
    """
    read = [(path, *read_stream(path)) for path in paths]
    imus = [(path, stream, notes) for path, stream, notes in read if isinstance(stream, ImuRows)]
    tracks = [(path, stream, notes) for path, stream, notes in read if isinstance(stream, Track)]
    if not imus:
        raise InputError(f"{', '.join(str(path) for path in paths)}: no IMU data; expected at least one file of them")
    marked = f"What says {CHECK[2:]} is guessed or unknown."
    lines = [f"# {len(imus)} IMU file(s), {len(tracks)} file(s) of positions. {marked}", "imus:"]
    for number, (path, rows, notes) in enumerate(imus, 1):
        lines += _imu_lines(number, path, rows, notes)
    span = (max(rows.time[0] for _, rows, _ in imus), min(rows.time[-1] for _, rows, _ in imus))
    # A file with attitude is a reference rather than a receiver's, if there is a choice.
    tracks.sort(key=lambda item: item[1].attitude is not None)
    only_solution = len(tracks) == 1 and data_format(tracks[0][0]) == "kf-gins-nav"
    sections = ["reference"] if only_solution else ["gnss", "reference"]
    for section, (path, track, notes) in zip(sections, tracks, strict=False):
        lines += ["", f"{section}:", *_track_lines(section, path, track, notes, span)]
    lines += [f"{CHECK} {path} also holds positions and is not used" for path, _, _ in tracks[len(sections) :]]
    lines += ["", "start:", _heading_line(bool(tracks) and not only_solution, [track for _, track, _ in tracks])]
    return "\n".join(lines) + "\n"


def _heading_line(gnss: bool, tracks: list[Track]) -> str:
    """Return where the heading comes from: of what a start needs, the one thing that data at rest do not tell."""
    if gnss:
        return f"  heading_from: auto  {CHECK} the course over ground; is it the heading? else heading_deg or reference"
    if any(track.attitude is not None for track in tracks):
        return f"  heading_from: auto  {CHECK} that of the reference"
    return f"  heading_deg: 0.0  {CHECK} clockwise from north; no file tells it"


def _imu_lines(number: int, path: str | Path, rows: ImuRows, notes: tuple[str, ...]) -> list[str]:
    facts = describe(rows)
    force = np.array(facts["accel_mean_m_s2"] or [0.0, 0.0, -9.8], dtype=float)
    axes = upright_axes(("x", "y", "z"), force)
    mean = ", ".join(f"{value:.1f}" for value in force)
    lines = [f"  - name: imu{number}", f"    file: {_quoted(path)}", *_format_lines(path, notes, "    ")]
    lines.append(f"    # {facts['rows']} rows, {facts['duration_s']:.1f} s at {facts['rate_hz'] or 0.0:.2f} Hz")
    if facts["repeated_stamps"]:
        rate = (facts["rows"] - 1) / facts["duration_s"]
        repeated = facts["repeated_stamps"]
        lines.append(f"    rate_hz: {rate:.6g}  {CHECK} {repeated} stamp(s) repeat, so rows are counted")
    if number > 1:
        lines.append(f"    clock_offset_s: 0.0  {CHECK} added to the stamps, to bring them to the clock of imu1, s")
    return [
        *lines,
        f"    # at rest or on average the sensor feels [{mean}] m/s^2, so down is known; forward is not",
        f"    axes: [{', '.join(axes)}]  {CHECK} sensor axes that point forward, right, down; forward is a guess",
        f"    mount_deg: [0, 0, 0]  {CHECK} roll, pitch, yaw that the axes are off by, deg",
        f"    position_m: [0, 0, 0]  {CHECK} forward, right, down from the array's origin, m",
        f"    noise: consumer-mems  {CHECK} a grade (consumer-mems, industrial-mems, tactical) or figures",
    ]


def _format_lines(path: str | Path, notes: tuple[str, ...], indent: str) -> list[str]:
    kind = data_format(path)
    lines = [f"{indent}format: {TRACK_FORMATS.get(kind, kind)}"]
    if kind != "table" or not notes:
        return lines
    columns, _ = guess_columns(path)
    lines.append(f"{indent}columns:  {CHECK} names and units")
    for group, content in columns.model_dump(mode="json", exclude_none=True).items():
        lines.append(f"{indent}  {group}: {_flow(content)}")
    return lines


def _track_lines(
    section: str, path: str | Path, track: Track, notes: tuple[str, ...], span: tuple[float, float]
) -> list[str]:
    facts = describe(track)
    lines = [
        f"  file: {_quoted(path)}",
        *_format_lines(path, notes, "  "),
        f"  # {facts['rows']} rows, {facts['begin_s']:.3f} to {facts['end_s']:.3f} s, {facts['rate_hz'] or 0.0:.2f} Hz",
    ]
    if track.time[-1] < span[0] or track.time[0] > span[1]:
        lines.append(
            f"  clock_offset_s: 0.0  {CHECK} the IMUs' stamps run from {span[0]:.3f} to {span[1]:.3f} s; give what "
            "brings these to the same clock"
        )
    else:
        lines.append(f"  clock_offset_s: 0.0  {CHECK} added to the stamps, to bring them to the clock of imu1, s")
    point = "antenna_position_m" if section == "gnss" else "point_m"
    lines.append(f"  {point}: [0, 0, 0]  {CHECK} forward, right, down from the array's origin, m")
    if section == "gnss" and track.position_std is None:
        lines.append(f"  position_std_m: [1.5, 1.5, 3.0]  {CHECK} north, east, down; the file has none")
    if track.above_sea:
        lines += ["  height: sea-level", f"  geoid_height_m:  {CHECK} height of the geoid above the ellipsoid there, m"]
    return lines


def _quoted(text: object) -> str:
    return "'" + str(text).replace("'", "''") + "'"


def _flow(value: Any) -> str:
    """Write plain values as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    return _quoted(value) if isinstance(value, str) else str(value)
