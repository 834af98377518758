"""An array turned by hand for its calibration: laid down in many attitudes, then shaken about all axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import DEG
from polyins.simulation.path import START, Path, Profile, path, smooth_steps

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HandTurning:
    """How somebody turns an array."""

    faces: int = 26
    """how many attitudes: the faces of a cube first, then its edges, then its corners up"""
    still: float = 3.0
    """s in each"""
    turn: tuple[float, float] = (1.0, 2.0)
    """s from one to the next, at least and at most"""
    awry: float = 8.0 * DEG
    """1 sigma, rad: by that an attitude is not the one that is meant"""
    shaking: float = 40.0
    """s, at the end"""
    swing: float = 40.0 * DEG
    """rad, 1 sigma, of a swing"""
    swing_time: tuple[float, float] = (0.6, 1.2)
    """s, at least and at most"""
    speed: float = 0.3
    """m/s, 1 sigma, of the middle in turns and swings"""


def turned_by_hand(rng: np.random.Generator, how: HandTurning = HandTurning()) -> Path:
    """Return the path of an array that somebody turns; it is still in the first attitude for the standing start."""
    roll, pitch = _attitudes(how, rng).T
    angles = np.column_stack([roll, pitch, np.cumsum(rng.normal(0.0, 60.0 * DEG, how.faces))])
    angles[:, 0] = np.unwrap(angles[:, 0])
    knots: list[Array] = []
    time = 0.0
    for k, attitude in enumerate(angles):
        if k:
            half = 0.5 * float(rng.uniform(*how.turn))
            between = 0.5 * (knots[-1][1:4] + attitude)
            knots.append(np.array([time + half, *between, *rng.normal(0.0, how.speed, 2)]))
            time += 2.0 * half
        knots.append(np.array([time, *attitude, 0.0, 0.0]))
        time += how.still
        knots.append(np.array([time, *attitude, 0.0, 0.0]))
    end = time + how.shaking
    while time < end:
        time += float(rng.uniform(*how.swing_time))
        swung = angles[-1] + rng.normal(0.0, how.swing, 3)
        knots.append(np.array([time, *swung, *rng.normal(0.0, how.speed, 2)]))
    table = np.array(knots)
    curves = [smooth_steps(table[:, 0], column) for column in table[:, 1:].T]
    profile = Profile(curves[3], curves[0], curves[1], curves[2], curves[4])
    return path(profile, duration=float(time), static=how.still, start=START)


def _attitudes(how: HandTurning, rng: np.random.Generator) -> Array:
    """Return roll and pitch of the attitudes, rad, shape (faces, 2)."""
    grid = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float)
    up = grid[np.argsort(np.abs(grid).sum(axis=1), kind="stable")][np.arange(how.faces) % len(grid)]
    up = up / np.linalg.norm(up, axis=1)[:, None] + rng.normal(0.0, how.awry, (how.faces, 3))
    up /= np.linalg.norm(up, axis=1)[:, None]
    return np.column_stack([np.arctan2(up[:, 1], up[:, 2]), np.arcsin(-up[:, 0])])
