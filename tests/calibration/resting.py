"""IMUs at rest whose noise is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import ImuStream

Array = NDArray[np.float64]

GYRO, ACCEL = 1e-4, 2e-3
"""random walks, rad/sqrt(s) and m/s/sqrt(s)"""
INTERVAL = 0.02


def stream(name: str, seconds: float, seed: int, *, common: Array | None = None) -> ImuStream:
    """White noise upon a bias and gravity; `common` is added to the rates, shape (T, 6)."""
    count = round(seconds / INTERVAL)
    white = np.random.default_rng([seed, 17]).standard_normal((count, 6)) / np.sqrt(INTERVAL)
    rates = white * np.repeat([GYRO, ACCEL], 3) + [0.01, -0.02, 0.005, 0.1, -0.2, -9.81]
    if common is not None:
        rates += common
    return of_rates(name, rates)


def of_rates(name: str, rates: Array) -> ImuStream:
    time = np.arange(1, len(rates) + 1) * INTERVAL
    return ImuStream(name, time, rates[:, :3] * INTERVAL, rates[:, 3:] * INTERVAL)


def shaken(one: ImuStream, begin: float, end: float) -> ImuStream:
    """The stream with a motion in that time, s."""
    inside = (one.time > begin) & (one.time < end)
    swing = np.where(inside, np.sin(7.0 * one.time), 0.0)[:, None]
    return ImuStream(one.name, one.time, one.dtheta + INTERVAL * swing, one.dvel + INTERVAL * 3.0 * swing)
