"""The lines of a start: where the heading comes from, or the whole state."""

from __future__ import annotations

import numpy as np

from polyins.config.yaml_document import flow
from polyins.formats.rows import Track
from polyins.model.rig import DEG
from polyins.tools.propose.lines import Line
from polyins.tools.propose.sources import FoundStream, Roles

STANDING_M_S = 0.1
"""less than that a reference says of what stands"""


def start_lines(of: Roles) -> list[Line]:
    """Return the section `start`."""
    reference = of.reference
    if of.gnss is None and of.heading is None and reference is not None and reference.log is not None:
        given = _given_start(reference, of.span) if reference.log is of.imus[0].log else []
        if given:
            return given
    return [_heading_line(of)]


def _heading_line(of: Roles) -> Line:
    """Return where the heading comes from: of what a start needs, the one thing that data at rest do not tell."""
    if of.heading is not None:
        return Line("  heading_from: auto", f"that of {of.heading.stream}; else heading_deg")
    if of.gnss is not None:
        why = "the course over ground; is it the heading? else heading_deg or reference"
        return Line("  heading_from: auto", why)
    if any(one.has_attitude for one in of.tracks):
        return Line("  heading_from: auto", "that of the reference")
    return Line("  heading_deg: 0.0", "clockwise from north; no file tells it")


def _given_start(of: FoundStream, span: tuple[float, float]) -> list[Line]:
    """Return the state that a log's reference has when the IMUs begin: without other aids nothing tells it better."""
    track = of.rows
    assert isinstance(track, Track)
    if track.velocity is None or track.attitude is None or track.time[-1] < span[0]:
        return []
    row = int(np.searchsorted(track.time, span[0]))
    roll, pitch, heading = (float(angle) for angle in np.round(track.attitude[row] / DEG, 6))
    velocity = [float(value) for value in np.round(track.velocity[row], 6)]
    moves = np.linalg.norm(velocity) > STANDING_M_S
    return [
        Line(f"  time_s: {float(track.time[row])!r}", "the state is that of the reference"),
        Line(f"  velocity_m_s: {flow(velocity)}"),
        Line(f"  roll_pitch_deg: {flow([roll, pitch])}"),
        Line(f"  heading_deg: {heading}"),
        *([Line("  estimate_gyro_bias: false  # it moves")] if moves else []),
    ]
