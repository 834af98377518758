"""The columns of a Parquet file as arrays of numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import find
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.column_place import Column, place_of
from polyins.formats.rows import RowSource
from polyins.model.recording import USUAL_OF, Array

PIECE_ROWS = max(16_384, USUAL_OF + 1)
"""of a file read in order"""
BUFFER_BYTES = 1 << 16
"""of a column; without it a whole row group would be held"""


class ParquetTable:
    """The columns of a Parquet file, as `TextTable` has them; rows have no lines."""

    def __init__(self, path: str | Path, content: bytes | None) -> None:
        self.path = find(path)
        self._content = content
        self.names = parquet_names(path, content)
        self.source = RowSource(str(self.path))

    def numbers(self, wanted: Sequence[Column], *, text_is_nan: bool = False) -> list[Array]:
        """Return columns, each of shape (T,); raises InputError for one that is missing or is text."""
        return _parquet_columns(self.path, wanted, self._content)

    def parse_numbers(self) -> None:
        """Do nothing: columns of Parquet are read one by one."""

    def texts(self, column: Column) -> NDArray[np.str_]:
        """Return a column as text, shape (T,)."""
        from pyarrow import BufferReader, parquet

        (name,) = _names_of(self.path, [column], self._content)
        table = parquet.read_table(self.path if self._content is None else BufferReader(self._content), columns=[name])
        return np.array([str(value) for value in table[name].to_pylist()], dtype=str)


def _names_of(path: str | Path, wanted: Sequence[Column], content: bytes | None = None) -> list[str]:
    """Return the names of the wanted columns of a Parquet file; raise InputError for one that is missing."""
    names = parquet_names(path, content)
    return [names[place_of(Path(path), names, column)] for column in wanted]


def parquet_names(path: str | Path, content: bytes | None = None) -> tuple[str, ...]:
    """Return the names of all columns; raise InputError for a damaged file."""
    from pyarrow import ArrowException, BufferReader, parquet

    try:
        return tuple(parquet.read_schema(find(path) if content is None else BufferReader(content)).names)
    except (ArrowException, OSError) as error:
        raise InputError(f"{find(path)}: is not a whole Parquet file ({str(error).splitlines()[0]})") from error


def parquet_pieces(path: str | Path, wanted: Sequence[Column]) -> Iterator[tuple[RowSource, list[Array]]]:
    """Give the wanted columns piece by piece; raise InputError for a damaged file."""
    from pyarrow import ArrowException, chunked_array, float64, parquet

    found, names = find(path), _names_of(path, wanted)
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

    chosen = _names_of(find(path), wanted, content)
    try:
        source = find(path) if content is None else BufferReader(content)
        table = parquet.ParquetFile(source, pre_buffer=False).read(chosen, use_threads=False)
        return [to_numpy(table[name].cast(float64(), safe=False)) for name in chosen]
    except (ArrowException, OSError) as error:
        raise InputError(f"{find(path)}: cannot be read as numbers ({str(error).splitlines()[0]})") from error
