"""Simulated rates of an IMU at rest whose random walk, bias instability and rate random walk are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FINER = 2
"""flicker is made at so many times the rate, and averaged as a sensor does"""
BEFORE = 3
"""times the length of a recording that flicker has gone on when it begins"""
FLOOR = 2.0 * np.log(2.0) / np.pi


@dataclass(frozen=True)
class NoiseCase:
    """The truth, and how long it was recorded."""

    random_walk: float
    """N, per sqrt(s)"""
    instability: float
    """B"""
    rate_walk: float
    """K, per sqrt(s)"""
    interval: float
    """s"""
    samples: int

    @property
    def truth(self) -> tuple[float, float, float]:
        """N, B, K."""
        return self.random_walk, self.instability, self.rate_walk

    def rates(self, rng: np.random.Generator) -> Array:
        """Draw a recording, shape (T,)."""
        white = rng.standard_normal(self.samples) * self.random_walk / np.sqrt(self.interval)
        drawn = flicker(self.samples * FINER, rng).reshape(-1, FINER).mean(axis=1)
        walk = np.cumsum(rng.standard_normal(self.samples * FINER)).reshape(-1, FINER).mean(axis=1)
        return np.asarray(white + self.instability * drawn + self.rate_walk * np.sqrt(self.interval / FINER) * walk)


def draw(rng: np.random.Generator, hours: tuple[float, float], samples: int) -> NoiseCase:
    """Return a case whose curve has a falling part, a floor and a rising one, drawn over what chips have.

    Flicker outweighs white noise from 10 to 200 s on, random walk flicker from 5 to 30 times that.
    """
    shortest, longest = np.log(hours)
    duration = 3600.0 * np.exp(shortest + (longest - shortest) * rng.uniform())
    floor_from = np.exp(rng.uniform(*np.log((10.0, 200.0))))
    rises_from = floor_from * np.exp(rng.uniform(*np.log((5.0, 30.0))))
    white = np.exp(rng.uniform(*np.log((1e-5, 1e-3))))
    instability = white / np.sqrt(FLOOR * floor_from)
    walk = instability * np.sqrt(3.0 * FLOOR / rises_from)
    return NoiseCase(white, instability, walk, duration / samples, samples)


def flicker(samples: int, rng: np.random.Generator) -> Array:
    """Return 1/f noise whose B is one, shape (T,), by fractional integration of white noise (Kasdin 1995)."""
    from scipy.signal import fftconvolve

    total = (1 + BEFORE) * samples
    order = np.arange(1, total)
    response = np.concatenate([[1.0], np.cumprod((order - 0.5) / order)])
    return np.asarray(fftconvolve(rng.standard_normal(total), response)[BEFORE * samples : total])
