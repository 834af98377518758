"""A robot that goes to and fro on level ground: straights of one length, joined by half turns to the right."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.simulation import earth
from polyins.simulation.path import START, Path, World, path, smooth_steps
from polyins.simulation.track import Level

Array = NDArray[np.float64]

SPEED_UP = 3.0  # s, from rest to the speed
STEER = 1.0  # s, from straight ahead to the full turn and back


def shuttle_path(
    duration: float,
    speed: float,
    straight: float,
    radius: float,
    *,
    static: float,
    start: ArrayLike = START,
    heading: float = 0.0,
    world: World = earth,
) -> Path:
    """Return the path, which stands for `static`, s, and then keeps its speed, m/s; lengths in m, heading in rad."""
    turn_rate = speed / radius
    turning = np.pi / turn_rate - STEER
    knots = [(0.0, 0.0)]
    for begin in straights(duration, speed, straight, radius, static)[0]:
        bend = begin + straight / speed
        knots += [(bend, 0.0), (bend + STEER, turn_rate), (bend + STEER + turning, turn_rate)]
        knots.append((bend + 2.0 * STEER + turning, 0.0))
    knots.append((max(knots[-1][0], duration) + 1.0, 0.0))
    ahead = smooth_steps(*np.array(knots).T).antiderivative()
    ahead.c[-1] += heading
    last = duration + 1.0
    pace = smooth_steps(
        np.array([0.0, static, static + SPEED_UP, static + SPEED_UP + last]), np.array([0.0, 0.0, speed, speed])
    )
    return path(pace, Level(), Level(), ahead, duration=duration, static=static, start=start, world=world)


def straights(duration: float, speed: float, straight: float, radius: float, static: float) -> tuple[Array, Array]:
    """Return when the straights begin, s, and after which way, m, shape (K,) each."""
    lap = straight / speed + np.pi * radius / speed + STEER
    first = static + SPEED_UP
    begins = np.arange(first, duration, lap)
    return begins, speed * (SPEED_UP / 2.0 + begins - first)
