"""What the names of columns say: quantity, axis, which of several sensors, unit.

Known are the names of ROS (field.angular_velocity.x), ulog2csv (gyro_rad[0]), pyins, u-blox (velN, hMSL), MAVLink
(xgyro), of Arduino sketches (aX, GyroX, millis) and of phone loggers (X (rad/s)).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

GYRO = (
    r"gyroscope|gyros|gyro_rate|gyro_?rotation|gyro|gyr|gy|angular_?velocity|angular_?rate|ang_?vel|ang_?rate"
    r"|rotation_?rate|omega|omg|w_rs_s|w|g"
)
ACCEL = (
    r"accelerometer|accelerations?|accel|acce|acc|ac|linear_?acceleration|linear_?accel|specific_?force|sf|a_rs_s"
    r"|fb|f|a"
)
ANGLE_INCREMENT = r"d_?theta|delta_?theta|delta_?angle|theta"
VELOCITY_INCREMENT = r"d_?vel|dv|delta_?vel(ocity)?|delta_?v"
UNIT = r"deg_s(ec)?|deg|dps|mdps|rad_s(ec)?|rad|mrad_s|m_s_?2|m_s_s|mps2|ms2|mg|g|m_s|raw|counts"
WHATS = {
    "gyro": GYRO,
    "accel": ACCEL,
    "angle increment": ANGLE_INCREMENT,
    "velocity increment": VELOCITY_INCREMENT,
}
FULL_WORDS = r"[a-z_]{3,}|gy|ac"
"""may stand behind the axis; single letters may not"""

GYRO_UNITS: dict[str, tuple[str, float]] = {
    **dict.fromkeys(("degs", "degsec", "degreess", "degsecond", "dps", "degs1", "degpersec", "deg"), ("deg/s", 1.0)),
    **dict.fromkeys(("rads", "radsec", "radians", "radsecond", "rads1", "radpersec", "rad", "rps"), ("rad/s", 1.0)),
    "mdps": ("deg/s", 1e-3),
    **dict.fromkeys(("mrads", "mradsec"), ("rad/s", 1e-3)),
}
ACCEL_UNITS: dict[str, tuple[str, float]] = {
    **dict.fromkeys(("ms2", "mss", "mps2", "msec2", "mssq", "metersecond2"), ("m/s^2", 1.0)),
    **dict.fromkeys(("g", "gs", "gn"), ("g", 1.0)),
    "mg": ("g", 1e-3),
    "ug": ("g", 1e-6),
    "mms2": ("m/s^2", 1e-3),
    "cms2": ("m/s^2", 1e-2),
}
TIME_UNITS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "usec", "usecs", "micros", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanosecond", "nanoseconds"), "ns"),
}
LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "dm": 0.1}
SPEEDS = {"ms": 1.0, "mps": 1.0, "mms": 1e-3, "cms": 1e-2, "kmh": 1 / 3.6, "kph": 1 / 3.6, "ms1": 1.0}

TIME = (
    r"(sample_?)?time(_?stamp|_?fine|_boot)?|t|stamp|timestamp|tow|i_tow|gps_?(time|tow)|sec(ond)?s?(_?of_?week)?|sow"
    r"|time_of_week|seconds_elapsed|elapsed|millis|milliseconds|ms|micros|microseconds|us|usec|nanoseconds|ns"
    r"|date|date_?time|utc|utc_?time|ticks?|epoch|zeit|zeitstempel"
)
TIME_BEHIND = r"time|time_?stamp|stamp|tow|time_usec|time_us|time_ms|time_s|date_?time"
"""may have words before it"""
NUMBER = (
    r"(imu|sensor|device|dev|node|unit|chip|board|module|channel|instance)(_?(id|no|nr|num|number|index|name|tag))?"
    r"|id|type|kind"
)
"""of a sensor among several"""
LATITUDE = r"(.*_)?lat(itude)?(_?gnss|_?gps)?"
LONGITUDE = r"(.*_)?(lon|long|lng|longitude)(_?gnss|_?gps)?"
ELLIPSOIDAL = r"h|height|hae|hgt|(.*_)?(height|alt|altitude|h|hgt)_?(gnss|gps|ellips\w*|above_ellips\w*|hae|wgs84)"
SEA_LEVEL = r"(.*_)?(h|height|alt|altitude)_?(a?msl|above_?(m?sea|msl)\w*|orthometric)|(a?msl)_?(height|alt|altitude)?"
AMBIGUOUS = r"(.*_)?(alt|altitude|elevation|ele|height_above\w*)(_?gnss|_?gps)?"
UNDULATION = r"(.*_)?(undulation|separation|geoid(al)?_?(sep|separation|height|undulation)?)"
LOCAL = {
    "north-east-down": (r"n|north|pos_?n", r"e|east|pos_?e", r"d|down|pos_?d"),
    "north-east-up": (r"n|north|pos_?n", r"e|east|pos_?e", r"u|up|height|pos_?u"),
}
VELOCITY = {
    "north-east-down": tuple(
        rf"(.*_)?(v|vel|velocity)_?({a})|({a})_(vel|velocity)" for a in ("n|north", "e|east", "d|down")
    ),
    "north-east-up": tuple(
        rf"(.*_)?(v|vel|velocity)_?({a})|({a})_(vel|velocity)" for a in ("n|north", "e|east", "u|up")
    ),
}
STD_WORDS = r"(sd|std|sigma|s|sig)"
STD = tuple(rf"{STD_WORDS}_?({a})" for a in ("n|north|lat", "e|east|lon", "d|u|down|up|h|height|alt"))
VELOCITY_STD = tuple(
    rf"{STD_WORDS}_?v_?({a})|{STD_WORDS}_({b})_(vel|velocity)"
    for a, b in (("n", "north"), ("e", "east"), ("d|u", "down|up"))
)
VARIANCES = tuple(rf"(.*_)?position_covariance_?{place}" for place in (4, 0, 8))
"""north, east, up of NavSatFix, whose order is east, north, up"""
HORIZONTAL_STD = r"h_?acc|horizontal_?(accuracy|acc)|eph"
VERTICAL_STD = r"v_?acc|vertical_?(accuracy|acc)|epv"
SPEED_STD = r"s_?acc|speed_?(accuracy|acc)|s_variance(_m_s)?"
FIX_TYPE = r"fix_?type|gps_?fix(_?type)?"
ATTITUDE = (r"roll", r"pitch", r"(compass_?)?heading|yaw|azimuth")
ANGLES = {
    "degree": ("deg", 1.0),
    "radians": ("rad", 1.0),
    "deg": ("deg", 1.0),
    "degrees": ("deg", 1.0),
    "rad": ("rad", 1.0),
    "1e7deg": ("deg", 1e-7),
    "dege7": ("deg", 1e-7),
}


@dataclass(frozen=True)
class ColumnName:
    """A name in small letters with one underscore between words, and the unit that stands in it."""

    plain: str
    unit: str
    """in small letters and digits; empty if there is none"""


@dataclass(frozen=True)
class SensorAxis:
    """One axis of a gyro or an accelerometer."""

    what: str
    """of WHATS"""
    axis: int
    of: str
    """tells several sensors apart"""
    unit: str


def parsed(name: str) -> ColumnName:
    """Split a name into what it names and its unit."""
    text, unit = name.strip().replace("²", "2").replace("°", "deg").replace("µ", "u").replace("μ", "u"), ""
    behind = re.search(r"\s*[\[(]([^\])(\[]*)[\])]\s*$", text)
    if behind is not None:
        index = {"0": "_x", "1": "_y", "2": "_z"}.get(behind[1])
        text = text[: behind.start()] + (index or "")
        unit = "" if index else re.sub(r"[^a-z0-9]", "", behind[1].lower())
    text = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", text)
    return ColumnName(re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_"), unit)


def sensor_axis(name: str) -> SensorAxis | None:
    """Return of which axis of which sensor a column is, as its name says."""
    known = parsed(name)
    for what, words in WHATS.items():
        number = r"\d{1,2}"
        before = r"(?:(?P<of>.*?)_)??"
        behind = rf"(?:_(?P<u2>{UNIT}))?"
        usual = (
            rf"{before}(?:{words})_?(?P<n1>{number})??_?(?:(?P<u1>{UNIT})_)??(?P<axis>[xyz])_?(?P<n2>{number})?{behind}"
        )
        axis_first = (
            rf"{before}(?P<axis>[xyz])_?(?=(?:{FULL_WORDS}))(?:{words})_?(?P<n1>)(?P<u1>)(?P<n2>{number})?{behind}"
        )
        found = re.fullmatch(usual, known.plain) or re.fullmatch(axis_first, known.plain)
        if found is not None:
            of = "_".join(found[key] for key in ("of", "n1", "n2") if found[key])
            unit = known.unit or re.sub("_", "", found["u1"] or found["u2"] or "")
            return SensorAxis(what, "xyz".index(found["axis"]), of, unit)
    return None


def named(names: Sequence[str], pattern: str, units: str = "") -> list[str]:
    """Return the names that fit a pattern, behind which a unit may stand."""
    fitting = re.compile(rf"(?:{pattern})(?:_(?:{units}))?" if units else pattern)
    return [name for name in names if name and fitting.fullmatch(parsed(name).plain)]


def first_of_each(names: Sequence[str], patterns: Sequence[str], units: str = "") -> list[str] | None:
    """Return the first name that fits each pattern, or None if one has none."""
    found = [named(names, pattern, units)[:1] for pattern in patterns]
    return [name for one in found for name in one] if all(found) else None


def unit_of(name: str) -> str:
    """Return the unit that stands in a name: in brackets, or the words behind the last underscores."""
    known = parsed(name)
    if known.unit:
        return known.unit
    words = known.plain.split("_")
    return next(
        (unit for n in (3, 2, 1) if len(words) > n and (unit := "".join(words[-n:])) in KNOWN_UNITS),
        "",
    )


KNOWN_UNITS = {*GYRO_UNITS, *ACCEL_UNITS, *TIME_UNITS, *LENGTHS, *SPEEDS, *ANGLES}


def time_unit_of(name: str) -> str | None:
    """Return the unit of stamps that a name says, or None."""
    known = parsed(name)
    if known.plain == "i_tow":
        return "ms"
    return TIME_UNITS.get(known.unit or known.plain.split("_")[-1])
