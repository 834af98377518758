"""What error-free IMUs anywhere on the body put out along a path.

An integrating sensor gives the integrals of w_ib^b and of the specific force f^b, taken in its own turning frame, over
each interval. At a point l of the rigid body

    f(l) = f(0) + (w x)(w x l) + dw/dt x l - C_bn (G + (w_ie x)(w_ie x)) C_nb l,    w = w_ib^b,

where G is the gradient of gravity (centrifugal part included, which the last term takes out again). It is linear in l,
so one integrated matrix per interval serves all IMUs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.simulation.path import Path

Array = NDArray[np.float64]

GAUSS_NODES = 3
BLOCK = 20_000  # intervals worked on at once: keeps the 3 x 3 matrices in the cache


@dataclass(frozen=True)
class Increments:
    """Error-free increments of the body, each over the interval that ends at its time stamp."""

    time: Array
    """s, shape (T,)"""
    interval: float
    """s"""
    dtheta: Array
    """rad, array axes, shape (T, 3)"""
    dvel: Array
    """m/s at the array origin, array axes, shape (T, 3)"""
    lever: Array
    """1/s, shape (T, 3, 3): lever @ l is what a lever arm l, m, adds to dvel"""

    def at(self, position: ArrayLike, rotation: ArrayLike | None = None) -> tuple[Array, Array]:
        """Return (dtheta, dvel), shape (T, 3) each, of an IMU in its own axes.

        `position` is its place in the array frame, m, shape (3,); `rotation` is C_ab, shape (3, 3), from the IMU's
        axes to the array's (None: the same axes).
        """
        arm = np.asarray(position, dtype=float)
        dvel = self.dvel + np.einsum("tij,j->ti", self.lever, arm)
        if rotation is None:
            return self.dtheta.copy(), dvel
        C_ab = np.asarray(rotation, dtype=float)
        return np.einsum("tj,ji->ti", self.dtheta, C_ab), np.einsum("tj,ji->ti", dvel, C_ab)


def stamps(path: Path, rate_hz: float) -> Array:
    """Return the ends of the intervals along a path, s, shape (T,)."""
    return np.arange(1.0, np.floor(path.duration * rate_hz + 1e-6) + 1.0) / rate_hz


def increments(path: Path, rate_hz: float = 200.0) -> Increments:
    """Return the error-free increments along a path; the first interval starts at time 0."""
    interval = 1.0 / rate_hz
    edges = np.append(0.0, stamps(path, rate_hz))
    count = edges.size - 1
    dtheta, dvel, lever = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3, 3))
    for first in range(0, count, BLOCK):
        part = slice(first, min(first + BLOCK, count))
        dtheta[part], dvel[part], lever[part] = _integrate(path, edges[part.start : part.stop + 1], interval)
    return Increments(edges[1:], interval, dtheta, dvel, lever)


def _integrate(path: Path, edges: Array, interval: float) -> tuple[Array, Array, Array]:
    """Return the integrals of w, f and the lever-arm matrix between the edges, by Gauss-Legendre quadrature."""
    dtheta, dvel = np.zeros((edges.size - 1, 3)), np.zeros((edges.size - 1, 3))
    # the integral of dw/dt needs no derivative
    lever = cross_matrix(np.diff(path.motion(edges).angular_rate, axis=0))
    for node, weight in zip(*np.polynomial.legendre.leggauss(GAUSS_NODES), strict=True):
        rate, force, arm = rates(path, edges[:-1] + interval * (1.0 + node) / 2.0)
        dtheta += rate * (weight * interval / 2.0)
        dvel += force * (weight * interval / 2.0)
        lever += arm * (weight * interval / 2.0)
    return dtheta, dvel, lever


def rates(path: Path, time: Array) -> tuple[Array, Array, Array]:
    """Return w_ib^b, f^b at the origin, and the lever-arm matrix without its dw/dt, at times."""
    motion = path.motion(time)
    speed, side = path.body_velocity(time)[:, :2].T
    # dv/dt in b is the change of v along b's axes + w_nb x v; with Coriolis (2 w_ie + w_en) x v the rates add up to
    # w_ib + w_ie
    turning = motion.angular_rate + motion.earth_rate
    force = path.body_velocity(time, 1) - path.world.gravity(motion.position)[:, None] * motion.C_nb[:, 2, :]
    force[:, 0] -= turning[:, 2] * side
    force[:, 1] += turning[:, 2] * speed
    force[:, 2] += turning[:, 0] * side - turning[:, 1] * speed
    gradient = np.swapaxes(motion.C_nb, 1, 2) @ path.world.gravity_gradient(motion.position) @ motion.C_nb
    arm = double_cross_matrix(motion.angular_rate) - double_cross_matrix(motion.earth_rate) - gradient
    return motion.angular_rate, force, arm


def cross_matrix(vector: Array) -> Array:
    """Return [v x], shape (T, 3, 3)."""
    matrix = np.zeros((vector.shape[0], 3, 3))
    matrix[:, 2, 1], matrix[:, 0, 2], matrix[:, 1, 0] = vector.T
    return matrix - np.swapaxes(matrix, 1, 2)


def double_cross_matrix(vector: Array) -> Array:
    """Return [v x][v x] = v v' - v'v I, shape (T, 3, 3)."""
    square = np.sum(vector**2, axis=1)[:, None, None]
    return np.asarray(vector[:, :, None] * vector[:, None, :] - square * np.eye(3))
