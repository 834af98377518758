"""The columns of a text table as arrays of numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import find, opened
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.column_place import Column, place_of
from polyins.formats.layout import (
    HEAD_BYTES,
    Dialect,
    cut_end,
    is_message,
    is_number,
    layout,
    offset_of_line,
    split,
)
from polyins.formats.rows import RowSource
from polyins.model.recording import USUAL_OF, Array

Text = bytes | memoryview
"""the rows of a text; a view where nothing has to change, for a copy of a large file takes as long as a check of it"""
PIECE_BYTES = 1 << 21
"""of a text read in order"""


class TextTable:
    """The columns of a text table; a column is parsed once."""

    def __init__(self, path: str | Path, content: bytes, header_has: str = "") -> None:
        self.path = find(path)
        self._dialect = layout(path, content, header_has)
        self.names = self._dialect.names
        self.source, self._content = whole_rows(self.path, content, self._dialect)
        self._parsed: dict[int, Array] = {}

    def numbers(self, wanted: Sequence[Column], *, text_is_nan: bool = False) -> list[Array]:
        """Return columns, each of shape (T,); what is missing in a cell is NaN.

        `text_is_nan`: cells that are not numbers are NaN as well, instead of an error. Raises InputError that names
        the missing column or the bad line.
        """
        places = [place_of(self.path, self.names, column) for column in wanted]
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

        place = place_of(self.path, self.names, column)
        self.source, self._content, (cells,) = _parse(self.source, self._content, self._dialect, [place], string())
        return np.array([text.strip() for text in cells.to_pylist()], dtype=str)


def text_pieces(path: str | Path, wanted: Sequence[Column]) -> Iterator[tuple[RowSource, list[Array]]]:
    """Give the wanted columns piece by piece; the first has more rows than `usual_interval` looks at."""
    found, table, places, line = find(path), None, [], 0
    for content in _whole_lines(found):
        if table is None:
            table = layout(path, content)
            places = [place_of(found, table.names, column) for column in wanted]
            line, first = table.first_line, table
        else:
            first = replace(table, first_line=1)
        source, whole = whole_rows(found, content, first, ahead=line - first.first_line)
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


def whole_rows(path: Path, content: bytes, table: Dialect, ahead: int = 0) -> tuple[RowSource, Text]:
    """Return the lines from the first row on as the parser takes them, and where they are from.

    Lines that are cut off are left out with a warning, empty ones without. `ahead`: lines before the content.
    """
    begin = offset_of_line(content, table.first_line - 1)
    cut = list(table.cut)
    end = cut_end(content, table, begin)
    if end < len(content):
        cut.append(ahead + content.count(b"\n", 0, end) + 1)
    named = " and ".join(str(line) for line in cut)
    lines = f"line {named} is" if len(cut) == 1 else f"lines {named} are"
    plain = content.isascii() and not table.decimal_comma and table.delimiter != " "
    warnings = (f"{path}: {lines} cut off, and left out",) if cut else ()
    source = RowSource(str(path), ahead + table.first_line, warnings=warnings)
    if plain and b"\n\n" not in content and b"\n\r\n" not in content:
        return source, memoryview(content)[begin:end]
    text = content[begin:end] if plain else _tidy(content[begin:end], table)
    rows = text.splitlines(keepends=True) if b"\n\n" in text or b"\n\r\n" in text else []
    kept = [n for n, row in enumerate(rows) if row.strip()]
    if len(kept) == len(rows):
        return source, text
    return source.at(np.array(kept)), b"".join(rows[n] for n in kept)


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


def _text_columns(
    source: RowSource, content: Text, table: Dialect, places: list[int], text_is_nan: bool
) -> tuple[RowSource, Text, list[Array]]:
    """Return columns of a text that begins with the first row of `source`, and the text without lines that are none."""
    from pyarrow import ArrowInvalid, binary, float64

    try:
        try:
            source, content, columns = _parse(source, content, table, places, float64(), empty=("",))
        except ArrowInvalid:
            source, content, columns = _parse(source, content, table, places, float64())
    except ArrowInvalid:
        source, content = _without_words(source, content, table)
        source, content, cells = _parse(source, content, table, places, binary())
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
    return _only(source, lines, np.array(kept))


def _only(source: RowSource, lines: Sequence[bytes], kept: NDArray[np.intp]) -> tuple[RowSource, Text]:
    """Return those of the lines, each with its number in the source, that are rows."""
    source = source.at(kept).warned(f"{len(lines) - len(kept)} line(s) between the rows are none of them")
    return source, b"".join(lines[n] for n in kept)


def _parse(
    source: RowSource, content: Text, table: Dialect, places: list[int], kind: Any, empty: Sequence[str] | None = None
) -> tuple[RowSource, Text, list[Any]]:
    """Parse the columns with Arrow; names are replaced by numbers, since a file may repeat or omit them.

    `empty`: what a cell without a value may look like, the fewer the faster; unless given NA, NULL and their like, too.

    Messages between the rows are left out, of the source and the content that are returned as well. Raises InputError
    for a row with another number of columns.
    """
    from pyarrow import ArrowInvalid

    def other(row: Any) -> str:
        if is_message(split(row.text, table.delimiter)):
            messages.append(row.number)
            return "skip"
        line = None if row.number is None else source.line(row.number - 1)
        bad.append(f"{source.path}, line {line}: {row.actual_columns} columns; expected {row.expected_columns}")
        return "error"

    bad: list[str] = []
    messages: list[int] = []
    try:
        columns = csv_columns(content, table, places, kind, other, empty)
    except ArrowInvalid as error:
        if bad:
            raise InputError(bad[0]) from error
        raise
    if messages:
        lines = bytes(content).splitlines(keepends=True)
        source, content = _only(source, lines, np.delete(np.arange(len(lines)), np.array(messages) - 1))
    return source, content, columns


def csv_columns(
    content: Text, table: Dialect, places: Sequence[int], kind: Any, bad_row: Any, empty: Sequence[str] | None
) -> list[Any]:
    """Parse columns, by their places from 0, since a file may repeat or omit names; all are read as `kind` of Arrow.

    `bad_row`: is asked of a row with another number of columns; `empty`: what a cell without a value may look like.
    """
    from pyarrow import BufferReader, csv

    wanted = [str(number) for number in places]
    parsed = csv.read_csv(
        BufferReader(content),
        csv.ReadOptions(column_names=[str(number) for number in range(table.width)], use_threads=False),
        csv.ParseOptions(delimiter=table.delimiter, invalid_row_handler=bad_row),
        csv.ConvertOptions(
            include_columns=sorted(set(wanted)),
            column_types=dict.fromkeys(wanted, kind),
            null_values=empty,
            strings_can_be_null=False,
        ),
    )
    return [parsed[name] for name in wanted]


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
