"""Offset, drift and leaps of a clock by least squares, where two streams explain each other linearly.

Near the right clock, what happens in a window of one stream is y = A x(t) + c, where x is what the other shows at the
window's time t by the clock, and an error of the clock by d changes it by A dx/dt d. A and c are fitted along.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polyins.calibration.leaps import MOST, Parts
from polyins.calibration.motion import Signals
from polyins.calibration.regression import blocks, fit, huber
from polyins.model.clock import Clock
from polyins.model.recording import Array
from polyins.model.rig import PPM

NEAR = 60.0
"""s to both sides of the middle, in which a drift does not spoil what is linear; from there it is followed outwards"""
ROUNDS = 4
DRIFT_STD = 100.0 * PPM
"""relative: what is known of a drift beforehand; crystals have up to 100 ppm"""
PART_WINDOWS = 20
"""windows in a part in which a leap is looked for"""
MOST_PARTS = 60


@dataclass(frozen=True)
class Line:
    """A clock, and how sure its offset, drift and leaps are."""

    clock: Clock
    covariance: Array
    """of offset, drift and leaps; s, relative, s ...; shape (2 + L, 2 + L)"""

    def plausible(self) -> Line:
        """Return it with what is known of any clock's drift beforehand."""
        clock, shared = self.clock, self.covariance[:, 1]
        gain = shared / (shared[1] + DRIFT_STD**2)
        offset, drift, *leaps = (np.array([clock.offset, clock.drift, *(size for _, size in clock.leaps)])
                                 - gain * clock.drift).tolist()  # fmt: skip
        sizes = tuple((at, size) for (at, _), size in zip(clock.leaps, leaps, strict=True))
        covariance = self.covariance - np.outer(gain, shared)
        return Line(Clock(offset, drift, clock.reference, sizes), covariance)


@dataclass(frozen=True)
class Pair:
    """Two streams of one motion."""

    signals: Signals
    base: Signals
    window: float
    """s"""

    def line(self, offset: float) -> Line:
        """Return the clock of `signals` by that of `base`, from an offset that is right to a tenth of a window."""
        begin, end = self.signals.span
        first, last = (edge - offset for edge in self.base.span)
        begin, end = max(begin, first), min(end, last)
        reference = float(np.round(0.5 * (begin + end)))
        line = Line(Clock(offset, 0.0, reference), np.zeros((2, 2)))
        reach, half = NEAR, 0.5 * (end - begin)
        while True:
            middle = self._middles(line.clock, reach)
            for _ in range(ROUNDS):
                line = self._step(line.clock, middle)
            if reach >= half:
                break
            reach *= 2.0
        for _ in range(MOST):
            leap = self._leap(line.clock)
            if leap is None:
                break
            leaps = tuple(sorted((*line.clock.leaps, (leap, 0.0))))
            clock = Clock(line.clock.offset, line.clock.drift, reference, leaps)
            for _ in range(2 * ROUNDS):
                line = self._step(clock, self._middles(clock, reach))
                clock = line.clock
        return line.plausible()

    def _middles(self, clock: Clock, reach: float) -> Array:
        """Return middles of windows that both cover and in which the clock does not leap, s."""
        begin, end = self.signals.span
        middle = np.arange(begin + self.window, end - self.window, 0.5 * self.window)
        at = clock.common(middle)
        first, last = self.base.span
        kept = (at > first + self.window) & (at < last - self.window) & (np.abs(middle - clock.reference) <= reach)
        for leap, _ in clock.leaps:
            kept &= np.abs(middle - leap) > 0.5 * self.window
        return middle[kept]

    def _compared(self, clock: Clock, middle: Array) -> tuple[Array, Array, Array]:
        """Return what is unexplained, (M, K), how it follows from the clock, (M, K), and weights, (M,).

        Each component is over its scatter; what A and c take up is taken out of both.
        """
        half, short = 0.5 * self.window, 0.05 * self.window
        at = clock.common(middle)
        own = self.signals.between(middle - half, middle + half)
        there, before, after = (self.base.between(at + s - half, at + s + half) for s in (0.0, -short, short))
        design = np.column_stack([there, np.ones(len(at))])
        solution = np.linalg.lstsq(design, own, rcond=None)[0]
        weights = np.ones(len(at))
        for _ in range(3):
            residual = own - design @ solution
            weights = np.min([huber(column) for column in residual.T], axis=0)
            root = np.sqrt(weights)[:, None]
            solution = np.linalg.lstsq(root * design, root * own, rcond=None)[0]
        residual = own - design @ solution
        slope = (after - before) / (2.0 * short) @ solution[:-1]
        slope = slope - design @ np.linalg.lstsq(root * design, root * slope, rcond=None)[0]
        scatter = np.sqrt(np.average(residual**2, axis=0, weights=weights)) + np.finfo(float).tiny
        return residual / scatter, slope / scatter, weights

    def _step(self, clock: Clock, middle: Array) -> Line:
        """Return the clock after a step of least squares."""
        residual, slope, weights = self._compared(clock, middle)
        leaps = [(middle >= leap).astype(float) for leap, _ in clock.leaps]
        terms = np.column_stack([np.ones(len(middle)), middle - clock.reference, *leaps])
        count, width = residual.shape
        rows = (slope[:, :, None] * terms[:, None, :]).reshape(count * width, -1)
        found = fit(rows, residual.ravel(), np.repeat(blocks(count), width), np.repeat(weights, width))
        offset, drift = clock.offset + found.values[0], clock.drift + found.values[1]
        sizes = tuple(
            (at, size + more) for (at, size), more in zip(clock.leaps, found.values[2:].tolist(), strict=True)
        )
        return Line(Clock(float(offset), float(drift), clock.reference, sizes), found.covariance)

    def _leap(self, clock: Clock) -> float | None:
        """Return the stamp of a leap that the clock does not have, s."""
        middle = self._middles(clock, np.inf)
        residual, slope, weights = self._compared(clock, middle)
        length = max(PART_WINDOWS * self.window, (middle[-1] - middle[0]) / MOST_PARTS)
        edges = np.arange(middle[0], middle[-1] - 0.5 * length, length)
        rough = _parts(middle, residual, slope, weights, edges).leap()
        if rough is None:
            return None
        k = int(np.searchsorted(edges, rough))
        near = middle[(middle > edges[k - 1]) & (middle < (edges[k + 1] if k + 1 < len(edges) else np.inf))]
        return _parts(middle, residual, slope, weights, np.union1d(edges, near[::2])).leap()


def _parts(middle: Array, residual: Array, slope: Array, weights: Array, edges: Array) -> Parts:
    """Return what parts that begin at the edges tell of the clock."""
    part = np.searchsorted(edges, middle, "right") - 1
    products = weights * np.sum(slope * residual, axis=1)
    squares = weights * np.sum(slope**2, axis=1)
    total, power = (np.bincount(part, values, len(edges)) for values in (products, squares))
    power = np.maximum(power, 1e-12 * power.max())
    return Parts(edges, 0.5 * (edges + np.append(edges[1:], middle[-1])), total / power, np.diag(1.0 / power))
