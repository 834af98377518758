"""Text files of SBG's sbgBasicLogger, a folder of them or the file of an IMU: a line of names, one of units, tabs.

`imuData.txt`, `imuShort.txt` and `imuFast.txt` have m/s^2 and deg/s of the same IMU. Stamps are microseconds since the
sensor was powered, of 32 bits. Altitudes are above the sea; with the undulation beside them they are above the
ellipsoid.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import find, read_bytes
from polyins.formats.bundle import LISTING, Bundle, is_bundle
from polyins.formats.joined import rates_to_rows
from polyins.formats.log import Log
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, rising
from polyins.formats.text_rows import TextRows, read_rows
from polyins.model.recording import Array
from polyins.model.rig import DEG

HEADER = b"status\taccelX\taccelY\taccelZ\tgyroX\tgyroY\tgyroZ"
FILE = r"(imuData|imuShort|imuFast|(?:gnss|gps)[12](?:Pos|Vel)|euler|nav)\.txt"
FORCES, RATES = ("accelX", "accelY", "accelZ"), ("gyroX", "gyroY", "gyroZ")
PLACE, PLACE_STD = ("latitude", "longitude", "altitude"), ("latitudeStd", "longitudeStd", "altitudeStd")
VELOCITY, VELOCITY_STD = ("velN", "velE", "velD"), ("velStdN", "velStdE", "velStdD")
ATTITUDE, YAW_STD = ("roll", "pitch", "yaw"), "yawStd"
NAMES = (*FORCES, *RATES, *PLACE, *PLACE_STD, *VELOCITY, *VELOCITY_STD, *ATTITUDE, YAW_STD)
VALUES = "|".join(["timestamp", "gpsTow", "undulation", *NAMES])
LEAST_SURE_DEG = 10.0
"""of a heading that is one"""
UNITS = {
    "yaw": "(deg)",
    "accelX": "(m.s^-2)",
    "gyroX": "(deg.s^-1)",
    "latitude": "(deg)",
    "altitude": "(m)",
    "velN": "(m.s^-1)",
}
COUNTER_RANGE = 2**32


def fits(head: bytes) -> bool:
    """Whether it is the file of an IMU, or a folder with one."""
    if head.startswith(LISTING):
        return re.search(rb"(?m)^imu(Data|Short|Fast)\.txt$", head) is not None
    return HEADER in head.partition(b"\n")[0]


def read(path: str | Path) -> Log:
    """Read IMU and receivers; raises InputError for a damaged file, other units or stamps that are dates."""
    found = find(path)
    tables = {name: _table(f"{found}, {name}", content) for name, content in _contents(found).items()}
    imus = {name: _imu(found, name, rows) for name, rows in tables.items() if name.startswith("imu")}
    tracks: dict[str, Track] = {}
    for name, rows in tables.items():
        if name.endswith("Pos") and (track := _track(found, name, rows, tables.get(name.replace("Pos", "Vel")))):
            tracks[name] = track
    unusable = dict.fromkeys(list(imus)[1:], "is the same IMU")
    unusable |= dict.fromkeys(list(tracks)[1:], "only one receiver can aid the filter")
    headings = _headings(found, tables.get("euler"), unusable)
    if "nav" in tables and (track := _track(found, "nav", tables["nav"], tables["nav"])):
        tracks["nav"] = replace(track, attitude=_attitude(track.time, tables.get("euler")))
    warnings = tuple(text for rows in tables.values() for text in rows.warnings)
    return Log("boot", imus, tracks, headings, unusable, references=frozenset({"nav"}), notes=warnings)


def _contents(path: Path) -> dict[str, bytes]:
    if not is_bundle(path):
        return {path.name.split(".")[0]: read_bytes(path)}
    files = Bundle(path)
    found = files.found(FILE)
    names = sorted(found, key=["imuShort", "imuData", "imuFast", *sorted(found)].index)
    return dict(zip(names, files.read_all([found[name] for name in names]), strict=True))


def _table(place: str, content: bytes) -> TextRows:
    header, units, _ = (content + b"\n\n").split(b"\n", 2)
    names = header.decode("utf-8-sig", errors="replace").strip().split("\t")
    if "iso8601Time" in names:
        raise InputError(
            f"{place}: stamps are dates; expected timestamp, which sbgBasicLogger writes without --time-mode"
        )
    if "timestamp" not in names:
        raise InputError(f"{place}: no column timestamp; expected the header of sbgBasicLogger")
    said = dict(zip(names, units.decode(errors="replace").strip().split("\t"), strict=False))
    for name, unit in {"timestamp": "(us)", **UNITS}.items():
        if name in said and said[name] != unit:
            raise InputError(f"{place}: {name} is in {said[name]}; expected {unit}")
    rows = read_rows(place, content, 0, "\t", wanted=VALUES, unit_lines=1)
    count = rows.columns["timestamp"]
    time = (count + np.cumsum(np.diff(count, prepend=count[:1]) < -0.5 * COUNTER_RANGE) * float(COUNTER_RANGE)) * 1e-6
    return TextRows({**rows.columns, "timestamp": time}, rows.first_line, rows.warnings)


def _imu(path: Path, name: str, rows: TextRows) -> ImuRows:
    if not rows.has(*RATES, *FORCES):
        raise InputError(f"{path}, {name}: no row has rates and accelerations; expected accelX, ... and gyroX, ...")
    rows = rows.whole("timestamp", *RATES, *FORCES)
    return rates_to_rows(path, name, rows.columns["timestamp"], rows.of(*RATES) * DEG, rows.of(*FORCES))


def _track(path: Path, name: str, rows: TextRows, speeds: TextRows | None) -> Track | None:
    """Return the fixes; rows at 0, 0 or without accuracy are none."""
    if not rows.has("timestamp", *PLACE):
        return None
    rows = rows.whole("timestamp", *PLACE)
    time, std = rows.columns["timestamp"], _all(rows, PLACE_STD)
    known = (rows.of(*PLACE[:2]) != 0.0).any(axis=1) & (std > 0.0).all(axis=1)
    kept = rising(time, known)
    if not len(kept):
        return None
    place, above = rows.of(*PLACE)[kept], _all(rows, ("undulation",))[kept, 0]
    above_sea = not np.isfinite(above).all()
    place[:, 2] += 0.0 if above_sea else above
    velocity, velocity_std = _velocity(rows, kept, speeds)
    return Track(
        RowSource(f"{path}, {name}"),
        time[kept],
        place * [DEG, DEG, 1.0],
        above_sea=above_sea,
        position_std=std[kept],
        velocity=velocity,
        velocity_std=velocity_std,
    )


def _rows_of(stamps: Array, wanted: Array) -> list[int]:
    """Return the row of each stamp, -1 where there is none."""
    at = {stamp: row for row, stamp in enumerate(stamps)}
    return [at.get(stamp, -1) for stamp in wanted]


def _attitude(time: Array, angles: TextRows | None) -> Array | None:
    """Return roll, pitch, heading, rad, of the same stamps, if each has them."""
    if angles is None or not angles.has(*ATTITUDE):
        return None
    found = _rows_of(angles.columns["timestamp"], time)
    attitude = angles.of(*ATTITUDE)[found] * DEG
    return attitude if min(found) >= 0 and np.isfinite(attitude).all() else None


def _headings(path: Path, angles: TextRows | None, unusable: dict[str, str]) -> dict[str, SensorRows]:
    """Return the heading of the sensor's own filter; it is not to be used if that is not sure of it."""
    if angles is None or not angles.has(*ATTITUDE, YAW_STD):
        return {}
    rows = angles.whole("timestamp", "yaw", YAW_STD)
    kept = rising(rows.columns["timestamp"])
    time, yaw, std = rows.of("timestamp", "yaw", YAW_STD)[kept].T
    if not np.median(std) < LEAST_SURE_DEG:
        unusable["euler"] = f"the sensor's filter knows its heading to {np.median(std):.0f} deg only"
    return {"euler": SensorRows(RowSource(f"{path}, euler"), "heading", time, yaw * DEG, std * DEG)}


def _all(rows: TextRows, names: tuple[str, ...]) -> Array:
    """Return columns, NaN where there is none."""
    return rows.of(*names) if all(name in rows.columns for name in names) else np.full((len(rows), len(names)), np.nan)


def _velocity(rows: TextRows, kept: NDArray[np.intp], speeds: TextRows | None) -> tuple[Array | None, Array | None]:
    """Return velocity and std of the same times of the week, else stamps, if each fix has them."""
    if speeds is None or not speeds.has(*VELOCITY, *VELOCITY_STD):
        return None, None
    stamp = "gpsTow" if rows.has("gpsTow") and speeds.has("gpsTow") else "timestamp"
    found = _rows_of(speeds.columns[stamp], rows.columns[stamp][kept])
    velocity, std = speeds.of(*VELOCITY)[found], speeds.of(*VELOCITY_STD)[found]
    whole = min(found) >= 0 and np.isfinite(velocity).all() and (std > 0.0).all()
    return (velocity, std) if whole else (None, None)
