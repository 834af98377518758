"""What sensors beside the IMUs say of a trajectory: predicted values, and how they follow from it and from the time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.preintegration import ERRORS, GYRO, Preintegrated, cross, rotation, rotation_vector
from polyins.model.recording import Array

STATES = 9 + ERRORS
"""of a node: position, velocity, rotation vector in its own axes, errors of the IMU"""
POSITION, VELOCITY, TURN, SLOW = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, STATES)


@dataclass(frozen=True)
class Nodes:
    """A trajectory at its nodes, in metres north, east, down of a tangent plane."""

    position: Array
    """shape (N, 3)"""
    velocity: Array
    """shape (N, 3)"""
    attitude: Array
    """matrices from body axes to north, east, down, shape (N, 3, 3)"""
    errors: Array
    """shape (N, 12)"""
    gravity: Array
    """m/s^2, shape (N, 3)"""

    def moved(self, step: Array) -> Nodes:
        """Return the trajectory after a step of the states, shape (N, 21)."""
        return replace(
            self,
            position=self.position + step[:, POSITION],
            velocity=self.velocity + step[:, VELOCITY],
            attitude=self.attitude @ rotation(step[:, TURN]),
            errors=self.errors + step[:, SLOW],
        )


@dataclass(frozen=True)
class Instants:
    """The trajectory at M instants, each from the node before it."""

    node: NDArray[np.intp]
    """which, shape (M,)"""
    position: Array
    velocity: Array
    attitude: Array
    rate: Array
    """rad/s, in body axes"""
    force: Array
    """m/s^2, in body axes"""
    gravity: Array
    position_by: Array
    """by the states of the node, shape (M, 3, 21)"""
    velocity_by: Array
    turn_by: Array
    """of the rotation vector in body axes"""

    @classmethod
    def at(cls, time: Array, nodes: Nodes, measured: Preintegrated) -> Instants:
        """Return where the trajectory is at instants, s, shape (M,), within the span of the nodes."""
        found = np.searchsorted(measured.time[:, 0], time, "right") - 1
        k = np.clip(found, 0, len(measured.time) - 1).astype(np.intp)
        edges = measured.time[k]
        j = np.clip(np.sum(edges <= time[:, None], axis=1) - 1, 0, edges.shape[1] - 2)
        rows = np.arange(len(time))
        h = (time - edges[rows, j])[:, None]
        part = (h[:, 0] / (edges[rows, j + 1] - edges[rows, j]))[:, None, None]
        since = (time - edges[:, 0])[:, None]
        turned_j, rate, force = measured.turned[k, j], measured.rate[k, j], measured.force[k, j]
        gain = np.einsum("mab,mb->ma", turned_j, force + 0.5 * h * np.cross(rate, force)) * h
        turned = turned_j @ rotation(rate * h)
        velocity = measured.velocity[k, j] + gain
        position = measured.position[k, j] + h * (measured.velocity[k, j] + 0.5 * gain)

        def between(values: Array) -> Array:
            return np.asarray((1.0 - part) * values[k, j] + part * values[k, j + 1])

        start, gravity = nodes.attitude[k], nodes.gravity[k]
        count = len(time)
        position_by, velocity_by, turn_by = (np.zeros((count, 3, STATES)) for _ in range(3))
        position_by[:, :, POSITION] = velocity_by[:, :, VELOCITY] = np.eye(3)
        position_by[:, :, VELOCITY] = since[:, :, None] * np.eye(3)
        position_by[:, :, TURN] = -start @ cross(position)
        position_by[:, :, SLOW] = start @ between(measured.position_by)
        velocity_by[:, :, TURN] = -start @ cross(velocity)
        velocity_by[:, :, SLOW] = start @ between(measured.velocity_by)
        turn_by[:, :, TURN] = turned.mT
        turn_by[:, :, SLOW] = between(measured.turned_by)
        return cls(
            k,
            nodes.position[k] + nodes.velocity[k] * since + 0.5 * gravity * since**2 + _by(start, position),
            nodes.velocity[k] + gravity * since + _by(start, velocity),
            start @ turned,
            rate,
            force,
            gravity,
            position_by,
            velocity_by,
            turn_by,
        )


def _by(matrix: Array, vector: Array) -> Array:
    return np.asarray(np.einsum("mab,mb->ma", matrix, vector))


@dataclass(frozen=True)
class Predicted:
    """What a sensor would show, less than what it does."""

    residual: Array
    """measured less predicted, shape (M, D)"""
    by_states: Array
    """of the predicted, shape (M, D, 21)"""
    by_time: Array
    """per second that the instant is later, shape (M, D)"""
    by_offsets: Array
    """by what is constant in the sensor's error, shape (M, D, C)"""


@dataclass(frozen=True)
class Sightings:
    """One kind of value of one stream."""

    stream: str
    """whose clock stamps them"""
    kind: str
    """position, velocity, heading, attitude or speed"""
    stamps: Array
    """s, shape (M,)"""
    values: Array
    """shape (M, D); attitudes (M, 3, 3)"""
    std: Array
    """shape (M, D)"""
    arm: Array
    """of the point, m, from the IMU, in body axes"""

    @property
    def key(self) -> str:
        """Names it among those of all streams."""
        return f"{self.stream}/{self.kind}"

    @property
    def offset_std(self) -> Array:
        """How little is known beforehand of what is constant in the error, shape (C,)."""
        return np.array(OFFSETS.get(self.kind, ()), dtype=float)

    def at(self, rows: NDArray[Any]) -> Sightings:
        """Return some of them."""
        return replace(self, stamps=self.stamps[rows], values=self.values[rows], std=self.std[rows])

    def predicted(self, at: Instants, offsets: Array) -> Predicted:
        """Return how the values differ from those of a trajectory; `offsets`: of the sensor, shape (C,)."""
        return KINDS[self.kind](self, at, offsets)


def _position(seen: Sightings, at: Instants, offsets: Array) -> Predicted:
    arm = at.attitude @ seen.arm
    moves = np.cross(at.rate, seen.arm)
    by = at.position_by - at.attitude @ cross(seen.arm) @ at.turn_by
    return Predicted(
        seen.values - at.position - arm, by, at.velocity + _by(at.attitude, moves), np.zeros((len(arm), 3, 0))
    )


def _velocity(seen: Sightings, at: Instants, offsets: Array) -> Predicted:
    moves = np.cross(at.rate, seen.arm)
    by = at.velocity_by - at.attitude @ cross(moves) @ at.turn_by
    by[:, :, SLOW] += at.attitude @ _arm_by_errors(at, seen.arm)
    by_time = at.gravity + _by(at.attitude, at.force + np.cross(at.rate, moves))
    return Predicted(
        seen.values - at.velocity - _by(at.attitude, moves), by, by_time, np.zeros((len(seen.stamps), 3, 0))
    )


def _arm_by_errors(at: Instants, arm: Array) -> Array:
    """Return how the velocity of a point about the IMU follows from the IMU's errors, in body axes, (M, 3, 12)."""
    out = np.zeros((len(at.rate), 3, ERRORS))
    out[:, :, GYRO[:3]] = cross(arm)
    out[:, :, GYRO[3:]] = cross(arm) * at.rate[:, None, :]
    return out


def _heading(seen: Sightings, at: Instants, offsets: Array) -> Predicted:
    c = at.attitude
    level = np.hypot(c[:, 0, 0], c[:, 1, 0])
    # the third component of how Euler angles follow a turn about the body's axes
    along = np.stack([np.zeros(len(level)), c[:, 2, 1] / level**2, c[:, 2, 2] / level**2], axis=1)
    off = seen.values[:, 0] - np.arctan2(c[:, 1, 0], c[:, 0, 0]) - offsets[0]
    residual = np.angle(np.exp(1j * off))[:, None]
    by = along[:, None, :] @ at.turn_by
    return Predicted(residual, by, np.sum(along * at.rate, axis=1)[:, None], np.ones((len(off), 1, 1)))


def _attitude(seen: Sightings, at: Instants, offsets: Array) -> Predicted:
    residual = rotation_vector(rotation(offsets).T @ at.attitude.mT @ seen.values)
    return Predicted(residual, at.turn_by, at.rate, np.tile(np.eye(3), (len(residual), 1, 1)))


def _speed(seen: Sightings, at: Instants, offsets: Array) -> Predicted:
    there = _by(at.attitude.mT, at.velocity) + np.cross(at.rate, seen.arm)
    by = at.attitude.mT @ at.velocity_by + cross(_by(at.attitude.mT, at.velocity)) @ at.turn_by
    by[:, :, SLOW] += _arm_by_errors(at, seen.arm)
    by_time = at.force + _by(at.attitude.mT, at.gravity) - np.cross(at.rate, _by(at.attitude.mT, at.velocity))
    scale = 1.0 + offsets[0]
    speed = there[:, :1]
    return Predicted(seen.values - scale * speed, scale * by[:, :1], scale * by_time[:, :1], speed[:, :, None])


KINDS: dict[str, Callable[[Sightings, Instants, Array], Predicted]] = {
    "position": _position,
    "velocity": _velocity,
    "heading": _heading,
    "attitude": _attitude,
    "speed": _speed,
}
OFFSETS = {"heading": (0.5,), "attitude": (0.2, 0.2, 0.5), "speed": (0.05,)}
"""rad; rad; relative"""
