"""Where a column of a table stands, by its name or its number."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path

from polyins.errors import InputError

Column = str | int
"""A column's name, or its number counted from 1."""


def place_of(path: Path, names: Sequence[str], column: Column) -> int:
    """Return where a column stands, from 0; raise InputError for one that is missing."""
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
