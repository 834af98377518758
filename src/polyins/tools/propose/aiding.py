"""The lines of what aids beside positions: an odometer, a barometer, a heading."""

from __future__ import annotations

from polyins.formats.rows import SensorRows
from polyins.tools.propose.lines import Line
from polyins.tools.propose.places import place_lines
from polyins.tools.propose.sources import FoundStream

HEADING_STD_DEG = 5.0
"""of the heading of another system, and of an offset of it: a compass on a vehicle"""
BAROMETER_STD_M, BAROMETER_BIAS_M, WEATHER_M_SQRT_S = 1.0, 300.0, 0.1
"""noise of a barometer on a vehicle; 35 hPa; 6 m in an hour"""
BAROMETER_RATE_HZ = HEADING_RATE_HZ = 1.0
"""errors of another filter last; taken at its own rate they would be averaged away"""


def odometer_lines(of: FoundStream, first: FoundStream) -> list[Line]:
    """Return the section `odometer`."""
    return [
        *place_lines(of, first),
        Line("  std_m_s: 0.1", "slip is what makes a wheel's speed wrong, not what the log states"),
        Line("  scale_std: 0.05", "of a constant part of its error"),
        Line("  position_m: [0, 0, 0]", "between the wheels: forward, right, down from the array's origin, m"),
    ]


def barometer_lines(of: FoundStream, first: FoundStream) -> list[Line]:
    """Return the section `height`."""
    off = "by which the weather is off the standard atmosphere, and the sea"
    return [
        *place_lines(of, first),
        Line(f"  std_m: {BAROMETER_STD_M:g}", "wind and rotors press on it as well"),
        Line(f"  bias_std_m: {BAROMETER_BIAS_M:g}", off),
        Line(f"  bias_random_walk_m_sqrt_s: {WEATHER_M_SQRT_S:g}", "how fast the weather changes"),
        Line(f"  rate_hz: {BAROMETER_RATE_HZ:g}  # its errors last"),
        Line("  position_m: [0, 0, 0]", "forward, right, down from the array's origin, m"),
    ]


def heading_lines(of: FoundStream, first: FoundStream) -> list[Line]:
    """Return the section `heading`."""
    told = isinstance(of.rows, SensorRows) and of.rows.std is not None
    how = "or leave it out, to take what the log tells" if told else "the log does not tell how good this heading is"
    return [
        *place_lines(of, first),
        Line(f"  std_deg: {HEADING_STD_DEG:g}", how),
        Line(f"  offset_std_deg: {HEADING_STD_DEG:g}", "of a constant part of its error"),
        Line(f"  rate_hz: {HEADING_RATE_HZ:g}  # its errors last"),
    ]
