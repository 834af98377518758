"""Reading data files nobody has described: columns by their names, units by the size of the values.

Every guess is returned as a sentence for the user to check.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polyins.config import ImuColumns, TrackColumns
from polyins.errors import InputError
from polyins.files import find
from polyins.formats import kf_gins, rtklib, table, xsens_dot
from polyins.formats.columns import column_names, read_columns
from polyins.formats.recognize import data_format, log_format, read_log
from polyins.formats.rows import ImuRows, Track
from polyins.formats.stamps import SECONDS
from polyins.model.recording import Array

Stream = ImuRows | Track

TIME = r"(sample)?_?time(_?stamp|fine)?|t|stamp|tow|gps_?(time|tow)|sec(ond)?s?(_?of_?week)?"
GYRO = r"(gyr|gyro|gyroscope|angvel|angular_?(velocity|rate)|omega|w|g)"
ACCEL = r"(acc|accel|acceleration|accelerometer|linear_?acceleration|specific_?force|f|a)"
GEODETIC = (
    r"lat(itude)?(_?gnss|_?gps)?",
    r"(lon|long|lng|longitude)(_?gnss|_?gps)?",
    r"(h|height|alt|altitude|hgt)(_?gnss|_?gps|_?ellips\w*|_?above\w*)?",
)
LOCAL = {
    "north-east-down": (r"n|north|pos_?n", r"e|east|pos_?e", r"d|down|pos_?d"),
    "north-east-up": (r"n|north|pos_?n", r"e|east|pos_?e", r"u|up|height|pos_?u"),
}
ATTITUDE = (r"roll", r"pitch", r"(compass_?)?heading|yaw|azimuth")
STD = (r"(sd|std|sigma)_?(n|north|lat)", r"(sd|std|sigma)_?(e|east|lon)", r"(sd|std|sigma)_?(d|u|down|up|h|height)")
UNIT = (
    r"[ _]*[\[(]?"
    r"(deg(rees?)?|rad|m|met(er|re)s?|s|sec|(milli|micro|nano)?seconds?|ms|us|ns|g|(deg|rad|d)_?/?p?_?s|m_?/?s(\^?2)?)?"
    r"[\])]?"
)
"""may follow a name"""

LIKELY_RATES_HZ = (10.0, 5000.0)
SLOWEST_FIX_HZ = 0.02


def read_stream(path: str | Path) -> tuple[Stream, tuple[str, ...]]:
    """Read a data file of whatever format; returns its rows and what was guessed about a table.

    Raises InputError if it holds neither IMU data nor positions as far as can be told.
    """
    kind = data_format(path)
    if kind == "configuration":
        raise InputError(f"{find(path)}: looks like a configuration; expected IMU data or positions")
    if kind == "table":
        return _read_table(path)
    if log_format(path) is not None:
        return _only_stream(path), ()
    readers: dict[str, Any] = {
        "xsens-dot": xsens_dot.read_imu,
        "kf-gins": kf_gins.read_imu,
        "kf-gins-gnss": kf_gins.read_gnss,
        "kf-gins-nav": kf_gins.read_nav,
        "rtklib-pos": rtklib.read_gnss,
    }
    return readers[kind](path), ()


def _only_stream(path: str | Path) -> Stream:
    """Return the one stream of a log that holds IMU data or positions."""
    log = read_log(path)
    streams: dict[str, Stream] = {**log.imus, **log.tracks}
    found = {name: rows for name, rows in streams.items() if name not in log.unusable}
    if len(found) != 1:
        raise InputError(f"{find(path)}: holds {', '.join(found) or 'no stream'}; expected one stream")
    return next(iter(found.values()))


def _read_table(path: str | Path) -> tuple[Stream, tuple[str, ...]]:
    names = set(column_names(path))
    if names.issuperset(table.IMU_NAMES):
        return table.read_imu(path), ()
    if "time_s" in names and (names.issuperset(table.GEODETIC_NAMES) or names.issuperset(table.LOCAL_NAMES)):
        return table.read_track(path), ()
    columns, guesses = guess_columns(path)
    if isinstance(columns, ImuColumns):
        return table.read_imu(path, columns), guesses
    return table.read_track(path, columns), guesses


def guess_columns(path: str | Path) -> tuple[ImuColumns | TrackColumns, tuple[str, ...]]:
    """Guess which columns of a table hold what, and in which units; returns the guesses in words as well.

    Raises InputError if the names say nothing.
    """
    names = column_names(path)
    time = _named(names, [TIME])
    gyro = _named(names, [f"{GYRO}_?{axis}" for axis in "xyz"])
    accel = _named(names, [f"{ACCEL}_?{axis}" for axis in "xyz"])
    if time and gyro and accel:
        return _imu_columns(path, time[0], gyro, accel)
    geodetic = _named(names, GEODETIC)
    local = {frame: found for frame, patterns in LOCAL.items() if (found := _named(names, patterns))}
    if time and (geodetic or local):
        return _track_columns(path, time[0], geodetic, local)
    raise InputError(
        f"{find(path)}: columns {', '.join(name for name in names if name) or '(no header)'} are of no known meaning; "
        "expected names such as time, gyro_x, acc_x or time, latitude, longitude, height (else declare them as columns)"
    )


def _named(names: Sequence[str], patterns: Sequence[str]) -> list[str] | None:
    """Return the first name that fits each pattern, or None if one has none."""
    found = []
    for pattern in patterns:
        fitting = re.compile(f"({pattern}){UNIT}", re.IGNORECASE)
        match = next((name for name in names if fitting.fullmatch(name)), None)
        if match is None:
            return None
        found.append(match)
    return found


def _imu_columns(path: str | Path, time: str, gyro: list[str], accel: list[str]) -> tuple[ImuColumns, tuple[str, ...]]:
    _, values = read_columns(path, [time, *gyro, *accel])
    steps = np.diff(values[0])
    usual = float(np.nanmedian(steps)) if np.isfinite(steps).any() else 0.0
    if not usual > 0.0 or not np.isfinite(values[1:]).any(axis=1).all():
        raise InputError(
            f"{find(path)}: {len(values[0])} row(s) without increasing times and values; expected IMU data"
        )
    time_unit = _time_unit(values[0], LIKELY_RATES_HZ)
    step = usual * SECONDS[time_unit]
    force = float(np.nanmedian(np.linalg.norm(values[4:7], axis=0)))
    accel_unit = min(
        ("m/s^2", "g", "m/s"),
        key=lambda unit: abs(np.log(max(force, 1e-12) * table.METRES[unit] / (step if unit == "m/s" else 1.0) / 9.8)),
    )
    gyro_unit = _gyro_unit(gyro[0], values[1:4], step, increments=accel_unit == "m/s")
    columns = ImuColumns.model_validate(
        {
            "time": {"name": time, "unit": time_unit},
            "gyro": {"names": gyro, "unit": gyro_unit},
            "accel": {"names": accel, "unit": accel_unit},
        }
    )
    return columns, (f"{find(path)}: taken as time in {time_unit}, gyro in {gyro_unit}, accel in {accel_unit}",)


def _gyro_unit(name: str, values: Sequence[Array], step: float, *, increments: bool) -> str:
    """Guess the unit from the name, else from the size: vehicles seldom turn at 5 rad/s, 5 deg/s is usual."""
    if re.search(r"deg|dps|d/s", name, re.IGNORECASE):
        degrees = True
    elif re.search(r"rad", name, re.IGNORECASE):
        degrees = False
    else:
        degrees = float(np.nanmax(np.abs(values))) / (step if increments else 1.0) > 10.0
    return ("deg" if degrees else "rad") + ("" if increments else "/s")


def _track_columns(
    path: str | Path, time: str, geodetic: list[str] | None, local: dict[str, list[str]]
) -> tuple[TrackColumns, tuple[str, ...]]:
    names = column_names(path)
    _, values = read_columns(path, [time])
    time_unit = _time_unit(values[0], (SLOWEST_FIX_HZ, LIKELY_RATES_HZ[1] / 10))
    frame = "latitude-longitude-height" if geodetic else next(iter(local))
    declared: dict[str, Any] = {
        "time": {"name": time, "unit": time_unit},
        "position": {"names": geodetic or local[frame], "frame": frame},
    }
    if std := _named(names, STD):
        declared["std"] = {"names": std}
    if attitude := _named(names, ATTITUDE):
        _, angles = read_columns(path, attitude)
        degrees = max(float(np.nanmax(np.abs(angle))) for angle in angles) > 2 * np.pi
        declared["attitude"] = {"names": attitude, "unit": "deg" if degrees else "rad"}
    said = f"{find(path)}: taken as time in {time_unit}, position as {frame}"
    return TrackColumns.model_validate(declared), (said,)


def _time_unit(stamps: Array, rates: tuple[float, float]) -> str:
    """Return the first unit that makes the rate a likely one."""
    steps = np.diff(stamps)
    step = float(np.nanmedian(steps)) if np.isfinite(steps).any() else 1.0
    for unit, length in SECONDS.items():
        if step > 0 and rates[0] <= 1.0 / (step * length) <= rates[1]:
            return unit
    return "s"
