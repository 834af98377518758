"""White noise, flicker and random walk of a rate, fitted to stretches at rest by maximum likelihood.

A gyro at rest shows a rate of two-sided spectral density (IEEE Std 952, annex C)

    S(f) = N^2 + B^2 / (2 pi f) + K^2 / (2 pi f)^2

with the angle random walk N, the bias instability B and the rate random walk K; an accelerometer likewise. The cosine
transform of a stretch turns samples into coefficients of which that of the mean is left out; the others do not depend
on each other, exactly so for white noise and random walk, and nearly so for flicker. Their variances are linear in N^2,
B^2 and K^2, so that their likelihood is a sum over frequencies, and nothing is counted twice, as neighbouring values of
an Allan deviation would be. Intervals are where the profile of the likelihood is within the quantile of chi^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.linalg import cholesky, solve_triangular
from scipy.ndimage import median_filter
from scipy.optimize import brentq, nnls
from scipy.special import sici, zeta
from scipy.stats import chi2

Array = NDArray[np.float64]

WITHIN_95 = 3.8415
"""quantile of chi^2 with one degree of freedom"""
SINGLE = 32
"""coefficients of the lowest frequencies that stand for themselves; those above share bins"""
BIN = 0.02
"""width of a bin over its frequency"""
STARTS = np.array([[1.0, 1e-3, 1e-6], [1.0, 1e-6, 1e-2]])
"""shares of all power that the three begin with"""
ROUNDS = 60
"""of scoring, at most"""
SETTLED = 1e-9
"""change of the deviance at which it ends"""
FEWEST = 16
"""samples of a stretch"""
NEIGHBOURS = 10
"""bins on either side that say what is usual"""
CHANCE = 1e-6
"""with which noise alone makes a line of a bin"""
CHANCE_OF_LOW = 1e-5
"""with which the low frequencies of the noise that was fitted are as far from it"""
UNFIT = 4.0
"""standard deviations by which noise beyond a frequency may miss the model, before it is left out of the fit"""
LOWEST_CUT = 1.0 / 64.0
"""of all frequencies: those below are never left out"""

LEAST_SHARE = 1e-6
"""of an estimate squared: what may be that small is not told from zero"""
ROOT = 1e-4
"""relative accuracy of the ends of an interval, squared"""

WHITE, FLICKER, WALK = range(3)


@dataclass(frozen=True)
class Coefficient:
    """An estimate with its 95 % interval, SI."""

    value: float | None
    """None: it is not told from zero, and `high` is all that is known"""
    low: float
    high: float


@dataclass(frozen=True)
class RateNoise:
    """What noise one axis of a gyro or an accelerometer has."""

    random_walk: Coefficient
    """N, of angle or velocity: rad/sqrt(s), m/s/sqrt(s)"""
    instability: Coefficient
    """B, of the bias: rad/s, m/s^2"""
    rate_walk: Coefficient
    """K, of the rate: rad/s/sqrt(s), m/s^2/sqrt(s)"""
    best: Array
    """N^2, B^2, K^2 of the largest likelihood, shape (3,)"""
    up_to_hz: float
    """frequencies above are not as the model says, such as behind a low-pass filter, and are left out"""
    lines_hz: tuple[float, ...]
    """frequencies of lines, as of vibration, that stand out of the noise and are left out, the strongest first"""
    excess: float
    """variance of what is left over, times that of the model; intervals are wider by its root where it exceeds one"""
    off: tuple[float, float] | None
    """below which frequency, Hz, the power is how many times that of the model; None: nowhere by more than chance"""

    def allan_variance(self, tau: Array) -> Array:
        """Return what the model says of averaging times, s."""
        return allan_variance_of(self.best, tau)


def allan_variance_of(squares: Array, tau: Array) -> Array:
    """Return N^2/tau + (2 ln 2 / pi) B^2 + K^2 tau / 3 of N^2, B^2, K^2, shape (3,)."""
    return np.asarray(squares[WHITE] / tau + 2.0 * np.log(2.0) / np.pi * squares[FLICKER] + squares[WALK] * tau / 3.0)


def fit(stretches: Sequence[Array], interval: float) -> RateNoise:
    """Fit the noise of rates, each stretch of shape (n,), in which samples are `interval` s apart.

    Every stretch has a mean of its own, as biases differ from pose to pose.
    """
    spectrum = Spectrum.of(stretches, interval)
    return replace(spectrum.without_lines().fitting().noise(), lines_hz=spectrum.lines())


@dataclass(frozen=True)
class Spectrum:
    """Mean squares of coefficients of the cosine transform, by bins."""

    angle: Array
    """2 pi f times the interval, shape (M,)"""
    power: Array
    count: Array
    """how many coefficients a bin has"""
    basis: Array
    """the variance of a coefficient for N^2, B^2 and K^2 of one, shape (M, 3)"""
    line: NDArray[np.bool_]
    """where a line stands out of the noise"""
    interval: float
    """s"""

    @classmethod
    def of(cls, stretches: Sequence[Array], interval: float) -> Spectrum:
        """Transform stretches of rates."""
        parts = [_of_stretch(one, interval) for one in stretches if len(one) >= FEWEST]
        return cls(
            np.concatenate([one.angle for one in parts]),
            np.concatenate([one.power for one in parts]),
            np.concatenate([one.count for one in parts]),
            np.concatenate([one.basis for one in parts]),
            np.concatenate([one.line for one in parts]),
            interval,
        )

    def lines(self) -> tuple[float, ...]:
        """Return the frequencies of lines, Hz, the strongest first."""
        strongest = np.flatnonzero(self.line)[np.argsort(-self.power[self.line], kind="stable")]
        return tuple(float(angle) / (2.0 * np.pi * self.interval) for angle in self.angle[strongest])

    def without_lines(self) -> Spectrum:
        """Return that of the noise alone."""
        return self._at(~self.line)

    def below(self, share: float) -> Spectrum:
        """Return that of frequencies up to a share of the largest."""
        return self._at(self.angle <= share * np.pi)

    def _at(self, kept: NDArray[np.bool_]) -> Spectrum:
        angle, power, count = self.angle[kept], self.power[kept], self.count[kept]
        return Spectrum(angle, power, count, self.basis[kept], self.line[kept], self.interval)

    def fitting(self) -> Spectrum:
        """Leave out high frequencies, octave by octave, while those in the upper half are not as the rest says."""
        share, kept = 1.0, self
        while share > LOWEST_CUT and kept._misses(0.5 * share) > UNFIT:
            share *= 0.5
            kept = self.below(share)
        return kept

    def _misses(self, share: float) -> float:
        """Return by how many sigma the power beyond a share of all frequencies is not what the fit below says."""
        below, above = self.below(share), self.angle > share * np.pi
        if not len(below.angle) or not above.any():
            return 0.0
        ratio = self.power[above] / (self.basis[above] @ below.maximum())
        weight = self.count[above]
        mean = float(np.average(ratio, weights=weight))
        near = below.count[below.angle > 0.5 * share * np.pi].sum()
        std = np.sqrt(2.0 / weight.sum() + 2.0 / max(near, 1.0))
        return abs(mean - 1.0) / float(std)

    def maximum(self, fixed: tuple[int, float] | None = None, near: Array | None = None) -> Array:
        """Return N^2, B^2, K^2 of the largest likelihood, none negative; one may be fixed at a value.

        The likelihood of what is no such noise has several maxima: the largest is looked for from all sides, and from
        `near`.
        """
        starts = [self._scale * shares for shares in STARTS] + ([near] if near is not None else [])
        return min((self._ascended(start, fixed) for start in starts), key=self.deviance)

    def _ascended(self, start: Array, fixed: tuple[int, float] | None) -> Array:
        """Return the maximum that Fisher scoring finds from a start.

        It is least squares with the weights of the last estimate, shortened until the deviance falls.
        """
        free = [i for i in range(3) if fixed is None or i != fixed[0]]
        squares = np.array(start, dtype=float)
        if fixed is not None:
            squares[fixed[0]] = fixed[1]
        deviance = self.deviance(squares)
        for _ in range(ROUNDS):
            step = self._scored(squares, free) - squares
            length = 1.0
            while (found := self.deviance(squares + length * step)) > deviance and length > 1e-6:
                length *= 0.5
            if length <= 1e-6:
                break
            squares, gained, deviance = squares + length * step, deviance - found, found
            if gained < SETTLED * (1.0 + abs(deviance)):
                break
        return squares

    def _scored(self, squares: Array, free: list[int]) -> Array:
        scale = self._scale
        weight = self.count / (self.basis @ squares) ** 2
        known = squares.copy()
        known[free] = 0.0
        X = self.basis[:, free] * scale[free]
        normal = (X * weight[:, None]).T @ X
        right = (X * weight[:, None]).T @ (self.power - self.basis @ known)
        size = np.sqrt(np.diag(normal))
        root = cholesky(normal / np.outer(size, size) + 1e-12 * np.eye(len(free)))
        solved, _ = nnls(root, solve_triangular(root, right / size, trans="T"))
        known[free] = solved / size * scale[free]
        return known

    @cached_property
    def _scale(self) -> Array:
        """Return each of N^2, B^2, K^2 that would make all of the power by itself."""
        total = float(np.average(self.power, weights=self.count))
        return np.array([total / float(np.average(column, weights=self.count)) for column in self.basis.T])

    def deviance(self, squares: Array) -> float:
        """Return -2 ln of the likelihood but for a constant."""
        variance = self.basis @ squares
        if not variance.min() > 0.0:
            return np.inf
        return float(np.sum(self.count * (np.log(variance) + self.power / variance)))

    def noise(self) -> RateNoise:
        """Return the fit with its intervals."""
        best = self.maximum()
        least, excess = self.deviance(best), self._excess(best)
        allowed = WITHIN_95 * max(1.0, excess)
        white, flicker, walk = (self._interval(i, best, least + allowed) for i in range(3))
        up_to = float(self.angle.max()) / (2.0 * np.pi * self.interval)
        return RateNoise(
            white, flicker, walk, best=best, up_to_hz=up_to, lines_hz=(), excess=excess, off=self._off(best)
        )

    def _excess(self, squares: Array) -> float:
        """Return Pearson's chi^2 over its expectation."""
        ratio = self.power / (self.basis @ squares)
        return float(np.sum(0.5 * self.count * (ratio - 1.0) ** 2) / max(len(ratio) - 3, 1))

    def _off(self, squares: Array) -> tuple[float, float] | None:
        """Return below which frequency, Hz, the power is how many times that of a fit, by more than chance."""
        octave = np.floor(np.log2(self.angle / self.angle.min())).astype(int)
        count = np.cumsum(np.bincount(octave, self.count))
        total = np.cumsum(np.bincount(octave, self.count * self.power / (self.basis @ squares)))
        chance = np.minimum(chi2.sf(total, count), chi2.cdf(total, count))
        worst = int(np.argmin(chance))
        if chance[worst] > CHANCE_OF_LOW:
            return None
        below = float(self.angle.min()) * 2.0 ** (worst + 1) / (2.0 * np.pi * self.interval)
        return below, float(total[worst] / count[worst])

    def _interval(self, i: int, best: Array, level: float) -> Coefficient:
        """Return the root of an estimate, and where the deviance with all others free reaches a level."""

        def beyond(share: float) -> float:
            return self.deviance(self.maximum((i, share * start), best)) - level

        # what is not there is looked for from a small part of all power on
        start = max(float(best[i]), LEAST_SHARE * float(self._scale[i]))
        most = 2.0
        while beyond(most) < 0.0:
            most *= 4.0
        high = float(brentq(beyond, 1.0, most, rtol=ROOT)) if beyond(1.0) < 0.0 else 1.0
        low = 0.0
        if best[i] == start and beyond(LEAST_SHARE) > 0.0:
            low = float(brentq(beyond, LEAST_SHARE, 1.0, rtol=ROOT))
        value = float(np.sqrt(start)) if low > 0.0 else None
        return Coefficient(value, float(np.sqrt(low * start)), float(np.sqrt(high * start)))


def _of_stretch(rate: Array, interval: float) -> Spectrum:
    """Return the bins of one stretch."""
    n = len(rate)
    squares = dct(rate - rate.mean(), norm="ortho")[1:] ** 2
    # the lowest ones by themselves, then ever wider bins
    edges = [np.arange(min(SINGLE, n - 1))]
    if n - 1 > SINGLE:
        steps = int(np.ceil(np.log((n - 1) / SINGLE) / BIN))
        edges.append(np.unique(np.geomspace(SINGLE, n - 1, steps + 1).astype(int))[:-1])
    begin = np.concatenate(edges)
    count = np.diff(np.append(begin, n - 1)).astype(float)
    power = np.add.reduceat(squares, begin) / count
    order = begin + 0.5 * (count + 1.0)
    angle = np.pi * order / n
    return Spectrum(angle, power, count, _basis(order, angle, interval), _stands_out(power, count), interval)


def _stands_out(power: Array, count: Array) -> NDArray[np.bool_]:
    """Return which bins have more power than chance gives, by the median of the bins around them.

    The lowest ones, over which flicker and walk fall steeply, are none.
    """
    usual = power * count / chi2.ppf(0.5, count)
    around = median_filter(usual, 2 * NEIGHBOURS + 1, mode="nearest")
    limit = chi2.isf(CHANCE, count) / count
    return np.asarray((power > limit * around) & (np.arange(len(power)) >= SINGLE))


def _basis(order: Array, angle: Array, interval: float) -> Array:
    """Return the variance of a coefficient of a stretch's cosine transform for each kind of noise of size one.

    Of means over the interval. White noise and random walk have it exactly; flicker, whose covariance is -ln of the
    distance, has that of its density, times what the ends of the stretch take from the lowest orders: with u(x) =
    sqrt(2) cos(pi j x), -(double integral of u(x) u(y) ln|x - y|) = (2 / pi j) (Si(pi j) - (1 - (-1)^j) / (pi j)).
    """
    white = np.full(len(order), 1.0 / interval)
    walk = interval * (2.0 + np.cos(angle)) / (3.0 * (2.0 - 2.0 * np.cos(angle)))
    turns = angle / (2.0 * np.pi)
    aliased = (2.0 - 2.0 * np.cos(angle)) * (zeta(3.0, turns) + zeta(3.0, 1.0 - turns)) / (2.0 * np.pi) ** 3
    x = np.pi * order
    whole = order == np.round(order)
    # in the mean over even and odd orders the cosines cancel
    ends = 2.0 / np.pi * np.where(whole, sici(x)[0] - (1.0 - np.cos(x)) / x, np.pi / 2.0 - 1.0 / x)
    return np.column_stack([white, ends * aliased, walk])
