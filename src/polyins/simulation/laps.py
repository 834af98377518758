"""Laps of a rectangle with round corners: a track of our own making, for where no surveyed one is at hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.simulation.path import Path, World
from polyins.simulation.track import track_path

Array = NDArray[np.float64]

SPACING_M = 0.5
"""between points"""
SPEED_INTERVAL_S = 0.5
SPEEDING_S = 40.0
"""from one time of greatest speed to the next"""
STARTING_S = 10.0
"""until the speed is reached, and from when it falls to rest"""


@dataclass(frozen=True)
class Laps:
    """How often round what, and how fast."""

    length_m: float
    width_m: float
    corner_m: float
    """radius of the corners"""
    count: int
    speed_m_s: float
    """mean"""
    change_m_s: float
    """by which the speed goes up and down about its mean"""

    @property
    def around_m(self) -> float:
        """The way of one lap."""
        return 2.0 * (self.length_m + self.width_m) - (8.0 - 2.0 * np.pi) * self.corner_m

    def points(self) -> tuple[Array, Array]:
        """Return points north and east of the start, m, shape (P,) each, counterclockwise as paper B's robot."""
        way = np.arange(0.0, self.count * self.around_m, SPACING_M)
        legs = np.tile([self.length_m, self.width_m], 2) - 2.0 * self.corner_m
        corner = 0.5 * np.pi * self.corner_m
        edges = np.append(0.0, np.cumsum(np.column_stack([legs, np.full(4, corner)])))
        turned = np.interp(way % self.around_m, edges, -0.5 * np.pi * np.array([0, 0, 1, 1, 2, 2, 3, 3, 4]))
        heading = turned - 2.0 * np.pi * (way // self.around_m)
        step = np.append(0.0, np.diff(way))
        middle = 0.5 * (heading + np.append(heading[:1], heading[:-1]))
        return np.cumsum(step * np.cos(middle)), np.cumsum(step * np.sin(middle))

    def speeds(self) -> tuple[Array, Array]:
        """Return times, s, and speeds, m/s, shape (S,) each."""
        time = np.arange(0.0, self.count * self.around_m / self.speed_m_s, SPEED_INTERVAL_S)
        speed = self.speed_m_s - self.change_m_s * np.cos(2.0 * np.pi * time / SPEEDING_S)
        return time, speed * np.minimum(1.0, np.minimum(time, time[-1] - time) / STARTING_S)

    def path(self, static: float, start: ArrayLike, world: World) -> Path:
        """Return the path; it stands for `static`, s, at `start`, in the world's coordinates."""
        return track_path(*self.points(), *self.speeds(), static=static, start=start, world=world)
