"""A robot that goes to and fro on level ground: straights of one length, joined by half turns to the right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.simulation import earth
from polyins.simulation.path import START, Path, Profile, World, path, smooth_steps
from polyins.simulation.track import Level

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Way:
    """How it goes."""

    speed: float
    """m/s"""
    straight: float
    """m"""
    radius: float
    """m, of the half turns"""
    speed_up: float = 3.0
    """s, from rest to the speed"""
    steer: float = 1.0
    """s, from straight ahead to the full turn and back"""

    def straights(self, duration: float, static: float) -> tuple[Array, Array]:
        """Return when the straights begin, s, and after which way, m, shape (K,) each."""
        lap = self.straight / self.speed + np.pi * self.radius / self.speed + self.steer
        first = static + self.speed_up
        begins = np.arange(first, duration, lap)
        return begins, self.speed * (self.speed_up / 2.0 + begins - first)


def shuttle_path(
    duration: float,
    there: Way,
    *,
    static: float,
    start: ArrayLike = START,
    heading: float = 0.0,
    world: World = earth,
) -> Path:
    """Return the path, which stands for `static`, s, and then keeps its speed; heading in rad."""
    speed, steer = there.speed, there.steer
    turn_rate = speed / there.radius
    turning = np.pi / turn_rate - steer
    knots = [(0.0, 0.0)]
    for begin in there.straights(duration, static)[0]:
        bend = begin + there.straight / speed
        knots += [(bend, 0.0), (bend + steer, turn_rate), (bend + steer + turning, turn_rate)]
        knots.append((bend + 2.0 * steer + turning, 0.0))
    knots.append((max(knots[-1][0], duration) + 1.0, 0.0))
    ahead = smooth_steps(*np.array(knots).T).antiderivative()
    ahead.c[-1] += heading
    times = np.cumsum([0.0, static, there.speed_up, duration + 1.0])
    pace = smooth_steps(times, np.array([0.0, 0.0, speed, speed]))
    return path(Profile(pace, Level(), Level(), ahead), duration=duration, static=static, start=start, world=world)
