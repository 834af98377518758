"""Reading data files nobody has described: columns by their names, units by the size of the values.

Every guess is returned as a sentence for the user to check.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from polyins.errors import InputError
from polyins.files import find
from polyins.formats import kf_gins, rtklib, table, written_table, xsens_dot
from polyins.formats.columns import open_table
from polyins.formats.recognize import data_format, log_format, read_log
from polyins.formats.rows import ImuRows, Track
from polyins.reading import named_columns, unnamed_columns
from polyins.reading.half_imu import HalfImu
from polyins.reading.table_stream import TableStream

Stream = ImuRows | Track


def read_stream(path: str | Path) -> tuple[Stream, tuple[str, ...]]:
    """Read a data file of whatever format; returns its rows and what was guessed about a table.

    Raises InputError if it holds neither IMU data nor positions as far as can be told, or several streams.
    """
    kind = data_format(path)
    if kind == "configuration":
        raise InputError(f"{find(path)}: looks like a configuration; expected IMU data or positions")
    if kind == "table":
        return _only_of_table(path)
    if log_format(path) is not None:
        return _only_stream(path), ()
    return read_rows(path, kind), ()


def read_rows(path: str | Path, kind: str) -> Stream:
    """Read a file of one stream in the format that `data_format` says."""
    readers: dict[str, Any] = {
        "xsens-dot": xsens_dot.read_imu,
        "kf-gins": kf_gins.read_imu,
        "kf-gins-gnss": kf_gins.read_gnss,
        "kf-gins-nav": kf_gins.read_nav,
        "rtklib-pos": rtklib.read_gnss,
    }
    rows: Stream = readers[kind](path)
    return rows


def _only_stream(path: str | Path) -> Stream:
    """Return the one stream of a log that holds IMU data or positions."""
    log = read_log(path)
    streams: dict[str, Stream] = {**log.imus, **log.tracks}
    found = {name: rows for name, rows in streams.items() if name not in log.unusable}
    if len(found) != 1:
        raise InputError(f"{find(path)}: holds {', '.join(found) or 'no stream'}; expected one stream")
    return next(iter(found.values()))


def _only_of_table(path: str | Path) -> tuple[Stream, tuple[str, ...]]:
    found = read_table(path)
    if isinstance(found, HalfImu):
        raise InputError(f"{find(path)}: holds the {found.what} of an IMU alone; expected one stream")
    if len(found) != 1:
        raise InputError(f"{find(path)}: holds {len(found)} streams; expected one")
    return found[0].rows, found[0].guesses


def read_table(path: str | Path) -> list[TableStream] | HalfImu:
    """Return the streams of a table; raise InputError if neither names nor values say what its columns are."""
    opened = open_table(path)
    opened.parse_numbers()
    names = set(opened.names)
    if names.issuperset(written_table.IMU_NAMES):
        return [TableStream(table.imu_of(opened, written_table.written_imu_columns()))]
    if written_table.is_written_track(names):
        return [TableStream(table.read_track(path))]
    if not any(names):
        return unnamed_columns.streams_of(opened)
    return named_columns.streams_of(opened)
