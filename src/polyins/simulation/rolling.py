"""A wheel that rolls along a path, and the true motion of an IMU that turns with it.

The module's axes: x to the right along the axle, y and z in the wheel. Where the wheel has turned by the angle a,

    C_vb = Rz(90 deg) Rx(a),

so the roll of the module is a and, on level ground, its heading that of the vehicle plus 90 deg. The point that touches
the ground stands still, so forward speed v of the wheel's centre and rate of the module against the Earth go together,

    w_eb . x = -v (1 + slip) / radius,

whatever the vehicle's own pitch rate is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.simulation.path import BodyMotion, Curve, Path

Array = NDArray[np.float64]

ANGLE_STEP = 0.01  # s; the integral of the cubic between such nodes is exact to 1e-10 rad


@dataclass(frozen=True)
class RollingWheel:
    """A wheel on a vehicle whose path is that of the middle of the rear axle."""

    path: Path
    centre: Array
    """of the wheel in v, m, shape (3,)"""
    radius: float
    """m"""
    angle: Curve
    """rad, continuous: the module's roll against the vehicle; it falls where the wheel rolls forward"""
    slip: Curve | None = None
    """by which share the wheel turns more than it rolls"""

    def speed(self, motion: BodyMotion, time: Array) -> Array:
        """Return the forward speed of the wheel's centre in v, m/s, shape (T,); `motion` is the path's at the times."""
        turning = motion.angular_rate - motion.earth_rate
        return np.asarray(self.path.speed(time) + np.cross(turning, self.centre)[:, 0])

    def spin(self, motion: BodyMotion, time: Array) -> Array:
        """Return the rate of the module against the vehicle about x, rad/s, shape (T,)."""
        slip = 0.0 if self.slip is None else self.slip(time)
        turning = motion.angular_rate - motion.earth_rate
        return np.asarray(-self.speed(motion, time) * (1.0 + slip) / self.radius - turning[:, 1])

    def motion(self, time: ArrayLike, lever_arm: ArrayLike = (0.0, 0.0, 0.0)) -> BodyMotion:
        """Return the true motion of an IMU on the wheel, in module axes, at times, shape (T,).

        `lever_arm` leads from the IMU to the wheel's centre, m, module axes, shape (3,).
        """
        at = np.asarray(time, dtype=float)
        vehicle, arm_b = self.path.motion(at), -np.asarray(lever_arm, dtype=float)
        C_vb = axle_axes(self.angle(at))
        earth_rate, rate = to_module(C_vb, vehicle.earth_rate), to_module(C_vb, vehicle.angular_rate)
        rate[:, 0] += self.spin(vehicle, at)
        C_nb = vehicle.C_nb @ C_vb
        arm = vehicle.C_nb @ self.centre + C_nb @ arm_b
        turning = np.cross(vehicle.angular_rate - vehicle.earth_rate, self.centre)
        velocity = vehicle.velocity + _turned(vehicle.C_nb, turning)
        velocity += _turned(C_nb, np.cross(rate - earth_rate, arm_b))
        # local level turns by 1.6e-7 rad per metre: first order is exact
        level = self.path.world.transport_rate(vehicle.position, arm)
        C_nb = C_nb - np.cross(level[:, None, :], C_nb.swapaxes(1, 2)).swapaxes(1, 2)
        return BodyMotion(
            position=vehicle.position + self.path.world.displacement(vehicle.position, arm),
            velocity=velocity - np.cross(level, velocity),
            attitude=_euler_angles(C_nb),
            C_nb=C_nb,
            earth_rate=earth_rate,
            angular_rate=rate,
        )


def roll(
    path: Path, centre: ArrayLike, radius: float, *, phase: float = 0.0, slip: Curve | None = None
) -> RollingWheel:
    """Return the wheel with its centre at a place in v, m, shape (3,), that rolls along a path.

    `radius` is in m; `phase` is the module's roll at the start, rad; `slip` the share by which the wheel turns more
    than it rolls.
    """
    from scipy.interpolate import CubicSpline

    time = np.linspace(0.0, path.duration, int(np.ceil(path.duration / ANGLE_STEP)) + 1)
    wheel = RollingWheel(path, np.asarray(centre, dtype=float), radius, _still, slip)
    angle = CubicSpline(time, wheel.spin(path.motion(time), time)).antiderivative()
    angle.c[-1] += phase
    return RollingWheel(path, wheel.centre, radius, angle, slip)


def axle_axes(angle: Array) -> Array:
    """Return C_vb = Rz(90 deg) Rx(angle), shape (T, 3, 3)."""
    C_vb = np.zeros((angle.size, 3, 3))
    C_vb[:, 1, 0] = 1.0
    C_vb[:, 0, 1], C_vb[:, 0, 2] = -np.cos(angle), np.sin(angle)
    C_vb[:, 2, 1], C_vb[:, 2, 2] = np.sin(angle), np.cos(angle)
    return C_vb


def to_module(C_vb: Array, vector: Array) -> Array:
    """Return vectors of v, shape (T, 3), in module axes."""
    return np.asarray(np.einsum("tji,tj->ti", C_vb, vector))


def _turned(C: Array, vector: Array) -> Array:
    return np.asarray(np.einsum("tij,tj->ti", C, vector))


def _still(time: Array, nu: int = 0) -> Array:
    return np.zeros_like(time)


def _euler_angles(C: Array) -> Array:
    """Return roll, pitch and heading, rad, shape (T, 3), of C_nb, shape (T, 3, 3)."""
    pitch = -np.arcsin(np.clip(C[:, 2, 0], -1.0, 1.0))
    return np.column_stack([np.arctan2(C[:, 2, 1], C[:, 2, 2]), pitch, np.arctan2(C[:, 1, 0], C[:, 0, 0])])
