"""Fewer points for display, with every peak kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def kept_for_display(columns: Array, limit: int) -> NDArray[np.intp]:
    """Return the indices to draw of curves that share their abscissa, shape (T, k).

    The rows are cut into equal bins; of each the rows with the least and greatest value of each column stay, besides
    both ends and both sides of every gap (NaN). Without gaps that is `limit` + 2 rows at most.
    """
    rows, curves = columns.shape
    if rows <= limit:
        return np.arange(rows)
    bins = max(1, limit // (2 * curves))
    length = -(-rows // bins)
    missing = np.isnan(columns)
    padded = np.pad(np.where(missing, 0.0, columns), ((0, bins * length - rows), (0, 0)), mode="edge")
    binned = padded.reshape(bins, length, curves)
    offset = length * np.arange(bins)[:, None]
    extremes = np.concatenate([offset + binned.argmin(axis=1), offset + binned.argmax(axis=1)], axis=None)
    edges = np.flatnonzero(np.any(missing[1:] != missing[:-1], axis=1))
    return np.unique(np.minimum(np.concatenate([[0, rows - 1], extremes, edges, edges + 1]), rows - 1))


def points_per_trace(traces: int, budget: int = 40_000) -> int:
    """Return how many points each of a figure's traces may have, so that the page stays light."""
    return int(np.clip(budget // max(1, traces), 100, 4000))
