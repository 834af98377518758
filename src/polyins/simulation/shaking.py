"""A robot's body on its tyres: the ground under four wheels heaves, pitches and rolls it about its path.

The robot drives along a smooth path p; the body b is displaced from it by the heave along p's z axis and turned by
pitch, then roll. What the tyres do is in `tyres`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from polyins.simulation.path import BodyMotion, Path
from polyins.simulation.road import Ground
from polyins.simulation.tyres import Suspension, bounce

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shaking:
    """How the body moves about its path, every `step` s from time 0."""

    step: float
    """s"""
    motion: Array
    """heave of the array origin, m, downwards; pitch and roll, rad; shape (T, 3)"""
    change: Array
    """its derivative, shape (T, 3)"""

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return motion and change, shape (N, 3) each, at times, s, shape (N,): cubics through the nearest two rows.

        A spline through all rows would take longer than the few instants that are asked for.
        """
        row = np.clip((time / self.step).astype(int), 0, len(self.motion) - 2)
        s = (time / self.step - row)[:, None]
        before, after = self.step * self.change[row], self.step * self.change[row + 1]
        rise = self.motion[row + 1] - self.motion[row]
        square, cube = 3.0 * rise - 2.0 * before - after, before + after - 2.0 * rise
        motion = self.motion[row] + s * (before + s * (square + s * cube))
        return motion, (before + s * (2.0 * square + s * 3.0 * cube)) / self.step


def shake(path: Path, ground: Ground, suspension: Suspension, step: float) -> Shaking:
    """Return what the ground does to the body of a robot that drives over it along a path."""
    time = step * np.arange(np.ceil(path.duration / step) + 1.0)
    along = way(path, time)
    half = suspension.wheelbase / 2.0
    gravity = float(path.world.gravity(path.position(np.zeros(1)))[0])
    motion, change = bounce(np.hstack([ground(along + half), ground(along - half)]), step, suspension, gravity)
    for values in (motion, change):
        # downwards, and from the middle between the wheels to the array origin
        values[:, 0] = suspension.centre[0] * values[:, 1] - suspension.centre[1] * values[:, 2] - values[:, 0]
    return Shaking(step, motion, change)


def way(path: Path, time: Array) -> Array:
    """Return the way travelled at evenly spaced times from 0, m, shape (T,)."""
    speed = path.speed(time)
    return np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2.0) * (time[1] - time[0]))


@dataclass(frozen=True)
class ShakenPath(Path):
    """A path whose body shakes: `motion` and `truth` are those of the body."""

    shaking: Shaking | None = None

    def motion(self, time: Array) -> BodyMotion:
        """Return position, velocity, attitude and rates of the array origin at times, shape (T,)."""
        smooth = super().motion(time)
        assert self.shaking is not None
        motion, change = self.shaking.at(time)
        (heave, pitch, roll), (rise, pitching, rolling) = motion.T, change.T
        none = np.zeros_like(heave)
        C_pb = rotation_matrices_of(roll, pitch)
        C_nb = smooth.C_nb @ C_pb
        offset = np.column_stack([none, none, heave])
        relative = smooth.angular_rate - smooth.earth_rate
        moving = np.cross(relative, offset) + np.column_stack([none, none, rise])
        shift, velocity = ((smooth.C_nb @ vector[..., None])[..., 0] for vector in (offset, moving))
        own = np.column_stack([rolling, pitching * np.cos(roll), -pitching * np.sin(roll)])
        return BodyMotion(
            smooth.position + self.world.displacement(smooth.position, shift),
            smooth.velocity + velocity,
            _euler(C_nb, smooth.attitude[:, 2]),
            C_nb,
            to_frame(C_pb, smooth.earth_rate),
            to_frame(C_pb, smooth.angular_rate) + own,
        )


def shaken_path(path: Path, shaking: Shaking) -> ShakenPath:
    """Return the path of the body of a robot that shakes about a smooth path."""
    return ShakenPath(**{field.name: getattr(path, field.name) for field in fields(Path)}, shaking=shaking)


def rotation_matrices_of(roll: Array, pitch: Array) -> Array:
    """Return Ry(pitch) Rx(roll), shape (T, 3, 3)."""
    (sr, sp), (cr, cp) = np.sin([roll, pitch]), np.cos([roll, pitch])
    none = np.zeros_like(sr)
    return np.stack([cp, sp * sr, sp * cr, none, cr, -sr, -sp, cp * sr, cp * cr], axis=-1).reshape(-1, 3, 3)


def to_frame(C: Array, vector: Array) -> Array:
    """Return C' v of matrices, shape (T, 3, 3), and vectors, shape (T, 3)."""
    return np.asarray(np.einsum("tji,tj->ti", C, vector))


def _euler(C_nb: Array, smooth: Array) -> Array:
    """Return roll, pitch, heading of matrices, rad; the heading is the one next to `smooth`."""
    heading = np.arctan2(C_nb[:, 1, 0], C_nb[:, 0, 0])
    heading += 2.0 * np.pi * np.rint((smooth - heading) / (2.0 * np.pi))
    return np.column_stack([np.arctan2(C_nb[:, 2, 1], C_nb[:, 2, 2]), -np.arcsin(C_nb[:, 2, 0]), heading])
