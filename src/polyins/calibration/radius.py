"""The rolling radius of a wheel and its place beside the antenna, from a GNSS track."""

from __future__ import annotations

import numpy as np

from polyins.calibration.motion import RunningSums
from polyins.calibration.regression import Fit, blocks, fit
from polyins.errors import InputError
from polyins.model.recording import Array

WINDOW = 1.0  # s
LEAST_SPEED = 1.0  # m/s: slower than this the noise of a fix lengthens the way
LEAST_DISTANCE = 50.0  # m


def rolling_radius(turns: RunningSums, time: Array, position: Array, name: str) -> Fit:
    """Find a wheel's radius and how far to the right of the wheel the antenna is, m.

    `turns`: spin and upward yaw of the wheel; `position`: of the antenna at `time`, m north, east, down, shape (M, 3).
    The way between fixes a second apart is radius x spin + lateral offset x yaw. The radius holds for the gyro as it
    is, its scale error included. Raises InputError for less than 50 m.
    """
    ahead = max(1, round(WINDOW / float(np.median(np.diff(time)))))
    begin, end = time[:-ahead], time[ahead:]
    chord = np.linalg.norm(position[ahead:] - position[:-ahead], axis=1)
    inside = (begin >= turns.span[0]) & (end <= turns.span[1]) & (end - begin < 1.5 * WINDOW + 1e-9)
    used = inside & (chord > LEAST_SPEED * (end - begin))
    if chord[used].sum() / ahead < LEAST_DISTANCE:
        raise InputError(f"IMU {name}: less than {LEAST_DISTANCE:g} m with GNSS; expected more, for the wheel's radius")
    turned = turns.between(begin[used], end[used])
    # the vehicle goes along an arc, whose chord is shorter
    half = 0.5 * turned[:, 1]
    return fit(turned, chord[used] / np.sinc(half / np.pi), blocks(int(used.sum())))
