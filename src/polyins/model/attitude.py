"""Attitudes of a whole trajectory at once: matrices, Euler angles and their variances, angular rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def wrap(angle: Array) -> Array:
    """Return the angle, rad, moved into [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def rotation_matrices(attitude: Array) -> Array:
    """Return C_nb, shape (T, 3, 3), of the quaternions q_nb, scalar first, shape (T, 4)."""
    w, x, y, z = attitude.T
    rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def euler_angles(attitude: Array) -> Array:
    """Return roll, pitch and heading (ZYX), rad, shape (T, 3), of q_nb, shape (T, 4)."""
    w, x, y, z = attitude.T
    roll = np.arctan2(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    pitch = np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))
    heading = np.arctan2(2.0 * (x * y + w * z), w * w + x * x - y * y - z * z)
    return np.column_stack([roll, pitch, heading])


def quaternions(euler: Array) -> Array:
    """Return q_nb, scalar first, shape (T, 4), of roll, pitch and heading (ZYX), rad, shape (T, 3)."""
    cr, cp, cy = np.cos(0.5 * euler).T
    sr, sp, sy = np.sin(0.5 * euler).T
    return np.column_stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def product(first: Array, second: Array) -> Array:
    """Return the quaternions of the second rotations after the first ones, about the axes that these turned to."""
    # by components: np.cross takes several times as long
    w, x, y, z = first.T
    v, a, b, c = second.T
    found = np.empty((len(first), 4))
    found[:, 0] = w * v - (x * a + y * b + z * c)
    found[:, 1] = w * a + v * x + (y * c - z * b)
    found[:, 2] = w * b + v * y + (z * a - x * c)
    found[:, 3] = w * c + v * z + (x * b - y * a)
    return found


def of_rotation_vectors(rotations: Array) -> Array:
    """Return the quaternions, shape (T, 4), of rotation vectors, rad, shape (T, 3)."""
    half = 0.5 * np.linalg.norm(rotations, axis=1, keepdims=True)
    return np.hstack([np.cos(half), 0.5 * np.sinc(half / np.pi) * rotations])


def in_succession(rotations: Array) -> Array:
    """Return the product, shape (4,), of one or more quaternions in their order, shape (T, 4)."""
    while len(rotations) > 1:  # by pairs: Python takes few steps, whatever the number
        even = len(rotations) // 2 * 2
        rotations = np.concatenate([product(rotations[:even:2], rotations[1:even:2]), rotations[even:]])
    return np.asarray(rotations[0])


def euler_jacobian(euler: Array) -> Array:
    """Return d(roll, pitch, heading)/d(phi), shape (T, 3, 3), where C = (I + phi x) C_hat in n.

    A rotation by phi is the sum of rotations about the ZYX sequence's axes; this is the inverse of that sum. It is
    singular at a pitch of +-90 deg, where roll and heading are not told apart.
    """
    _, pitch, heading = euler.T
    cy, sy = np.cos(heading), np.sin(heading)
    zero, one = np.zeros_like(pitch), np.ones_like(pitch)
    rows = [
        [cy / np.cos(pitch), sy / np.cos(pitch), zero],
        [-sy, cy, zero],
        [cy * np.tan(pitch), sy * np.tan(pitch), one],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def euler_variance(euler: Array, phi_covariance: Array) -> Array:
    """Return the variances of roll, pitch and heading, rad^2, shape (T, 3).

    `phi_covariance` holds NN, NE, ND, EE, ED, DD of phi, shape (T, 6).
    """
    full = phi_covariance[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    jacobian = euler_jacobian(euler)
    return np.asarray(np.sum(jacobian @ full * jacobian, axis=2), dtype=float)


def angular_rate(time: Array, attitude: Array) -> Array:
    """Return the rate of b against n, rad/s in b, shape (T, 3), from the differences of q_nb.

    At an epoch it is the mean of the intervals before and after it.
    """
    if len(time) < 2:
        return np.zeros((len(time), 3))
    w, x, y, z = attitude[:-1].T
    conjugate = np.array([[w, x, y, z], [-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
    step = np.einsum("ijt,tj->ti", conjugate, attitude[1:])
    step *= np.where(step[:, :1] < 0.0, -1.0, 1.0)  # the shorter way round
    half_sine = np.linalg.norm(step[:, 1:], axis=1)
    turning = half_sine > 1e-12
    ratio = np.full_like(half_sine, 2.0)
    np.divide(2.0 * np.arctan2(half_sine, step[:, 0]), half_sine, out=ratio, where=turning)
    rate = ratio[:, None] * step[:, 1:] / np.diff(time)[:, None]
    return np.asarray(0.5 * (np.vstack([rate[:1], rate]) + np.vstack([rate, rate[-1:]])), dtype=float)
