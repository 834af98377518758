"""Rough ground under two wheel tracks, and books lying on it, as round and soft wheels meet them.

A tyre is a bed of equal springs, which level the ground over its footprint, all alike: a small bump under any of them
adds the same force. With a radius, a disc first rolls over the ground: its lowest point is the greatest of the ground
lifted by the disc's own curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

STEP = 0.01  # m between the points of a random profile
FINE = 0.0025  # m between those that wheels roll over
MARGIN = 2.0  # m before and beyond the way travelled


@dataclass(frozen=True)
class Roughness:
    """Random ground whose power spectral density falls with the second power of the wave number."""

    rms: float
    """of a patch of median size, m"""
    shortest: float
    """wavelength, m"""
    longest: float
    """wavelength, m"""
    correlation: float
    """of the two tracks"""
    patch_length: float
    """m, over which the roughness keeps its size"""
    patch_sigma: float
    """std of the logarithm of that size"""


@dataclass(frozen=True)
class Bump:
    """A book."""

    begin: float
    """m along the way"""
    length: float
    """m"""
    height: float
    """m"""
    left: bool
    """under the left wheels"""
    right: bool


@dataclass(frozen=True)
class WheelContact:
    """What of a wheel decides how it meets the ground."""

    radius: float
    """of the disc, m; 0: what lies under the wheel counts as it is"""
    footprint: float
    """length over which its tyre levels the ground, m"""


@dataclass(frozen=True)
class Ground:
    """Heights that the left and the right wheels follow over the ground."""

    heights: CubicSpline
    """m upwards, over m along the way: (T,) -> (T, 2)"""

    def __call__(self, along: Array) -> Array:
        """Return the heights under left and right wheels at places along the way, m, shape (T, 2)."""
        return np.asarray(self.heights(along))


def ground(
    length: float, roughness: Roughness, bumps: Sequence[Bump], wheel: WheelContact, rng: np.random.Generator
) -> Ground:
    """Draw the ground along a way of a length, m, as a wheel meets it."""
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import convolve1d

    along = np.arange(-MARGIN, length + MARGIN, STEP)
    common, left, right = (_rough(along.size, roughness, rng) for _ in range(3))
    share = roughness.correlation
    heights = np.sqrt(share) * common[:, None] + np.sqrt(1.0 - share) * np.column_stack([left, right])
    heights = heights * (roughness.rms * _patches(along.size, roughness, rng))[:, None]
    fine = np.arange(-MARGIN, length + MARGIN - STEP, FINE)
    heights = CubicSpline(along, heights)(fine)
    for bump in bumps:
        under = (fine >= bump.begin) & (fine < bump.begin + bump.length)
        heights[under] += bump.height * np.array([bump.left, bump.right])
    level = convolve1d(_rolled(heights, wheel.radius), _footprint(wheel.footprint), axis=0, mode="nearest")
    return Ground(CubicSpline(fine, level))


def _rolled(heights: Array, radius: float) -> Array:
    """Return how high the lowest point of a disc is that rolls over a profile, m, shape (T, 2)."""
    reach = int(radius / FINE)
    lift = radius - np.sqrt(radius**2 - (FINE * np.arange(-reach, reach + 1)) ** 2)
    around = np.pad(heights, ((reach, reach), (0, 0)), mode="edge")
    highest = np.full_like(heights, -np.inf)
    for k, gap in enumerate(lift):
        np.maximum(highest, around[k : k + len(heights)] - gap, out=highest)
    return highest


def _footprint(length: float) -> Array:
    """Return the even weights of the points of a footprint, which ends at the outermost two."""
    reach = round(length / 2.0 / FINE)
    weights = np.ones(2 * reach + 1)
    if reach:
        weights[[0, -1]] = 0.5
    return np.asarray(weights / weights.sum())


def _rough(count: int, roughness: Roughness, rng: np.random.Generator) -> Array:
    """Return a random profile of unit rms with wavelengths in the band, shape (count,)."""
    wave = np.fft.rfftfreq(count, STEP)
    inside = (wave >= 1.0 / roughness.longest) & (wave <= 1.0 / roughness.shortest)
    amplitude = np.where(inside, 1.0 / np.maximum(wave, 1.0 / roughness.longest), 0.0)
    drawn = rng.standard_normal(wave.size) + 1j * rng.standard_normal(wave.size)
    # the mean square of the profile that these amplitudes have in expectation
    power = 4.0 * np.sum(amplitude**2) / count**2
    return np.asarray(np.fft.irfft(amplitude * drawn, count) / np.sqrt(power))


def _patches(count: int, roughness: Roughness, rng: np.random.Generator) -> Array:
    """Return the local size of the roughness, log-normal with a median of one, shape (count,)."""
    from scipy.ndimage import gaussian_filter1d

    width = roughness.patch_length / STEP / 2.0
    smooth = gaussian_filter1d(rng.standard_normal(count), width, mode="wrap")
    # the filter's gain: the integral of a squared Gaussian
    smooth *= np.sqrt(2.0 * np.sqrt(np.pi) * width)
    return np.asarray(np.exp(roughness.patch_sigma * smooth))
