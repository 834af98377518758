"""What several IMUs on one body measured at the same instants, smoothed alike.

Smoothing is linear: what holds between the IMUs at every instant holds between what is left of them, and vibration, in
which every IMU has its own part, is gone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.motion import motion
from polyins.errors import InputError
from polyins.model.recording import Array, ImuStream

FINEST = 0.005
"""s, of the grid: what hands and vehicles do is slower by far"""
SIGMA = 0.025
"""s, of the Gaussian window: at 5 Hz it leaves 0.73, at 15 Hz 0.06, at 20 Hz nothing"""
REACH = 4.0
"""sigmas, where the window ends"""
SPACING = 0.05
"""s, from one smoothed instant to the next: nothing is lost at twice the sigma"""
LOST = 1.5
"""times the usual interval: a longer one has lost rows"""
LEAST_INSTANTS = 200


@dataclass(frozen=True)
class CommonMotion:
    """Mean rates and specific forces of N IMUs over the cells of a common grid, in the axes of their streams."""

    time: Array
    """s, middles of the cells, shape (T,)"""
    step: float
    """s"""
    rate: Array
    """rad/s, shape (T, N, 3)"""
    force: Array
    """m/s^2, shape (T, N, 3)"""
    lost: NDArray[np.bool_]
    """where an IMU has no rows, shape (T,)"""

    @property
    def instants(self) -> NDArray[np.intp]:
        """Rows of the grid about which nothing is lost, `SPACING` apart."""
        from scipy.ndimage import maximum_filter1d

        reach = int(np.ceil(REACH * SIGMA / self.step))
        near = maximum_filter1d(self.lost.astype(np.int8), 2 * reach + 1, mode="constant", cval=1)
        rows = np.arange(reach, len(self.time) - reach, max(1, round(SPACING / self.step)))
        return np.asarray(rows[near[rows] == 0], dtype=np.intp)

    def smoothed(self, values: Array, rows: NDArray[np.intp], derivative: int = 0) -> Array:
        """Return values on the grid, shape (T, ...), or their derivative per s, smoothed, at some rows."""
        from scipy.ndimage import gaussian_filter1d

        sigma = SIGMA / self.step
        smooth = gaussian_filter1d(values, sigma, axis=0, order=derivative, truncate=REACH, mode="nearest")
        return np.asarray(smooth[rows] / self.step**derivative)


def common_motion(streams: Sequence[ImuStream]) -> CommonMotion:
    """Return what the streams, on one clock, show between the last beginning and the first end.

    Raises InputError if that is not ten seconds.
    """
    moved = [motion(stream) for stream in streams]
    begin, end = max(one.edges[0] for one in moved), min(one.edges[-1] for one in moved)
    step = max(FINEST, *(float(np.median(one.steps)) for one in moved))
    count = int((end - begin) / step)
    if count * step < LEAST_INSTANTS * SPACING:
        raise InputError(
            f"calibrate: the IMUs have {max(count * step, 0.0):.1f} s in common; expected at least "
            f"{LEAST_INSTANTS * SPACING:g} s on one clock"
        )
    edges = begin + step * np.arange(count + 1)
    rate, force = np.empty((count, len(moved), 3)), np.empty((count, len(moved), 3))
    lost = np.zeros(count, dtype=bool)
    for i, one in enumerate(moved):
        sums = one.running(np.hstack([one.rate, one.force]))
        both = sums.between(edges[:-1], edges[1:]) / step
        rate[:, i], force[:, i] = both[:, :3], both[:, 3:]
        for k in np.flatnonzero(one.steps > LOST * np.median(one.steps)):
            first, last = np.searchsorted(edges, [one.edges[k], one.edges[k + 1]])
            lost[max(first - 1, 0) : last] = True
    return CommonMotion(edges[:-1] + 0.5 * step, step, rate, force, lost)
