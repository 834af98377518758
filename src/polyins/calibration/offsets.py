"""Offsets between clocks that were never synchronised, from the motion that their sensors share.

Each stream is reduced to a few signals that need no knowledge of its mounting: the three rates of a body, the spin and
the yaw of a wheel, the distances between GNSS fixes. Two streams on the right offset explain each other linearly. How
well is the mutual information of Gaussian signals, -1/2 sum ln(1 - rho_i^2) with their canonical correlations rho_i:
its product with the common time is the gain of log likelihood, which is compared over all offsets. About the best one
the signals are linear in offset, drift and leaps, and least squares find these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from polyins.calibration.clock_line import Pair
from polyins.calibration.motion import RunningSums, Signals, motion
from polyins.calibration.regression import huber
from polyins.calibration.wheels import spin_axis, turns
from polyins.errors import InputError
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, GnssStream, ImuStream, Offset
from polyins.model.rig import Imu

WINDOW = 1.0
"""s: increments over so long are compared; shorter ones show the road, which each sensor feels in its own way"""
COARSE_STEP = 0.05  # s
FINE_STEP = 0.1  # s, from one window to the next
FINE_REACH = 0.1  # s, to both sides
FINE_TRIALS = 41
SHORTEST_COMMON = 20.0
"""windows"""
SHORT_WINDOW = 0.2
"""s: of bodies that are one rigid thing, all of whose turns are shared"""
ATTITUDE_WINDOW = 0.5
"""s: over less, what a coarse attitude changes by is its resolution"""
SMALLEST_SHARE = 0.2  # of the shorter stream
NOISE = 0.01
"""of the variance, added in the coarse search: on its grid no offset fits better than so, and none wins by rounding"""
IDLE = 1e-12
"""of the variance, added in the fine search: a signal that is exactly nought explains nothing and does no harm"""
RIVAL = 0.7
"""A second peak with this part of the first one's information makes the offset ambiguous."""
LOBE = 3.0  # s: nearer than this it is the same peak
LEAST_CORRELATION = 0.8


@dataclass(frozen=True)
class Positions:
    """Horizontal positions, compared by the distances between them."""

    time: Array
    """s, shape (M,)"""
    position: Array
    """m north, east, shape (M, 2)"""
    least: float = 0.2
    """m"""

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant, s."""
        return float(self.time[0]), float(self.time[-1])

    def between(self, begin: Array, end: Array) -> Array:
        """Return the distances between two instants, m, shape (M, 1)."""
        chord = RunningSums(self.time, self.position).between(begin, end)
        return np.asarray(np.linalg.norm(chord, axis=1)[:, None])


@dataclass(frozen=True)
class Mean:
    """The mean of several streams on one clock: of the wheels on both sides it is the middle of the axle's."""

    parts: Sequence[RunningSums]
    least: float = 0.003
    """rad"""

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant that all cover, s."""
        return max(part.span[0] for part in self.parts), min(part.span[1] for part in self.parts)

    def between(self, begin: Array, end: Array) -> Array:
        """Return the mean increments, shape (M, K)."""
        return np.asarray(np.mean([part.between(begin, end) for part in self.parts], axis=0))


def imu_offsets(imus: Sequence[Imu], streams: Sequence[ImuStream], base: int) -> tuple[Offset, ...]:
    """Find what to add to the stamps of each IMU to put them on the clock of number `base`.

    Wheels are compared by spin and yaw, a wheel and a body by yaw, bodies by all rates. A steered wheel's yaw is not
    the body's: it is compared by its spin with another wheel. Raises InputError where streams share no motion, or fit
    each other at more than one offset.
    """
    hub = _hub(imus, base)
    signals = [_imu_signals(imu, stream) for imu, stream in zip(imus, streams, strict=True)]
    bodies = [imu.wheel is None for imu in imus]
    windows = [SHORT_WINDOW if body and bodies[hub] else WINDOW for body in bodies]
    to_hub = [
        none(imu.name) if i == hub else find_offset(imu.name, signals[i], imus[hub].name, signals[hub], windows[i])
        for i, imu in enumerate(imus)
    ]
    onward = reversed_offset(to_hub[base], imus[hub].name)
    return tuple(none(one.name) if i == base else chained(one, onward) for i, one in enumerate(to_hub))


def gnss_offset(
    imus: Sequence[Imu], streams: Sequence[ImuStream], gnss: GnssStream, geodetic: bool, name: str = "GNSS"
) -> Offset:
    """Find what to add to the stamps of GNSS to put them on the clock of the IMUs, which share one.

    The distances between fixes are compared with the spin of the wheels, steered ones only if there are no others.
    What comes out holds the receiver's latency. Raises InputError without an IMU on a wheel, and as `imu_offsets`.
    """
    wheels = [i for i, imu in enumerate(imus) if imu.wheel is not None]
    straight = [i for i in wheels if not _steered(imus[i])]
    if not wheels:
        raise InputError(f"{name}: its clock's offset is found by wheel speed; expected an IMU on a wheel")
    rolling = Mean([_imu_signals(imus[i], streams[i]) for i in straight or wheels])
    position = displacement(gnss.position, gnss.position[0], geodetic)
    return find_offset(name, Positions(gnss.time, position[:, :2]), "the wheels", rolling)


def body_offset(
    name: str, signals: Signals, imus: Sequence[Imu], streams: Sequence[ImuStream], window: float
) -> Offset:
    """Find what to add to the stamps of a heading, an attitude or a speed, by the rates or forces of a body.

    Raises InputError without an IMU on a body, and as `imu_offsets`.
    """
    moved = [motion(stream) for imu, stream in zip(imus, streams, strict=True) if imu.wheel is None]
    if not moved:
        raise InputError(f"{name}: its clock's offset is found by an IMU on the body; expected one")
    felt = moved[0].force if name == "odometer" else moved[0].rate
    return find_offset(name, signals, "the IMUs", moved[0].running(felt), window)


def find_offset(name: str, signals: Signals, base_name: str, base: Signals, window: float = WINDOW) -> Offset:
    """Find what to add to the stamps of `signals` to put them on the clock of `base`.

    All offsets are searched that leave twenty windows, of `window` s, and a fifth of the shorter stream, in common; the
    best one is refined to a fraction of a sample, with a drift and leaps. Their std is that of estimates which leave
    out an eighth of the time each. Raises InputError for no common motion and for an ambiguous offset.
    """
    pair = f"{name} and {base_name}"
    found = [_refined(signals, base, coarse, window) for coarse in candidates(signals, base, pair, window)]
    offset, gain, correlation = found[0]
    for rival in found[1:]:
        if rival.gain > RIVAL * gain:
            raise ambiguous(pair, offset, rival.offset)
    if correlation < LEAST_CORRELATION:
        raise InputError(
            f"time_offset: {pair} share no common motion (correlation {correlation:.2f} at best); expected streams of "
            "one drive"
        )
    line = Pair(signals, base, window).line(offset)
    clock, std = line.clock, np.sqrt(np.diag(line.covariance)).tolist()
    leaps = tuple((at, size, sure) for (at, size), sure in zip(clock.leaps, std[2:], strict=True))
    return Offset(name, clock.offset, std[0], correlation, clock.drift, std[1], clock.reference, leaps)


def _hub(imus: Sequence[Imu], base: int) -> int:
    """Return the IMU with which all others are compared: a wheel that is not steered, else a body, else the base."""
    wheels = [i for i, imu in enumerate(imus) if imu.wheel is not None and not _steered(imu)]
    bodies = [i for i, imu in enumerate(imus) if imu.wheel is None]
    candidates = wheels or bodies or [base]
    return base if base in candidates else candidates[0]


def _steered(imu: Imu) -> bool:
    return imu.wheel is not None and imu.wheel.steering


def none(name: str) -> Offset:
    """Return the offset of a clock from itself."""
    return Offset(name, 0.0, 0.0, 1.0)


def chained(one: Offset, onward: Offset) -> Offset:
    """Return the offset of `one` to the clock to which `onward` leads from that of its base."""
    clock = one.clock.then(onward.clock)
    at = clock.reference
    away = one.clock.common(at) - onward.reference_s if onward.drift else 0.0
    apart = at - one.reference_s if one.drift else 0.0
    std = float(np.linalg.norm([one.std_s, one.drift_std * apart, onward.std_s, onward.drift_std * away]))
    sure = [sure for *_, sure in (*one.leaps, *onward.leaps)]
    known = [value for value in (one.correlation, onward.correlation) if value is not None]
    correlation = min(known) if len(known) == 2 else None
    return Offset(
        one.name,
        clock.offset,
        std,
        correlation,
        clock.drift,
        float(np.hypot(one.drift_std, onward.drift_std)),
        clock.reference,
        tuple((*leap, max(sure)) for leap in clock.leaps),
    )


def reversed_offset(one: Offset, name: str) -> Offset:
    """Return what to add to the other clock instead, whose stream has that name."""
    clock = one.clock.inverse
    leaps = tuple((*leap, std) for leap, (*_, std) in zip(clock.leaps, one.leaps, strict=True))
    return replace(one, name=name, offset_s=clock.offset, drift=clock.drift, reference_s=clock.reference, leaps=leaps)


def _imu_signals(imu: Imu, stream: ImuStream) -> RunningSums:
    moved = motion(stream)
    if imu.wheel is None:
        return moved.running(moved.rate)
    spin_and_yaw = turns(moved, spin_axis(moved, imu.name))
    return RunningSums(spin_and_yaw.edges, spin_and_yaw.sums[:, :1]) if imu.wheel.steering else spin_and_yaw


def _windows(signals: Signals, step: float, window: float) -> tuple[Array, Array]:
    """Return the middles of windows every `step` seconds, shape (M,), and what happened in them, shape (M, K)."""
    begin, end = signals.span
    middle = np.arange(begin + 0.5 * window, end - 0.5 * window, step)
    return middle, signals.between(middle - 0.5 * window, middle + 0.5 * window)


class _Refined(NamedTuple):
    """An offset near which two streams fit best."""

    offset: float
    """s"""
    gain: float
    """information times windows in common"""
    correlation: float


def ambiguous(pair: str, one: float, other: float) -> InputError:
    """Return the error that two offsets, s, fit almost equally well."""
    return InputError(
        f"time_offset: ambiguous offset of {pair}: {one:.2f} s and {other:.2f} s fit almost equally well; expected a "
        "drive whose speed or turns do not repeat, or none in common"
    )


def candidates(signals: Signals, base: Signals, pair: str, window: float = WINDOW) -> list[float]:
    """Return the offset with the most information, to a step of the grid, and the best of its rivals, if there are."""
    time, one = _windows(signals, COARSE_STEP, window)
    base_time, two = _windows(base, COARSE_STEP, window)
    shortest = SHORTEST_COMMON * window
    least = shortest + SMALLEST_SHARE * (min(len(one), len(two)) * COARSE_STEP - shortest)
    if min(len(one), len(two)) * COARSE_STEP < shortest:
        raise InputError(f"time_offset: {pair}: one has less than {shortest:g} s of data; expected more")
    for windows, source in ((one, signals), (two, base)):
        if np.sqrt(np.mean((windows - windows.mean(axis=0)) ** 2, axis=0)).max() < source.least:
            raise InputError(f"time_offset: {pair} share no common motion: one hardly moves; expected a drive")
    lags, gain = _gains(one, two, least / COARSE_STEP)
    best = int(np.argmax(gain))
    peaks = np.flatnonzero((gain[1:-1] >= gain[:-2]) & (gain[1:-1] > gain[2:])) + 1
    rivals = peaks[np.abs(lags[peaks] - lags[best]) * COARSE_STEP > LOBE]
    offset = base_time[0] - time[0] + lags * COARSE_STEP
    if len(rivals) and gain[rivals].max() > RIVAL * gain[best]:
        return [float(offset[best]), float(offset[rivals[np.argmax(gain[rivals])]])]
    return [float(offset[best])]


def _gains(one: Array, two: Array, least: float) -> tuple[Array, Array]:
    """Return lags, in rows, and the gain of log likelihood at each; row i of `one` meets row i + lag of `two`.

    Means and covariances are those of the rows in common, by FFT; at least `least` of them.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    size = next_fast_len(len(one) + len(two), real=True)
    a, b = _standard(one), _standard(two)
    count_a, count_b = np.ones((len(a), 1)), np.ones((len(b), 1))

    def sums(x: Array, y: Array) -> Array:
        """Sum x[i] y[i + lag] over i, shape (size, columns of x, columns of y)."""
        spectrum = np.conj(rfft(x, size, axis=0))[:, :, None] * rfft(y, size, axis=0)[:, None, :]
        return np.asarray(irfft(spectrum, size, axis=0))

    lags = np.arange(size)
    lags[lags >= len(b)] -= size
    order = np.argsort(lags)
    common = np.rint(sums(count_a, count_b)[:, 0, 0])
    kept = order[common[order] >= least]
    n = common[kept, None, None]
    mean_a, mean_b = sums(a, count_b)[kept] / n, sums(count_a, b)[kept] / n
    aa = sums(_products(a), count_b)[kept].reshape(-1, a.shape[1], a.shape[1]) / n - mean_a @ mean_a.mT
    bb = sums(count_a, _products(b))[kept].reshape(-1, b.shape[1], b.shape[1]) / n - mean_b.mT @ mean_b
    ab = sums(a, b)[kept] / n - mean_a @ mean_b
    return lags[kept], common[kept] * _information(aa, bb, ab, NOISE)


def _standard(values: Array) -> Array:
    """Return the columns less their means, over their standard deviations."""
    centred = values - values.mean(axis=0)
    return np.asarray(centred / (centred.std(axis=0) + np.finfo(float).tiny))


def _products(values: Array) -> Array:
    return np.asarray(np.einsum("ti,tj->tij", values, values).reshape(len(values), -1))


def _information(aa: Array, bb: Array, ab: Array, noise: float) -> Array:
    """Return the mutual information of Gaussian signals from their covariances, shapes (..., K, K) to (..., K, L).

    `noise` is added to the variances, which are about one.
    """
    aa, bb = aa + noise * np.eye(aa.shape[-1]), bb + noise * np.eye(bb.shape[-1])
    left = np.eye(aa.shape[-1]) - np.linalg.solve(aa, ab) @ np.linalg.solve(bb, ab.mT)
    return np.asarray(-0.5 * np.log(np.maximum(np.linalg.det(left), np.finfo(float).tiny)))


def _refined(signals: Signals, base: Signals, coarse: float, window: float) -> _Refined:
    """Return the offset with the most information near `coarse`; windows that do not fit count less (Huber)."""
    begin, end = signals.span
    first, last = base.span
    half = 0.5 * window
    reach = half + FINE_REACH + COARSE_STEP
    for _ in range(3):
        middle = np.arange(max(begin, first - coarse) + reach, min(end, last - coarse) - reach, FINE_STEP)
        windows = (middle - half, middle + half)
        one = _standard(signals.between(*windows))
        weights = _weights(one, base.between(windows[0] + coarse, windows[1] + coarse))
        trials = coarse + np.linspace(-FINE_REACH, FINE_REACH, FINE_TRIALS)
        gains = np.array([_gain(one, _standard(base.between(*(w + t for w in windows))), weights) for t in trials])
        peak, before = _peak(trials, gains), coarse
        coarse = peak
        if abs(peak - before) <= 0.9 * FINE_REACH:
            break
    return _Refined(peak, len(middle) * float(gains.max()), float(np.sqrt(-np.expm1(-2.0 * gains.max()))))


def _weights(one: Array, two: Array) -> Array:
    """Return Huber's weights of the windows from what `two` leaves unexplained of `one`, shape (M,)."""
    design = np.column_stack([two, np.ones(len(two))])
    residuals = one - design @ np.linalg.lstsq(design, one, rcond=None)[0]
    return np.asarray(np.prod([huber(column) for column in residuals.T], axis=0))


def _gain(one: Array, two: Array, weights: Array) -> float:
    """Return the mutual information over all windows."""
    covariance = np.cov(np.column_stack([one, two]).T, aweights=weights, ddof=0)
    k = one.shape[1]
    return float(_information(covariance[:k, :k], covariance[k:, k:], covariance[:k, k:], IDLE))


def _peak(at: Array, values: Array) -> float:
    """Return where the parabola through the values about the largest one has its top."""
    best = int(np.clip(np.argmax(values), 3, len(values) - 4))
    around = slice(best - 3, best + 4)
    square, slope, _ = np.polyfit(at[around] - at[best], values[around], 2)
    if square >= 0.0:
        return float(at[np.argmax(values)])
    return float(at[best] + np.clip(-0.5 * slope / square, at[0] - at[best], at[-1] - at[best]))
