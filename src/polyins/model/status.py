"""What a state is worth: a word per epoch, beside its standard deviations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.model.solution import Trajectory

Array = NDArray[np.float64]

STATUSES = ("aligning", "tracking", "coasting", "attitude only", "not to be used")
ALIGNING, TRACKING, COASTING, ATTITUDE_ONLY, NOT_TO_BE_USED = range(5)

ALIGNED_STD = np.radians(20.0)
"""rad: with a heading less sure than that it is still looked for"""
LOST_STD = 100.0
"""m: a position less sure than that says nothing"""
LEAST_COASTING = 2.0
"""s without a position or a speed that are coasting, and 2.5 times the usual interval"""
USUAL_INTERVALS = 2.5


def patience(intervals: Array) -> float:
    """Return how long after the last measurement a state is still tracking, s, of the usual intervals between them."""
    return max(LEAST_COASTING, USUAL_INTERVALS * float(np.median(intervals)) if len(intervals) else 0.0)


def status_of(trajectory: Trajectory, aided: Array, usual: float) -> NDArray[np.uint8]:
    """Return the index of the status at each epoch, shape (T,).

    `aided`: s, when a position or a speed was last accepted, shape (T,); `usual`: how long it may be ago, s.
    """
    found = np.full(len(trajectory.time), TRACKING, dtype=np.uint8)
    with np.errstate(invalid="ignore"):
        found[trajectory.time - aided > usual] = COASTING
        found[np.sqrt(trajectory.position_variance[:, :2].max(axis=1)) > LOST_STD] = ATTITUDE_ONLY
        found[np.sqrt(trajectory.phi_covariance[:, 5]) > ALIGNED_STD] = ALIGNING
    finite = np.isfinite(trajectory.position).all(axis=1) & np.isfinite(trajectory.attitude).all(axis=1)
    found[~finite | ~np.isfinite(trajectory.position_variance).all(axis=1)] = NOT_TO_BE_USED
    return found
