"""What digitizing does to increments: samples are taken a little early or late, and rounded to whole steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def jittered(increments: Array, jitter: Array, interval: float) -> Array:
    """Return the increments, shape (T, 3), over intervals that are shifted by `jitter`, s, shape (T,), but as long.

    A chip that puts out rates is read at a wrong instant: what one sample misses no other makes up for. Rates are
    constant over each interval, and for one more before and after; no shift may be longer than an interval.
    """
    extended = np.vstack([increments[:1], increments, increments[-1:]])
    total = np.vstack([np.zeros(3), np.cumsum(extended, axis=0)])
    edges = interval * np.arange(-1.0, len(increments) + 2.0)
    begin = edges[1:-2] + jitter
    first, last = (
        np.column_stack([np.interp(time, edges, column) for column in total.T]) for time in (begin, begin + interval)
    )
    return np.asarray(last - first)


def rounded(increments: Array, lsb: float, interval: float) -> Array:
    """Return the increments, shape (T, 3), of a sensor whose rates, or forces, are multiples of `lsb`; 0: of any."""
    if lsb == 0.0:
        return increments
    return np.asarray(np.rint(increments / (lsb * interval)) * (lsb * interval))
