"""A first trajectory, from which least squares converge, and how far apart its clocks are at first sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polyins.calibration.preintegration import Increments, rotation
from polyins.calibration.sightings import Nodes
from polyins.calibration.trajectory import World
from polyins.model.recording import Array

WAY_S = 1.0
"""s of the way that tells a velocity"""
MEMORY = 20.0
"""s: how long gyros hold a direction before their biases are known"""
STEP = 2.0
"""s from one position to the next, of which third differences are taken"""


@dataclass(frozen=True)
class Jerks:
    """How hard a body's acceleration changes, whatever its attitude.

    Third differences of positions hold neither the start nor a velocity nor a constant acceleration, so neither gravity
    nor the bias of an accelerometer; their length does not depend on the axes.
    """

    time: Array
    """s, shape (T,)"""
    position: Array
    """m, in axes that hardly turn within seconds, shape (T, 3)"""
    least: float = 0.05
    """m/s^3, rms: less is no motion"""

    @classmethod
    def of_imu(cls, time: Array, increments: Array) -> Jerks:
        """Integrate increments, shape (T, 6), in axes that the gyros hold."""
        steps = rotation(increments[:, :3])
        held = np.empty_like(steps)
        now = np.eye(3)
        for k, step in enumerate(steps):
            held[k] = now
            now = now @ step
        velocity = np.cumsum(np.einsum("tab,tb->ta", held, increments[:, 3:]), axis=0)
        interval = np.diff(time, prepend=2.0 * time[0] - time[1])[:, None]
        before = np.vstack([np.zeros(3), velocity[:-1]])
        return cls(time, np.cumsum(0.5 * (before + velocity) * interval, axis=0))

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant, s."""
        return float(self.time[0]) + 1.5 * STEP, float(self.time[-1]) - 1.5 * STEP

    def between(self, begin: Array, end: Array) -> Array:
        """Return the jerk about the middles of intervals, m/s^3, shape (M, 1)."""
        middle = 0.5 * (begin + end)
        third = np.zeros((len(middle), 3))
        for factor, steps in ((1.0, 1.5), (-3.0, 0.5), (3.0, -0.5), (-1.0, -1.5)):
            at = middle + steps * STEP
            third += factor * np.column_stack([np.interp(at, self.time, column) for column in self.position.T])
        return np.asarray(np.linalg.norm(third, axis=1)[:, None] / STEP**3)


def first_nodes(increments: Increments, time: Array, position: Array, velocity: Array | None, world: World) -> Nodes:
    """Return a trajectory through fixes, metres north, east, down at `time`, on the IMU's clock.

    The attitude at a node is the rotation that brings the velocity gained between nodes, as the IMU measured it, to
    that between fixes (Wahba's problem), those nearby counting most.
    """
    nodes = increments.nodes

    def at(when: Array, values: Array) -> Array:
        return np.column_stack([np.interp(when, time, column) for column in values.T])

    place = at(nodes, position)
    if velocity is None:
        half = max(0.5 * WAY_S, float(np.median(np.diff(time))))
        speed = (at(nodes + half, position) - at(nodes - half, position)) / (2.0 * half)
    else:
        speed = at(nodes, velocity)
    gravity = world.pull(place)
    span = np.diff(nodes)
    measured = increments.preintegrated(np.zeros((len(span), 12)))
    gained = np.diff(speed, axis=0) - gravity[:-1] * span[:, None]
    own = gained[:, :, None] * measured.velocity[:, -1][:, None, :]
    kept, turned = np.exp(-span / MEMORY), measured.turned[:, -1]
    count = len(span)
    profile, carried = np.zeros((count + 1, 3, 3)), np.zeros((3, 3))
    for k in range(count):
        carried = kept[k] * (carried + own[k]) @ turned[k]
        profile[k + 1] += carried
    carried = np.zeros((3, 3))
    for k in range(count - 1, -1, -1):
        carried = own[k] + kept[k] * carried @ turned[k].T
        profile[k] += carried
    left, _, right = np.linalg.svd(profile)
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    return Nodes(place, speed, left @ right, np.zeros((count + 1, 12)), gravity)
