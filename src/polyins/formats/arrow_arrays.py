"""Numbers between NumPy and Arrow, copied at most once.

Arrow's own conversions import pandas where it is installed, which takes longer than reading most files.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import Array

if TYPE_CHECKING:
    import pyarrow as pa


def to_arrow(values: NDArray[Any]) -> pa.Array:
    """Return an Arrow array of float64 or int32 values, shape (T,)."""
    import pyarrow as pa

    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def texts_to_arrow(texts: Sequence[str]) -> pa.Array:
    """Return an Arrow array of texts."""
    import pyarrow as pa

    encoded = [text.encode() for text in texts]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded)))


def to_numpy(column: pa.ChunkedArray) -> Array:
    """Return the numbers of a column, shape (T,); NaN where it has none."""
    import pyarrow as pa

    if column.null_count or not pa.types.is_floating(column.type):
        return np.array(column.to_numpy(), dtype=float)
    parts = [np.from_dlpack(chunk) for chunk in column.chunks]
    return np.concatenate([np.zeros(0), *parts])
