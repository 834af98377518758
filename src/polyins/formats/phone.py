"""Exports of the phone apps phyphox and Sensor Logger: a folder or zip archive with a file per sensor, own stamps each.

Rates are rad/s, forces m/s^2, in the phone's axes: x to the right of the screen, y to its top, z out of it. The forces
are taken at the stamps of the rates, between their own. phyphox counts from the start of the experiment, and does not
count pauses, which `meta/time.csv` tells; its heights are above the sea. Sensor Logger's stamps are Unix time, its
heights above the ellipsoid; on iOS its accelerations have the opposite sign, which `Metadata.csv` tells.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find
from polyins.formats.bundle import LISTING, Bundle
from polyins.formats.joined import at_stamps, joined_rates
from polyins.formats.log import Log
from polyins.formats.rows import ImuRows, RowSource, Track, rising
from polyins.formats.text_rows import TextRows, read_rows
from polyins.model.recording import Array
from polyins.model.rig import DEG

GYROSCOPE = "Gyroscope"
FILE = r"(?:meta/)?(Gyroscope|Accelerometer|TotalAcceleration|Gravity|Location|Linear Accelerometer|Metadata|time)\.csv"
TEXTS = ("Metadata", "time")
NANOSECONDS = "time"
"""the stamps of Sensor Logger; those of phyphox are in a column Time (s)"""


def fits(head: bytes) -> bool:
    """Whether it is a folder or an archive with a file of a gyroscope or an accelerometer."""
    return head.startswith(LISTING) and re.search(rb"(?m)^(Gyroscope|Accelerometer)\.csv$", head) is not None


def read(path: str | Path) -> Log:
    """Read the IMU and the positions; raises InputError for a damaged file, or for axes of unknown sign."""
    found = find(path)
    contents = _contents(Bundle(found))
    texts = {name: contents.pop(name, b"").decode("utf-8-sig", errors="replace") for name in TEXTS}
    tables = {name: _table(found, name, content) for name, content in contents.items()}
    warnings = tuple(text for rows in tables.values() for text in rows.warnings)
    known = tables.get(GYROSCOPE) or tables.get("Accelerometer")
    if known is None:
        raise InputError(f"{found}: no Gyroscope.csv or Accelerometer.csv; expected an export with them")
    if NANOSECONDS in known.columns:
        log = _sensor_logger(found, tables, texts["Metadata"])
    else:
        log = _phyphox(found, tables, texts["time"])
    return replace(log, notes=(*warnings, *log.notes))


def _contents(files: Bundle) -> dict[str, bytes]:
    found = files.found(FILE)
    return dict(zip(found, files.read_all(list(found.values())), strict=True))


def _table(path: Path, name: str, content: bytes) -> TextRows:
    """Read a file; decimal commas are those of a table whose columns are apart by semicolons."""
    header = content.partition(b"\n")[0]
    delimiter = next((mark for mark in ";\t," if mark.encode() in header), ",")
    if delimiter == ";":
        content = header + b"\n" + content.partition(b"\n")[2].replace(b",", b".")
    wanted = r"(?i)time( \(s\))?|.*\b[xyz]( \(.*\))?|(latitude|longitude|height|altitude|.*accuracy).*"
    return read_rows(f"{path}, {name}.csv", content, 0, delimiter, wanted=wanted)


def _three(path: Path, name: str, rows: TextRows, unit: str) -> Array:
    """Return stamps, s, and the axes x, y, z, shape (T, 4); raises InputError for columns of another app."""
    columns = {}
    for axis in "xyz":
        fitting = [one for one in rows.columns if re.fullmatch(rf"(?i)(.* )?{axis}( \({re.escape(unit)}\))?", one)]
        if len(fitting) != 1:
            raise InputError(f"{path}, {name}.csv: no column of {axis} in {unit}; expected one")
        columns[axis] = fitting[0]
    stamp, scale = (NANOSECONDS, 1e-9) if NANOSECONDS in rows.columns else ("Time (s)", 1.0)
    if stamp not in rows.columns:
        raise InputError(f"{path}, {name}.csv: no column of time; expected time or Time (s)")
    rows = rows.whole(stamp, *columns.values())
    time = rows.columns[stamp] * scale
    kept = rising(time)
    return np.column_stack([time, rows.of(*columns.values())])[kept]


def _phyphox(path: Path, tables: dict[str, TextRows], times: str) -> Log:
    """Read phyphox's files; without `meta/time.csv` pauses cannot be told."""
    imus: dict[str, ImuRows] = {}
    tracks: dict[str, Track] = {}
    notes: list[str] = []
    starts = _starts(path, times)
    if GYROSCOPE in tables and "Accelerometer" in tables:
        gyro = _three(path, GYROSCOPE, tables[GYROSCOPE], "rad/s")
        imus["imu"] = joined_rates(path, "imu", gyro, _three(path, "Accelerometer", tables["Accelerometer"], "m/s^2"))
        imus["imu"] = replace(imus["imu"], time=_with_pauses(imus["imu"].time, starts))
    else:
        missing = "Accelerometer" if GYROSCOPE in tables else GYROSCOPE
        notes.append(f"no {missing}.csv: both are needed for an IMU" + _without_gravity(tables))
    if len(starts) > 1:
        notes.append(f"{len(starts) - 1} pause(s), which the app's own stamps do not count, are put into the stamps")
    if "Location" in tables:
        names = ("Latitude (°)", "Longitude (°)", "Height (m)")
        accuracy = ("Horizontal Accuracy (m)", "Vertical Accuracy (m)", "Vertical Accuracy (°)")
        track = _location(path, tables["Location"], "Time (s)", names, accuracy)
        tracks = {"Location": replace(track, time=_with_pauses(track.time, starts), above_sea=True)} if track else {}
    return Log(
        "unknown", imus, tracks, {}, utc_of_zero=starts[0][1] - starts[0][0] if starts else None, notes=tuple(notes)
    )


def _without_gravity(tables: dict[str, TextRows]) -> str:
    return (
        "; the linear accelerometer has no gravity, without which there is no level"
        if "Linear Accelerometer" in tables
        else ""
    )


def _starts(path: Path, text: str) -> list[tuple[float, float]]:
    """Return the times of the experiment and of the system, s, at which it was started and went on."""
    found = []
    for line in text.splitlines():
        cells = [cell.strip().strip('"') for cell in re.split(r"[,;\t](?=(?:[^\"]*\"[^\"]*\")*[^\"]*$)", line)]
        if cells[0] == "START":
            try:
                found.append((float(cells[1].replace(",", ".")), float(cells[2].replace(",", "."))))
            except (ValueError, IndexError):
                raise InputError(f"{path}, meta/time.csv: {line!r}; expected times of START") from None
    return found


def _with_pauses(time: Array, starts: list[tuple[float, float]]) -> Array:
    """Return stamps that go on through pauses."""
    later = np.zeros(len(time))
    for experiment, system in starts[1:]:
        pause = (system - starts[0][1]) - (experiment - starts[0][0])
        later[time >= experiment] = pause
    return time + later


def _sensor_logger(path: Path, tables: dict[str, TextRows], metadata: str) -> Log:
    imus: dict[str, ImuRows] = {}
    notes: list[str] = []
    force = _specific_force(path, tables, metadata, notes)
    if GYROSCOPE in tables and force is not None:
        imus["imu"] = joined_rates(path, "imu", _three(path, GYROSCOPE, tables[GYROSCOPE], "rad/s"), force)
    elif GYROSCOPE not in tables:
        notes.append("no Gyroscope.csv: it is needed for an IMU")
    track = None
    if "Location" in tables:
        names = ("latitude", "longitude", "altitude")
        track = _location(path, tables["Location"], NANOSECONDS, names, ("horizontalAccuracy", "verticalAccuracy"))
    return Log("unix", imus, {"Location": track} if track else {}, {}, utc_of_zero=0.0, notes=tuple(notes))


def _specific_force(path: Path, tables: dict[str, TextRows], metadata: str, notes: list[str]) -> Array | None:
    """Return the acceleration with gravity; raises InputError if its sign cannot be known."""
    if "TotalAcceleration" in tables and _platform(metadata)[0] != "ios":  # of Android alone, as documented
        return _three(path, "TotalAcceleration", tables["TotalAcceleration"], "m/s^2")
    if "Accelerometer" not in tables or "Gravity" not in tables:
        notes.append("no TotalAcceleration.csv, nor Accelerometer.csv with Gravity.csv: there is no specific force")
        return None
    moved = _three(path, "Accelerometer", tables["Accelerometer"], "m/s^2")
    told = _three(path, "Gravity", tables["Gravity"], "m/s^2")
    gravity, known = at_stamps(told[:, 0], told[:, 1:], moved[:, 0])
    return np.column_stack([moved[:, 0], _sign(path, metadata) * (moved[:, 1:] + gravity)])[known]


def _platform(metadata: str) -> tuple[str, bool]:
    """Return the system of the phone, and whether what iOS has otherwise was made like Android's."""
    lines = [line.split(",") for line in metadata.splitlines()]
    said = dict(zip(lines[0], lines[1], strict=False)) if len(lines) > 1 else {}
    return said.get("platform", "").strip().lower(), said.get("standardisation", "").strip().lower() == "true"


def _sign(path: Path, metadata: str) -> float:
    platform, standard = _platform(metadata)
    if platform not in ("ios", "android"):
        raise InputError(
            f"{path}: no Metadata.csv that tells the platform; expected it, since accelerations of iOS and Android "
            "have opposite signs"
        )
    return -1.0 if platform == "ios" and not standard else 1.0


def _location(
    path: Path, rows: TextRows, stamp: str, names: tuple[str, ...], accuracy: tuple[str, ...]
) -> Track | None:
    """Return the fixes that have a height; an accuracy that is not above zero is none."""
    scale = 1e-9 if stamp == NANOSECONDS else 1.0
    if not rows.has(stamp, *names):
        return None
    rows = rows.whole(stamp, *names)
    time = rows.columns[stamp] * scale
    given = [rows.columns[name] for name in accuracy if name in rows.columns]
    std = np.column_stack([given[0], given[0], given[1]]) if len(given) > 1 else np.full((len(time), 3), np.nan)
    told = (std > 0.0).all(axis=1)
    kept = rising(time, told if told.any() else np.ones(len(time), dtype=bool))
    return Track(
        RowSource(f"{path}, Location"),
        time[kept],
        rows.of(*names)[kept] * [DEG, DEG, 1.0],
        position_std=std[kept] if told.any() else None,
    )
