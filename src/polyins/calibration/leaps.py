"""Whether a clock leapt: what a constant and a drift leave of the offsets of parts of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import Array

SURE = 6.0
"""standard deviations by which a leap is not zero, after the best place for it was chosen"""
LEAST = 0.002
"""s: less may be how a receiver filters"""
MOST = 5
"""leaps of one clock that are looked for"""


@dataclass(frozen=True)
class Parts:
    """What parts of a recording tell of a clock, beyond the terms that are known."""

    begins: Array
    """stamps from which on each part counts, s, shape (P,)"""
    middles: Array
    """s, shape (P,)"""
    offsets: Array
    """s, shape (P,)"""
    covariance: Array
    """s^2, shape (P, P)"""

    def leap(self) -> float | None:
        """Return the stamp with which the part begins before which the clock leapt, s; None: it did not."""
        known = np.isfinite(self.offsets)
        count = int(known.sum())
        if count < 4:
            return None
        root = np.linalg.cholesky(self.covariance[np.ix_(known, known)])
        line = np.column_stack([np.ones(count), self.middles[known] - self.middles[known].mean()])
        design = np.linalg.solve(root, line)
        observed = np.linalg.solve(root, self.offsets[known])
        left = _left(design, observed)
        steps = np.linalg.solve(root, np.tril(np.ones((count, count)))[:, 1:])
        steps = np.column_stack([_left(design, step) for step in steps.T])
        squares = np.sum(steps**2, axis=0)
        sizes = left @ steps / np.maximum(squares, 1e-300)
        gains = sizes**2 * squares
        # what else is wrong with the noise figures scatters too
        remains = np.maximum(1.0, (np.sum(left**2) - gains) / max(count - 3, 1))
        gains = np.where(np.abs(sizes) > LEAST, gains / remains, 0.0)
        best = int(np.argmax(gains))
        return float(self.begins[known][best + 1]) if gains[best] > SURE**2 else None


def _left(design: Array, observed: NDArray[np.floating[Any]]) -> Array:
    """Return what a design leaves of the observed."""
    return np.asarray(observed - design @ np.linalg.lstsq(design, observed, rcond=None)[0])
