"""The GPS/IMU stream of a KITTI raw drive: `oxts/timestamps.txt`, and a file of 30 values for each of its lines.

Axes are forward, left, up; rates are rad/s, forces m/s^2. The pose is the solution of the OXTS itself, to be compared
with. Stamps are dates in a time zone that the files do not tell; neither do they what heights are above.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find
from polyins.formats.bundle import LISTING, Bundle
from polyins.formats.joined import rates_to_rows
from polyins.formats.log import Log
from polyins.formats.rows import RowSource, Track, rising
from polyins.model.axes import Axes
from polyins.model.recording import Array
from polyins.model.rig import DEG

VALUES = 30
DATE = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(\.\d{1,9})?"
NORTH_EAST_VELOCITY, UP_VELOCITY = slice(6, 8), 10
FORCES, RATES = slice(11, 14), slice(17, 20)
POSITION_STD, VELOCITY_STD = 23, 24
FORWARD_LEFT_UP: Axes = ("x", "-y", "-z")
"""which of these axes point forward, right, down"""
FULL_RATE_HZ = 50.0
"""the unsynchronized drives have 100 Hz, the others 10"""


def fits(head: bytes) -> bool:
    """Whether it is a folder with such a stream, or the stream's own."""
    if not head.startswith(LISTING):
        return False
    within = re.search(rb"(?m)^([^/\n]+/)?oxts/timestamps\.txt$", head)
    own = re.search(rb"(?m)^timestamps\.txt$", head) and re.search(rb"(?m)^data/\d+\.txt$", head)
    return bool(within or own)


def read(path: str | Path) -> Log:
    """Read IMU and pose; raises InputError for a damaged file, and for a folder of several drives."""
    found = find(path)
    files = Bundle(found)
    time, values, notes = _rows(files, _folder(files))
    rate = 1.0 / float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if rate < FULL_RATE_HZ:
        notes.append(f"{rate:.3g} Hz: the unsynchronized version of the drive (extract) has 100 Hz")
    return Log(
        "local-time",
        {"imu": rates_to_rows(found, "imu", time, values[:, RATES], values[:, FORCES])},
        {"pose": _pose(found, time, values)},
        {},
        upright=True,
        axes={"imu": FORWARD_LEFT_UP},
        references=frozenset({"pose"}),
        notes=(*notes, "pose: the solution of the OXTS itself, no measurement"),
    )


def _folder(files: Bundle) -> str:
    """Return the folder of the one stream there is, with its `/`; raises InputError for several drives."""
    stamps = files.found(r"oxts/(timestamps)\.txt").get("timestamps", "timestamps.txt")
    return stamps.removesuffix("timestamps.txt")


def _rows(files: Bundle, folder: str) -> tuple[Array, Array, list[str]]:
    """Return stamps, s, and values, shape (T, 30); a file's number is that of its line, counted from 0."""
    lines = [
        line for line in files.read(f"{folder}timestamps.txt").decode(errors="replace").split("\n") if line.strip()
    ]
    names = [name for name in files.inside(f"{folder}data") if re.fullmatch(r".*/\d+\.txt(\.gz)?", name)]
    if not names:
        raise InputError(f"{files.path}: no {folder}data/0000000000.txt; expected a file for each stamp")
    numbers = [int(re.sub(r"\D", "", name.rpartition("/")[2].split(".")[0])) for name in names]
    notes = []
    if len(names) != len(lines):
        notes.append(f"{len(names)} files of values and {len(lines)} stamps: files go by their number")
    kept = [(number, name) for number, name in zip(numbers, names, strict=True) if number < len(lines)]
    values: list[list[float]] = []
    for (_, name), content in zip(kept, files.read_all([name for _, name in kept]), strict=True):
        row = _numbers(content)
        if len(row) != VALUES:
            if name != names[-1]:
                raise InputError(f"{files.path}, {name}: {len(row)} values; expected {VALUES}")
            notes.append(f"{name} is cut off ({len(row)} values; expected {VALUES}); it is left out")
            kept.pop()
            continue
        values.append(row)
    stamps = [_stamp(files.path, lines[number], number) for number, _ in kept]
    return np.array(stamps), np.array(values).reshape(-1, VALUES), notes


def _numbers(content: bytes) -> list[float]:
    """Return the numbers of a file up to the first that is none."""
    found = []
    for text in content.split():
        try:
            found.append(float(text))
        except ValueError:
            break
    return found


def _stamp(path: Path, line: str, number: int) -> float:
    place = f"{path}, timestamps.txt, line {number + 1}"
    if not re.fullmatch(DATE, line.strip()):
        raise InputError(f"{place}: {line.strip()!r}; expected a date like 2011-09-26 13:02:25.964389445")
    try:
        instant = np.datetime64(line.strip().replace(" ", "T"), "ns")
    except ValueError as error:
        raise InputError(f"{place}: {error}; expected a date") from error
    return float(instant.astype(np.int64)) * 1e-9


def _pose(path: Path, time: Array, values: Array) -> Track:
    """Return the solution; roll is positive left side up, pitch front down, yaw from east to north."""
    kept = rising(time)
    values = values[kept]
    std = np.repeat(values[:, [POSITION_STD]], 3, axis=1)
    velocity_std = np.repeat(values[:, [VELOCITY_STD]], 3, axis=1)
    roll, pitch, yaw = values[:, 3:6].T
    return Track(
        RowSource(f"{path}, pose"),
        time[kept],
        values[:, :3] * [DEG, DEG, 1.0],
        datum_known=False,
        position_std=std if (std > 0.0).all() else None,
        velocity=np.column_stack([values[:, NORTH_EAST_VELOCITY], -values[:, UP_VELOCITY]]),
        velocity_std=velocity_std if (velocity_std > 0.0).all() else None,
        attitude=np.column_stack([roll, -pitch, 0.5 * np.pi - yaw]),
    )
