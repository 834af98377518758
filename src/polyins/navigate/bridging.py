"""What a short pause of all IMUs leaves unknown, as variances that are added where it begins: a fix may lie in it.

An array is carried over it by the mean of the rates on both sides. What the rates do in between is a random walk known
at both ends, of which the integral over a pause of length L has the variance q L^3 / 12, and the double integral
q L^5 / 45. The strength q is what a vehicle that begins or ends a turn shows, or what the rates on both sides differ
by, if that is more. A vehicle on wheels goes on straight at the speed it had: it turns and brakes as it likes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.aiding import kinds
from polyins.navigate import events
from polyins.navigate.events import Events

Array = NDArray[np.float64]

RATE_CHANGE = 0.4
"""rad/s by which a rate usually changes within a second, about each axis"""
FORCE_CHANGE = 2.0
"""m/s^2, likewise of the specific force"""
TURN_RATE, TILT_RATE = 0.3, 0.03
"""rad/s at which a vehicle on wheels usually turns and leans, at most"""
ACCELERATION = 1.5
"""m/s^2, by which it usually changes its speed, at most"""


def of_array(time: Array, increments: Array, nothing: NDArray[np.bool_], snap: float) -> Events:
    """Return the noise of epochs that are bridged: stamps (T,), increments (T, 6, N), and where nothing is measured.

    The first epoch only tells the rates before the second.
    """
    found = np.flatnonzero(nothing[1:]) + 1
    if not len(found):
        return _noise(np.empty(0), np.empty((0, 4)), snap)
    length = time[found] - time[found - 1]
    earlier = time[found - 1] - np.where(found > 1, time[found - 2], 2.0 * time[0] - time[1])
    before = increments[found - 1].mean(axis=2) / earlier[:, None]
    change = 2.0 * np.linalg.norm((increments[found].mean(axis=2) / length[:, None] - before).reshape(-1, 2, 3), axis=2)
    walk = np.maximum(np.array([RATE_CHANGE, FORCE_CHANGE]) ** 2, change**2 / length[:, None])
    angle, velocity = (walk * length[:, None] ** 3 / 12.0).T
    return _noise(time[found - 1], np.column_stack([velocity * length**2 * 4.0 / 15.0, velocity, angle, angle]), snap)


def of_wheels(time: Array, nothing: NDArray[np.bool_], snap: float) -> Events:
    """Return the noise of epochs in which no IMU of a vehicle on wheels has data; the first has a stamp only."""
    found = np.flatnonzero(nothing[1:]) + 1
    length = time[found] - time[found - 1]
    velocity = (ACCELERATION * length) ** 2
    turned = [(TILT_RATE * length) ** 2, (TURN_RATE * length) ** 2]
    return _noise(time[found - 1], np.column_stack([velocity * length**2 / 4.0, velocity, *turned]), snap)


def _noise(begin: Array, variances: Array, snap: float) -> Events:
    """Return variances of position, velocity, tilt and heading, (M, 4), as events just after the epochs before."""
    return events.events(kinds.PAUSE, begin + 1.5 * snap + 1e-6, variances, np.ones((len(begin), 1)))
