"""Laps of a rectangle with round corners: a track of our own making, for where no surveyed one is at hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SPACING = 0.5
"""m between points"""
SPEED_INTERVAL = 0.5
"""s"""


def lap_length(length: float, width: float, corner: float) -> float:
    """Return the way of one lap, m, around a rectangle, m, with corners of a radius, m."""
    return 2.0 * (length + width) - (8.0 - 2.0 * np.pi) * corner


def lap_points(length: float, width: float, corner: float, count: int) -> tuple[Array, Array]:
    """Return points north and east of the start, m, shape (P,) each, of some laps, counterclockwise."""
    around = lap_length(length, width, corner)
    way = np.arange(0.0, count * around, SPACING)
    legs = np.tile([length, width], 2) - 2.0 * corner
    edges = np.append(0.0, np.cumsum(np.column_stack([legs, np.full(4, 0.5 * np.pi * corner)])))
    turned = np.interp(way % around, edges, -0.5 * np.pi * np.array([0, 0, 1, 1, 2, 2, 3, 3, 4]))
    heading = turned - 2.0 * np.pi * (way // around)
    step = np.append(0.0, np.diff(way))
    middle = 0.5 * (heading + np.append(heading[:1], heading[:-1]))
    return np.cumsum(step * np.cos(middle)), np.cumsum(step * np.sin(middle))


def lap_speeds(way: float, mean: float, *, change: float, every: float, starting: float) -> tuple[Array, Array]:
    """Return times, s, and speeds, m/s, shape (S,) each, of a way, m, at a mean speed.

    It goes up and down by `change`, m/s, once in `every` s, and rises from rest and falls to it within `starting` s.
    """
    time = np.arange(0.0, way / mean, SPEED_INTERVAL)
    speed = mean - change * np.cos(2.0 * np.pi * time / every)
    return time, speed * np.minimum(1.0, np.minimum(time, time[-1] - time) / starting)
