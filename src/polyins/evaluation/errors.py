"""A solution minus its reference, at the reference's point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.attitude import angular_rate, euler_angles, rotation_matrices, wrap
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Reference
from polyins.model.rig import Vector
from polyins.model.solution import Solution

Array = NDArray[np.float64]

LONGEST_BRIDGED_GAP = 5.0
"""in median intervals of the reference"""
ROUNDING_S = 1e-6
"""what time stamps such as GPS seconds of the week are exact to"""


@dataclass(frozen=True)
class Errors:
    """Solution minus reference at the E epochs of the solution that the reference covers."""

    time: Array
    """s, shape (E,)"""
    position: Array
    """m north, east, down, shape (E, 3)"""
    velocity: Array | None
    """m/s north, east, down, shape (E, 3); None: the reference has none"""
    attitude: Array | None
    """roll, pitch, heading, rad in [-pi, pi), shape (E, 3); None: the reference has none"""
    distance: Array
    """m travelled over ground, along the reference, since the first of these epochs, shape (E,)"""
    covered: NDArray[np.bool_]
    """which of the solution's T epochs these are, shape (T,)"""

    @property
    def horizontal(self) -> Array:
        """Horizontal position error, m, shape (E,)."""
        return np.hypot(self.position[:, 0], self.position[:, 1])

    @property
    def epochs_without_reference(self) -> int:
        """How many epochs of the solution were left out."""
        return int(np.count_nonzero(~self.covered))

    def at(self, rows: NDArray[np.intp]) -> Errors:
        """Return those at some of the epochs, which count as a solution's only ones."""

        def of(values: Array | None) -> Array | None:
            return None if values is None else values[rows]

        everywhere = np.ones(len(rows), dtype=bool)
        velocity, attitude = of(self.velocity), of(self.attitude)
        return Errors(self.time[rows], self.position[rows], velocity, attitude, self.distance[rows], everywhere)

    @classmethod
    def joined(cls, parts: Sequence[Errors]) -> Errors:
        """Return those of parts that follow one another."""

        def whole(name: str) -> Any:
            values = [getattr(part, name) for part in parts]
            return None if any(value is None for value in values) else np.concatenate(values)

        if not parts:
            return cls(np.zeros(0), np.zeros((0, 3)), None, None, np.zeros(0), np.zeros(0, dtype=bool))
        names = ("time", "position", "velocity", "attitude", "distance", "covered")
        return cls(*(whole(name) for name in names))


ANGLES = ("roll", "pitch", "heading")


def rms(values: Array | None) -> float | None:
    """Return the root mean square; None of nothing."""
    if values is None or values.size == 0:
        return None
    return float(np.sqrt(np.mean(np.square(values))))


def compare_to_reference(solution: Solution, reference: Reference) -> Errors:
    """Move the solution from its own point to the reference's and subtract the reference.

    The reference is interpolated linearly to the solution's epochs (angles the shorter way round), neither beyond its
    ends nor across gaps of more than five of its median intervals; epochs without reference are left out. Position is
    p + D^-1 C l, velocity v + C (w x l) with l = reference.lever_arm - solution.point and w from the differences of
    the solution's own attitudes.

    Raises InputError if the reference has fewer than two epochs or its times do not increase.
    """
    place = _Places.of(reference.time, solution.time)
    time = solution.time[place.covered]
    attitude = solution.attitude[place.covered]
    lever_arm = reference.lever_arm - solution.point

    angles = np.array([False, solution.geodetic, False])  # longitude
    truth = place.interpolate(reference.position, angles)
    scale = metres_per_unit(truth, solution.geodetic)
    difference = solution.position[place.covered] - truth
    difference[:, angles] = wrap(difference[:, angles])
    position = difference * scale + rotation_matrices(attitude) @ lever_arm

    velocity = None
    if reference.velocity is not None:
        moved = solution.velocity[place.covered] + _lever_arm_velocity(solution, lever_arm)[place.covered]
        velocity = moved - place.interpolate(reference.velocity)
    attitude_error = None
    if reference.attitude is not None:
        attitude_error = wrap(euler_angles(attitude) - place.interpolate(reference.attitude, np.full(3, True)))
    travelled = np.interp(time, reference.time, path_length(reference.position, solution.geodetic))
    return Errors(time, position, velocity, attitude_error, travelled - travelled[:1], place.covered)


def _lever_arm_velocity(solution: Solution, lever_arm: Vector) -> Array:
    """Return C (w x l), m/s, shape (T, 3)."""
    if not np.any(lever_arm):
        return np.zeros_like(solution.velocity)
    rate = angular_rate(solution.time, solution.attitude)
    around = np.cross(rate, lever_arm)
    return np.asarray((rotation_matrices(solution.attitude) @ around[..., None])[..., 0], dtype=float)


def path_length(position: Array, geodetic: bool) -> Array:
    """Return the metres travelled over ground up to each position, shape (R,)."""
    step = np.diff(position, axis=0)
    if geodetic:
        step[:, 1] = wrap(step[:, 1])
    north, east, _ = (step * metres_per_unit(position[1:], geodetic)).T
    return np.concatenate([[0.0], np.cumsum(np.hypot(north, east))])


@dataclass(frozen=True)
class _Places:
    """Where the covered epochs lie between those of the reference."""

    covered: NDArray[np.bool_]
    """shape (T,)"""
    before: NDArray[np.intp]
    """index of the reference epoch at or before, shape (E,)"""
    weight: Array
    """of the reference epoch after it, shape (E,)"""

    @classmethod
    def of(cls, known: Array, wanted: Array) -> _Places:
        """Find the epochs `wanted`, shape (T,), among the epochs `known`, shape (R,)."""
        step = np.diff(known)
        if step.size == 0 or not np.all(step > 0.0):
            raise InputError(f"reference: {known.size} epochs; expected at least two, with increasing times")
        before = np.clip(np.searchsorted(known, wanted, side="right") - 1, 0, step.size - 1)
        weight = (wanted - known[before]) / step[before]
        bridged = step <= LONGEST_BRIDGED_GAP * np.median(step) + ROUNDING_S
        inside = (weight >= 0.0) & (weight <= 1.0)
        covered = inside & (bridged[before] | (weight == 0.0) | (weight == 1.0))
        return cls(covered, before[covered], weight[covered])

    def interpolate(self, values: Array, angles: NDArray[np.bool_] | None = None) -> Array:
        """Interpolate `values`, shape (R, 3), to shape (E, 3); the columns in `angles` the shorter way round."""
        first = values[self.before]
        difference = values[self.before + 1] - first
        if angles is not None:
            difference[:, angles] = wrap(difference[:, angles])
        return first + self.weight[:, None] * difference
