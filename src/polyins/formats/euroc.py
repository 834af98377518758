"""EuRoC's (ASL's) folders, and single files of them: a `data.csv` per sensor, with `sensor.yaml` beside.

Stamps are ns; they are kept to 1 us. Rates are rad/s, forces m/s^2, in the sensor's axes. Positions (laser tracker,
motion capture, ground truth) are in a local frame with z up, whose x and y are taken for east and north. Attitudes are
left aside: they are those of a sensor, not of a vehicle.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_bytes
from polyins.formats.bundle import LISTING, Bundle, is_bundle
from polyins.formats.joined import rates_to_rows
from polyins.formats.log import Clock, Log
from polyins.formats.rows import ImuRows, RowSource, Track, rising
from polyins.formats.text_rows import TextRows, read_rows
from polyins.model.axes import Axes, axes_matrix, right_handed_axes
from polyins.model.gps_time import EARLIEST_UNIX_S
from polyins.model.recording import Array

HEADER = re.compile(rb"#timestamp( \[ns\])?, ?(w_RS_S_x|p_RS_R_x|p_R?S?_?x)\b")
VALUES = r"#timestamp.*|(w_RS_S|a_RS_S|p_\w*?|v_RS_R)_[xyz] .*"
UNITS = {"w_RS_S": "rad s^-1", "a_RS_S": "m s^-2", "v_RS_R": "m s^-1"}
ESTIMATED = "state_groundtruth"
"""begins the name of what was estimated afterwards; other positions are measured"""
TAKEN_FOR_EAST = "its x, y, z are taken for east, north, up: headings count from its y"


def fits(head: bytes) -> bool:
    """Whether it is such a file, or a folder with an IMU of this kind."""
    if head.startswith(LISTING):
        return re.search(rb"(?m)^(mav0/)?imu\d*/data\.csv$|^mav0/|^data\.csv$", head) is not None
    return HEADER.match(head.removeprefix(b"\xef\xbb\xbf")) is not None


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError for a damaged file, and for a folder without any of them."""
    found = find(path)
    files = _files(found)
    imus: dict[str, ImuRows] = {}
    tracks: dict[str, Track] = {}
    warnings: list[str] = []
    for name, (content, _) in files.items():
        place = f"{found}, {name}"
        rows = _named(read_rows(place, content, 0, ",", wanted=VALUES))
        warnings += rows.warnings
        if rows.has("w_RS_S_x", "a_RS_S_x"):
            rows = rows.whole("#timestamp", *_axes("w_RS_S"), *_axes("a_RS_S"))
            time = rows.columns["#timestamp"] * 1e-9
            imus[name] = rates_to_rows(found, name, time, rows.of(*_axes("w_RS_S")), rows.of(*_axes("a_RS_S")))
        elif track := _track(place, rows):
            tracks[name] = track
    if not imus and not tracks:
        raise InputError(f"{found}: no data.csv of an IMU or of positions; expected mav0/imu0/data.csv or the like")
    calibrated = {name: _calibration(text) for name, (_, text) in files.items() if text}
    first = min([rows.time[0] for rows in imus.values()] + [track.time[0] for track in tracks.values()])
    unix = bool(first > EARLIEST_UNIX_S)
    clock: Clock = "unix" if unix else "unknown"
    return Log(
        clock,
        imus,
        tracks,
        {},
        utc_of_zero=0.0 if unix else None,
        axes={name: one for name in imus if name in calibrated and (one := _named_axes(calibrated[name][0]))},
        points={name: _point(mount) for name, (mount, _) in calibrated.items() if mount is not None},
        noise={name: noise for name in imus if name in calibrated and (noise := calibrated[name][1])},
        references=frozenset(name for name in tracks if name.startswith(ESTIMATED)),
        notes=(*warnings, *(f"{name}: {TAKEN_FOR_EAST}" for name in tracks)),
    )


def _files(path: Path) -> dict[str, tuple[bytes, str]]:
    """Return the content of each data.csv and of the sensor.yaml beside it, by the name of the sensor."""
    if not is_bundle(path):
        beside = path.parent / "sensor.yaml"
        name = path.parent.name if path.name.startswith("data.csv") else path.name.split(".")[0]
        return {name: (read_bytes(path), beside.read_text(errors="replace") if beside.is_file() else "")}
    files = Bundle(path)
    data = files.found(r"(\w+)/data\.csv")
    if not data and "data.csv" in files.names:
        data = {path.name: "data.csv"}
    texts = {}
    for sensor, name in data.items():
        content = files.read(name)
        if HEADER.match(content.removeprefix(b"\xef\xbb\xbf")):
            yaml = name.removesuffix("data.csv") + "sensor.yaml"
            texts[sensor] = content, files.read(yaml).decode(errors="replace") if yaml in files.names else ""
    return texts


def _named(rows: TextRows) -> TextRows:
    """Return the columns by their names without units; raises InputError for a unit that is not the format's."""
    columns = {}
    for name, values in rows.columns.items():
        short, _, unit = name.partition(" [")
        expected = UNITS.get(short[:-2])
        if unit and expected and unit.rstrip("]") != expected:
            raise InputError(f"column {short} is in {unit.rstrip(']')}; expected {expected}")
        columns[short] = values
    return TextRows(columns, rows.first_line, rows.warnings)


def _axes(name: str) -> list[str]:
    return [f"{name}_{axis}" for axis in "xyz"]


def _track(place: str, rows: TextRows) -> Track | None:
    names = sorted(name for name in rows.columns if name.startswith("p_"))
    if [name[-1] for name in names] != ["x", "y", "z"]:
        return None
    if not rows.has("#timestamp", *names):
        return None
    rows = rows.whole("#timestamp", *names)
    time = rows.columns["#timestamp"] * 1e-9
    kept = rising(time)
    velocity = rows.of(*_axes("v_RS_R"))[kept] if rows.has("v_RS_R_x") else None
    return Track(
        RowSource(place),
        time[kept],
        rows.of(*names)[kept][:, [1, 0, 2]],
        geodetic=False,
        velocity=None if velocity is None else velocity[:, [1, 0, 2]] * [1.0, 1.0, -1.0],
    )


def _calibration(text: str) -> tuple[Array | None, tuple[float, float] | None]:
    """Return T_BS, shape (4, 4), and the densities of white noise, rad/s/sqrt(Hz) and m/s^2/sqrt(Hz), where given."""
    given = re.search(r"T_BS:.*?data:\s*\[([^\]]*)\]", text, re.DOTALL)
    numbers = [float(number) for number in re.findall(r"[-+.\deE]+", given[1])] if given else []
    mount = np.reshape(numbers, (4, 4)) if len(numbers) == 16 else None
    densities = [
        re.search(rf"^{sensor}_noise_density:\s*([-+.\deE]+)", text, re.MULTILINE)
        for sensor in ("gyroscope", "accelerometer")
    ]
    gyro, accel = (float(found[1]) if found else 0.0 for found in densities)
    return mount, (gyro, accel) if gyro > 0.0 and accel > 0.0 else None


def _named_axes(mount: Array | None) -> Axes | None:
    """Return which axes of the sensor point along those of the body, if they are parallel."""
    if mount is None:
        return None
    return next(
        (axes for axes in right_handed_axes() if np.allclose(axes_matrix(axes), mount[:3, :3], atol=0.02)), None
    )


def _point(mount: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in mount[:3, 3])
    return x, y, z
