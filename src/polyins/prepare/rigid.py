"""IMUs that are rigidly joined: what one of them would measure where it has no data, from what the others measure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import Rig
from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]

NOTHING, MEASURED, COMPLETED = 0, 1, 2
"""what an IMU has in an epoch"""


def groups(rig: Rig) -> list[tuple[int, ...]]:
    """Return the indices of IMUs that move alike: all that are fixed to the body, and the chips of each wheel."""
    fixed = tuple(i for i, imu in enumerate(rig.imus) if imu.wheel is None)
    wheels = [tuple(indices) for indices in rig.modules().values() if rig.imus[indices[0]].wheel is not None]
    return [group for group in (fixed, *wheels) if len(group) > 1]


def presence(rig: Rig, missing: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return what each IMU has in each epoch once gaps are completed, shape (T, N); `missing` is (T, N)."""
    present = np.where(missing, NOTHING, MEASURED).astype(np.uint8)
    for group in groups(rig):
        some = ~missing[:, group].all(axis=1)
        for i in group:
            present[missing[:, i] & some, i] = COMPLETED
    return present


def completed(rig: Rig, aligned: Aligned, errors: Array) -> Aligned:
    """Give IMUs without data what those that they are joined with measure, with their own biases, at their own place.

    `errors`: the slow ones at the start, (N, 12). What is missing stays marked.
    """
    if not aligned.missing.any():
        return aligned
    found = aligned.increments.copy()
    for group in groups(rig):
        for i in group:
            others = [j for j in group if j != i]
            epochs = np.flatnonzero(aligned.missing[:, i] & ~aligned.missing[:, others].all(axis=1))
            if len(epochs):
                found[epochs, :, i] = _from_others(i, others, epochs, rig, aligned, errors)
    return replace(aligned, increments=found)


def _from_others(
    i: int, others: list[int], epochs: NDArray[np.intp], rig: Rig, aligned: Aligned, errors: Array
) -> Array:
    """Return what IMU i would measure in K epochs, shape (K, 6)."""
    intervals = np.diff(aligned.time, prepend=2.0 * aligned.time[0] - aligned.time[1])[epochs, None]
    have = ~aligned.missing[epochs][:, others]
    weights = have / have.sum(axis=1, keepdims=True)
    found = np.einsum("tkj,tj->tk", aligned.increments[epochs][:, :, others], weights)
    found -= weights @ (errors[others, :6] - errors[i, :6]) * intervals
    spots = np.array([imu.position if imu.wheel is None else -imu.wheel.lever_arm for imu in rig.imus])
    apart = spots[i] - weights @ spots[others]
    rate = found[:, :3] / intervals - errors[i, :3]
    found[:, 3:] += np.cross(rate, np.cross(rate, apart)) * intervals
    return np.asarray(found)
