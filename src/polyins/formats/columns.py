"""Named columns of a table, text or Parquet, as arrays of numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from polyins.files import find, read_bytes, read_head
from polyins.formats.column_place import Column
from polyins.formats.layout import HEAD_BYTES, layout
from polyins.formats.parquet_table import ParquetTable, parquet_names, parquet_pieces
from polyins.formats.rows import RowSource
from polyins.formats.text_table import TextTable, text_pieces
from polyins.model.recording import Array

PARQUET_MAGIC = b"PAR1"


def is_parquet(path: str | Path) -> bool:
    """Whether a file, packed or not, is Parquet by its first bytes."""
    return read_head(path, len(PARQUET_MAGIC)) == PARQUET_MAGIC


def column_names(path: str | Path) -> tuple[str, ...]:
    """Return the names of all columns; those of a file without a header are empty."""
    head = read_head(path, HEAD_BYTES)
    if head[:4] != PARQUET_MAGIC:
        return layout(path, head).names
    return parquet_names(path, read_bytes(path) if find(path).suffix == ".gz" else None)


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
        yield from parquet_pieces(path, wanted)
    else:
        yield from text_pieces(path, wanted)
