"""Increments of an IMU as mean rates, and as running sums that can be read between any two instants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from polyins.model.recording import Array, ImuStream
from polyins.prepare.timesync import GAP


class Signals(Protocol):
    """What two streams are compared by."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant, s."""

    @property
    def least(self) -> float:
        """Rms of what happens in a window, below which it is no motion."""

    def between(self, begin: Array, end: Array) -> Array:
        """Return what happened from `begin` to `end`, shape (M, K)."""


@dataclass(frozen=True)
class RunningSums:
    """Sums of increments since the beginning: what lies between two instants is a difference, whatever the rate."""

    edges: Array
    """s, shape (T + 1,)"""
    sums: Array
    """shape (T + 1, K)"""
    least: float = 0.003
    """rms of what happens in a window, below which it is no motion; of angles, rad"""

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant, s."""
        return float(self.edges[0]), float(self.edges[-1])

    def between(self, begin: Array, end: Array) -> Array:
        """Return the increments from `begin` to `end`, shape (M, K), both of shape (M,), s."""
        columns = [np.interp(end, self.edges, c) - np.interp(begin, self.edges, c) for c in self.sums.T]
        return np.column_stack(columns)


@dataclass(frozen=True)
class Motion:
    """What one IMU measured, as means over its intervals, in the axes of its stream."""

    edges: Array
    """s, shape (T + 1,): where the intervals begin and end"""
    rate: Array
    """rad/s, shape (T, 3)"""
    force: Array
    """specific force, m/s^2, shape (T, 3)"""

    @property
    def steps(self) -> Array:
        """Lengths of the intervals, s, shape (T,)."""
        return np.diff(self.edges)

    @property
    def rate_hz(self) -> float:
        """Nominal rate: one over the median interval."""
        return float(1.0 / np.median(self.steps))

    def running(self, rates: Array) -> RunningSums:
        """Integrate rates, shape (T, K)."""
        increments = rates * self.steps[:, None]
        return RunningSums(self.edges, np.vstack([np.zeros(rates.shape[1]), np.cumsum(increments, axis=0)]))


def motion(stream: ImuStream) -> Motion:
    """Return the mean rates and specific forces of a stream; in a gap, the means of those on both sides."""
    usual = float(np.median(np.diff(stream.time)))
    edges = np.concatenate([[stream.time[0] - usual], stream.time])
    steps = np.diff(edges)
    rates = np.hstack([stream.dtheta, stream.dvel]) / steps[:, None]
    for lost in np.flatnonzero(steps > GAP * usual).tolist():
        rates[lost] = 0.5 * (rates[lost - 1] + rates[min(lost + 1, len(rates) - 1)])
    return Motion(edges, rates[:, :3], rates[:, 3:])


def smoothed(values: Array, rows: float) -> Array:
    """Return the columns of `values`, shape (T, K) or (T,), with a Gaussian window whose sigma is `rows`."""
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, rows, axis=0, mode="nearest"))
