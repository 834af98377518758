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


USUAL = 5
"""latest intervals between measurements whose median is the usual one"""


def patience(times: Array) -> Array:
    """Return how long after each of some measurements a state is still tracking, s, of the intervals up to it."""
    intervals = np.diff(times)
    usual = np.zeros(len(times))
    if len(intervals):
        known = np.concatenate([np.full(USUAL - 1, intervals[0]), intervals])
        usual[1:] = np.median(np.lib.stride_tricks.sliding_window_view(known, USUAL), axis=1)
    return np.maximum(LEAST_COASTING, USUAL_INTERVALS * usual)


def status_of(trajectory: Trajectory, times: Array, snap: float = 0.0) -> NDArray[np.uint8]:
    """Return the index of the status at each epoch, shape (T,).

    `times`: when a position or a speed was accepted, from before the first epoch on, s; one that is later than an epoch
    by no more than `snap`, s, is at it.
    """
    last = np.maximum(np.searchsorted(times, trajectory.time + snap, "right") - 1, 0)
    found = np.full(len(trajectory.time), TRACKING, dtype=np.uint8)
    with np.errstate(invalid="ignore"):
        found[trajectory.time - times[last] > patience(times)[last]] = COASTING
        found[np.sqrt(trajectory.position_variance[:, :2].max(axis=1)) > LOST_STD] = ATTITUDE_ONLY
        found[np.sqrt(trajectory.phi_covariance[:, 5]) > ALIGNED_STD] = ALIGNING
    finite = np.isfinite(trajectory.position).all(axis=1) & np.isfinite(trajectory.attitude).all(axis=1)
    found[~finite | ~np.isfinite(trajectory.position_variance).all(axis=1)] = NOT_TO_BE_USED
    return found
