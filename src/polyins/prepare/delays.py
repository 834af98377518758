"""Whether clocks agree: how late each IMU is against the others, and the fixes against the IMUs.

IMUs of one array turn together: the rates of one, against the mean of the others, fit best at the delay between them.
A receiver's course turns as the gyros do: the angle between one displacement and the next, against what the gyros
turned meanwhile. Neither needs a filter, which would take part of a delay for errors of the state.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.errors import ImplausibleError
from polyins.model.findings import Finding, Severity
from polyins.model.geodesy import displacement
from polyins.model.recording import GnssStream, Recording
from polyins.model.rig import PPM, Rig
from polyins.prepare.blocks import Blocks

Array = NDArray[np.float64]

SURE = 6.0
"""standard deviations by which a delay is not zero"""

PART_S = 50.0
"""s of rates in which a delay is looked for: a clock may leap"""
COARSE = 5
"""blocks, of which means are compared first"""
STEPS = 3
"""of least squares"""
FARTHEST = 2.4
"""s: delays between IMUs that are looked for"""
LEAST_IMU_DELAY = 0.012
"""s: below, it is how chips filter"""
UNLIKE = 0.5
"""share of the power of rates that may be left at the best delay"""
LEAST_TURNING = 0.02
"""rad/s rms: less is no motion to compare"""
HARMFUL = 0.05
"""s, from which the delay of an IMU is more than a note"""

TURNS, LEAST_TURNS = 60, 25
"""of the course, that tell one delay"""
FARTHEST_FIXES = 25.0
"""s: delays of fixes that are looked for; leap seconds are 18"""
ROUGH, STEP = 0.5, 0.1
"""s, of the search: everywhere, and near what it finds"""
WAY_S = 1.0
"""s of the ways whose courses tell a drift"""
SIGMAS = 4.0
"""robust standard deviations, from which a turn is left out of a trend"""
SURE_OF_FIXES = 4.0
"""standard deviations by which a delay of fixes is not zero; they hold what is not known of the antenna"""
LEAST_FIX_DELAY = 0.05
"""s: below, it is the receiver's own latency"""
AHEAD_STD = 0.5
"""m by which an antenna is ahead of the axle that does not steer, or behind it: its course turns earlier or later than
the vehicle by that over the speed, which is no delay"""
ROUGHLY_LIKE, COURSE_LIKE = 0.7, 0.9
"""least correlation of the turns of course and gyros: a vehicle that moves sideways shows none"""
AS_GOOD = 2.0
"""times the misfit of the best delay, up to which another is as good"""
LEAST_TURN = 0.05
"""rad rms, from one displacement to the next"""
SURE_COURSE = 8.0
"""times the noise of the fixes, least length of a displacement that has a course"""
LEAST_TURN_STD = 0.005
"""rad, of a turn however long the displacements are: vehicles roll, and slip sideways"""
HOPELESS = 2.0
"""s: of fixes that are off by more, and all along, there is no solution"""
DOUBTFUL, USELESS = 3.0, 10.0
"""standard deviations of the fixes by which the vehicle moves in the delay"""


@dataclass(frozen=True)
class _Delay:
    """What one part of a recording tells."""

    begin: float
    end: float
    delay: float
    """s; above zero: late"""
    std: float
    speed: float = 0.0
    """m/s rms, of a receiver"""


def delays(recording: Recording, blocks: Blocks) -> tuple[Finding, ...]:
    """Return which IMU, and whether the receiver, is late, and by how much; of an array without wheels.

    `blocks`: of its IMUs, or of the beginning of what they measured. Raises InputError if all fixes are late by so much
    that they belong to another time.
    """
    rig, gnss = recording.rig, recording.gnss
    if rig.has_wheels:
        return ()
    late = [] if len(rig.imus) < 3 else list(_of_imus(rig, blocks))
    return (*late, *(() if gnss is None else _of_fixes(blocks, gnss, recording)))


# --- IMUs -------------------------------------------------------------------------------------------------------------


def _of_imus(rig: Rig, blocks: Blocks) -> Iterator[Finding]:
    parts = blocks.parts(PART_S)
    for i, imu in enumerate(rig.imus):
        found = []
        for part in parts:
            if blocks.whole[part, i].mean() < 0.9:
                continue
            own = np.ascontiguousarray(blocks.rates[part, :3, i].T)
            told = lag(own, np.ascontiguousarray(blocks.middle[part, :3].T), blocks.interval)
            if told is not None:
                found.append(_Delay(float(blocks.time[part][0]), float(blocks.time[part][-1]), *told))
        off = [one for one in found if abs(one.delay) > max(LEAST_IMU_DELAY, SURE * one.std)]
        if not off:
            continue
        size = _typical(off)
        often = len(off) > 1 or len(found) == 1 or abs(size) > HARMFUL
        if often:
            yield _finding(imu.name, off, size, "doubt" if abs(size) > HARMFUL else "note")


def lag(own: Array, mean: Array, interval: float) -> tuple[float, float] | None:
    """Return by how much one signal, shape (3, K), is later than another, s, and how sure that is; None: not told.

    own(t + D) = mean(t). D is m where the mean square of own(t + m) - mean(t) is least, of means over some blocks; near
    it own(t + m) - mean(t) = (m - D) d mean / dt, which least squares solve.
    """
    reach, count = round(FARTHEST / interval) // COARSE, own.shape[1] // COARSE
    if count < 4 * reach:
        return None
    own, mean = (one[:, : count * COARSE] - one.mean(axis=1, keepdims=True) for one in (own, mean))
    power = float(np.mean(mean**2))
    if np.sqrt(3.0 * power) < LEAST_TURNING:
        return None
    rough_own, rough_mean = (one.reshape(3, count, COARSE).mean(axis=2) for one in (own, mean))
    best = int(np.argmin(_misfits(rough_own, rough_mean, reach)))
    if not 0 < best < 2 * reach:
        return None
    margin, length = reach * COARSE, mean.shape[1]
    inside = slice(margin, length - margin)
    slope = (mean[:, margin + 1 : length - margin + 1] - mean[:, margin - 1 : length - margin - 1]) / (2.0 * interval)
    steepness, m = float(np.sum(slope**2)), (best - reach) * COARSE
    for _ in range(STEPS):
        off = own[:, inside.start + m : inside.stop + m] - mean[:, inside]
        less = float(np.sum(off * slope)) / steepness
        delay, m = m * interval - less, m - round(less / interval)
        if abs(m) > margin:
            return None
    left = max(float(np.sum(off**2)) - less**2 * steepness, 0.0) / off.size
    return None if left > UNLIKE * power else (delay, float(np.sqrt(left / steepness)))


def _misfits(own: Array, mean: Array, reach: int) -> Array:
    """Return the mean squares of own(t + m) - mean(t) for m from -reach to reach; t keeps that from both ends."""
    known = mean[:, reach:-reach]
    products = sum(np.correlate(own[a], known[a], "valid") for a in range(3))
    squares, length = np.concatenate([[0.0], np.cumsum(np.sum(own**2, axis=0))]), known.shape[1]
    return np.asarray(squares[length:] - squares[:-length] - 2.0 * products + np.sum(known**2)) / known.size


# --- fixes ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Turns:
    """By how much the course turned from one displacement, or velocity, to the next."""

    begin: Array
    """s (K,)"""
    end: Array
    turned: Array
    """rad (K,)"""
    std: Array
    """rad (K,)"""
    speed: Array
    """m/s (K, 2): before and after"""

    def at(self, rows: slice) -> Turns:
        """Return some of them."""
        return Turns(self.begin[rows], self.end[rows], self.turned[rows], self.std[rows], self.speed[rows])

    def by_gyros(self, time: Array, yaw: Array, delays: Array) -> Array:
        """Return what the gyros turned at delays, (D, 1) or of each turn (D, K); shape (D, K).

        `yaw` is what they turned up to `time`, rad.
        """
        ends = np.stack([self.begin - delays, self.end - delays])
        return np.asarray(np.diff(np.interp(ends, time, yaw), axis=0)[0])

    def ahead(self, time: Array, yaw: Array, delay: float | Array) -> Array:
        """Return by how much more the course turns for each metre that the antenna is ahead of the axle, rad/m (K,).

        There the velocity makes an angle of rate over speed with the vehicle.
        """
        ends = np.stack([self.begin - delay, self.end - delay], axis=1)
        rate = (np.interp(ends + STEP, time, yaw) - np.interp(ends - STEP, time, yaw)) / (2.0 * STEP)
        return np.asarray(np.diff(rate / self.speed, axis=1)[:, 0])

    def centred(self, turned: Array) -> Array:
        """Return turns, (..., K), less their mean, each over its std, whose largest weight is 1."""
        weight = (self.std.min() / self.std) ** 2
        mean = np.sum(weight * turned, axis=-1, keepdims=True) / weight.sum()
        return np.asarray(np.sqrt(weight) * (turned - mean))


def _of_fixes(blocks: Blocks, gnss: GnssStream, recording: Recording) -> Iterator[Finding]:
    turns = turns_of_course(gnss, recording.geodetic)
    steps = np.diff(blocks.time, prepend=blocks.time[0] - blocks.interval)
    yaw = np.cumsum(blocks.middle[:, 2] * steps)
    parts = [turns.at(slice(k, k + TURNS)) for k in range(0, len(turns.begin) - LEAST_TURNS + 1, TURNS)]
    found = list(_told(blocks.time, yaw, parts))
    # what no part is sure of all of them may be
    off = _late(found) or _late(list(_told(blocks.time, yaw, [turns])))
    trend = (
        _surest_trend(blocks.time, yaw, gnss, recording.geodetic, _typical(off or found)) if len(found) > 1 else None
    )
    if not off and trend is not None:
        off = found
    if not off:
        return
    size = _typical(off) if trend is None else trend.delay
    expected = [size if trend is None else trend.at(0.5 * (one.begin + one.end)) for one in found]
    agree = all(abs(one.delay - there) < STEP for one, there in zip(found, expected, strict=True))
    hopeless = abs(size) > HOPELESS and "delay" not in recording.accepted
    if hopeless and 1 < len(off) == len(found) and agree:
        late = "late" if size > 0.0 else "early"
        more, keys = _drifting(trend, size)
        digits = 1 if trend is None else 3
        raise ImplausibleError(
            "delay",
            f"GNSS: its course turns as the gyros do, {abs(size):.1f} s {late} all along{more}; expected one clock:"
            f" gnss.clock_offset_s: {-size:.{digits}f}{keys} corrects that, or gnss.time_offset: estimate",
        )
    std = float(np.median(gnss.position_std[:, :2]))
    largest = max(abs(size), *map(abs, expected)) if trend is not None else abs(size)
    moves = largest * max(one.speed for one in off) / std
    severity: Severity = "serious" if moves > USELESS else "doubt" if moves > DOUBTFUL else "note"
    yield _finding("GNSS position", off, size, severity, trend)


@dataclass(frozen=True)
class _Trend:
    """A delay that grows."""

    middle: float
    """s, where it is `delay`"""
    delay: float
    drift: float
    """s per second"""
    drift_std: float

    def at(self, time: float) -> float:
        return self.delay + self.drift * (time - self.middle)


def _surest_trend(time: Array, yaw: Array, gnss: GnssStream, geodetic: bool, delay: float) -> _Trend | None:
    """Return by how much a delay grows, if it surely does, by velocities or by ways of a second, which is surer.

    `delay`: on the whole, s. A way has the mean course of its time, so the gyros' yaw is averaged likewise.
    """
    every = max(1, round(WAY_S / float(np.median(np.diff(gnss.time)))))
    ways = replace(gnss.at(slice(None, None, every)), velocity=None, velocity_std=None)
    half = 0.5 * float(np.median(np.diff(ways.time)))
    area = np.concatenate([[0.0], np.cumsum(0.5 * (yaw[1:] + yaw[:-1]) * np.diff(time))])
    mean = (np.interp(time + half, time, area) - np.interp(time - half, time, area)) / (2.0 * half)
    kinds = [(mean, ways)] + ([] if gnss.velocity is None else [(yaw, gnss)])
    turned = [(about, turns_of_course(fixes, geodetic)) for about, fixes in kinds]
    found = [_trend(time, about, turns, delay) for about, turns in turned if len(turns.begin) >= LEAST_TURNS]
    surest = min(found, key=lambda one: one.drift_std, default=None)
    if surest is None or abs(surest.drift) < SURE_OF_FIXES * surest.drift_std:
        return None
    return surest if abs(surest.drift) * (gnss.time[-1] - gnss.time[0]) > LEAST_FIX_DELAY else None


def _trend(time: Array, yaw: Array, turns: Turns, delay: float) -> _Trend:
    """Return by how much a delay grows, from what it is on the whole, s.

    What is not known of the place of the antenna is the same all along and spoils no drift.
    """
    middle, drift = float(0.5 * (turns.begin[0] + turns.end[-1])), 0.0
    off, own = 0.5 * (turns.begin + turns.end) - middle, turns.centred(turns.turned)
    used = np.ones(len(off), dtype=bool)
    for _ in range(STEPS + 1):
        delays = delay + drift * off
        before, at, after = (turns.by_gyros(time, yaw, (delays + more)[None])[0] for more in (-STEP, 0.0, STEP))
        slope = (after - before) / (2.0 * STEP)
        columns = (slope, slope * off, turns.ahead(time, yaw, delays))
        design = np.column_stack([turns.centred(column) for column in columns])
        left = own - turns.centred(at)
        size = np.median(np.abs(left[used])) / 0.6745
        used = np.abs(left) < SIGMAS * size
        variance = float(np.mean(left[used] ** 2))
        normal = design[used].T @ design[used] + np.diag([1e-12, 1e-12, variance / AHEAD_STD**2])
        solved = np.linalg.solve(normal, design[used].T @ left[used])
        delay, drift = delay + float(solved[0]), drift + float(solved[1])
    std = float(np.sqrt(variance * np.linalg.inv(normal)[1, 1]))
    return _Trend(middle, delay, drift, std)


def _drifting(trend: _Trend | None, size: float) -> tuple[str, str]:
    """Return what to say of a drift, and the keys that correct it."""
    if trend is None:
        return "", ""
    grows = "growing" if trend.drift * size > 0.0 else "shrinking"
    text = f", {grows} by {abs(trend.drift) / PPM:.0f} ppm (std {trend.drift_std / PPM:.0f} ppm)"
    return text, f", clock_drift_ppm: {-trend.drift / PPM:.0f} and clock_reference_s: {trend.middle:.0f}"


def _told(time: Array, yaw: Array, parts: Sequence[Turns]) -> Iterator[_Delay]:
    for part in parts:
        told = _best(time, yaw, part) if len(part.begin) >= LEAST_TURNS else None
        if told is not None:
            speed = float(np.sqrt(np.mean(part.speed**2)))
            yield _Delay(float(part.begin[0]), float(part.end[-1]), *told, speed)


def _late(found: Sequence[_Delay]) -> list[_Delay]:
    return [one for one in found if abs(one.delay) > max(LEAST_FIX_DELAY, SURE_OF_FIXES * one.std)]


def turns_of_course(gnss: GnssStream, geodetic: bool) -> Turns:
    """Return where the course is known twice running."""
    if gnss.velocity is not None and gnss.velocity_std is not None:
        time, way, noise = gnss.time, gnss.velocity[:, :2], gnss.velocity_std[:, :2].max(axis=1)
        speed = np.hypot(*way.T)
    else:
        way = np.diff(displacement(gnss.position, gnss.position[0], geodetic)[:, :2], axis=0)
        time, std = 0.5 * (gnss.time[1:] + gnss.time[:-1]), gnss.position_std[:, :2].max(axis=1)
        noise, speed = 1.5 * np.hypot(std[1:], std[:-1]), np.hypot(*way.T) / np.diff(gnss.time)
    along = way[:, 0] + 1j * way[:, 1]
    known = np.abs(along) > SURE_COURSE * noise
    step = np.diff(time)
    k = np.flatnonzero(known[1:] & known[:-1] & (step < 3.0 * np.median(step))) if len(step) else np.zeros(0, int)
    course_std = noise / np.maximum(np.abs(along), 1e-12)
    std = np.sqrt(course_std[k] ** 2 + course_std[k + 1] ** 2 + LEAST_TURN_STD**2)
    both = np.column_stack([speed[k], speed[k + 1]])
    return Turns(time[k], time[k + 1], np.angle(along[k + 1] / along[k]), std, both)


def _best(time: Array, yaw: Array, turns: Turns) -> tuple[float, float] | None:
    """Return at which delay the gyros turned as the course did, s, and its std, s; None: not told.

    `yaw` is what they turned up to `time`, rad.
    """
    own = turns.centred(turns.turned)
    # where the gyros begin or end with the fixes no delay at all has neighbours on both sides too
    first = max(-FARTHEST_FIXES, turns.end[-1] - time[-1] - 2.0 * ROUGH)
    last = min(FARTHEST_FIXES, turns.begin[0] - time[0] + 2.0 * ROUGH)
    rough = ROUGH * np.arange(np.ceil(first / ROUGH), np.floor(last / ROUGH) + 1.0)
    if len(rough) < 3 or np.std(turns.turned) < LEAST_TURN:
        return None
    likes = _likes(time, yaw, turns, own, rough)[0]
    found = []
    for peak in rough[_peaks(likes, ROUGHLY_LIKE)]:
        near = peak + STEP * np.arange(-round(ROUGH / STEP), round(ROUGH / STEP) + 1)
        likes, shifted = _likes(time, yaw, turns, own, near)
        for best in _peaks(likes, COURSE_LIKE):
            slope = (shifted[best + 1] - shifted[best - 1]) / (2.0 * STEP)
            ahead = turns.centred(turns.ahead(time, yaw, float(near[best])))
            more, std = _more(own - shifted[best], slope, ahead)
            found.append((1.0 - float(likes[best]), float(near[best]) + more, std))
    if not found:
        return None
    # where bends come again and again several delays fit as well: the least is the likeliest
    as_good = [one for one in found if one[0] <= AS_GOOD * min(found)[0]]
    _, delay, std = min(as_good, key=lambda one: abs(one[1]))
    return delay, std


def _more(left: Array, slope: Array, ahead: Array) -> tuple[float, float]:
    """Return by how much a delay is larger than the one that leaves this, s, and its std, s.

    left = slope x delay + ahead x place of the antenna, of which `AHEAD_STD` is known: it tells less of the delay than
    it seems where all bends are taken at one speed.
    """
    design = np.column_stack([slope, ahead])
    variance = float(np.mean(left**2))
    for _ in range(STEPS):
        normal = design.T @ design + np.diag([1e-12, variance / AHEAD_STD**2])
        solved = np.linalg.solve(normal, design.T @ left)
        variance = float(np.mean((left - design @ solved) ** 2))
    return float(solved[0]), float(np.sqrt(variance * np.linalg.inv(normal)[0, 0]))


def _likes(time: Array, yaw: Array, turns: Turns, own: Array, delays: Array) -> tuple[Array, Array]:
    """Return the correlation of turns at each delay, (D,), and what the gyros turned, (D, K)."""
    shifted = turns.centred(turns.by_gyros(time, yaw, delays[:, None]))
    size = np.linalg.norm(shifted, axis=1) * np.linalg.norm(own)
    return shifted @ own / np.maximum(size, 1e-12), shifted


def _peaks(likes: Array, least: float) -> NDArray[np.intp]:
    """Return the places of local maxima."""
    inner = likes[1:-1]
    return np.flatnonzero((inner >= likes[:-2]) & (inner >= likes[2:]) & (inner > least)) + 1


# --- both -------------------------------------------------------------------------------------------------------------


def _typical(found: Sequence[_Delay]) -> float:
    return float(np.median([one.delay for one in found]))


def _finding(
    stream: str, off: Sequence[_Delay], size: float, severity: Severity, trend: _Trend | None = None
) -> Finding:
    begin, end = off[0].begin, off[-1].end
    late = "late" if size > 0.0 else "early"
    more, keys = _drifting(trend, size)
    return Finding(
        "delay",
        f"{stream}: {abs(size):.3g} s {late} from {begin:.0f} to {end:.0f} s{more}, as its turns tell",
        severity,
        stream=stream,
        from_s=begin,
        to_s=end,
        size=size,
        expected=0.0,
        remedy=f"clock_offset_s: {-size:.3g}{keys} corrects that"
        + (", time_offset: estimate finds it more closely" if trend is not None else ""),
    )
