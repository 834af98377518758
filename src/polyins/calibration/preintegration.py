"""What an IMU measured between nodes of a trajectory, before anything is known of where it was.

From one node to the next the increments give a rotation, a velocity and a position in the axes of the first one, and
how these follow the twelve slow errors of the IMU (Forster and others, IEEE T-RO 33(1), 2017, whose bias terms are
here those of scale factors too). An error e makes of an increment x the increment x - (bias x interval + scale x).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polyins.model.recording import Array

ERRORS = 12
"""gyro bias, accelerometer bias, gyro scale, accelerometer scale"""
GYRO = np.array([0, 1, 2, 6, 7, 8])
ACCEL = np.array([3, 4, 5, 9, 10, 11])


def cross(vector: Array) -> Array:
    """Return the matrices of vector products, (..., 3) to (..., 3, 3)."""
    out = np.zeros((*vector.shape, 3))
    x, y, z = np.moveaxis(vector, -1, 0)
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out


def rotation(vector: Array) -> Array:
    """Return the matrices of rotation vectors, rad, (..., 3) to (..., 3, 3)."""
    square = np.sum(vector**2, axis=-1)[..., None, None]
    angle = np.sqrt(square)
    k = cross(vector)
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (k @ k))


def rotation_vector(matrix: Array) -> Array:
    """Return the rotation vectors, rad, of matrices, (..., 3, 3) to (..., 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_rotvec().reshape(matrix.shape[:-1]))


@dataclass(frozen=True)
class Increments:
    """Increments of one IMU in segments of as many epochs each."""

    time: Array
    """s, shape (K, m + 1): the node before, and the epochs up to the next node"""
    dtheta: Array
    """rad, shape (K, m, 3), coning compensated"""
    dvel: Array
    """m/s, shape (K, m, 3), sculling compensated"""

    @classmethod
    def of(cls, time: Array, increments: Array, length: int) -> Increments:
        """Cut increments, (T, 6) at (T,), into segments of `length` epochs; the first one is the first node."""
        before = np.vstack([increments[:1], increments[:-1]])
        dtheta = increments[:, :3] + np.cross(before[:, :3], increments[:, :3]) / 12.0
        turned = np.cross(before[:, :3], increments[:, 3:]) + np.cross(before[:, 3:], increments[:, :3])
        dvel = increments[:, 3:] + turned / 12.0
        count = (len(time) - 1) // length
        used = slice(1, 1 + count * length)
        edges = np.column_stack([time[: count * length : length], time[used].reshape(count, length)])
        return cls(edges, dtheta[used].reshape(count, length, 3), dvel[used].reshape(count, length, 3))

    @property
    def nodes(self) -> Array:
        """When they are, s, shape (K + 1,)."""
        return np.append(self.time[:, 0], self.time[-1, -1])

    def preintegrated(self, errors: Array) -> Preintegrated:
        """Return what they add up to with these errors, shape (K, 12)."""
        count, length, _ = self.dtheta.shape
        out = Preintegrated.empty(self.time, count, length)
        for j in range(length):
            out.step(j, self.dtheta[:, j], self.dvel[:, j], errors)
        return out


@dataclass(frozen=True)
class Preintegrated:
    """Rotation, velocity, position since the node before, after each epoch, and their derivatives by the errors."""

    time: Array
    """s, shape (K, m + 1)"""
    turned: Array
    """shape (K, m + 1, 3, 3): maps vectors from the axes then to those at the node"""
    velocity: Array
    """m/s, shape (K, m + 1, 3)"""
    position: Array
    """m, shape (K, m + 1, 3)"""
    turned_by: Array
    """of the rotation vector in the axes then, shape (K, m + 1, 3, 12)"""
    velocity_by: Array
    position_by: Array
    rate: Array
    """rad/s in the interval after, shape (K, m + 1, 3)"""
    force: Array
    """m/s^2"""

    @classmethod
    def empty(cls, time: Array, count: int, length: int) -> Preintegrated:
        """Return what has not begun."""
        vectors = [np.zeros((count, length + 1, 3)) for _ in range(4)]
        by = [np.zeros((count, length + 1, 3, ERRORS)) for _ in range(3)]
        turned = np.tile(np.eye(3), (count, length + 1, 1, 1))
        return cls(time, turned, vectors[0], vectors[1], by[0], by[1], by[2], vectors[2], vectors[3])

    def step(self, j: int, dtheta: Array, dvel: Array, errors: Array) -> None:
        """Take the increments of epoch j + 1 of all segments, shape (K, 3) each, less their errors, (K, 12)."""
        h = (self.time[:, j + 1] - self.time[:, j])[:, None]
        by_gyro = _by_errors(h, dtheta)
        by_accel = _by_errors(h, dvel)
        true_dtheta = dtheta - np.einsum("kae,ke->ka", by_gyro, errors[:, GYRO])
        true_dvel = dvel - np.einsum("kae,ke->ka", by_accel, errors[:, ACCEL])
        turned = self.turned[:, j]
        change = rotation(true_dtheta)
        middle = true_dvel + 0.5 * np.cross(true_dtheta, true_dvel)
        gain = np.einsum("kab,kb->ka", turned, middle)
        gain_by = -turned @ cross(middle) @ self.turned_by[:, j]
        gain_by[:, :, ACCEL] -= turned @ (np.eye(3) + 0.5 * cross(true_dtheta)) @ by_accel
        gain_by[:, :, GYRO] += 0.5 * turned @ cross(true_dvel) @ by_gyro
        self.turned[:, j + 1] = turned @ change
        self.position[:, j + 1] = self.position[:, j] + h * (self.velocity[:, j] + 0.5 * gain)
        self.velocity[:, j + 1] = self.velocity[:, j] + gain
        self.position_by[:, j + 1] = self.position_by[:, j] + h[:, :, None] * (self.velocity_by[:, j] + 0.5 * gain_by)
        self.velocity_by[:, j + 1] = self.velocity_by[:, j] + gain_by
        self.turned_by[:, j + 1] = change.mT @ self.turned_by[:, j]
        self.turned_by[:, j + 1][:, :, GYRO] -= (np.eye(3) - 0.5 * cross(true_dtheta)) @ by_gyro
        self.rate[:, j], self.force[:, j] = true_dtheta / h, true_dvel / h
        self.rate[:, j + 1], self.force[:, j + 1] = self.rate[:, j], self.force[:, j]


def _by_errors(interval: Array, increment: Array) -> Array:
    """Return the derivative of an increment by bias and scale, shape (K, 3, 6)."""
    out = np.zeros((len(increment), 3, 6))
    for axis in range(3):
        out[:, axis, axis] = interval[:, 0]
        out[:, axis, 3 + axis] = increment[:, axis]
    return out
