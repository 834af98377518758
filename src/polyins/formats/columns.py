"""Named columns of a table, CSV or Parquet, as arrays of numbers."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.files import find, opened, read_bytes, read_head
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.rows import RowSource
from polyins.model.recording import USUAL_OF, Array

Column = str | int
"""A column's name, or its number counted from 1."""

PARQUET_MAGIC = b"PAR1"
HEAD_BYTES = 16384
PIECE_ROWS = max(16_384, USUAL_OF + 1)
"""of a Parquet file read in order"""
PIECE_BYTES = 1 << 21
"""of a text read in order"""
BUFFER_BYTES = 1 << 16
"""of a column; without it a whole row group would be held"""


@dataclass(frozen=True)
class Dialect:
    """How a text table is built."""

    delimiter: str
    names: tuple[str, ...]
    first_line: int
    """line of the first row, counted from 1"""


def is_parquet(path: str | Path) -> bool:
    """Whether a file, packed or not, is Parquet by its first bytes."""
    return read_head(path, len(PARQUET_MAGIC)) == PARQUET_MAGIC


def column_names(path: str | Path) -> tuple[str, ...]:
    """Return the names of all columns; those of a file without a header are empty."""
    head = read_head(path, HEAD_BYTES)
    if head[:4] != PARQUET_MAGIC:
        return layout(path, head).names
    return _parquet_names(path, read_bytes(path) if find(path).suffix == ".gz" else None)


def read_columns(
    path: str | Path, wanted: Sequence[Column], *, header_has: str = "", text_is_nan: bool = False
) -> tuple[RowSource, list[Array]]:
    """Read the wanted columns, each of shape (T,); what is missing in a cell is NaN.

    `header_has`: a name by which the header line is known where other lines come before it. `text_is_nan`: cells that
    are not numbers are NaN instead of an error. Raises InputError that names the missing column or the bad line.
    """
    if find(path).suffix != ".gz" and read_head(path, 4) == PARQUET_MAGIC:
        return RowSource(str(find(path))), _parquet_columns(path, wanted)
    content = read_bytes(path)
    if content[:4] == PARQUET_MAGIC:
        return RowSource(str(find(path))), _parquet_columns(path, wanted, content)
    table = layout(path, content, header_has)
    places = [_place(find(path), table.names, column) for column in wanted]
    values = _text_columns(find(path), _tidy(content, table), table, places, text_is_nan, table.first_line - 1)
    return RowSource(str(find(path)), table.first_line), values


def read_in_order(path: str | Path, wanted: Sequence[Column]) -> Iterator[tuple[RowSource, list[Array]]]:
    """Read the wanted columns piece by piece, as `read_columns` reads them at once; a packed Parquet file cannot be.

    The first piece has more rows than `usual_interval` looks at.
    """
    if is_parquet(path):
        yield from _parquet_pieces(path, wanted)
        return
    found, table, places, line = find(path), None, [], 0
    for content in _whole_lines(found):
        if table is None:
            table = layout(path, content)
            places = [_place(found, table.names, column) for column in wanted]
            lines = content.split(b"\n", table.first_line - 1)
            content, line = lines[-1], table.first_line
        piece = replace(table, first_line=line)
        yield RowSource(str(found), line), _text_columns(found, _tidy(content, piece), piece, places, False, skipped=0)
        line += content.count(b"\n")


def _whole_lines(path: Path) -> Iterator[bytes]:
    """Give pieces of a text file that end where a line does, the first with the lines of `usual_interval`."""
    with opened(path) as file:
        rest, least = b"", 2 * USUAL_OF
        while more := file.read(PIECE_BYTES):
            rest += more
            if rest.count(b"\n") > least:
                whole, _, rest = rest.rpartition(b"\n")
                least = 0
                yield whole + b"\n"
        if rest.strip():
            yield rest


def _tidy(content: bytes, table: Dialect) -> bytes:
    """Return the content as the parser takes it: one blank between columns, and UTF-8."""
    if not content.isascii():
        content = content.decode(errors="replace").encode()
    if table.delimiter == " ":
        content = re.sub(rb"(?m)^[ \t]+|[ \t]+$", b"", content)
        content = re.sub(rb"[ \t]+", b" ", content)
    return content


def layout(path: str | Path, content: bytes, header_has: str = "") -> Dialect:
    """Find delimiter, header and first row of a text table."""
    lines = content[:HEAD_BYTES].decode("utf-8-sig", errors="replace").splitlines()
    start = next((n for n, line in enumerate(lines) if header_has in line and not _is_preamble(line)), None)
    if start is None:
        raise InputError(f"{find(path)}: no line of column names with {header_has}; expected such a header")
    first = lines[start]
    delimiter = next((mark for mark in (",", ";", "\t") if mark in first), " ")
    fields = _split(first, delimiter)
    if any(_is_number(text) for text in fields):
        commented = _split(lines[start - 1].lstrip("#% "), delimiter) if start else []
        names = commented if len(commented) == len(fields) else [""] * len(fields)
        return Dialect(delimiter, tuple(names), start + 1)
    if start + 1 >= len(lines):
        raise InputError(f"{find(path)}: has a header and no rows; expected data")
    extra = len(_split(lines[start + 1], delimiter)) - len(fields)
    return Dialect(delimiter, tuple(fields + [""] * max(extra, 0)), start + 2)


def _is_preamble(line: str) -> bool:
    return not line.strip() or line.startswith(("#", "%", "sep="))


def _split(line: str, delimiter: str) -> list[str]:
    return [text.strip().strip('"') for text in (line.split(delimiter) if delimiter != " " else line.split())]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _place(path: Path, names: Sequence[str], column: Column) -> int:
    """Return where a column stands, from 0."""
    if isinstance(column, int):
        if not 1 <= column <= len(names):
            raise InputError(f"{path}: no column {column}; expected a number from 1 to {len(names)}")
        return column - 1
    if column not in names:
        present = [name for name in names if name]
        similar = difflib.get_close_matches(column, present, n=1, cutoff=0.4)
        hint = f"did you mean {similar[0]!r}?" if similar else f"expected one of {', '.join(present) or '1, 2, ...'}"
        raise InputError(f"{path}: no column {column!r}; {hint}")
    return names.index(column)


def _text_columns(
    path: Path, content: bytes, table: Dialect, places: list[int], text_is_nan: bool, skipped: int
) -> list[Array]:
    """Return columns of a text; `skipped`: its lines before the first row."""
    from pyarrow import ArrowInvalid, float64

    try:
        columns = _parse(path, content, table, places, float64(), skipped)
    except ArrowInvalid:
        from pyarrow import binary

        cells = _parse(path, content, table, places, binary(), skipped)
        return [_numbers(path, table, place, column, text_is_nan) for place, column in zip(places, cells, strict=True)]
    return [to_numpy(column) for column in columns]


def _parse(path: Path, content: bytes, table: Dialect, places: list[int], kind: Any, skipped: int) -> list[Any]:
    """Parse the columns with Arrow; names are replaced by numbers, since a file may repeat or omit them."""
    from pyarrow import ArrowInvalid, BufferReader, csv

    def refuse(row: Any) -> str:
        line = None if row.number is None else row.number + table.first_line - 1 - skipped
        bad.append(f"{path}, line {line}: {row.actual_columns} columns; expected {row.expected_columns}")
        return "error"

    bad: list[str] = []
    names = [str(number) for number in range(len(table.names))]
    wanted = [str(place) for place in places]
    try:
        parsed = csv.read_csv(
            BufferReader(content),
            csv.ReadOptions(column_names=names, skip_rows=skipped, use_threads=False),
            csv.ParseOptions(delimiter=table.delimiter, invalid_row_handler=refuse),
            csv.ConvertOptions(
                include_columns=sorted(set(wanted)),
                column_types=dict.fromkeys(wanted, kind),
                strings_can_be_null=False,
            ),
        )
    except ArrowInvalid as error:
        if bad:
            raise InputError(bad[0]) from error
        raise
    return [parsed[name] for name in wanted]


def _numbers(path: Path, table: Dialect, place: int, cells: Any, text_is_nan: bool) -> Array:
    """Convert cell by cell, to find the one that is not a number."""
    values = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells.to_pylist()):
        text = cell.decode(errors="replace")
        if _is_number(text):
            values[row] = float(text)
        elif text.strip() and not text_is_nan:
            name = table.names[place] or f"column {place + 1}"
            raise InputError(f"{path}, line {table.first_line + row}: {name} is {text!r}; expected a number")
    return values


def parquet_places(path: str | Path, wanted: Sequence[Column], content: bytes | None = None) -> list[str]:
    """Return the names of the wanted columns of a Parquet file; raise InputError for one that is missing."""
    names = _parquet_names(path, content)
    return [names[_place(Path(path), names, column)] for column in wanted]


def _parquet_names(path: str | Path, content: bytes | None = None) -> tuple[str, ...]:
    from pyarrow import ArrowException, BufferReader, parquet

    try:
        return tuple(parquet.read_schema(find(path) if content is None else BufferReader(content)).names)
    except (ArrowException, OSError) as error:
        raise InputError(f"{find(path)}: is not a whole Parquet file ({str(error).splitlines()[0]})") from error


def _parquet_pieces(path: str | Path, wanted: Sequence[Column]) -> Iterator[tuple[RowSource, list[Array]]]:
    from pyarrow import ArrowException, chunked_array, float64, parquet

    found, names = find(path), parquet_places(path, wanted)
    try:
        file = parquet.ParquetFile(found, buffer_size=BUFFER_BYTES, pre_buffer=False)
        for batch in file.iter_batches(PIECE_ROWS, columns=names, use_threads=False):
            columns = (chunked_array([batch.column(name).cast(float64(), safe=False)]) for name in names)
            yield RowSource(str(found)), [to_numpy(column) for column in columns]
    except (ArrowException, OSError) as error:
        raise InputError(f"{found}: cannot be read ({str(error).splitlines()[0]})") from error


def _parquet_columns(path: str | Path, wanted: Sequence[Column], content: bytes | None = None) -> list[Array]:
    """Read columns from a file, or from its content where that is unpacked."""
    from pyarrow import ArrowException, BufferReader, float64, parquet

    chosen = parquet_places(find(path), wanted, content)
    try:
        source = find(path) if content is None else BufferReader(content)
        table = parquet.ParquetFile(source, pre_buffer=False).read(chosen, use_threads=False)
        return [to_numpy(table[name].cast(float64(), safe=False)) for name in chosen]
    except (ArrowException, OSError) as error:
        raise InputError(f"{find(path)}: cannot be read as numbers ({str(error).splitlines()[0]})") from error
