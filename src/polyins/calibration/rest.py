"""Where an IMU rests, and its rates and forces there: what its noise can be told from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.recording import ImuStream
from polyins.model.rig import DEG
from polyins.prepare.alignment import (
    STILL_FORCE,
    STILL_RATE,
    hardly_turns,
    second_spreads,
    still_seconds,
)
from polyins.prepare.timesync import GAP, Aligned

Array = NDArray[np.float64]

FEWEST = 3
"""rows"""
SHORTEST_S = 10.0
"""s at rest of a stretch that is used"""
LONGEST_PAUSE_S = 1.0
"""s: the samples around a pause that long still follow each other; a longer one ends the stretch"""
ALIKE = 1e-9
"""relative difference of samples that are the same"""
SETTLING_S = 1.0
"""s left out after and before motion"""


@dataclass(frozen=True)
class Stretch:
    """Rates and forces of one IMU at rest, sample after sample."""

    begin: float
    """s"""
    end: float
    values: Array
    """rad/s and m/s^2, shape (n, 6)"""


@dataclass(frozen=True)
class Rest:
    """All stretches of one IMU, on its own samples."""

    name: str
    interval: float
    """s, between samples"""
    stretches: tuple[Stretch, ...]
    recorded_s: float
    """in which it measured at all"""
    closeness: float
    """how near its own noise comes to what is taken for motion; beyond a half the quiet seconds are picked"""

    @property
    def used_s(self) -> float:
        """How long the stretches are together."""
        return float(sum(len(one.values) for one in self.stretches)) * self.interval

    @property
    def longest_s(self) -> float:
        """The longest of them."""
        return max(len(one.values) for one in self.stretches) * self.interval

    def repeated(self) -> Array:
        """Return which share of samples are as the one before, (6,)."""
        # division by intervals leaves them alike to rounding only
        same = sum(np.sum(np.isclose(one.values[1:], one.values[:-1], ALIKE, 0.0), axis=0) for one in self.stretches)
        return np.asarray(same / sum(len(one.values) - 1 for one in self.stretches))


def at_rest(stream: ImuStream) -> Rest:
    """Find where an IMU rests, by the test that finds the standstill of a start.

    Raises InputError, saying what is missing, if no stretch is long enough.
    """
    if len(stream.time) < FEWEST:
        raise InputError(f"IMU {stream.name}: has {len(stream.time)} row(s); expected {SHORTEST_S:.0f} s at rest")
    increments = np.concatenate([stream.dtheta, stream.dvel], axis=1)
    aligned = Aligned(stream.time, increments[:, :, None], (), np.zeros((len(stream.time), 1), bool))
    intervals = resting_intervals(aligned)
    if not intervals:
        raise InputError(f"IMU {stream.name}: {_lacking(aligned)}")
    steps = np.diff(stream.time)
    interval = float(np.mean(steps[steps <= GAP * np.median(steps)]))
    values = rates_of(stream.time, increments, interval)
    stretches = []
    for begin, end in intervals:
        rows = slice(*np.searchsorted(stream.time, [begin, np.nextafter(end, np.inf)]))
        stretches.append(Stretch(begin, end, values[rows]))
    edges, spread = second_spreads(aligned)
    inside = np.zeros(len(spread), bool)
    for begin, end in intervals:
        inside |= (edges[:-1] >= begin) & (edges[1:] <= end)
    shares = np.median(spread[inside], axis=0) / np.repeat([STILL_RATE, STILL_FORCE], 3)
    return Rest(stream.name, interval, tuple(stretches), len(stream.time) * interval, float(shares.max()))


def resting_intervals(aligned: Aligned) -> list[tuple[float, float]]:
    """Return where all IMUs measure and rest for ten seconds at least, s, without what is next to motion or a pause."""
    edges, still = still_seconds(aligned)
    broken = aligned.missing.any(axis=1) | (np.diff(aligned.time, append=aligned.time[-1]) > LONGEST_PAUSE_S)
    second = np.searchsorted(edges, aligned.time[broken], "right") - 1
    whole = still.copy()
    whole[second[second < len(whole)]] = False
    runs = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    found = []
    for first, last in zip(runs[::2], runs[1::2], strict=True):
        begin = edges[first] + (SETTLING_S if first > 0 else 0.0)
        end = edges[last] - (SETTLING_S if last < len(whole) else 0.0)
        if end - begin >= SHORTEST_S and hardly_turns(aligned, float(begin), float(end)):
            found.append((float(begin), float(end)))
    return found


def rates_of(time: Array, increments: Array, interval: float) -> Array:
    """Return increments over time, (T, 6, ...), of gyros and accelerometers each by the interval that shakes them less.

    Of a file of rates each was multiplied by its own interval; where stamps jitter and samples do not, or of a file of
    increments, by the usual one.
    """
    own = np.diff(time, prepend=time[0] - interval)
    own = np.where(own > LONGEST_PAUSE_S, interval, own).reshape(-1, *[1] * (increments.ndim - 1))
    found = np.empty_like(increments)
    for columns in (slice(0, 3), slice(3, 6)):
        each = [increments[:, columns] / own, increments[:, columns] / interval]
        shaken = [float(np.median(np.abs(np.diff(one, 2, axis=0)), axis=0).sum()) for one in each]
        found[:, columns] = each[int(shaken[1] < shaken[0])]
    return found


def _lacking(aligned: Aligned) -> str:
    """Say why there is no stretch at rest."""
    _, spread = second_spreads(aligned)
    if not len(spread):
        return f"measures for less than a second; expected {SHORTEST_S:.0f} s at rest, better an hour"
    still = still_seconds(aligned)[1]
    runs = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    longest = int(np.max(runs[1::2] - runs[::2])) if still.any() else 0
    rate, force = (float(spread[:, columns].max(axis=1).min()) for columns in (slice(0, 3), slice(3, 6)))
    return (
        f"never rests for {SHORTEST_S:.0f} s without turning: nothing shakes for {longest} s at most; in the quietest"
        f" second tenths differ by {rate / DEG:.2g} deg/s and {force:.2g} m/s^2, at rest by less than"
        f" {STILL_RATE / DEG:.2g} and {STILL_FORCE:.2g}; expected it left alone, better for an hour, away from engines"
        " and fans"
    )
