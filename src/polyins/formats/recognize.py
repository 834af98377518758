"""Which format a file has, told by its content; the table of logs, and of what is known and not read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_head
from polyins.formats import (
    bundle,
    euroc,
    kf_gins,
    kitti,
    microstrain,
    mimu4444,
    nmea_log,
    phone,
    sbg,
    ublox,
    vectornav,
    xsens_mt,
)
from polyins.formats.columns import PARQUET_MAGIC
from polyins.formats.layout import is_number, sample
from polyins.formats.log import Log
from polyins.formats.rtklib import is_solution
from polyins.model.recording import Array

HEAD_BYTES = 16384
MOST_ROWS = 100
"""without a header that are looked at"""
MANY_ROWS = 10
"""make a table of a text that begins with something else"""
FASTEST_DEG_S = 0.05
"""of a latitude"""
FEW_ROWS = 4
"""tell nothing of stamps"""
MOSTLY = 0.8
"""of the steps between stamps are forward"""


def _begins(*signatures: bytes) -> Callable[[bytes], bool]:
    return lambda head: head.startswith(signatures)


def _is_ros2_sqlite(head: bytes) -> bool:
    """Whether a database has the tables of a ROS 2 bag, whose text stands on its first page, or a folder holds such."""
    return (head.startswith(b"SQLite format 3\0") and b"serialization_format" in head) or _is_ros2_folder(head, b".db3")


def _is_mcap(head: bytes) -> bool:
    return head.startswith(b"\x89MCAP0\r\n") or _is_ros2_folder(head, b".mcap")


def _is_ros2_folder(head: bytes, suffix: bytes) -> bool:
    names = head.splitlines()
    return head.startswith(bundle.LISTING) and b"metadata.yaml" in names and any(n.endswith(suffix) for n in names)


@dataclass(frozen=True)
class LogFormat:
    """A format whose files hold several streams."""

    name: str
    title: str
    fits: Callable[[bytes], bool]
    """whether a file that begins like this has it, or a folder or archive with such a list of files"""
    reader: str
    """the module of this package whose `read` returns the `Log` of a path"""
    library: str
    """it is read with, which the extra installs; empty: polyins alone reads it"""
    extra: str


LOGS: tuple[LogFormat, ...] = (
    LogFormat("px4-ulog", "PX4 ULog", _begins(b"ULog\x01\x12\x35"), "px4_ulog", "pyulog", "px4"),
    LogFormat("dataflash", "ArduPilot DataFlash", _begins(b"\xa3\x95\x80\x80"), "dataflash", "pymavlink", "ardupilot"),
    LogFormat("ros1-bag", "ROS 1 bag", _begins(b"#ROSBAG V2"), "ros_bag", "rosbags", "ros"),
    LogFormat("ros2-sqlite", "ROS 2 bag (SQLite)", _is_ros2_sqlite, "ros_bag", "rosbags", "ros"),
    LogFormat("mcap", "MCAP of ROS 2", _is_mcap, "ros_bag", "rosbags", "ros"),
    LogFormat("ubx", "u-blox UBX", ublox.fits, "ublox", "pyubx2", "ubx"),
    LogFormat("nmea", "NMEA 0183", nmea_log.fits, "nmea_log", "", ""),
    LogFormat("xsens-mt", "Xsens MT Manager text", xsens_mt.fits, "xsens_mt", "", ""),
    LogFormat("vectornav", "VectorNav CSV", vectornav.fits, "vectornav", "", ""),
    LogFormat("microstrain", "MicroStrain MIP Monitor CSV", microstrain.fits, "microstrain", "", ""),
    LogFormat("sbg", "SBG sbgBasicLogger text", sbg.fits, "sbg", "", ""),
    LogFormat("navego", "NaveGo .mat (version 5)", _begins(b"MATLAB 5.0"), "navego", "", ""),
    LogFormat("navego-hdf5", "NaveGo .mat (version 7.3)", _begins(b"MATLAB 7.3"), "navego", "h5py", "matlab"),
    LogFormat("kitti-oxts", "KITTI raw drive (oxts)", kitti.fits, "kitti", "", ""),
    LogFormat("phone", "phyphox or Sensor Logger export", phone.fits, "phone", "", ""),
    LogFormat("euroc", "EuRoC (ASL) folder", euroc.fits, "euroc", "", ""),
    LogFormat("mimu4444", "MIMU4444", mimu4444.fits, "mimu4444", "", ""),
)
FOLDERS = ("ROS 2 bag", "EuRoC", "KITTI", "phyphox", "Sensor Logger", "SBG")
"""what is read of folders and zip archives"""

NOT_READ: dict[str, Callable[[bytes], bool]] = {
    "SQLite": _begins(b"SQLite format 3\0"),
    "HDF5": _begins(b"\x89HDF\r\n\x1a\n"),
    "a zip archive": _begins(b"PK\x03\x04"),
}
"""what is known and not read, and how it is known"""


def data_format(path: str | Path) -> str:
    """Return a name of LOGS, xsens-dot, kf-gins (IMU), kf-gins-gnss, kf-gins-nav, rtklib-pos, table or configuration.

    Raises InputError if it is none of them.
    """
    if (log := log_format(path)) is not None:
        return log.name
    if find(path).is_dir():
        raise InputError(f"{path}: is a folder of no known log; expected a file, or {', '.join(FOLDERS)}")
    content = read_head(path, HEAD_BYTES)
    if content[:4] == PARQUET_MAGIC:
        return "table"
    for title, fits in NOT_READ.items():
        if fits(content):
            raise InputError(f"{find(path)}: looks like {title}, which is not read; expected {readable()}")
    if not kf_gins.is_text(content):
        return _binary(path, content)
    lines = content.decode("utf-8-sig", errors="replace").splitlines() or [""]
    rows = [line for line in lines if line.strip() and not line.startswith(("%", "#", "sep="))]
    if any("Acc_X" in line and "Gyr_X" in line for line in lines):
        return "xsens-dot"
    if is_solution(lines):
        return "rtklib-pos"
    if _are_many_rows(content):
        return _rows_of_numbers(content) or "table"
    if any(": " in line or line.endswith(":") for line in rows[:20]):
        return "configuration"
    return _rows_of_numbers(content) or _table(path, rows)


def readable() -> str:
    """Say what is read."""
    logs = ", ".join(log.title for log in LOGS)
    return f"{logs}, KF-GINS, RTKLIB .pos, Xsens DOT, a table (CSV, Parquet) or a configuration"


def log_format(path: str | Path) -> LogFormat | None:
    """Return the format of a log, or None of any other file."""
    head = bundle.head(path, HEAD_BYTES)
    return next((log for log in LOGS if log.fits(head)), None)


def read_log(path: str | Path) -> Log:
    """Read all streams of a log.

    Raises InputError if it is none, is damaged, or the library that reads it is missing.
    """
    found = find(path)
    return _read_log(found, *bundle.state(found))


@lru_cache(maxsize=8)
def _read_log(path: Path, _changed: int, _size: int) -> Log:
    """Read a log once for all of its streams, as long as the file stays the same."""
    known = log_format(path)
    if known is None:
        raise InputError(f"{path}: is no log of several streams; expected {', '.join(log.title for log in LOGS)}")
    if known.library and path.suffix == ".gz":
        raise InputError(f"{path}: is packed; expected the log unpacked")
    log: Log = import_module(f"polyins.formats.{known.reader}").read(path)
    return log


def imu_format(path: str | Path) -> str:
    """Return the format of a file of IMU data as the configuration names it, or log."""
    return _one_of(path, {"xsens-dot": "xsens-dot", "kf-gins": "kf-gins", "table": "table"}, "IMU data")


def track_format(path: str | Path) -> str:
    """Return the format of a file of positions as the configuration names it, or log."""
    names = {"kf-gins-gnss": "kf-gins", "kf-gins-nav": "kf-gins-nav", "rtklib-pos": "rtklib-pos", "table": "table"}
    return _one_of(path, names, "positions")


def _one_of(path: str | Path, names: dict[str, str], what: str) -> str:
    found = data_format(path)
    names = names | {log.name: "log" for log in LOGS}
    if found not in names:
        raise InputError(
            f"{find(path)}: looks like {found}; expected {what} ({', '.join(dict.fromkeys(names.values()))})"
        )
    return names[found]


def _binary(path: str | Path, head: bytes) -> str:
    """Tell rows of doubles from anything else, which is refused."""
    if kf_gins.are_rows(head):
        return "kf-gins"
    if head.startswith(b"\xb5\x62"):
        raise InputError(f"{find(path)}: looks like u-blox UBX without a whole message; is it damaged?")
    raise InputError(f"{find(path)}: is of no known binary format; expected {readable()}")


def _are_many_rows(head: bytes) -> bool:
    """Whether a text is a table, whatever stands before its rows: many have the same number of columns."""
    found = sample(head)
    return found is not None and found[0].width >= 3 and len(found[1]) >= MANY_ROWS


def _rows_of_numbers(head: bytes) -> str | None:
    """Tell the files without header apart by the number of columns, where the stamps are and by the size of values."""
    found = sample(head)
    if found is None or any(found[0].names):
        return None
    columns = np.array([_numbers(cells) for cells in found[1][:MOST_ROWS]]).T
    count = len(columns)
    if count == 7 and _rises(columns[0]):
        # A latitude and longitude in degrees, or increments of an IMU: only the former exceed a radian or so.
        if max(abs(value) for value in columns[1:3, 0]) > 2.0:
            return "kf-gins-gnss" if _are_places(columns[0], columns[1], columns[4:7]) else None
        return None if _are_rates(columns[0], columns[4:7]) or _are_rates(columns[0], columns[1:4]) else "kf-gins"
    if count == 13 and _rises(columns[0]):
        return "kf-gins-gnss"
    if count == 11 and _rises(columns[1]) and columns[0][0] == np.round(columns[0][0]):
        on_earth = np.abs(columns[2]).max() <= 90.0 and np.abs(columns[3]).max() <= 360.0
        return "kf-gins-nav" if on_earth else None
    return None


def _numbers(cells: list[str]) -> list[float]:
    return [float(text) if is_number(text) else np.nan for text in cells]


def _are_places(time: Array, latitude: Array, std: Array) -> bool:
    """Whether columns can be a latitude, deg, and standard deviations: nothing moves that fast, no std is negative."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        speed = np.abs(np.diff(latitude)) / np.abs(np.diff(time))
    return _median(speed) <= FASTEST_DEG_S and float(np.mean(std >= 0.0)) > 0.5


def _median(values: Array) -> float:
    """Return the median of what is finite, 0 of nothing."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0


def _are_rates(time: Array, force: Array) -> bool:
    """Whether three columns are a specific force in m/s^2 or g rather than its increments."""
    with np.errstate(over="ignore", invalid="ignore"):
        size, step = _median(np.linalg.norm(force, axis=0)), _median(np.abs(np.diff(time)))
    increments = step > 0.0 and 5.0 < size / step < 15.0
    return not increments and (8.5 < size < 11.2 or 0.85 < size < 1.15)


def _rises(stamps: Array) -> bool:
    """Whether a column can be that of the stamps, some of them wrong."""
    return len(stamps) < FEW_ROWS or float(np.mean(np.diff(stamps) > 0.0)) > MOSTLY


def _table(path: str | Path, rows: list[str]) -> str:
    fields = rows[0].replace(";", ",").replace("\t", ",").split(",") if rows else []
    if len(fields) < 3:
        raise InputError(f"{find(path)}: is of no known format; expected IMU data, positions or a configuration")
    return "table"
