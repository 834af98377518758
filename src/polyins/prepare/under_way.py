"""The course of an array under way: its heading from fixes, over as long as they need.

A vehicle moves where it looks, but for a few degrees. The gyros tell how far it has turned since its first fix, so that
all displacements can be turned back to the heading there and added up: their sum points along it, and is the surer the
longer it is against the noise of the fixes. The first fixes whose sum is sure enough give the start, so that further
data do not change it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.model.geodesy import displacement
from polyins.model.recording import GnssStream
from polyins.model.rig import DEG

Array = NDArray[np.float64]

WANTED_STD = 5.0 * DEG
"""of the heading, at which the search ends"""
LOOSE_STD = 7.0 * DEG
"""an earlier start is preferred up to that"""
LEAST_STD = 15.0 * DEG
"""a heading less sure than that is none"""
LONGEST = 60.0
"""s of fixes that are added up"""
SLIP_STD = 2.0 * DEG
"""between where a vehicle moves and where it looks"""
SLOWEST = 0.3
"""m/s, mean along the way: slower is standing or hovering"""
MANY = 1500
"""fixes that are looked at: the search is over a triangle of them"""
AROUND = 5
"""fixes: their median outvotes one that lies, and the two differences in which it shows"""
HARDEST = 5.0
"""m/s^2: what a vehicle accelerates by at most, for seconds"""


@dataclass(frozen=True)
class GroundMotion:
    """How an array moves at a fix."""

    time: float
    """s"""
    heading: float
    """rad"""
    heading_std: float
    """rad"""
    until: float
    """s: the last fix that tells the heading"""


def find_motion(
    gnss: GnssStream, geodetic: bool, turned: Callable[[Array], Array], bias_std: float, after: float
) -> GroundMotion | None:
    """Find the first fix from `after`, s, on at which the heading can be told; None: there is none.

    `turned`: how far the heading has turned at given times, rad, less a constant; `bias_std`: of the gyros, rad/s.
    """
    shown = np.flatnonzero(gnss.time >= after)[:MANY]
    shown = shown[agreeing(gnss, geodetic, shown)]
    if len(shown) < 2:
        return None
    way = _Way(gnss, geodetic, shown, turned)
    for last in range(1, len(shown)):
        first = int(np.searchsorted(way.time, way.time[last] - LONGEST))
        std = way.heading_std(first, last, bias_std)
        enough = np.flatnonzero(std <= WANTED_STD)
        if not enough.size and (way.time[last] - way.time[0] < LONGEST or std.min() > LEAST_STD):
            continue
        loose = np.flatnonzero(std <= (LOOSE_STD if enough.size else LEAST_STD))
        begin = first + int(loose[0])
        return way.motion(begin, last, float(std[loose[0]]))
    return None


def agreeing(gnss: GnssStream, geodetic: bool, shown: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which fixes lie where those around them say, within what noise and acceleration allow."""
    count = len(shown)
    if count < AROUND:
        return np.ones(count, dtype=bool)
    near = np.clip(np.arange(count) - AROUND // 2, 0, count - AROUND)[:, None] + np.arange(AROUND)
    time = gnss.time[shown]
    place = displacement(gnss.position[shown], gnss.position[shown[0]], geodetic)
    steps = np.diff(place[near], axis=1) / np.diff(time[near], axis=1)[:, :, None]
    moved = np.median(steps, axis=1)[:, None, :] * (time[:, None] - time[near])[:, :, None]
    off = np.abs(place - np.median(place[near] + moved, axis=1))
    span = np.ptp(time[near], axis=1)[:, None]
    good = (off <= 10.0 * gnss.position_std[shown] + 0.125 * HARDEST * span**2).all(axis=1)
    if gnss.velocity is not None and gnss.velocity_std is not None:
        velocity = gnss.velocity[shown]
        apart = np.abs(velocity - np.median(velocity[near], axis=1))
        good &= (apart <= 10.0 * gnss.velocity_std[shown] + 0.5 * HARDEST * span).all(axis=1)
    return np.asarray(good)


class _Way:
    """The way from fix to fix, turned back to the heading at the first one, as complex numbers north + i east."""

    def __init__(
        self, gnss: GnssStream, geodetic: bool, shown: NDArray[np.intp], turned: Callable[[Array], Array]
    ) -> None:
        self.time = gnss.time[shown]
        self.yaw = turned(self.time)
        self.given = gnss.velocity is not None and gnss.velocity_std is not None
        steps = np.diff(self.time)
        self.position = displacement(gnss.position[shown], gnss.position[shown[0]], geodetic)
        self.std = gnss.position_std[shown, :2].max(axis=1)
        if self.given and gnss.velocity is not None and gnss.velocity_std is not None:
            self.velocity, self.velocity_std = gnss.velocity[shown], gnss.velocity_std[shown]
            moved = 0.5 * (self.velocity[1:] + self.velocity[:-1]) * steps[:, None]
            own = self.velocity_std[:, :2].max(axis=1)
            noise = steps**2 * np.maximum(own[1:], own[:-1]) ** 2
        else:
            moved = np.diff(self.position, axis=0)
            noise = np.zeros(len(steps))
        back = np.exp(-0.5j * (self.yaw[1:] + self.yaw[:-1]))
        self.sum = np.concatenate([[0.0], np.cumsum((moved[:, 0] + 1j * moved[:, 1]) * back)])
        # the noise of a position in between counts as far as the vehicle turns there
        bends = np.abs(np.diff(back)) ** 2 * self.std[1:-1] ** 2
        self.noise = np.concatenate([[0.0], np.cumsum(noise)])
        self.bends = np.concatenate([[0.0, 0.0], np.cumsum(bends)]) if not self.given else np.zeros(len(self.time))

    def heading_std(self, first: int, last: int, bias_std: float) -> Array:
        """Return how sure the heading is that fixes from each of first ... last - 1 to the last one tell, rad."""
        begin = np.arange(first, last)
        length = np.abs(self.sum[last] - self.sum[begin])
        duration = self.time[last] - self.time[begin]
        noise = self.noise[last] - self.noise[begin] + self.bends[last] - self.bends[begin + 1]
        if not self.given:
            noise = noise + self.std[begin] ** 2 + self.std[last] ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            told = np.where(length > SLOWEST * duration, np.sqrt(noise) / length, np.inf)
        return np.asarray(np.sqrt(told**2 + (0.5 * bias_std * duration) ** 2 + SLIP_STD**2))

    def motion(self, first: int, last: int, std: float) -> GroundMotion:
        """Return the motion at the first of some fixes, whose last one is given."""
        along = np.exp(1j * np.angle(self.sum[last] - self.sum[first]))
        heading = float(np.angle(along * np.exp(1j * self.yaw[first])))
        return GroundMotion(float(self.time[first]), heading, std, float(self.time[last]))
