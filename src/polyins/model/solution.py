"""What comes out of a run: merged states with their standard deviations, IMU errors, innovations."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import Vector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Innovations:
    """One row per GNSS fix that the filter was shown (fixes inside outages are not)."""

    time: Array
    """s, shape (M,)"""
    residual: Array
    """predicted minus measured position, m north, east, down, shape (M, 3)"""
    std: Array
    """predicted standard deviation of the residual, m, shape (M, 3)"""
    nis: Array
    """normalized innovation squared, three degrees of freedom, shape (M,)"""
    accepted: NDArray[np.bool_]
    """False where the gate rejected the fix, shape (M,)"""
    reopened: NDArray[np.bool_]
    """True where a fix was believed because it followed a run of rejections, shape (M,)"""
    velocity_rejected: NDArray[np.bool_]
    """True where the position was accepted and the velocity of the same fix was not, shape (M,)"""


@dataclass(frozen=True)
class Solution:
    """The trajectory of one method over one recording, one row per IMU epoch."""

    method: str
    geodetic: bool
    time: Array
    """s, shape (T,)"""
    position: Array
    """(latitude rad, longitude rad, height m), or (north m, east m, height m) on a local plane, shape (T, 3)"""
    velocity: Array
    """m/s north, east, down, shape (T, 3)"""
    attitude: Array
    """q_nb, scalar first, shape (T, 4)"""
    position_variance: Array
    """m^2 north, east, down, shape (T, 3)"""
    velocity_variance: Array
    """m^2/s^2, shape (T, 3)"""
    phi_covariance: Array
    """rad^2: NN, NE, ND, EE, ED, DD of the attitude error phi, shape (T, 6)"""
    point: Vector
    """the point that the solution describes, m, in the array frame"""
    imus: int
    """how many IMUs it is made from"""
    imu_names: tuple[str, ...]
    """of the navigators; a virtual IMU is one"""
    imu_error_time: Array
    """s, shape (K,)"""
    imu_errors: Array
    """gyro bias rad/s, accelerometer bias m/s^2, gyro scale, accelerometer scale; shape (K, N, 12)"""
    imu_error_std: Array
    """shape (K, N, 12)"""
    innovations: Innovations
    mounting: Array | None = None
    """with wheels: estimated relative error of the wheel speed, and of a wheel's lever arm y and z (m) or of a body's
    mount pitch and yaw (rad), shape (K, N, 3)"""
    mounting_std: Array | None = None
    """shape (K, N, 3); zero where it is not estimated"""
    faults: tuple[str, ...] = ()
    """IMUs that fell silent, in words"""
    start: dict[str, object] = field(default_factory=dict)
    """how the start was found: time, position, velocity, roll and pitch, heading, gyro bias"""
    filter_s: float = 0.0
    """CPU time inside the compiled loop"""
    first_call_s: float = 0.0
    """time spent on compiling or loading the kernels"""
    warnings: tuple[str, ...] = ()
