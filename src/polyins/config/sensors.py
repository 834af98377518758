"""Sensors beside IMUs and GNSS: heights, headings, the speed of an odometer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from polyins.config.clock import ClockSettings
from polyins.config.columns import TimeColumn
from polyins.config.fields import ORIGIN, Column, NotNegative, Positive, Section, Triple


class SensorColumns(Section):
    """The columns of a table of one sensor."""

    time: TimeColumn
    """the stamps"""
    value: Column
    """what the sensor shows"""
    unit: Literal["m", "deg", "rad", "m/s", "km/h"] | None = None
    """of the value; unless given m, deg or m/s"""
    std: Column | None = None
    """standard deviation of the value, in its unit"""


class SensorEntry(ClockSettings):
    """What all of them have in common."""

    file: str = ""
    """where the data are; `polyins live` needs it for a replay only"""
    stream: str = ""
    """which stream of a log; may be left out where there is only one of the kind"""
    columns: SensorColumns | None = None
    """of the table; without it time_s and height_m, heading_deg or speed_m_s"""
    rate_hz: Positive | None = None
    """thin the values to this rate; the larger, the more of them are used, as if their errors were independent"""
    position_m: Triple = ORIGIN
    """the point whose height or velocity it shows, from the array's origin: forward, right, down, m"""


class HeightEntry(SensorEntry):
    """Heights of a barometer, or known ones, above what the heights of GNSS are above."""

    FIELDS: ClassVar[Mapping[str, str]] = {"bias_std": "offset_std", "bias_random_walk": "offset_random_walk"}

    std_m: Positive | None = None
    """m; takes the place of what the file says; the larger, the less heights weigh"""
    bias_std_m: NotNegative = 0.0
    """of the difference from the height of GNSS at the start, m; above zero the filter estimates it; the larger, the
    more GNSS decides on the height"""
    bias_random_walk_m_sqrt_s: NotNegative = 0.0
    """of that difference; the larger, the faster the estimate follows the weather"""


class HeadingEntry(SensorEntry):
    """Headings of two antennas, a compass or another system, clockwise from true north."""

    std_deg: Positive | None = None
    """deg; takes the place of what the file says; the larger, the less headings weigh"""
    offset_std_deg: NotNegative = 0.0
    """of a constant offset from the heading of the array, deg; above zero the filter estimates it; the larger, the less
    headings say of the array's until it is known"""


class OdometerEntry(SensorEntry):
    """The speed of an encoder, and that the vehicle moves neither sideways nor up at `position_m`."""

    FIELDS: ClassVar[Mapping[str, str]] = {"scale_std": "offset_std"}

    std_m_s: Positive | None = None
    """of the speed, m/s; takes the place of what the file says; the larger, the less speeds weigh"""
    right_std_m_s: NotNegative = 0.1
    """of the velocity to the right, which is taken for zero, m/s; the larger, the more slip is allowed for; 0: it is
    not taken for zero"""
    down_std_m_s: NotNegative = 0.1
    """of the velocity down, likewise, m/s; the larger, the more the vehicle may bounce"""
    scale_std: NotNegative = 0.0
    """of a constant relative error of the speed; above zero the filter estimates it; the larger, the more GNSS decides
    on the scale"""
    constraint_interval_s: Positive | None = None
    """from one update by right_std_m_s and down_std_m_s alone to the next, s; the larger, the less they weigh; without
    it only where there is a speed"""
