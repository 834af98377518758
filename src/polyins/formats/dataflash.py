"""ArduPilot's DataFlash (.bin), by pymavlink.

`TimeUS` counts microseconds since boot, axes are forward, right, down; rates and forces are instants of the filtered
sensors. IMU instances are messages IMU, IMU2, IMU3 up to 4.0, afterwards messages IMU with a number `I`; those of
batches (ISBH, ISBD) are left aside. `Alt` of GPS is above the sea; `Und` of GPA, in new logs, is the height of
that less the height above the ellipsoid. Fixes are stamped as they arrive.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from polyins.files import find
from polyins.formats.joined import rates_to_rows
from polyins.formats.library import damage_named, heard, needed
from polyins.formats.log import Log, counted, fastest
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, rising
from polyins.model.gps_time import utc_of_week
from polyins.model.recording import Array
from polyins.model.rig import DEG

IMU_MESSAGES = ("IMU", "IMU2", "IMU3")
FILTERS = ("NKF1", "NKF6", "XKF1", "XKF6")
"""messages of the autopilot's own filters: EKF2 and EKF3, first and second core, or with a number `C`"""
KINDS = (*IMU_MESSAGES, "GPS", "GPS2", "GPA", "GPA2", "ATT", "PARM", *FILTERS)
THREE_DIMENSIONS = 3
TAIL_BYTES = 528
"""that may follow the last message: logs of old boards are made of pages"""
FIXES = {0: "none", 1: "none", 2: "2D", 3: "3D", 4: "DGPS", 5: "float", 6: "fix"}

Table = dict[str, Array]


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError for a damaged file or without pymavlink."""
    found = find(path)
    library = needed("pymavlink.DFReader", "ardupilot", found)
    with damage_named(found, "ArduPilot DataFlash"):
        with heard():
            reader = library.DFReader_binary(str(found))
            lost = _no_messages(reader)
            tables, parameters = _tables(reader)
        imus = _imus(found, tables)
        tracks, estimates = _tracks(found, tables), _estimates(found, tables)
        return Log(
            "boot",
            imus,
            tracks | estimates,
            _headings(found, tables),
            dict.fromkeys(list(tracks)[1:], "only one receiver can aid the filter")
            | dict.fromkeys(estimates, "ArduPilot's own estimate, on a plane"),
            utc_of_zero=_utc_of_zero(tables),
            upright=True,
            fix_age=parameters["GPS_DELAY_MS"] * 1e-3 if parameters.get("GPS_DELAY_MS") else None,
            antenna=_antenna(parameters),
            notes=(f"{lost} bytes on the way are no messages and are left out",) if lost > TAIL_BYTES else (),
        )


def _no_messages(reader: Any) -> int:
    """Return how many bytes of a log belong to no message."""
    known = sum(count * reader.formats[kind].len for kind, count in enumerate(reader.counts) if kind in reader.formats)
    return int(reader.data_len) - int(known)


def _tables(reader: Any) -> tuple[dict[str, Table], dict[str, float]]:
    """Return the messages by kind and instance, column by column, and the parameters."""
    rows: dict[str, list[dict[str, Any]]] = defaultdict(list)
    parameters: dict[str, float] = {}
    while (message := reader.recv_match(type=list(KINDS))) is not None:
        kind, values = message.get_type(), message.to_dict()
        if kind == "PARM":
            parameters[values["Name"]] = float(values["Value"])
        elif "TimeUS" in values:
            rows[_name(kind, values.get("C" if kind in FILTERS else "I"))].append(values)
    tables = {}
    for name, found in rows.items():
        numeric = [key for key, value in found[0].items() if isinstance(value, int | float)]
        tables[name] = {key: np.array([row[key] for row in found], dtype=float) for key in numeric}
    return tables, parameters


def _name(kind: str, instance: int | None) -> str:
    """Name a stream: the message of old logs, the message and its number of new ones."""
    return kind if instance is None else f"{kind}[{instance}]"


def _imus(path: Path, tables: dict[str, Table]) -> dict[str, ImuRows]:
    found = {}
    for name in sorted(tables):
        if name.startswith("IMU"):
            table, axes = tables[name], "XYZ"
            gyro = np.column_stack([table[f"Gyr{axis}"] for axis in axes])
            force = np.column_stack([table[f"Acc{axis}"] for axis in axes])
            found[name] = rates_to_rows(path, name, table["TimeUS"] * 1e-6, gyro, force)
    return found


def _tracks(path: Path, tables: dict[str, Table]) -> dict[str, Track]:
    return {
        name: _track(path, name, tables[name], tables.get(name.replace("GPS", "GPA")))
        for name in sorted(tables)
        if name.startswith("GPS") and (tables[name]["Status"] >= THREE_DIMENSIONS).any()
    }


def _track(path: Path, name: str, fixes: Table, accuracies: Table | None) -> Track:
    """Return the fixes in three dimensions, with the accuracies that were logged with them."""
    time, course = fixes["TimeUS"] * 1e-6, fixes["GCrs"] * DEG
    kept = rising(time, fixes["Status"] >= THREE_DIMENSIONS)
    velocity = np.column_stack([fixes["Spd"] * np.cos(course), fixes["Spd"] * np.sin(course), fixes["VZ"]])
    std, velocity_std = _accuracies(fixes["TimeUS"], accuracies)
    if std is not None:
        kept = kept[(std[kept] > 0.0).all(axis=1)]
    lowered = _at_fixes(fixes["TimeUS"], accuracies, "Und")[kept]
    known = bool(len(kept)) and bool(np.isfinite(lowered).all())
    height = fixes["Alt"][kept] - (lowered if known else 0.0)
    return Track(
        RowSource(f"{path}, {name}"),
        time[kept],
        np.column_stack([fixes["Lat"][kept] * DEG, fixes["Lng"][kept] * DEG, height]),
        above_sea=not known,
        position_std=None if std is None else std[kept],
        velocity=None if velocity_std is None else velocity[kept],
        velocity_std=None if velocity_std is None else velocity_std[kept],
        quality=counted(fixes["Status"], lambda status: FIXES.get(int(status), f"status {status:g}")),
    )


def _accuracies(stamps: Array, table: Table | None) -> tuple[Array | None, Array | None]:
    """Return the std of position and velocity at each fix, shape (M, 3), of the same stamp or the last before."""
    if table is None or "HAcc" not in table:
        return None, None
    horizontal, vertical, speed = (_at_fixes(stamps, table, key) for key in ("HAcc", "VAcc", "SAcc"))
    position = np.nan_to_num(np.column_stack([horizontal, horizontal, vertical]))
    velocity = np.repeat(np.nan_to_num(speed)[:, None], 3, axis=1)
    return position, velocity if (speed[np.isfinite(speed)] > 0.0).all() else None


def _at_fixes(stamps: Array, table: Table | None, key: str) -> Array:
    """Return what was logged with each fix, shape (M,), or NaN: of the same stamp or the last before."""
    if table is None or key not in table:
        return np.full(len(stamps), np.nan)
    last = np.searchsorted(table["TimeUS"], stamps, "right") - 1
    return np.where(last >= 0, table[key][last], np.nan)


def _estimates(path: Path, tables: dict[str, Table]) -> dict[str, Track]:
    """Return what the autopilot's own filters say: north, east and height on their plane, m, with the attitude."""
    found = {}
    for name in sorted(tables):
        table = tables[name]
        if not name.startswith(FILTERS) or not {"PN", "PE", "PD", "Roll", "Pitch", "Yaw"} <= set(table):
            continue
        time = table["TimeUS"] * 1e-6
        kept = rising(time)
        place, speed, angles = (
            np.column_stack([table[one] for one in names])[kept]
            for names in (("PN", "PE", "PD"), ("VN", "VE", "VD"), ("Roll", "Pitch", "Yaw"))
        )
        attitude = (angles * DEG + np.pi) % (2.0 * np.pi) - np.pi
        position, source = place * [1.0, 1.0, -1.0], RowSource(f"{path}, {name}")
        found[name] = Track(source, time[kept], position, geodetic=False, velocity=speed, attitude=attitude)
    return found


def _headings(path: Path, tables: dict[str, Table]) -> dict[str, SensorRows]:
    """Return the heading of the autopilot's own filter."""
    if "ATT" not in tables:
        return {}
    table = tables["ATT"]
    time, heading = table["TimeUS"] * 1e-6, table["Yaw"] * DEG
    kept = rising(time)
    return {"ATT": SensorRows(RowSource(f"{path}, ATT"), "heading", time[kept], heading[kept])}


def _utc_of_zero(tables: dict[str, Table]) -> float | None:
    """Return Unix time less time since boot."""
    fixes = next((tables[name] for name in sorted(tables) if name.startswith("GPS")), None)
    if fixes is None or "GWk" not in fixes:
        return None
    known = (fixes["GWk"] > 0.0) & (fixes["Status"] >= THREE_DIMENSIONS)
    if not known.any():
        return None
    utc = utc_of_week(fixes["GWk"][known], fixes["GMS"][known] * 1e-3)
    return fastest(utc - fixes["TimeUS"][known] * 1e-6)


def _antenna(parameters: dict[str, float]) -> tuple[float, float, float] | None:
    """Return where the antenna is from the first IMU: both are set from the body's origin."""
    names = [(f"GPS_POS1_{axis}", f"INS_POS1_{axis}") for axis in "XYZ"]
    if not all(antenna in parameters and imu in parameters for antenna, imu in names):
        return None
    x, y, z = (round(parameters[antenna] - parameters[imu], 4) for antenna, imu in names)
    return x, y, z
