"""The data files of KF-GINS: IMU increments (text and binary), GNSS positions, navigation results.

Columns as that program documents them. Angles are degrees in files and radians in memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from polyins.errors import InputError
from polyins.files import find, opened, read_bytes, read_head, write_bytes
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.column_place import Column
from polyins.formats.layout import HEAD_BYTES, layout
from polyins.formats.parquet_table import PIECE_ROWS
from polyins.formats.rows import ImuRows, RowSource, Track, intervals
from polyins.formats.text_table import text_pieces, whole_rows
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, GnssStream, ImuStream
from polyins.model.rig import DEG

if TYPE_CHECKING:
    from polyins.config import ImuColumns

IMU_COLUMNS = 7
ROW_BYTES = 8 * IMU_COLUMNS
LARGEST_STAMP = 1e10
SMALLEST_STAMP = 1e-9
"""s, but for zero"""
LARGEST_VALUE = 1e4
"""of an increment or a rate, m/s^2 at most"""
CLEARLY = 0.8
"""of two differences the smaller is that part of the larger one at most"""
MOSTLY = 0.8
"""of the rows, where some are damaged"""
IMU_FORMATS = ("%.9f", *6 * ["%.12e"])


def read_imu(path: str | Path) -> ImuRows:
    """Read IMU increments: s, 3 angle increments (rad), 3 velocity increments (m/s); text or little-endian doubles.

    Which of the two it is shows in the content. Raises InputError for a wrong number of columns, a value that is not
    a number, or a binary file that ends within a row.
    """
    content = read_bytes(path)
    text = is_text(content)
    if text:
        source, rows = _numbers(path, content, {IMU_COLUMNS: "s, 3 rad, 3 m/s"})
    else:
        source, rows = RowSource(str(find(path))), _binary(path, content)
    return ImuRows(source, rows[:, 0], rows[:, 1:4], rows[:, 4:7], warnings=source.warnings)


def read_rates(path: str | Path, rate_hz: float | None = None) -> ImuRows:
    """Read the IMU file of Wheel-INS: s, 3 rates (rad/s), 3 specific forces (m/s^2) in little-endian doubles.

    Increments are rate x interval, as in that program; with `rate_hz` the stamps are ignored. Raises InputError for
    text and for a file that ends within a row.
    """
    content = read_bytes(path)
    if is_text(content):
        raise InputError(f"{find(path)}: is text; expected rows of {IMU_COLUMNS} doubles (s, 3 rad/s, 3 m/s^2)")
    rows = _binary(path, content)
    time = np.arange(len(rows)) / rate_hz if rate_hz else rows[:, 0]
    increments = rows[:, 1:] * intervals(time)[:, None]
    source = RowSource(str(find(path)))
    return ImuRows(source, time, increments[:, :3], increments[:, 3:], gyro_unit="rad/s", accel_unit="m/s^2")


def columns_of(path: str | Path, *, rates: bool = False) -> ImuColumns:
    """Return the columns of an IMU file, of `read_rates` or `read_imu`; raises InputError if it has not seven."""
    from polyins.config import ImuColumns

    head = read_head(path, HEAD_BYTES)
    if is_text(head) and len(head.splitlines()[0].replace(b",", b" ").split()) != IMU_COLUMNS:
        raise InputError(f"{find(path)}: expected {IMU_COLUMNS} columns (s, 3 rad, 3 m/s)")
    gyro, accel = ("rad/s", "m/s^2") if rates else ("rad", "m/s")
    units = {"gyro": {"names": [2, 3, 4], "unit": gyro}, "accel": {"names": [5, 6, 7], "unit": accel}}
    return ImuColumns.model_validate({"time": {"name": 1}, **units})


def read_in_order(path: str | Path, wanted: Sequence[Column]) -> Iterator[tuple[RowSource, list[Array]]]:
    """Read columns of an IMU file, which have numbers, piece by piece; raises InputError as `read_imu` does."""
    if is_text(read_head(path, HEAD_BYTES)):
        yield from text_pieces(path, wanted)
        return
    with opened(path) as file:
        while content := file.read(ROW_BYTES * PIECE_ROWS):
            rows = _binary(path, content)
            yield RowSource(str(find(path))), [rows[:, int(number) - 1].copy() for number in wanted]


def read_gnss(path: str | Path) -> Track:
    """Read positions: s, latitude, longitude (deg), height (m), std north, east, down (m).

    With 13 columns the velocity (north, east, down, m/s) stands before the position's std and its std after it, or, as
    KF-GINS-Matlab has it, behind that std: the values tell which, and a warning says so. Raises InputError if they do
    not.
    """
    wanted = {
        7: "s, latitude deg, longitude deg, height m, std m",
        13: "the same with velocity and its std",
    }
    source, rows = _numbers(path, read_bytes(path), wanted)
    if rows.shape[1] == 7:
        places = _radians(rows[:, 1:4], 2)
        return Track(source, rows[:, 0], places, position_std=rows[:, 4:7], warnings=source.warnings)
    velocity, std = slice(4, 7), slice(7, 10)
    matlab = _std_first(source, rows)
    order = (f"{source.path}: columns 5 to 7 are taken as std and 8 to 10 as velocity",) if matlab else ()
    if matlab:
        velocity, std = std, velocity
    return Track(
        source,
        rows[:, 0],
        _radians(rows[:, 1:4], 2),
        position_std=rows[:, std],
        velocity=rows[:, velocity],
        velocity_std=rows[:, 10:13],
        warnings=(*source.warnings, *order),
    )


def _std_first(source: RowSource, rows: Array) -> bool:
    """Whether columns 5 to 7 are the std and 8 to 10 the velocity: a std is above zero, a velocity moves."""
    no_std = [bool((rows[:, k : k + 3] <= 0.0).any()) for k in (4, 7)]
    if no_std[0] != no_std[1]:
        return no_std[1]
    if all(no_std) or len(rows) < 2:
        return False  # whatever is wrong with a std is said of the order that KF-GINS documents
    moved = displacement(_radians(rows[:, 1:4], 2), _radians(rows[:1, 1:4], 2)[0], True)
    rates = np.diff(moved, axis=0) / np.diff(rows[:, 0])[:, None]
    with np.errstate(invalid="ignore"):
        apart = [float(np.nanmedian(np.abs(rates - rows[1:, k : k + 3]).sum(axis=1))) for k in (4, 7)]
    if min(apart) > CLEARLY * max(apart):
        raise InputError(
            f"{source.path}: columns 5 to 7 or 8 to 10 may be the velocity, the others the std; expected values that "
            "tell, or a table with its columns declared"
        )
    return apart[1] < apart[0]


def read_nav(path: str | Path) -> Track:
    """Read a navigation result or truth: week, s, latitude, longitude (deg), height (m), velocity NED, angles (deg)."""
    wanted = {11: "week, s, lat, lon, h, vN, vE, vD, roll, pitch, heading"}
    source, rows = _numbers(path, read_bytes(path), wanted)
    return Track(
        source,
        rows[:, 1],
        _radians(rows[:, 2:5], 2),
        velocity=rows[:, 5:8],
        attitude=rows[:, 8:11] * DEG,
        warnings=source.warnings,
    )


def write_imu_text(path: str | Path, stream: ImuStream) -> None:
    """Write increments as KF-GINS text."""
    _write_text(path, np.column_stack([stream.time, stream.dtheta, stream.dvel]), IMU_FORMATS)


def write_imu_binary(path: str | Path, stream: ImuStream) -> None:
    """Write increments as KF-GINS binary: 7 little-endian doubles per row."""
    write_bytes(path, np.column_stack([stream.time, stream.dtheta, stream.dvel]).astype("<f8").tobytes())


def write_gnss(path: str | Path, stream: GnssStream) -> None:
    """Write geodetic positions as a KF-GINS GNSS file, of 13 columns where the stream has velocities."""
    position = stream.position.copy()
    position[:, :2] /= DEG
    columns = [stream.time, position, stream.position_std]
    formats = ["%.9f", "%.12f", "%.12f", "%.6f", *3 * ["%.6f"]]
    if stream.velocity is not None and stream.velocity_std is not None:
        columns = [stream.time, position, stream.velocity, stream.position_std, stream.velocity_std]
        formats += 6 * ["%.6f"]
    _write_text(path, np.column_stack(columns), formats)


def is_text(content: bytes) -> bool:
    """Tell text, of whatever encoding, from binary by the first bytes: it has no control characters but blanks."""
    return all(byte in b"\t\n\r\f" or byte >= 32 for byte in content[:512])


def are_rows(head: bytes) -> bool:
    """Tell rows of doubles, of increments or rates, from any other binary by the first bytes: stamps rise."""
    rows = np.frombuffer(head[: len(head) // ROW_BYTES * ROW_BYTES], "<f8").reshape(-1, IMU_COLUMNS)
    with np.errstate(invalid="ignore", over="ignore"):
        size = np.abs(rows[:, 1:]).max(axis=1, initial=0.0)
        known = (rows[:, 0] == 0.0) | (np.abs(rows[:, 0]) > SMALLEST_STAMP)
        likely = (size < LARGEST_VALUE) & known & (np.abs(rows[:, 0]) < LARGEST_STAMP)
        rising = np.diff(rows[:, 0]) > 0.0
    return bool(len(rows)) and likely.mean() > MOSTLY and (len(rows) < 2 or bool(rising.mean() > MOSTLY))


def _radians(rows: Array, columns: int) -> Array:
    rows = rows.copy()
    rows[:, :columns] *= DEG
    return rows


def _binary(path: str | Path, content: bytes) -> Array:
    if len(content) % ROW_BYTES:
        raise InputError(
            f"{find(path)}: {len(content)} bytes, the last row is cut off; expected a multiple of {ROW_BYTES} "
            f"({IMU_COLUMNS} doubles a row)"
        )
    return np.frombuffer(content, "<f8").reshape(-1, IMU_COLUMNS).astype(float)


def _numbers(path: str | Path, content: bytes, wanted: dict[int, str]) -> tuple[RowSource, Array]:
    """Parse rows of numbers between blanks or commas and check how many columns there are.

    A first or last line that was cut off is left out with a warning.
    """
    source, content = _whole_lines(path, content)
    if b"," in content[:4096]:
        content = content.replace(b",", b" ")
    rows = _evenly_spaced(content)
    if rows is None:
        try:
            rows = np.loadtxt(content.splitlines(), ndmin=2, comments=None)
        except ValueError as error:
            raise _bad_line(source, content) from error
    if rows.shape[1] not in wanted:
        expected = " or ".join(f"{count} ({names})" for count, names in wanted.items())
        raise InputError(f"{find(path)}: {rows.shape[1]} columns; expected {expected}")
    return source, rows


def _whole_lines(path: str | Path, content: bytes) -> tuple[RowSource, bytes]:
    """Return where the rows come from, and the text without lines that were cut off or are empty."""
    try:
        table = layout(path, content)
    except InputError:
        return RowSource(str(find(path)), 1), content
    source, rows = whole_rows(find(path), content, table)
    if any(table.names) or not (source.warnings or source.lines is not None):
        return RowSource(source.path, 1), content
    return source, bytes(rows)


def _evenly_spaced(content: bytes) -> Array | None:
    """Return the numbers of lines in which one blank stands between any two; None of any other file, or a wrong one."""
    from pyarrow import ArrowInvalid, BufferReader, csv, float64

    if content.startswith(b" ") or any(mark in content for mark in (b"  ", b"\n ", b" \n", b" \r", b'"')):
        return None
    names = [str(k) for k in range(len(content[: content.find(b"\n")].split()))]
    try:
        table = csv.read_csv(
            BufferReader(content),
            csv.ReadOptions(column_names=names, use_threads=False),
            csv.ParseOptions(delimiter=" "),
            csv.ConvertOptions(column_types=dict.fromkeys(names, float64()), null_values=[]),
        )
    except ArrowInvalid:
        return None
    return np.column_stack([to_numpy(column) for column in table.columns])


def _bad_line(source: RowSource, content: bytes) -> InputError:
    """Find the line that is to blame: the first that is not numbers, or not as many as the first line has."""
    width = 0
    for row, line in enumerate(content.splitlines()):
        fields, place = line.split(), source.place(row)
        for text in fields:
            try:
                float(text)
            except ValueError:
                return InputError(f"{place}: {text.decode(errors='replace')!r}; expected a number")
        width = width or len(fields)
        if fields and len(fields) != width:
            return InputError(f"{place}: {len(fields)} columns; expected {width} as in the lines before")
    return InputError(f"{source.path}: cannot be read as rows of numbers")


def _write_text(path: str | Path, rows: Array, formats: list[str] | tuple[str, ...]) -> None:
    line = " ".join(formats)
    write_bytes(path, ("\n".join(line % tuple(row) for row in rows.tolist()) + "\n").encode())
