"""How a vehicle rolls at an instant, from the data of its IMUs alone: its speed, and how each of them lies.

What an IMU on a wheel feels turns with the wheel. Turned back by the angle that its gyro counts from the instant on,
the mean over a second is gravity and the vehicle's acceleration, which the wheels' speed and the rate of turn tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.rig import Rig
from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

HALF = 0.5
"""s before and after the instant that are looked at"""


@dataclass(frozen=True)
class RollingMotion:
    """What the wheels and the rates tell."""

    speed: float
    """m/s ahead, of the middle of the axle"""
    acceleration: Array
    """m/s^2 ahead, to the right and down, shape (3,)"""
    forces: Array
    """mean specific force on each IMU as it lies at the instant, in its own axes, m/s^2, shape (N, 3)"""


def rolling_motion(rig: Rig, aligned: Aligned, errors: Array, time: float) -> RollingMotion:
    """Return how a vehicle rolls at a time, s; `errors`: biases of the IMUs come first in them, (N, 12).

    Raises InputError where an IMU has no data around it.
    """
    part = aligned.between(time - HALF, time + HALF)
    lacking = part.missing[1:].any(axis=0)
    if lacking.any():
        name = rig.imus[int(np.argmax(lacking))].name
        raise InputError(f"start: IMU {name} has no data around {time:.3f} s; expected some of every IMU")
    steps = np.diff(part.time)
    values = part.increments[1:].transpose(2, 0, 1) / steps[:, None] - errors[:, None, :6]
    rates, forces = values[:, :, :3], values[:, :, 3:].copy()
    turns, speeds, places = [], [], []
    for i, imu in enumerate(rig.imus):
        if imu.wheel is None:
            turns.append(rates[i, :, 2])
            continue
        forces[i] += np.cross(rates[i], np.cross(rates[i], imu.wheel.lever_arm))
        angle = np.cumsum(rates[i, :, 0] * steps)
        back = np.exp(1j * (angle - 0.5 * rates[i, :, 0] * steps - np.interp(time, part.time[1:], angle)))
        forces[i, :, 1:] = _turned(forces[i, :, 1:], back)
        if not imu.wheel.steering:
            speeds.append(-imu.wheel.radius * rates[i, :, 0])
            places.append(imu.position[1])
            across = _turned(rates[i, :, 1:], back)
            up = forces[i, :, 1:].mean(axis=0)
            turns += [] if _has_body(rig) else [-(across @ up) / np.linalg.norm(up)]
    turn = np.mean(turns, axis=0)
    speed = np.mean(speeds, axis=0) + turn * np.mean(places)
    later = part.time[1:] > time
    ahead = (speed[later].mean() - speed[~later].mean()) / HALF
    acceleration = np.array([ahead, float(np.mean(speed * turn)), 0.0])
    return RollingMotion(float(speed.mean()), acceleration, forces.mean(axis=1))


def _has_body(rig: Rig) -> bool:
    return any(imu.wheel is None for imu in rig.imus)


def _turned(across: Array, back: Complex) -> Array:
    turned = (across[:, 0] + 1j * across[:, 1]) * back
    return np.column_stack([turned.real, turned.imag])
