"""Where streams are found: file, name, columns; and what brings them to the clock and the axes of the first IMU."""

from __future__ import annotations

import numpy as np

from polyins.config.yaml_document import flow, quoted
from polyins.formats.recognize import data_format
from polyins.model.axes import axes_matrix
from polyins.tools.propose.axes import shared_axes
from polyins.tools.propose.lines import UNIT_GUESSED, Line
from polyins.tools.propose.sources import FoundStream

TRACK_FORMATS = {"kf-gins-gnss": "kf-gins"}
BY_UTC = "by what both files say of UTC; an autopilot knows it to a tenth of a second; time_offset: estimate finds more"
TO_ONE_CLOCK = "added to the stamps, to bring them to the clock of imu1, s"


def place_lines(of: FoundStream, first: FoundStream) -> list[Line]:
    """Return where a stream of a log is, and what brings it to the clock of the first IMU."""
    shift = of.shift_to(first)
    clock = [Line(f"  clock_offset_s: {shift!r}", BY_UTC)] if shift else []
    return [Line(f"  file: {quoted(of.path)}"), Line(f"  stream: {quoted(of.stream)}"), *clock]


def format_lines(of: FoundStream, indent: str) -> list[Line]:
    """Return the stream of a log, or the format and columns of a file of one."""
    if of.log is not None:
        return [Line(f"{indent}stream: {quoted(of.stream)}")]
    kind = data_format(of.path)
    lines = [Line(f"{indent}format: {TRACK_FORMATS.get(kind, kind)}")]
    if of.table is None or of.table.columns is None:
        return lines
    guessed = any(doubt.about == "units" for doubt in of.table.doubts)
    why = "; ".join(["names and units", *(doubt.text for doubt in of.table.doubts)])
    lines.append(Line(f"{indent}columns:", why, UNIT_GUESSED if guessed else None))
    written = of.table.columns.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    return lines + [Line(f"{indent}  {group}: {flow(content)}") for group, content in written.items()]


def point_line(key: str, of: FoundStream) -> Line:
    """Return where a sensor is, as the log says, or that nobody knows."""
    if of.log is not None and of.stream in of.log.points:
        point = axes_matrix(shared_axes(of.log)) @ np.array(of.log.points[of.stream])
        return Line(f"{key}: {flow([round(float(value), 6) + 0.0 for value in point])}", "as the log says")
    return Line(f"{key}: [0, 0, 0]", "forward, right, down from the array's origin, m")
