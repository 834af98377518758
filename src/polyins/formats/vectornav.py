"""CSV of VectorNav's sensors with the binary output's names as columns: `IMU::Accel::X [m/s^2]`, `GNSS1::PosLla::...`.

Stamps of the IMU are `GpsTow [s]`. Fixes are stamped with their own time, `GNSS1::Tow [ns]`, not that of the message
they came in. `IMU::Accel` and `IMU::AngularRate` are compensated by the sensor's calibration, `UncompAccel` and
`UncompGyro` are not. Heights are above the ellipsoid. Axes are the sensor's own.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import find, read_bytes
from polyins.formats.joined import rates_to_rows
from polyins.formats.log import Log, counted
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, rising
from polyins.formats.stamps import unwrapped
from polyins.formats.text_rows import TextRows, header_line, read_rows
from polyins.model.gps_time import WEEK_S, utc_of_week
from polyins.model.recording import Array
from polyins.model.rig import DEG

HEADER = re.compile(rb"(?m)^[^\n]*\b(IMU::|GNSS\d::|INS::|Att::)\w+")
VALUES = (
    r"GpsTow.*|GpsWeek|Time::GpsWeek|IMU::(Accel|AngularRate|UncompAccel|UncompGyro)::[XYZ].*|"
    r"GNSS\d::(Tow|Week|Fix|(PosLla|VelNed|PosU)::\w+|VelU)( \[.*)?|Att::YawPitchRoll::Y.*|INS::InsStatus::Mode"
)
UNITS = {
    "GpsTow": "s", "Accel": "m/s^2", "UncompAccel": "m/s^2", "AngularRate": "rad/s", "UncompGyro": "rad/s",
    "Tow": "ns", "latitude": "deg", "longitude": "deg", "altitude": "m", "VelNed": "m/s", "PosU": "m", "VelU": "m/s",
    "YawPitchRoll": "deg",
}  # fmt: skip
IMUS = {
    "IMU (compensated)": ("IMU::AngularRate", "IMU::Accel"),
    "IMU (Uncomp)": ("IMU::UncompGyro", "IMU::UncompAccel"),
}
FIXES = {0: "none", 1: "time only", 2: "2D", 3: "3D"}
THREE_DIMENSIONS = 3


def fits(head: bytes) -> bool:
    """Whether a first line names such columns."""
    line = head.partition(b"\n")[0]
    return b"GpsTow [s]" in line and HEADER.search(line) is not None


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError for a damaged file or one without stamps."""
    found = find(path)
    content = read_bytes(found)
    rows = _named(found, read_rows(str(found), content, header_line(content, "GpsTow") or 0, ",", wanted=VALUES))
    if not rows.has("GpsTow"):
        raise InputError(f"{found}: no row has GpsTow; expected stamps")
    time = unwrapped(rows.columns["GpsTow"], WEEK_S)
    rows = TextRows({**rows.columns, "GpsTow": time}, rows.first_line, rows.warnings)
    imus = {name: imu for name, columns in IMUS.items() if (imu := _imu(found, name, rows, *columns))}
    ages: list[str] = []
    tracks = {}
    for name in ("GNSS1", "GNSS2"):
        if (track := _track(found, name, rows, ages)) and len(track.time):
            tracks[name] = track
    unusable = dict.fromkeys(list(imus)[1:], "is the same IMU before its calibration")
    unusable |= dict.fromkeys(list(tracks)[1:], "only one receiver can aid the filter")
    headings = _headings(found, rows)
    if not _is_aligned(rows):
        unusable |= dict.fromkeys(
            headings, "the sensor's filter was not aligned (INS::InsStatus::Mode is 0 throughout)"
        )
    return Log(
        "gps-week",
        imus,
        tracks,
        headings,
        unusable,
        utc_of_zero=_utc_of_zero(rows),
        notes=(*rows.warnings, *ages),
    )


def _named(path: Path, rows: TextRows) -> TextRows:
    """Return the columns by their names without units; raises InputError for a unit that is not the format's."""
    columns = {}
    for name, values in rows.columns.items():
        short, _, unit = name.partition(" [")
        for part in short.split("::"):
            if unit and part in UNITS and unit.rstrip("]") != UNITS[part]:
                raise InputError(f"{path}: column {name}; expected {UNITS[part]}")
        columns[short] = values
    return TextRows(columns, rows.first_line, rows.warnings)


def _imu(path: Path, name: str, rows: TextRows, gyro: str, force: str) -> ImuRows | None:
    rates, forces = ([f"{one}::{axis}" for axis in "XYZ"] for one in (gyro, force))
    if not rows.has(*rates, *forces):
        return None
    rows = rows.whole("GpsTow", *rates, *forces)
    return rates_to_rows(path, name, rows.columns["GpsTow"], rows.of(*rates), rows.of(*forces))


def _track(path: Path, name: str, rows: TextRows, ages: list[str]) -> Track | None:
    """Return the fixes in three dimensions, once each: rows repeat the last one, or have 0, 0 for none."""
    place = [f"{name}::PosLla::{one}" for one in ("latitude", "longitude", "altitude")]
    if not rows.has(*place):
        return None
    rows = rows.whole(*place)
    time = rows.columns["GpsTow"]
    if rows.has(f"{name}::Tow"):
        own = rows.columns[f"{name}::Tow"] * 1e-9
        own = own + np.round((time - own) / WEEK_S) * WEEK_S
        ages.append(f"{name}: fixes have their own time, {np.median(time - own):.3f} s before that of their messages")
        time = own
    known = (rows.of(*place[:2]) != 0.0).any(axis=1) & np.isfinite(time)
    if f"{name}::Fix" in rows.columns:
        kind = rows.columns[f"{name}::Fix"]
        known &= kind >= THREE_DIMENSIONS
        quality = counted(kind[np.isfinite(kind)], lambda fix: FIXES.get(int(fix), f"type {fix:g}"))
    else:
        quality = {}
    kept = rising(time, known)
    velocity = _known(rows, kept, [f"{name}::VelNed::{axis}" for axis in "NED"])
    speed = _known(rows, kept, 3 * [f"{name}::VelU"], positive=True)
    return Track(
        RowSource(f"{path}, {name}"),
        time[kept],
        rows.of(*place)[kept] * [DEG, DEG, 1.0],
        position_std=_known(rows, kept, [f"{name}::PosU::{axis}" for axis in "NED"], positive=True),
        velocity=velocity if speed is not None else None,
        velocity_std=speed if velocity is not None else None,
        quality=quality,
    )


def _known(rows: TextRows, kept: NDArray[np.intp], names: list[str], *, positive: bool = False) -> Array | None:
    """Return columns if each of the rows has them."""
    if not len(kept) or not rows.has(*names):
        return None
    values = rows.of(*names)[kept]
    return values if np.isfinite(values).all() and (not positive or (values > 0.0).all()) else None


def _headings(path: Path, rows: TextRows) -> dict[str, SensorRows]:
    """Return the heading of the sensor's own filter, where there is one."""
    name = "Att::YawPitchRoll::Y"
    if not rows.has(name):
        return {}
    rows = rows.whole("GpsTow", name)
    kept = rising(rows.columns["GpsTow"])
    value = rows.columns[name] * DEG
    return {"Att": SensorRows(RowSource(f"{path}, Att"), "heading", rows.columns["GpsTow"][kept], value[kept])}


def _is_aligned(rows: TextRows) -> bool:
    mode = rows.columns.get("INS::InsStatus::Mode")
    return mode is None or bool(np.nan_to_num(mode).any())


def _utc_of_zero(rows: TextRows) -> float | None:
    """Return Unix time at the begin of the first row's week; the week is that of 10 bits where it is small."""
    name = "Time::GpsWeek"
    if not rows.has(name):
        return None
    week = rows.columns[name][np.isfinite(rows.columns[name])]
    return float(utc_of_week(week[:1], np.zeros(1))[0]) if week[0] > 0.0 else None
