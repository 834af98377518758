"""What the chips of one board have in common: supply and reference noise, temperature.

Each is a share of the variance of every chip's white noise, or of its drift, and runs alike in all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SharedNoise:
    """The noise that all chips of a board have in common; equal seeds give equal noise."""

    seed: int
    white_share: float = 0.0
    """of the variance of white noise"""
    drift_share: float = 0.0
    """of the variance of drifts"""

    def generator(self, kind: int) -> np.random.Generator:
        """Return the generator of one kind of noise, the same for every chip."""
        return np.random.default_rng([self.seed, kind])


def blend(own: Array, common: Array, share: float) -> Array:
    """Return noise of the same variance as `own`, a share of which is common."""
    return np.asarray(np.sqrt(1.0 - share) * own + np.sqrt(share) * common)
