"""From error-free increments to what a real IMU puts out.

In the order of the sensor's physics: samples are taken a little early or late, the triads are turned and not quite
square, force acts on what should not feel it, then scale, bias and noise come on top, and all is rounded,

    measured = (1 + scale) (turned(true) + force response) + bias dt + noise,

so that (measured - bias dt) / (1 + scale) takes bias and scale off again. Biases and scale factors are the sum of a
constant, drawn at turn-on, and a first-order Gauss-Markov drift; biases may walk besides.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import ImuErrors, NoiseGrade, Vector
from polyins.simulation.force_response import ForceResponse, draw_force_response
from polyins.simulation.sampling import jittered, rounded
from polyins.simulation.shared_noise import SharedNoise, blend
from polyins.simulation.triads import Chip, product, skewed, turned

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
    gyro_turn_on_std: float = 0.0
    """rad/s: of a constant bias besides"""
    accel_turn_on_std: float = 0.0
    """m/s^2"""
    chip_rotation_std: float = 0.0
    """rad: rotation of the chip, both triads alike, about each axis"""
    gyro_skew_std: float = 0.0
    """rad, by which each two gyro axes are not square"""
    accel_skew_std: float = 0.0
    """rad"""
    gyro_random_walk: float = 0.0
    """of the gyro biases, rad/s/sqrt(s)"""
    accel_random_walk: float = 0.0
    """of the accelerometer biases, m/s^2/sqrt(s)"""
    g_sensitivity_std: float = 0.0
    """of each of nine elements, rad/s per m/s^2"""
    rectification_mean: float = 0.0
    """m/s^2 per (m/s^2)^2, of all chips and axes"""
    rectification_std: float = 0.0
    """about the mean, of each axis of each chip"""
    jitter_std: float = 0.0
    """s"""
    gyro_lsb: float = 0.0
    """rad/s; 0: none"""
    accel_lsb: float = 0.0
    """m/s^2; 0: none"""
    chips: tuple[Chip, ...] = ()
    """calibrations that are not made up for, one for each IMU in turn"""

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
    gyro_response: Array = field(default_factory=lambda: np.eye(3))
    """besides: what maps the true rate to the triad's axes, shape (3, 3)"""
    accel_response: Array = field(default_factory=lambda: np.eye(3))
    """likewise"""
    force_response: ForceResponse = field(default_factory=ForceResponse)

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
    duration: float,
    grade: NoiseGrade,
    imperfections: Imperfections,
    rng: np.random.Generator,
    *,
    shared: SharedNoise | None = None,
    number: int = 0,
) -> TrueErrors:
    """Draw the slow errors of one IMU over a duration, s, from the statistics of its grade.

    `shared` is what it has in common with its board; `number` counts the IMUs from 0, for their calibrations.
    """
    limited = imperfections.limit(grade)
    std = np.concatenate(
        [limited.gyro_bias_std, limited.accel_bias_std, limited.gyro_scale_std, limited.accel_scale_std]
    )
    share = imperfections.turn_on_share
    gyro_misalignment, accel_misalignment = rng.normal(0.0, imperfections.misalignment_std, (2, 3))
    constant = np.sqrt(share) * std * rng.standard_normal(12)
    step = min(DRIFT_STEP, grade.correlation_time / DRIFT_STEPS_PER_CORRELATION_TIME)
    time = np.arange(np.ceil(duration / step) + 1.0) * step
    drift = gauss_markov(time.size, step / grade.correlation_time, rng)
    # what follows draws from generators of its own, so that the other errors stay the same without it
    walk_rng, chip_rng = rng.spawn(2)
    walk = _random_walk(time.size, step, imperfections, walk_rng)
    if shared is not None and shared.drift_share > 0.0:
        same = gauss_markov(time.size, step / grade.correlation_time, shared.generator(0))
        drift = blend(drift, same, shared.drift_share)
        same_walk = _random_walk(time.size, step, imperfections, shared.generator(1))
        walk = blend(walk, same_walk, shared.drift_share)
    series = constant + np.sqrt(1.0 - share) * std * drift
    series[:, :6] += walk
    drawn = TrueErrors(time, series, gyro_misalignment, accel_misalignment)
    return _with_chip(drawn, imperfections, chip_rng, number)


def _random_walk(count: int, step: float, imperfections: Imperfections, rng: np.random.Generator) -> Array:
    """Return the walks of the six biases from 0, shape (count, 6)."""
    density = np.repeat([imperfections.gyro_random_walk, imperfections.accel_random_walk], 3)
    steps = np.sqrt(step) * density * rng.standard_normal((count, 6))
    steps[0] = 0.0
    return np.cumsum(steps, axis=0)


def _with_chip(drawn: TrueErrors, imperfections: Imperfections, rng: np.random.Generator, number: int) -> TrueErrors:
    """Return the errors with those of the chip: its triads, its calibration, its response to force."""
    chip_turn = turned(imperfections.chip_rotation_std * rng.standard_normal(3))
    gyro_skew, accel_skew = rng.standard_normal((2, 3))
    gyro_response = skewed(imperfections.gyro_skew_std * gyro_skew) @ chip_turn
    accel_response = skewed(imperfections.accel_skew_std * accel_skew) @ chip_turn
    force = draw_force_response(
        imperfections.g_sensitivity_std, imperfections.rectification_mean, imperfections.rectification_std, rng
    )
    turn_on = np.repeat([imperfections.gyro_turn_on_std, imperfections.accel_turn_on_std, 0.0, 0.0], 3)
    series = drawn.series + turn_on * rng.standard_normal(12)
    if imperfections.chips:
        chip = imperfections.chips[number % len(imperfections.chips)]
        gyro_response, accel_response = chip.gyro.response @ gyro_response, chip.accel.response @ accel_response
        series = series + np.concatenate([chip.gyro.bias, chip.accel.bias, np.zeros(6)])
    return replace(
        drawn, series=series, gyro_response=gyro_response, accel_response=accel_response, force_response=force
    )


def gauss_markov(count: int, step: float, rng: np.random.Generator) -> Array:
    """Return twelve stationary first-order Gauss-Markov sequences of unit variance, shape (count, 12).

    `step` is the time between values over the correlation time.
    """
    from scipy.signal import lfilter

    white = rng.standard_normal((count, 12))
    white[1:] *= np.sqrt(-np.expm1(-2.0 * step))
    return np.asarray(lfilter([1.0], [1.0, -np.exp(-step)], white, axis=0))


class TrueIncrements(NamedTuple):
    """What an error-free IMU puts out along its own axes."""

    time: Array
    """s, of the ends of the intervals, evenly spaced, shape (T,)"""
    dtheta: Array
    """rad, shape (T, 3)"""
    dvel: Array
    """m/s, shape (T, 3)"""
    vibration: Array | None = None
    """its mean square along each axis, which the increments do not show, (m/s^2)^2, shape (T,); None: there is none"""


def corrupt(
    true: TrueIncrements,
    errors: TrueErrors,
    white: NoiseGrade,
    rng: np.random.Generator,
    *,
    imperfections: Imperfections | None = None,
    shared: SharedNoise | None = None,
) -> tuple[Array, Array]:
    """Return the increments, shape (T, 3) each, in sensor axes, with the errors and with white noise of a grade.

    `imperfections` say how samples are taken; `shared` is what the IMU has in common with its board.
    """
    time, dtheta, dvel, vibration = true
    interval = float(time[1] - time[0])
    imperfections = imperfections or Imperfections()
    gyro_bias, accel_bias, gyro_scale, accel_scale = np.split(errors.at(time - interval / 2.0), 4, axis=1)
    noise = rng.standard_normal((2, *dtheta.shape))
    if shared is not None and shared.white_share > 0.0:
        noise = blend(noise, shared.generator(2).standard_normal(noise.shape), shared.white_share)
    gyro_noise, accel_noise = np.sqrt(interval) * noise
    if imperfections.jitter_std > 0.0:
        jitter = imperfections.jitter_std * rng.spawn(1)[0].standard_normal(time.size)
        dtheta, dvel = jittered(dtheta, jitter, interval), jittered(dvel, jitter, interval)
    turned_dtheta, turned_dvel = _felt(dtheta, dvel, errors, vibration, interval)
    return (
        rounded(
            (1.0 + gyro_scale) * turned_dtheta + gyro_bias * interval + gyro_noise * white.angle_random_walk,
            imperfections.gyro_lsb,
            interval,
        ),
        rounded(
            (1.0 + accel_scale) * turned_dvel + accel_bias * interval + accel_noise * white.velocity_random_walk,
            imperfections.accel_lsb,
            interval,
        ),
    )


def _felt(
    dtheta: Array, dvel: Array, errors: TrueErrors, vibration: Array | None, interval: float
) -> tuple[Array, Array]:
    """Return the increments along the axes of the triads, with what force does to them."""
    felt_dtheta = product(errors.gyro_response @ turned(errors.gyro_misalignment), dtheta)
    felt_dvel = product(errors.accel_response @ turned(errors.accel_misalignment), dvel)
    response = errors.force_response
    if np.any(response.g_sensitivity):
        felt_dtheta = felt_dtheta + response.gyro(felt_dvel)
    if np.any(response.rectification):
        still = np.zeros(len(dvel)) if vibration is None else vibration
        felt_dvel = felt_dvel + response.accel(felt_dvel, still, interval)
    return felt_dtheta, felt_dvel
