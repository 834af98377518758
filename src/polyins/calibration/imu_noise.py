"""All noise figures of one IMU, and what a configuration is told of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.allan import AllanCurve, curve
from polyins.calibration.gauss_markov import CORRELATION_TIME_S, drift_std
from polyins.calibration.noise_model import Coefficient, RateNoise, fit
from polyins.calibration.rest import Rest, at_rest
from polyins.config import NOISE_GRADES
from polyins.errors import InputError
from polyins.model.recording import ImuStream
from polyins.model.rig import DEG, HOUR, MGAL

Array = NDArray[np.float64]
Sensor = Literal["gyro", "accel"]
SENSORS: tuple[Sensor, ...] = ("gyro", "accel")
AXES = ("x", "y", "z")
SIX = tuple(f"{sensor} {axis}" for sensor in SENSORS for axis in AXES)

USUAL_GRADE = "consumer-mems"
FITS = 2.0
"""times the variance of the model that what is left over may have, before the model is doubted"""
DRIFT_FROM_S = 60.0
"""s: averaging times that long show how biases drift between fixes"""


@dataclass(frozen=True)
class AxisNoise:
    """One axis of a gyro or an accelerometer."""

    noise: RateNoise
    curve: AllanCurve


@dataclass(frozen=True)
class ImuNoise:
    """One IMU."""

    rest: Rest
    axes: Mapping[Sensor, tuple[AxisNoise, ...]]
    """x, y, z of each"""

    @property
    def longest(self) -> float:
        """The longest averaging time, s."""
        return float(self.axes["gyro"][0].curve.tau[-1])

    def configuration(self) -> dict[str, float | None]:
        """Return the keys of `noise` in a configuration: those of the worst axis, to three digits.

        A bias that is not seen to drift is given what it can at most. None: that is more than what a cheap IMU is taken
        for anyway, no rest was long enough to show it, or the noise is not as the model says.
        """
        walk = {sensor: max(one.noise.random_walk.high for one in axes) for sensor, axes in self.axes.items()}
        usual = NOISE_GRADES[USUAL_GRADE]
        deg_h = DEG / HOUR
        figures = {
            "angle_random_walk_deg_sqrt_h": walk["gyro"] / DEG * np.sqrt(HOUR),
            "velocity_random_walk_m_s_sqrt_h": walk["accel"] * np.sqrt(HOUR),
            "gyro_bias_deg_h": self._drift("gyro", usual["gyro_bias_deg_h"] * deg_h) / deg_h,
            "accel_bias_mgal": self._drift("accel", usual["accel_bias_mgal"] * MGAL) / MGAL,
            "correlation_time_h": CORRELATION_TIME_S / HOUR,
        }
        return {key: float(f"{value:.3g}") if np.isfinite(value) else None for key, value in figures.items()}

    def _drift(self, sensor: Sensor, usual: float) -> float:
        """Return the std of the worst bias, or NaN; `usual` is that of a cheap IMU."""
        axes = [one.noise for one in self.axes[sensor]]
        if self.longest < DRIFT_FROM_S or any(one.excess > FITS for one in axes):
            return np.nan
        std = max(self._at_most(one) for one in axes)
        return std if any(map(slow_is_told, axes)) or std < usual else np.nan

    def _at_most(self, noise: RateNoise) -> float:
        """Return the std of a bias; of one that is not seen to drift what it is at most, by either process."""
        if slow_is_told(noise):
            return drift_std(noise.best, self.longest)
        white, flicker, walk = noise.best[0], noise.instability.high**2, noise.rate_walk.high**2
        return max(
            drift_std(np.array(squares), self.longest) for squares in ([white, flicker, 0.0], [white, 0.0, walk])
        )


def slow_is_told(noise: RateNoise) -> bool:
    """Whether flicker or walk, or that there is one of them, is told from zero."""
    return noise.instability.value is not None or noise.rate_walk.value is not None


def imu_noise(stream: ImuStream) -> ImuNoise:
    """Return the noise of an IMU by its stretches at rest; raises InputError without one, or without any noise."""
    rest = at_rest(stream)
    stuck = [axis for axis, share in zip(SIX, rest.repeated(), strict=True) if share == 1.0]
    if stuck:
        raise InputError(f"IMU {stream.name}: {', '.join(stuck)}: one value at rest throughout; expected noise")
    axes: dict[Sensor, tuple[AxisNoise, ...]] = {}
    for number, sensor in enumerate(SENSORS):
        columns = range(3 * number, 3 * number + 3)
        axes[sensor] = tuple(_axis([one.values[:, k] for one in rest.stretches], rest.interval) for k in columns)
    return ImuNoise(rest, axes)


def _axis(stretches: Sequence[Array], interval: float) -> AxisNoise:
    noise = fit(stretches, interval)
    return AxisNoise(noise, curve(stretches, interval, noise.best))


def coefficients(noise: RateNoise) -> tuple[Coefficient, Coefficient, Coefficient]:
    """Return random walk, bias instability, rate random walk."""
    return noise.random_walk, noise.instability, noise.rate_walk
