"""How much better the mean of N IMUs is than one of them, by averaging time, and what they have in common.

With what each has by itself, of variance i^2, and what all have in common, c^2, one of them has the Allan variance
s1^2 = c^2 + i^2 and their mean sN^2 = c^2 + i^2 / N. The gain s1 / sN is sqrt(N) only where nothing is common.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.allan import degrees_of_freedom, factors, variances
from polyins.calibration.noise_model import fit
from polyins.calibration.rest import rates_of, resting_intervals
from polyins.errors import InputError
from polyins.model.recording import ImuStream, usual_interval
from polyins.prepare.timesync import align

Array = NDArray[np.float64]

RESAMPLED = 4
"""samples, up to which the mean of IMUs that do not sample together is smoothed"""
NORMAL_95 = 1.96
SENSORS = {"gyro": slice(0, 3), "accel": slice(3, 6)}
AT_S = 1.0
"""averaging time of the one figure that stands for all"""


@dataclass(frozen=True)
class SensorGain:
    """Of the gyros or the accelerometers, over all three axes, shape (K,) each."""

    tau: Array
    """s"""
    single: Array
    """Allan deviation of one, rms over the IMUs, rad/s or m/s^2"""
    mean: Array
    """of the mean of all"""
    low: Array
    """of the gain, 95 %"""
    high: Array
    imus: int

    @property
    def gain(self) -> Array:
        """How much less the mean has."""
        return self.single / self.mean

    @property
    def common_share(self) -> Array:
        """Share of the variance of one that all have in common; below zero by chance it is zero."""
        one, all_of_them = self.single**2, self.mean**2
        common = (self.imus * all_of_them - one) / (self.imus - 1)
        return np.asarray(np.clip(common / one, 0.0, 1.0))

    def at(self, tau: float) -> int:
        """Return the row nearest to an averaging time, s."""
        return int(np.argmin(np.abs(np.log(self.tau / tau))))


@dataclass(frozen=True)
class ArrayGain:
    """The gain of an array."""

    imus: int
    rest_s: float
    gyro: SensorGain
    accel: SensorGain


def array_gain(streams: tuple[ImuStream, ...]) -> ArrayGain:
    """Compare the mean of IMUs, whose streams are in the same axes and on one clock, with each.

    Raises InputError if they never rest together for ten seconds.
    """
    aligned = align(streams, bridge=False)
    interval = usual_interval(aligned.time)
    rates = rates_of(aligned.time, aligned.increments, interval)
    parts = []
    for begin, end in resting_intervals(aligned):
        first, last = np.searchsorted(aligned.time, [begin, np.nextafter(end, np.inf)])
        parts.append(rates[first:last])
    if not parts:
        raise InputError("imus: do not rest together for 10 s; expected one recording of all of them at rest")
    alike = all(np.array_equal(one.time, aligned.time) for one in streams)
    of = factors([len(one) for one in parts])
    of = of if alike else of[of >= RESAMPLED]
    if not len(of):
        raise InputError("imus: rest together for too few samples; expected a longer rest")
    found = {name: _sensor(parts, of, interval, columns) for name, columns in SENSORS.items()}
    return ArrayGain(len(streams), sum(map(len, parts)) * interval, **found)


def _sensor(parts: list[Array], of: NDArray[np.intp], interval: float, columns: slice) -> SensorGain:
    """Return the gain of the sensors of those columns; `parts`: rates of stretches, (n, 6, N) each."""
    count, lengths = parts[0].shape[2], [len(one) for one in parts]
    single, mean, spread = np.zeros(len(of)), np.zeros(len(of)), np.zeros(len(of))
    for axis in range(columns.start, columns.stop):
        each = [variances([one[:, axis, i] for one in parts], of) for i in range(count)]
        average = [one[:, axis].mean(axis=1) for one in parts]
        of_mean = variances(average, of)
        squares = fit(average, interval).best
        freedom = np.array([degrees_of_freedom(int(m), lengths, interval, squares) for m in of])
        single, mean = single + np.mean(each, axis=0), mean + of_mean
        spread += 2.0 * of_mean**2 / freedom
    # the variance of one is known from N of them, that of the mean from itself
    relative = 0.5 * np.sqrt(spread * (1.0 + 1.0 / count)) / mean
    gain = np.sqrt(single / mean)
    low, high = gain * np.exp(-NORMAL_95 * relative), gain * np.exp(NORMAL_95 * relative)
    return SensorGain(np.asarray(of * interval, float), np.sqrt(single / 3.0), np.sqrt(mean / 3.0), low, high, count)
