"""From error-free increments to what a real IMU puts out.

In the order of the sensor's physics: the triads are misaligned, then scale, bias and noise come on top,

    measured = (1 + scale) turned(true) + bias dt + noise,

so that (measured - bias dt) / (1 + scale) takes them off again. Biases and scale factors are the sum of a constant,
drawn at turn-on, and a first-order Gauss-Markov drift.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.rig import ImuErrors, NoiseGrade, Vector

Array = NDArray[np.float64]

DRIFT_STEP = 1.0  # s, at most, between the nodes of the drift; it is linear in between
DRIFT_STEPS_PER_CORRELATION_TIME = 50


@dataclass(frozen=True)
class Imperfections:
    """What an IMU's errors are made of, beyond the statistics of its noise grade."""

    turn_on_share: float = 0.0
    """share of the variance of each bias and scale factor that is constant; 0: all drifts, as the filter assumes"""
    misalignment_std: float = 0.0
    """rad: rotation of the gyro triad, and another of the accelerometer triad, about each axis"""
    noise: bool = True
    biases: bool = True
    scales: bool = True

    def limit(self, grade: NoiseGrade) -> NoiseGrade:
        """Return the grade with zeros for the errors that are switched off."""
        return replace(
            grade,
            angle_random_walk=grade.angle_random_walk * self.noise,
            velocity_random_walk=grade.velocity_random_walk * self.noise,
            gyro_bias_std=grade.gyro_bias_std * self.biases,
            accel_bias_std=grade.accel_bias_std * self.biases,
            gyro_scale_std=grade.gyro_scale_std * self.scales,
            accel_scale_std=grade.accel_scale_std * self.scales,
        )


@dataclass(frozen=True)
class TrueErrors:
    """The errors that one IMU was given."""

    time: Array
    """s, shape (K,): nodes; the errors are linear in between"""
    series: Array
    """gyro bias rad/s, accelerometer bias m/s^2, gyro scale, accelerometer scale, sensor axes, shape (K, 12)"""
    gyro_misalignment: Vector
    """rad: rotation vector from the nominal axes to those of the gyro triad"""
    accel_misalignment: Vector
    """rad, likewise"""

    def at(self, time: Array) -> Array:
        """Return the twelve errors in sensor axes at times, shape (T, 12)."""
        return np.array([np.interp(time, self.time, column) for column in self.series.T]).T

    def in_array_axes(self, time: Array, rotation: Array) -> Array:
        """Return the twelve errors as a filter in array axes sees them, shape (T, 12).

        `rotation` is C_ab, shape (3, 3). Exact for mounts that permute axes; else the scales' cross terms are left out.
        """
        gyro_bias, accel_bias, gyro_scale, accel_scale = np.split(self.at(time), 4, axis=1)
        biases = [bias @ rotation.T for bias in (gyro_bias, accel_bias)]
        return np.hstack([*biases, *(scale @ rotation.T**2 for scale in (gyro_scale, accel_scale))])

    def start(self, rotation: Array) -> ImuErrors:
        """Return the errors at the first node in array axes."""
        return ImuErrors(*np.split(self.in_array_axes(self.time[:1], rotation)[0], 4))


def draw_errors(
    duration: float, grade: NoiseGrade, imperfections: Imperfections, rng: np.random.Generator
) -> TrueErrors:
    """Draw the slow errors of one IMU over a duration, s, from the statistics of its grade."""
    limited = imperfections.limit(grade)
    std = np.concatenate(
        [limited.gyro_bias_std, limited.accel_bias_std, limited.gyro_scale_std, limited.accel_scale_std]
    )
    share = imperfections.turn_on_share
    gyro_misalignment, accel_misalignment = rng.normal(0.0, imperfections.misalignment_std, (2, 3))
    constant = np.sqrt(share) * std * rng.standard_normal(12)
    step = min(DRIFT_STEP, grade.correlation_time / DRIFT_STEPS_PER_CORRELATION_TIME)
    time = np.arange(np.ceil(duration / step) + 1.0) * step
    drift = np.sqrt(1.0 - share) * std * gauss_markov(time.size, step / grade.correlation_time, rng)
    return TrueErrors(time, constant + drift, gyro_misalignment, accel_misalignment)


def gauss_markov(count: int, step: float, rng: np.random.Generator) -> Array:
    """Return twelve stationary first-order Gauss-Markov sequences of unit variance, shape (count, 12).

    `step` is the time between values over the correlation time.
    """
    from scipy.signal import lfilter

    white = rng.standard_normal((count, 12))
    white[1:] *= np.sqrt(-np.expm1(-2.0 * step))
    return np.asarray(lfilter([1.0], [1.0, -np.exp(-step)], white, axis=0))


def corrupt(
    time: Array,
    dtheta: Array,
    dvel: Array,
    errors: TrueErrors,
    white: NoiseGrade,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Return the increments, shape (T, 3) each, in sensor axes, with the errors and with white noise of a grade.

    `time` is that of the ends of the intervals, s, shape (T,), evenly spaced.
    """
    interval = float(time[1] - time[0])
    gyro_bias, accel_bias, gyro_scale, accel_scale = np.split(errors.at(time - interval / 2.0), 4, axis=1)
    gyro_noise, accel_noise = np.sqrt(interval) * rng.standard_normal((2, *dtheta.shape))
    turned_dtheta = dtheta @ _rotation(errors.gyro_misalignment)
    turned_dvel = dvel @ _rotation(errors.accel_misalignment)
    return (
        (1.0 + gyro_scale) * turned_dtheta + gyro_bias * interval + gyro_noise * white.angle_random_walk,
        (1.0 + accel_scale) * turned_dvel + accel_bias * interval + accel_noise * white.velocity_random_walk,
    )


def _rotation(vector: Vector) -> Array:
    """Return the matrix of a rotation vector; row vectors times it are in the turned axes."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector).as_matrix())
