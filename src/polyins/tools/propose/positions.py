"""The lines of positions, a receiver or a reference: their clock, their antenna, what their heights are above."""

from __future__ import annotations

from polyins.config.yaml_document import flow, quoted
from polyins.formats import geoid
from polyins.formats.rows import Track
from polyins.tools.inspect import describe
from polyins.tools.propose.lines import DATUM_UNKNOWN, Line
from polyins.tools.propose.places import BY_UTC, TO_ONE_CLOCK, format_lines, point_line
from polyins.tools.propose.sources import FoundStream, Roles


def track_lines(section: str, of: FoundStream, imus: Roles) -> list[Line]:
    """Return the section `gnss` or `reference`."""
    track = of.rows
    assert isinstance(track, Track)
    facts = describe(track)
    span = f"{facts['begin_s']:.3f} to {facts['end_s']:.3f} s"
    lines = [
        Line(f"  file: {quoted(of.path)}"),
        *format_lines(of, "  "),
        Line(f"  # {facts['rows']} rows, {span}, {facts['rate_hz'] or 0.0:.2f} Hz"),
        _clock_line(of, imus),
    ]
    antenna = of.log.antenna if of.log else None
    if section == "gnss" and antenna is not None:
        lines.append(Line(f"  antenna_position_m: {flow(list(antenna))}", "as the log's parameters say"))
    else:
        lines.append(point_line("  antenna_position_m" if section == "gnss" else "  point_m", of))
    if section == "gnss" and track.position_std is None:
        lines.append(Line("  position_std_m: [1.5, 1.5, 3.0]", "north, east, down; the file has none"))
    return [*lines, *_height_lines(of, track)]


def _height_lines(of: FoundStream, track: Track) -> list[Line]:
    doubts = [doubt.text for doubt in of.table.doubts if doubt.about == "heights"] if of.table else []
    lines = [
        Line("  height: as-given", f"{text}; sea-level with geoid_height_m, or ellipsoidal, say which", DATUM_UNKNOWN)
        for text in doubts
    ]
    if not doubts and not track.datum_known:
        why = "the log does not tell what heights are above; else sea-level"
        lines.append(Line("  height: ellipsoidal", why, DATUM_UNKNOWN))
    return [*lines, _above_sea()] if track.above_sea else lines


def _above_sea() -> Line:
    if geoid.library() is not None:
        why = f"above the sea; {geoid.MODEL} or geoid_height_m makes them ellipsoidal"
        return Line("  height: sea-level", why)
    return Line(
        "  height: as-given",
        "above the sea; sea-level with geoid_height_m, or a grid of it (pip install 'polyins[geoid]'), makes them "
        "ellipsoidal",
    )


def _clock_line(of: FoundStream, imus: Roles) -> Line:
    time, shift = of.rows.time, of.shift_to(imus.imus[0])
    if shift:
        age = of.log.fix_age or 0.0 if of.log else 0.0
        return Line(f"  clock_offset_s: {round(shift - age, 6)!r}", BY_UTC)
    if of.log is not None and of.log.fix_age is not None:
        return Line(f"  clock_offset_s: {-of.log.fix_age:g}", "how old fixes are when they are stamped, by the log")
    begin, end = imus.span
    if time[-1] < begin or time[0] > end:
        why = f"the IMUs' stamps run from {begin:.3f} to {end:.3f} s; give what brings these to the same clock"
        return Line("  clock_offset_s: 0.0", why)
    return Line("  clock_offset_s: 0.0", TO_ONE_CLOCK)
