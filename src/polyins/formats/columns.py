"""Named columns of a table, CSV or Parquet, as arrays of numbers."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import find, opened, read_bytes, read_head
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.layout import HEAD_BYTES, Dialect, cut_end, is_message, is_number, layout, split
from polyins.formats.rows import RowSource
from polyins.model.recording import USUAL_OF, Array

Column = str | int
"""A column's name, or its number counted from 1."""

Text = bytes | memoryview
"""the rows of a text; a view where nothing has to change, for a copy of a large file takes as long as a check of it"""
PARQUET_MAGIC = b"PAR1"
PIECE_ROWS = max(16_384, USUAL_OF + 1)
"""of a Parquet file read in order"""
PIECE_BYTES = 1 << 21
"""of a text read in order"""
BUFFER_BYTES = 1 << 16
"""of a column; without it a whole row group would be held"""


def is_parquet(path: str | Path) -> bool:
    """Whether a file, packed or not, is Parquet by its first bytes."""
    return read_head(path, len(PARQUET_MAGIC)) == PARQUET_MAGIC


def column_names(path: str | Path) -> tuple[str, ...]:
    """Return the names of all columns; those of a file without a header are empty."""
    head = read_head(path, HEAD_BYTES)
    if head[:4] != PARQUET_MAGIC:
        return layout(path, head).names
    return _parquet_names(path, read_bytes(path) if find(path).suffix == ".gz" else None)


class TextTable:
    """The columns of a text table; a column is parsed once."""

    def __init__(self, path: str | Path, content: bytes, header_has: str = "") -> None:
        self.path = find(path)
        self._dialect = layout(path, content, header_has)
        self.names = self._dialect.names
        self._content, warnings = whole_rows(self.path, content, self._dialect)
        self.source = RowSource(str(self.path), self._dialect.first_line, warnings=warnings)
        self._parsed: dict[int, Array] = {}

    def numbers(self, wanted: Sequence[Column], *, text_is_nan: bool = False) -> list[Array]:
        """Return columns, each of shape (T,); what is missing in a cell is NaN.

        `text_is_nan`: cells that are not numbers are NaN as well, instead of an error. Raises InputError that names
        the missing column or the bad line.
        """
        places = [_place(self.path, self.names, column) for column in wanted]
        known = dict(self._parsed)
        missing = sorted({place for place in places if place not in known})
        if missing:
            self.source, self._content, columns = _text_columns(
                self.source, self._content, self._dialect, missing, text_is_nan
            )
            known |= dict(zip(missing, columns, strict=True))
            self._parsed = self._parsed if text_is_nan else known
        return [known[place] for place in places]

    def parse_numbers(self) -> None:
        """Parse all columns that begin with numbers at once, so that each is there when it is asked for."""
        head = bytes(self._content[:HEAD_BYTES]).decode(errors="replace").splitlines()[:-1]
        rows = [fields for line in head if len(fields := split(line, self._dialect.delimiter)) == len(self.names)]
        numeric = [n for n, cells in enumerate(zip(*rows, strict=True), 1) if _are_numbers(cells)]
        with suppress(InputError):  # what is wrong is said of the columns that are used
            self.numbers(numeric)

    def texts(self, column: Column) -> NDArray[np.str_]:
        """Return a column as it stands there, shape (T,)."""
        from pyarrow import string

        place = _place(self.path, self.names, column)
        self.source, (cells,) = _parse(self.source, self._content, self._dialect, [place], string())
        return np.array([text.strip() for text in cells.to_pylist()], dtype=str)


class ParquetTable:
    """The columns of a Parquet file, as `TextTable` has them; rows have no lines."""

    def __init__(self, path: str | Path, content: bytes | None) -> None:
        self.path = find(path)
        self._content = content
        self.names = _parquet_names(path, content)
        self.source = RowSource(str(self.path))

    def numbers(self, wanted: Sequence[Column], *, text_is_nan: bool = False) -> list[Array]:
        """Return columns, each of shape (T,); raises InputError for one that is missing or is text."""
        return _parquet_columns(self.path, wanted, self._content)

    def parse_numbers(self) -> None:
        """Do nothing: columns of Parquet are read one by one."""

    def texts(self, column: Column) -> NDArray[np.str_]:
        """Return a column as text, shape (T,)."""
        from pyarrow import BufferReader, parquet

        (name,) = parquet_places(self.path, [column], self._content)
        table = parquet.read_table(self.path if self._content is None else BufferReader(self._content), columns=[name])
        return np.array([str(value) for value in table[name].to_pylist()], dtype=str)


OpenTable = TextTable | ParquetTable


def open_table(path: str | Path, header_has: str = "") -> OpenTable:
    """Read a table whose columns are asked for afterwards.

    `header_has`: a name by which the header line is known where other lines come before it. Raises InputError for a
    file without rows.
    """
    if find(path).suffix != ".gz" and is_parquet(path):
        return ParquetTable(path, None)
    content = read_bytes(path)
    if content[:4] == PARQUET_MAGIC:
        return ParquetTable(path, content)
    return TextTable(path, content, header_has)


def read_columns(
    path: str | Path, wanted: Sequence[Column], *, header_has: str = "", text_is_nan: bool = False
) -> tuple[RowSource, list[Array]]:
    """Read the wanted columns of a table, as `open_table` and `numbers` do."""
    table = open_table(path, header_has)
    values = table.numbers(wanted, text_is_nan=text_is_nan)
    return table.source, values


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
            line, first = table.first_line, table
        else:
            first = replace(table, first_line=1)
        whole, warnings = whole_rows(found, content, first, ahead=line - first.first_line)
        source = RowSource(str(found), line, warnings=warnings)
        source, _, values = _text_columns(source, whole, table, places, False)
        yield source, values
        line += content.count(b"\n") - (first.first_line - 1)


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


def whole_rows(path: Path, content: bytes, table: Dialect, ahead: int = 0) -> tuple[Text, tuple[str, ...]]:
    """Return the lines from the first row on as the parser takes them, and warnings of lines that are cut off.

    `ahead`: lines of the file before the content.
    """
    begin = 0
    for _ in range(table.first_line - 1):
        begin = content.index(b"\n", begin) + 1
    cut = list(table.cut)
    end = cut_end(content, table, begin)
    if end < len(content):
        cut.append(ahead + content.count(b"\n", 0, end) + 1)
    named = " and ".join(str(line) for line in cut)
    lines = f"line {named} is" if len(cut) == 1 else f"lines {named} are"
    plain = content.isascii() and not table.decimal_comma and table.delimiter != " "
    text = memoryview(content)[begin:end] if plain else _tidy(content[begin:end], table)
    return text, (f"{path}: {lines} cut off, and left out",) if cut else ()


def _tidy(content: bytes, table: Dialect) -> bytes:
    """Return the content as the parser takes it: one blank between columns, points in numbers, and UTF-8."""
    if not content.isascii():
        content = content.decode(errors="replace").encode()
    if table.decimal_comma:
        content = content.replace(b",", b".")
    return _one_blank(content) if table.delimiter == " " else content


def _are_numbers(cells: Sequence[str]) -> bool:
    return any(map(is_number, cells)) and all(not text or is_number(text) for text in cells)


def _one_blank(content: bytes) -> bytes:
    """Return a text with one blank between columns, none before the first and behind the last."""
    letters = np.frombuffer(content, np.uint8)
    word = letters > ord(" ")
    kept = word | (letters == ord("\n"))
    kept[:-1] |= ~kept[:-1] & word[1:]
    packed = letters[kept]
    blank = (packed <= ord(" ")) & (packed != ord("\n"))
    packed[blank] = ord(" ")
    leading = blank[1:] & (packed[:-1] == ord("\n"))
    leading = np.concatenate([blank[:1], leading])
    return bytes(packed[~leading] if leading.any() else packed)


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
    source: RowSource, content: Text, table: Dialect, places: list[int], text_is_nan: bool
) -> tuple[RowSource, Text, list[Array]]:
    """Return columns of a text that begins with the first row of `source`, and the text without lines that are none."""
    from pyarrow import ArrowInvalid, binary, float64

    try:
        try:
            source, columns = _parse(source, content, table, places, float64(), empty=("",))
        except ArrowInvalid:
            source, columns = _parse(source, content, table, places, float64())
    except ArrowInvalid:
        source, content = _without_words(source, content, table)
        source, cells = _parse(source, content, table, places, binary())
        return source, content, _numbers(source, table, places, cells, text_is_nan)
    return source, content, [to_numpy(column) for column in columns]


def _without_words(source: RowSource, content: Text, table: Dialect) -> tuple[RowSource, Text]:
    """Leave out the lines that hold no number: messages, and a header that is there again."""
    lines = bytes(content).splitlines(keepends=True)
    cells = [split(line.decode(errors="replace"), table.delimiter) for line in lines]
    kept = [n for n, fields in enumerate(cells) if any(map(is_number, fields)) or not any(fields)]
    kept = [n for n in kept if len(cells[n]) == table.width or not is_message(cells[n])]
    if len(kept) == len(lines) or not kept:
        return source, content
    source = source.at(np.array(kept)).warned(f"{len(lines) - len(kept)} line(s) between the rows are none of them")
    return source, b"".join(lines[n] for n in kept)


def _parse(
    source: RowSource, content: Text, table: Dialect, places: list[int], kind: Any, empty: Sequence[str] | None = None
) -> tuple[RowSource, list[Any]]:
    """Parse the columns with Arrow; names are replaced by numbers, since a file may repeat or omit them.

    `empty`: what a cell without a value may look like, the fewer the faster; unless given NA, NULL and their like, too.

    Messages between the rows are left out. Raises InputError for a row with another number of columns.
    """
    from pyarrow import ArrowInvalid, BufferReader, csv

    def other(row: Any) -> str:
        if is_message(split(row.text, table.delimiter)):
            messages.append(row.number)
            return "skip"
        line = None if row.number is None else source.line(row.number - 1)
        bad.append(f"{source.path}, line {line}: {row.actual_columns} columns; expected {row.expected_columns}")
        return "error"

    bad: list[str] = []
    messages: list[int] = []
    names = [str(number) for number in range(table.width)]
    wanted = [str(place) for place in places]
    try:
        parsed = csv.read_csv(
            BufferReader(content),
            csv.ReadOptions(column_names=names, use_threads=False),
            csv.ParseOptions(delimiter=table.delimiter, invalid_row_handler=other),
            csv.ConvertOptions(
                include_columns=sorted(set(wanted)),
                column_types=dict.fromkeys(wanted, kind),
                null_values=empty,
                strings_can_be_null=False,
            ),
        )
    except ArrowInvalid as error:
        if bad:
            raise InputError(bad[0]) from error
        raise
    if messages and source.lines is None:
        rows = np.delete(np.arange(parsed.num_rows + len(messages)), np.array(messages) - 1)
        source = source.at(rows).warned(f"{len(messages)} line(s) between the rows are none of them")
    return source, [parsed[name] for name in wanted]


def _numbers(source: RowSource, table: Dialect, places: list[int], cells: list[Any], text_is_nan: bool) -> list[Array]:
    """Convert cell by cell, to find the one that is not a number."""
    found = []
    for place, column in zip(places, cells, strict=True):
        values = np.full(len(column), np.nan)
        for row, cell in enumerate(column.to_pylist()):
            text = cell.decode(errors="replace")
            if is_number(text):
                values[row] = float(text)
            elif text.strip() and not text_is_nan:
                name = table.names[place] or f"column {place + 1}"
                raise InputError(f"{source.place(row)}: {name} is {text!r}; expected a number")
        found.append(values)
    return found


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
