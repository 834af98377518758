"""How a text table is built: what stands between its columns, where its rows begin, what its header says.

The rows tell: lines of many numbers, most of them of one width. What stands before them is a header or no part of the
table, whatever it looks like.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from polyins.errors import InputError
from polyins.files import find

HEAD_BYTES = 16384
LOOKED_AT = 300
"""lines that tell how the rows are built"""
ENOUGH = 10
"""rows, so that a line that is cut is one of many"""
DELIMITERS = (",", ";", "\t", " ")
WITH_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
LIKE_DATE = re.compile(r"\d[\d:/.\-+ T]*[:/\-][\d:/.\-+ T]*\d(Z| ?UTC)?")
WITH_POINT = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")
UNIT = re.compile(
    r"[\[(]?(-|s|sec|[mun]s|hz|g|deg|rad|m|(deg|rad|m)(/|_?per_?)s(\^?2|ec)?|m/s/s|m s-2|dps)?[\])]?", re.I
)
"""what a line of units below the names holds"""


@dataclass(frozen=True)
class Dialect:
    """How a text table is built."""

    delimiter: str
    names: tuple[str, ...]
    first_line: int
    """line of the first row, counted from 1"""
    decimal_comma: bool = False
    cut: tuple[int, ...] = ()
    """lines before the rows that look like the rest of one"""

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.names)


def layout(path: str | Path, content: bytes, header_has: str = "") -> Dialect:
    """Find delimiter, header and first row of a text table.

    `header_has`: a name by which the header is known, whatever stands before it. Raises InputError for a text without
    rows or without that header.
    """
    text = content[:HEAD_BYTES].decode("utf-8-sig", errors="replace")
    if len(content) > HEAD_BYTES:
        text = text.rpartition("\n")[0] or text
    lines = text.splitlines()
    if header_has:
        return _below_header(path, lines, header_has)
    found = _rows(lines)
    if found is None:
        what = "has a header and" if any(not is_preamble(line) for line in lines) else "has"
        raise InputError(f"{find(path)}: {what} no rows; expected data")
    delimiter, width, first, comma = found
    names, above = _header(lines, first, delimiter, width)
    cut = () if above is not None else _rest_of_a_row(lines, first, delimiter, width)
    return Dialect(delimiter, names, first + 1, comma, cut)


def sample(content: bytes) -> tuple[Dialect, list[list[str]]] | None:
    """Return how the first bytes of a text are built, and the cells of its first rows; None if it has no rows."""
    lines = content[:HEAD_BYTES].decode("utf-8-sig", errors="replace").splitlines()
    found = _rows(lines)
    if found is None:
        return None
    delimiter, width, first, comma = found
    names, _ = _header(lines, first, delimiter, width)
    cells = [fields for line in lines[first:] if len(fields := split(line, delimiter)) == width and is_row(fields)]
    return Dialect(delimiter, names, first + 1, comma), cells


def _below_header(path: str | Path, lines: list[str], header_has: str) -> Dialect:
    start = next((n for n, line in enumerate(lines) if header_has in line and not is_preamble(line)), None)
    if start is None:
        raise InputError(f"{find(path)}: no line of column names with {header_has}; expected such a header")
    delimiter = next((mark for mark in DELIMITERS if mark in lines[start]), " ")
    fields = split(lines[start], delimiter)
    if start + 1 >= len(lines):
        raise InputError(f"{find(path)}: has a header and no rows; expected data")
    extra = len(split(lines[start + 1], delimiter)) - len(fields)
    return Dialect(delimiter, tuple(fields + [""] * max(extra, 0)), start + 2)


def is_preamble(line: str) -> bool:
    """Whether a line is none of the table: empty, a remark, or what a spreadsheet is told."""
    return not line.strip() or line.startswith(("#", "%", "//", "sep="))


def split(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line."""
    return [text.strip().strip('"') for text in (line.split(delimiter) if delimiter != " " else line.split())]


def is_number(text: str) -> bool:
    """Whether a cell is a number, written with a point."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def is_row(fields: Sequence[str]) -> bool:
    """Whether cells are those of a row: numbers, nothing, or few words that tell rows apart."""
    numbers = sum(map(_numeric, fields))
    words = sum(1 for text in fields if text and not _numeric(text))
    return numbers > 0 and (words == 0 or numbers >= 2 * words or (numbers >= words and len(fields) > 2))


def _numeric(text: str) -> bool:
    return is_number(text) or WITH_COMMA.fullmatch(text) is not None or LIKE_DATE.fullmatch(text) is not None


def _rows(lines: list[str]) -> tuple[str, int, int, bool] | None:
    """Return delimiter, number of columns, first row (from 0) and whether commas are decimal; None without rows."""
    best: tuple[tuple[int, bool, int], str, int, list[int]] | None = None
    for delimiter in DELIMITERS:
        rows: dict[int, list[int]] = {}
        numbers: Counter[int] = Counter()
        for number, line in enumerate(lines[-LOOKED_AT:], max(len(lines) - LOOKED_AT, 0)):
            fields = [] if is_preamble(line) else split(line, delimiter)
            if fields and is_row(fields):
                rows.setdefault(len(fields), []).append(number)
                numbers[len(fields)] += sum(1 if _numeric(text) else -1 for text in fields if text)
        for width, count in numbers.most_common(1):
            worth = count, width > 1, -width  # of as many numbers the fewer empty cells
            if best is None or worth > best[0]:
                best = worth, delimiter, width, rows[width]
    if best is None:
        return None
    _, delimiter, width, found = best
    cells = [text for number in found[:ENOUGH] for text in split(lines[number], delimiter)]
    comma = any(WITH_COMMA.fullmatch(text) for text in cells) and not any(WITH_POINT.fullmatch(text) for text in cells)
    return delimiter, width, _first(lines, found[0], delimiter, width), delimiter != "," and comma


def _first(lines: list[str], row: int, delimiter: str, width: int) -> int:
    """Return the first of the rows; `row`: one of them, maybe far below it."""
    found = row
    for number in range(row, -1, -1):
        fields = [] if is_preamble(lines[number]) else split(lines[number], delimiter)
        if len(fields) == width and is_row(fields):
            found = number
    return found


def _header(lines: list[str], first: int, delimiter: str, width: int) -> tuple[tuple[str, ...], int | None]:
    """Return the names of the columns, and the line (from 0) that has them, if one has."""
    above = [n for n in range(first - 1, -1, -1) if lines[n].strip()][:2]
    names = [_names(lines[n], delimiter, width) for n in above]
    if not names or names[0] is None:
        return ("",) * width, None
    if len(names) == 2 and names[1] is not None and all(map(UNIT.fullmatch, names[0])):
        units = (unit.strip("[()]-") for unit in names[0])
        return tuple(f"{name} [{unit}]" if unit else name for name, unit in zip(names[1], units, strict=True)), above[1]
    return names[0], above[0]


def _names(line: str, delimiter: str, width: int) -> tuple[str, ...] | None:
    """Return the names of so many columns that stand in a line, or None."""
    bare = line.lstrip("#%/ \t") if is_preamble(line) else line
    for mark in dict.fromkeys((delimiter, *DELIMITERS)):
        fields = split(bare, mark)
        if (len(fields) == width or len(fields) == width - 1 > 1) and not any(map(is_number, fields)):
            return tuple(fields + [""] * (width - len(fields)))
    return None


def _rest_of_a_row(lines: list[str], first: int, delimiter: str, width: int) -> tuple[int, ...]:
    """Return the line (from 1) before the first row if it is the end of one that was cut."""
    if first != 1 or is_preamble(lines[0]):
        return ()
    fields = split(lines[0], delimiter)
    return (1,) if 0 < len(fields) < width and all(map(_numeric, fields[1:] or fields)) else ()


def cut_end(content: bytes, table: Dialect, first: int) -> int:
    """Return how many bytes of a table are whole lines, where the last one was cut off by a loss of power.

    `first`: where the rows begin. A line is cut if it has fewer columns than the many before it, or if it lacks the
    end of a line and has fewer digits than they all.
    """
    tail = content[-HEAD_BYTES:]
    end = len(content) - len(tail) + len(tail.rstrip())
    begin = content.rfind(b"\n", 0, end) + 1
    if begin <= first:
        return len(content)
    before = content[max(first, begin - HEAD_BYTES) : begin].decode(errors="replace").splitlines()
    rows = [fields for line in before if len(fields := split(line, table.delimiter)) == table.width]
    if len(rows) < ENOUGH:
        return len(content)
    last = split(content[begin:end].decode(errors="replace"), table.delimiter)
    ended = end < len(content)
    if len(last) < table.width:
        return begin if not ended or (is_row(last) and not is_message(last)) else len(content)
    digits = {len(fields[-1].partition(".")[2]) for fields in rows}
    short = len(digits) == 1 and len(last[-1].partition(".")[2]) < min(digits)
    return begin if not ended and len(last) == table.width and short else len(content)


def is_message(fields: Sequence[str]) -> bool:
    """Whether the cells of a line between the rows are no part of one: it begins with a word."""
    return not _numeric(fields[0])


def offset_of_line(content: bytes, line: int) -> int:
    """Return where a line begins, counted from 0."""
    at = 0
    for _ in range(line):
        at = content.find(b"\n", at) + 1
        if at == 0:
            return len(content)
    return at
