"""The table under the header of a text log."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.layout import Dialect, offset_of_line
from polyins.formats.text_table import csv_columns
from polyins.model.recording import Array

NOTHING = ("", "nan", "NaN", "NAN", "null", "N/A", "-nan", "-nan(ind)")
Bad = tuple[int, str]
"""a row, counted from 0, and why it cannot be read"""


@dataclass(frozen=True)
class TextRows:
    """Columns of numbers by name; what is missing is NaN."""

    columns: dict[str, Array]
    """each of shape (T,)"""
    first_line: int
    """line of the first row, counted from 1"""
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def has(self, *names: str) -> bool:
        """Whether there are all of these, each with a number in some row."""
        return all(name in self.columns and bool(np.isfinite(self.columns[name]).any()) for name in names)

    def of(self, *names: str) -> Array:
        """Return columns beside each other, shape (T, count); raises KeyError for one that is missing."""
        return np.column_stack([self.columns[name] for name in names])

    def whole(self, *names: str) -> TextRows:
        """Return the rows with a number in each of these."""
        kept = np.all([np.isfinite(self.columns[name]) for name in names], axis=0)
        if kept.all():
            return self
        return TextRows({name: values[kept] for name, values in self.columns.items()}, self.first_line, self.warnings)


def lines_before(content: bytes, line: int) -> list[str]:
    """Return the first lines, with that of the number given, counted from 0, as the last."""
    return content[: offset_of_line(content, line + 1)].decode("utf-8-sig", errors="replace").splitlines()


def header_line(content: bytes, pattern: str) -> int | None:
    """Return the line, counted from 0, of the first 200 that a regular expression is found in."""
    lines = content[: 1 << 16].decode("utf-8-sig", errors="replace").splitlines()[:200]
    return next((number for number, line in enumerate(lines) if re.search(pattern, line)), None)


def read_rows(
    place: str, content: bytes, header: int, delimiter: str, *, wanted: str = ".*", unit_lines: int = 0
) -> TextRows:
    """Read the rows under the header in line `header` (counted from 0), of the columns that fit `wanted`.

    A last line that is cut off is left out, with a warning. `unit_lines`: of units between header and rows. Raises
    InputError that names the line of a cell that is no number, or of a row with other columns than the header's.
    """
    begin = offset_of_line(content, header)
    end = content.find(b"\n", begin)
    line = content[begin : end if end >= 0 else len(content)].decode("utf-8-sig", errors="replace")
    names = [name.strip().strip('"').strip() for name in line.split(delimiter)]
    places = {name: names.index(name) for name in names if name and re.fullmatch(wanted, name)}
    first = header + 1 + unit_lines
    rows = content[offset_of_line(content, first) : _end(content)]
    if not rows:
        return TextRows({name: np.zeros(0) for name in places}, first + 1)
    end = rows.find(b"\n")
    fields = rows[: end if end >= 0 else len(rows)].rstrip(b"\r").split(delimiter.encode())
    ends_empty = (
        len(fields) == len(names) + 1 and not fields[-1].strip()
    )  # rows end in a delimiter, the header does not
    columns, bad = _columns(rows, delimiter, len(names) + ends_empty, places)
    last = rows.count(b"\n") if bad else 0
    for row, why in bad:
        if row != last:
            raise InputError(f"{place}, line {first + row + 1}: {why}")
    cut = (f"{place}, line {first + last + 1}: is cut off ({bad[0][1]}); it is left out",) if bad else ()
    return TextRows(columns, first + 1, cut)


def _columns(rows: bytes, delimiter: str, count: int, places: dict[str, int]) -> tuple[dict[str, Array], list[Bad]]:
    """Return the columns by name, and the rows that cannot be read, counted from 0; the last of them is left out."""
    from pyarrow import ArrowInvalid, float64, string

    try:
        cells, bad = _parsed(rows, delimiter, count, list(places.values()), float64())
        return {name: to_numpy(column) for name, column in zip(places, cells, strict=True)}, bad
    except ArrowInvalid:
        cells, bad = _parsed(rows, delimiter, count, list(places.values()), string())
    columns = {}
    for name, column in zip(places, cells, strict=True):
        columns[name], wrong = _numbers(column, name)
        bad += wrong
    if any(row == len(cells[0]) - 1 for row, _ in bad):
        columns = {name: values[:-1] for name, values in columns.items()}
    return columns, bad


def _parsed(rows: bytes, delimiter: str, count: int, places: Sequence[int], kind: Any) -> tuple[list[Any], list[Bad]]:
    """Return columns by their numbers, since a file may repeat names, and the rows with other columns, from 0."""
    bad: list[Bad] = []

    def skip(row: Any) -> str:
        bad.append((row.number - 1, f"{row.actual_columns} columns; expected {row.expected_columns}"))
        return "skip"

    text = rows if rows.isascii() else rows.decode(errors="replace").encode()
    return csv_columns(text, Dialect(delimiter, ("",) * count, 1), places, kind, skip, NOTHING), bad


def _numbers(cells: Any, name: str) -> tuple[Array, list[Bad]]:
    """Convert cell by cell, to find those that are no numbers."""
    values, bad = np.full(len(cells), np.nan), []
    for row, text in enumerate(cells.to_pylist()):
        try:
            values[row] = np.nan if text in NOTHING else float(text)
        except ValueError:
            bad.append((row, f"{name} is {text!r}; expected a number"))
    return values, bad


def _end(content: bytes) -> int:
    """Return where the last line ends, without blank lines after it; nothing large is copied."""
    end = len(content)
    while end and content[end - 1 : end].isspace():
        end -= 1
    return end
