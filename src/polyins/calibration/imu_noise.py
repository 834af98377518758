"""All noise figures of one IMU, and what a configuration is told of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from polyins.calibration.allan import AllanCurve, curve
from polyins.calibration.gauss_markov import CORRELATION_TIME_S, drift_std
from polyins.calibration.noise_model import FLICKER, WALK, Coefficient, RateNoise, fit
from polyins.calibration.rest import Rest, at_rest
from polyins.config import NOISE_GRADES
from polyins.model.findings import Finding
from polyins.model.recording import ImuStream
from polyins.model.rig import DEG, HOUR, MGAL

Sensor = Literal["gyro", "accel"]
SENSORS: tuple[Sensor, ...] = ("gyro", "accel")
AXES = ("x", "y", "z")

USUAL_GRADE = "consumer-mems"
PICKED = 0.5
"""of what is taken for motion: an IMU whose own noise is larger has its quiet seconds picked"""
FITS = 2.0
"""times the variance of the model that what is left over may have, before the model is doubted"""
DRIFT_FROM_S = 60.0
"""s: averaging times that long show how biases drift between fixes"""
REPEATS = 0.5
"""share of samples that repeat the one before"""
LONG_S = 10_000.0
"""s in one piece: a longer one seldom tells more"""
SIX = tuple(f"{sensor} {axis}" for sensor in SENSORS for axis in AXES)
NARROW = 0.5
"""of all frequencies: fewer have to fit, else it is said"""


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
        figures = {
            "angle_random_walk_deg_sqrt_h": walk["gyro"] / DEG * np.sqrt(HOUR),
            "velocity_random_walk_m_s_sqrt_h": walk["accel"] * np.sqrt(HOUR),
            "gyro_bias_deg_h": self._drift("gyro", NOISE_GRADES[USUAL_GRADE]["gyro_bias_deg_h"] * DEG / HOUR) / DEG * HOUR,
            "accel_bias_mgal": self._drift("accel", NOISE_GRADES[USUAL_GRADE]["accel_bias_mgal"] * MGAL) / MGAL,
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
        if slow_is_told(noise):
            return drift_std(noise.best, self.longest)
        white, flicker, walk = noise.best[0], noise.instability.high**2, noise.rate_walk.high**2
        return max(drift_std(np.array(squares), self.longest) for squares in ([white, flicker, 0.0], [white, 0.0, walk]))

    def findings(self) -> tuple[Finding, ...]:
        """Return what of the figures is doubtful."""
        return (*_of_rest(self.rest), *_of_fit(self))


def _of_rest(rest: Rest) -> Iterator[Finding]:
    begin, end = rest.stretches[0].begin, rest.stretches[-1].end
    left_out = rest.recorded_s - rest.used_s
    if left_out > rest.interval * len(rest.stretches):
        count = len(rest.stretches)
        yield Finding(
            "motion",
            f"IMU {rest.name}: {left_out:.1f} of {rest.recorded_s:.1f} s are left out, in which it moves or has just moved;"
            f" {rest.used_s:.1f} s in {count} stretch{'es' if count > 1 else ''} at rest are used",
            stream=rest.name,
            from_s=begin,
            to_s=end,
            size=left_out,
        )
    if rest.closeness > PICKED:
        yield Finding(
            "noise",
            f"IMU {rest.name}: in most seconds at rest its own noise is {100 * rest.closeness:.0f} % of what is taken for"
            " motion, so that its quieter seconds are used and its figures are too small",
            "doubt",
            stream=rest.name,
            size=rest.closeness,
            expected=PICKED,
            remedy="measure it away from engines and fans",
        )
    for axis, share in zip(SIX, rest.repeated(), strict=True):
        if share > REPEATS:
            yield Finding(
                "noise",
                f"IMU {rest.name}: {100 * share:.0f} % of the samples of {axis} are as the one before: they are rounded to"
                " steps as large as the noise, or written more often than measured",
                "doubt",
                stream=rest.name,
                axis=axis,
                size=share,
                expected=REPEATS,
                remedy="log at the sensor's own rate and resolution",
            )


def _of_fit(one: ImuNoise) -> Iterator[Finding]:
    name, nyquist = one.rest.name, 0.5 / one.rest.interval
    each = [(f"{sensor} {axis}", of.noise) for sensor in SENSORS for axis, of in zip(AXES, one.axes[sensor], strict=True)]
    cut = [(axis, noise.up_to_hz) for axis, noise in each if noise.up_to_hz < NARROW * nyquist]
    if cut:
        yield Finding(
            "noise",
            f"IMU {name}: beyond {min(hz for _, hz in cut):.3g} Hz the noise of {', '.join(axis for axis, _ in cut)} is not"
            f" white, as behind a filter or beside a vibration: the figures are of what is below",
            stream=name,
            size=min(hz for _, hz in cut),
            expected=nyquist,
        )
    lines = {axis: noise.lines_hz for axis, noise in each if noise.lines_hz}
    if lines:
        yield Finding(
            "noise",
            f"IMU {name}: lines stand out of the noise of "
            + ", ".join(f"{axis} (the strongest at {of[0]:.3g} Hz)" for axis, of in lines.items())
            + ", as vibration, mains or gyros that disturb each other make; they are left out of the fit",
            stream=name,
            size=len(lines),
        )
    unlike = [(axis, noise.excess) for axis, noise in each if noise.excess > FITS]
    if unlike:
        yield Finding(
            "noise",
            f"IMU {name}: white noise, flicker and random walk do not describe {', '.join(axis for axis, _ in unlike)};"
            f" what is left over has up to {max(size for _, size in unlike):.1f} times their variance, and intervals are"
            " wider by its root",
            "doubt",
            stream=name,
            size=max(size for _, size in unlike),
            expected=1.0,
            remedy="look at the plot for steps, or a ramp while it warms up",
        )
    for word, index in (("bias instability", FLICKER), ("rate random walk", WALK)):
        untold = [axis for axis, noise in each if coefficients(noise)[index].value is None]
        if untold:
            yield Finding(
                "noise",
                f"IMU {name}: {one.rest.used_s:.0f} s at rest, {one.rest.longest_s:.0f} s in one piece, do not tell the {word}"
                f" of {', '.join(untold)} from zero: only what it is at most is known",
                stream=name,
                size=one.rest.used_s,
                remedy="" if one.rest.longest_s > LONG_S else "record hours in one piece",
            )


def slow_is_told(noise: RateNoise) -> bool:
    """Whether flicker or walk, or that there is one of them, is told from zero."""
    return noise.instability.value is not None or noise.rate_walk.value is not None


def imu_noise(stream: ImuStream) -> ImuNoise:
    """Return the noise of an IMU by its stretches at rest; raises InputError where there are none."""
    rest = at_rest(stream)
    axes: dict[Sensor, tuple[AxisNoise, ...]] = {}
    for number, sensor in enumerate(SENSORS):
        columns = range(3 * number, 3 * number + 3)
        axes[sensor] = tuple(_axis([one.values[:, k] for one in rest.stretches], rest.interval) for k in columns)
    return ImuNoise(rest, axes)


def _axis(stretches: Sequence[np.ndarray], interval: float) -> AxisNoise:
    noise = fit(stretches, interval)
    return AxisNoise(noise, curve(stretches, interval, noise.best))


def coefficients(noise: RateNoise) -> tuple[Coefficient, Coefficient, Coefficient]:
    """Return random walk, bias instability, rate random walk."""
    return noise.random_walk, noise.instability, noise.rate_walk
