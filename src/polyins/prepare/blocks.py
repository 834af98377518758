"""Mean rates and forces over short blocks of time, in which IMUs can be compared."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]

BLOCK = 0.04
"""s"""


@dataclass(frozen=True)
class Blocks:
    """K blocks of N IMUs."""

    time: Array
    """s (K,): where each ends"""
    rates: Array
    """rad/s and m/s^2, shape (K, 6, N)"""
    whole: NDArray[np.bool_]
    """(K, N): the IMU has all its data"""
    middle: Array
    """median of the rates of all IMUs, shape (K, 6)"""

    @classmethod
    def of(cls, aligned: Aligned) -> Blocks:
        """Average the increments of IMUs."""
        length = max(1, round(BLOCK * aligned.rate_hz))
        count = (len(aligned.time) - 1) // length
        used = slice(1, 1 + count * length)
        edges = aligned.time[np.arange(count + 1) * length]
        summed = aligned.increments[used].reshape(count, length, 6, -1).sum(axis=1)
        whole = ~np.asarray(aligned.missing[used].reshape(count, length, -1).any(axis=1))
        rates = summed / np.diff(edges)[:, None, None]
        # sorting a few is several times quicker than `np.median`
        ordered, half = np.sort(rates, axis=2), rates.shape[2] // 2
        middle = 0.5 * (ordered[:, :, half] + ordered[:, :, -1 - half])
        return cls(edges[1:], rates, whole, middle)

    @cached_property
    def interval(self) -> float:
        """The usual length of a block, s."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else BLOCK

    def parts(self, seconds: float) -> list[slice]:
        """Return parts of so many seconds; the last one has at least half of that."""
        length = round(seconds / self.interval)
        return [slice(k, k + length) for k in range(0, max(len(self.time) - length // 2, 1), length)]
