"""A robot's body on four tyres: springs and dampers between the ground under each wheel and a corner of the body.

A tyre under wheel i is a spring and a damper between the ground g_i and the body's corner
h_i = z + x_i pitch - y_i roll (heights upwards, y to the right). At rest it is pressed in by d_0. With
d_i = d_0 + g_i - h_i its force over the body's mass is

    f_i = k d_i + c d_i',

and the body obeys z'' = sum f_i - g, and likewise pitch and roll; k, c and the moments of inertia follow from the
natural frequencies. These are three oscillators whose feet are the plane that fits the ground under the wheels best.

Tyres that only push have f_i = max(0, k d_i + c d_i') on the ground, d_i > 0, and none above it: a wheel that the
ground lets go falls with the body, no faster than gravity has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polyins.kernels.jit import kernel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Suspension:
    """Four wheels and the tyres between the ground and the body."""

    wheelbase: float
    """m"""
    track: float
    """m"""
    centre: Array
    """between the wheels, in the array frame, m, shape (3,)"""
    rates: Array
    """natural frequencies of heave, pitch, roll, rad/s, shape (3,)"""
    damping: float
    """ratio, of the heave; of the others it grows with their frequency, as the tyres are the same"""
    only_push: bool = False
    """a wheel may leave the ground"""

    def arms(self) -> Array:
        """Return by how much each mode lifts each corner, front left, right, rear left, right, shape (3, 4)."""
        x, y = self.wheelbase / 2.0, self.track / 2.0
        return np.array([[1.0, 1.0, 1.0, 1.0], [x, x, -x, -x], [y, -y, y, -y]])


class _Robot(NamedTuple):
    """A body on its tyres, as the equations of motion have it."""

    arms: Array
    """as in `Suspension.arms`"""
    acting: Array
    """what the force of each tyre over the body's mass does to each mode, shape (3, 4)"""
    tyre: Array
    """stiffness, 1/s^2, and drag, 1/s, of a tyre over the body's mass; how far it is pressed in at rest, m; gravity,
    m/s^2"""
    least: float
    """smallest force of a tyre over the body's mass, m/s^2"""


class _Footing(NamedTuple):
    """The ground under the wheels within a step."""

    before: Array
    """heights at its beginning, m, shape (4,)"""
    after: Array
    """and at its end"""
    ahead: float
    """the part of the step that is over"""
    step: float
    """s"""


def bounce(ground: Array, step: float, suspension: Suspension, gravity: float) -> tuple[Array, Array]:
    """Return heave upwards, m, pitch and roll, rad, shape (T, 3), and their derivatives over rough ground.

    `ground` has the heights under the four wheels, m, every `step` s, shape (T, 4), as in `Suspension.arms`; between
    them they change evenly. At the first instant all is at rest. Runge and Kutta's fourth order.
    """
    arms = suspension.arms()
    # equal tyres: of each mode the sum of squared arms, over its inertia, makes its natural frequency
    acting = (suspension.rates**2 / (arms**2).sum(axis=1))[:, None] * arms / suspension.rates[0] ** 2
    stiffness, drag = suspension.rates[0] ** 2, 2.0 * suspension.damping * suspension.rates[0]
    least = 0.0 if suspension.only_push else -np.inf
    robot = _Robot(arms, acting, np.array([stiffness, drag, gravity / stiffness, gravity]), least)
    motion, change = np.zeros((len(ground), 3)), np.zeros((len(ground), 3))
    motion[0] = arms @ ground[0] / (arms**2).sum(axis=1)
    _bounce(np.ascontiguousarray(ground), step, robot, np.empty(30), motion, change)
    return motion, change


@kernel
def _bounce(ground: Array, step: float, robot: _Robot, scratch: Array, motion: Array, change: Array) -> None:
    """Fill motion and change from their first row."""
    slopes, place, speed = scratch[:24].reshape(4, 6), scratch[24:27], scratch[27:30]
    for k in range(1, len(ground)):
        for stage in range(4):
            ahead = (0.0, 0.5, 0.5, 1.0)[stage]
            for i in range(3):
                before = max(stage - 1, 0)
                place[i] = motion[k - 1, i] + ahead * step * slopes[before, i] if stage else motion[k - 1, i]
                speed[i] = change[k - 1, i] + ahead * step * slopes[before, 3 + i] if stage else change[k - 1, i]
            _accelerate(_Footing(ground[k - 1], ground[k], ahead, step), robot, place, speed, slopes[stage])
        for i in range(3):
            motion[k, i] = motion[k - 1, i] + step * _mean(slopes, i)
            change[k, i] = change[k - 1, i] + step * _mean(slopes, 3 + i)


@kernel
def _mean(slopes: Array, i: int) -> float:
    """Return the mean slope of the step."""
    return float(slopes[0, i] + 2.0 * (slopes[1, i] + slopes[2, i]) + slopes[3, i]) / 6.0


@kernel
def _accelerate(footing: _Footing, robot: _Robot, place: Array, speed: Array, slope: Array) -> None:
    """Write the derivatives of place and speed."""
    before, after, ahead, step = footing
    for i in range(3):
        slope[i], slope[3 + i] = speed[i], 0.0
    slope[3] = -robot.tyre[3]
    for wheel in range(4):
        pressed = robot.tyre[2] + before[wheel] + ahead * (after[wheel] - before[wheel])
        pressing = (after[wheel] - before[wheel]) / step
        for i in range(3):
            pressed -= robot.arms[i, wheel] * place[i]
            pressing -= robot.arms[i, wheel] * speed[i]
        if pressed > robot.least:
            force = max(robot.least, robot.tyre[0] * pressed + robot.tyre[1] * pressing)
            for i in range(3):
                slope[3 + i] += robot.acting[i, wheel] * force
