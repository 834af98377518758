"""CSV of MicroStrain's MIP Monitor: lines about the session up to `DATA_START`, and columns named by their MIP field.

`X Accel [x8004]` is in g, `X Gyro [x8005]` rad/s, both in the sensor's axes. Rows are packets: those of the IMU leave
the receiver's columns empty, and the other way round. Stamps are `GPS TOW`; rows without are left out. Heights are
above the ellipsoid.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_bytes
from polyins.formats.joined import rates_to_rows
from polyins.formats.log import Log
from polyins.formats.rows import ImuRows, RowSource, Track, rising
from polyins.formats.stamps import unwrapped
from polyins.formats.text_rows import TextRows, header_line, lines_before, read_rows
from polyins.model.gps_time import WEEK_S, utc_of_week
from polyins.model.rig import DEG, STANDARD_GRAVITY

HEADER = r"GPS TOW.*\[x8[0-9A-Fa-f]{3}\]"
VALUES = r"GPS (Week|TOW)|[XYZ] (Accel \[x8004\]|Gyro \[x8005\])|.* \[x810[35]\]"
FORCES = tuple(f"{axis} Accel [x8004]" for axis in "XYZ")
RATES = tuple(f"{axis} Gyro [x8005]" for axis in "XYZ")
PLACE = ("Lat [x8103]", "Long [x8103]", "Height [x8103]")
ACCURACY = ("Horz Acc [x8103]", "Vert Acc [x8103]")
VELOCITY = ("Vel N [x8105]", "Vel E [x8105]", "Vel D [x8105]")
SPEED_ACCURACY = "Speed Acc [x8105]"


def fits(head: bytes) -> bool:
    """Whether its header is one of MIP Monitor."""
    return header_line(head, HEADER) is not None


def read(path: str | Path) -> Log:
    """Read IMU and receiver; raises InputError for a damaged file or one without stamps."""
    found = find(path)
    content = read_bytes(found)
    header = header_line(content, HEADER) or 0
    *session, names = lines_before(content, header)
    delimiter = next((mark for mark in ";\t," if mark in names), ",")
    if "DecimalSeparator=comma" in session and delimiter != ",":
        content = content.replace(b",", b".")
    rows = read_rows(str(found), content, header, delimiter, wanted=VALUES)
    stamped = np.nan_to_num(rows.columns["GPS TOW"]) > 0.0
    if not stamped.any():
        raise InputError(f"{found}: no row has GPS TOW; expected stamps")
    rows = TextRows({name: values[stamped] for name, values in rows.columns.items()}, rows.first_line, rows.warnings)
    lost = int(np.sum(~stamped))
    imu, track = _imu(found, rows), _track(found, rows)
    return Log(
        "gps-week",
        {"imu": imu} if imu else {},
        {"gnss": track} if track else {},
        {},
        utc_of_zero=_utc_of_zero(rows),
        notes=(*rows.warnings, *((f"{lost} row(s) without GPS TOW are left out",) if lost else ())),
    )


def _imu(path: Path, rows: TextRows) -> ImuRows | None:
    if not rows.has(*FORCES, *RATES):
        return None
    rows = rows.whole(*FORCES, *RATES)
    time = unwrapped(rows.columns["GPS TOW"], WEEK_S)
    return rates_to_rows(path, "imu", time, rows.of(*RATES), rows.of(*FORCES) * STANDARD_GRAVITY)


def _track(path: Path, rows: TextRows) -> Track | None:
    """Return the fixes; an accuracy that is not above zero is none."""
    if not rows.has(*PLACE):
        return None
    rows = rows.whole(*PLACE)
    known = (rows.of(*PLACE[:2]) != 0.0).any(axis=1)
    time = unwrapped(rows.columns["GPS TOW"], WEEK_S)
    kept = rising(time, known)
    if not len(kept):
        return None
    std = rows.of(ACCURACY[0], *ACCURACY)[kept] if rows.has(*ACCURACY) else np.zeros((len(kept), 3))
    told = rows.has(*VELOCITY, SPEED_ACCURACY)
    velocity = rows.of(*VELOCITY)[kept] if told else np.full((len(kept), 3), np.nan)
    speed = rows.of(*3 * [SPEED_ACCURACY])[kept] if told else np.zeros((len(kept), 3))
    whole = bool(np.isfinite(velocity).all() and (speed > 0.0).all())
    return Track(
        RowSource(f"{path}, gnss"),
        time[kept],
        rows.of(*PLACE)[kept] * [DEG, DEG, 1.0],
        position_std=std if (std > 0.0).all() else None,
        velocity=velocity if whole else None,
        velocity_std=speed if whole else None,
    )


def _utc_of_zero(rows: TextRows) -> float | None:
    """Return Unix time at the begin of the first row's week."""
    if not rows.has("GPS Week"):
        return None
    week = rows.columns["GPS Week"][np.nan_to_num(rows.columns["GPS Week"]) > 0.0]
    return float(utc_of_week(week[:1], np.zeros(1))[0]) if len(week) else None
