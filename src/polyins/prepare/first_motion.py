"""How an array begins where no standstill says it all: from the first fixes that tell attitude and velocity.

What the fixes accelerate against what the IMUs feel shows the heading, whatever the vehicle is and wherever it looks.
Only where that does not tell it, and does not say otherwise, the course over ground counts as heading. Ever more fixes
are taken until they decide, so that further data change nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.kernels import earth
from polyins.model.geodesy import displacement
from polyins.model.recording import GnssStream, Recording
from polyins.model.rig import DEG
from polyins.prepare.in_motion import BG, PHI, FixSeries, MeanImu, Minimum, Prior, Search, V
from polyins.prepare.timesync import Aligned
from polyins.prepare.under_way import AROUND, agreeing

Array = NDArray[np.float64]

WINDOWS = (3.0, 5.0, 8.0, 12.0, 18.0, 27.0, 40.0, 60.0)
"""s of fixes, one after the other"""
LONGEST = WINDOWS[-1]
SURE = 5.0 * DEG
"""std of a heading at which the search ends"""
LEAST = 15.0 * DEG
"""a heading less sure than that is none"""
LEVEL = 1.0 * DEG
"""std of roll and pitch at which it ends where the heading is given"""
ALONE = 16.0
"""in the sum of squares: a second minimum within that may be the right one"""
CONTRADICTED = 12.0
"""in the sum of squares: a course that costs more is no heading"""
NEXT = 30.0
"""s after which it is tried anew where nothing told the heading"""
LATEST = 300.0
"""s within which it is tried"""
FEWEST = 4
"""fixes"""
SETTLING = AROUND // 2
"""fixes after a window, until which its last ones may still turn out to lie"""
AGAIN = 2.0
"""times the std: the filter sees the same fixes again, and then claims 1 / sqrt(1 + 1 / 4) of what they earned"""
LEAST_TILT_STD = 0.1 * DEG
LEAST_VELOCITY_STD = 0.05  # m/s
MOVES = 6.0
"""sigma by which the sum of squares of fixes exceeds that of a fixed place where something moves"""
STEP = 0.05
"""s: increments are summed over about that"""

Course = Callable[[float, float], tuple[float, float] | None]
"""heading at a time by the course over ground, and its std, rad, with fixes from that time to another; None: none"""


@dataclass(frozen=True)
class FirstMotion:
    """The state of the array origin at an epoch in motion."""

    time: float
    """s, of the epoch"""
    until: float
    """s: of the last fix that was used"""
    attitude: Array
    """roll, pitch, heading, rad"""
    attitude_std: Array
    """rad, of phi"""
    velocity: Array
    """m/s"""
    velocity_std: Array
    """m/s"""
    gyro_bias: Array
    """of the mean of the IMUs, beyond what was known, rad/s"""
    gyro_bias_std: Array
    """rad/s"""
    told_by: str
    """what told the heading"""
    decided: bool
    """whether further data leave it as it is"""


class Beginning:
    """The search for it in a recording."""

    def __init__(self, recording: Recording, aligned: Aligned, errors: Array, error_std: Array) -> None:
        """`errors`, `error_std`: what is known of the IMUs that turn with the body, shape (N, 12)."""
        self.recording, self.aligned = recording, aligned
        self.bodies = [i for i, imu in enumerate(recording.rig.imus) if imu.wheel is None]
        self.errors, self.error_std = errors[self.bodies], error_std[self.bodies]
        assert recording.gnss is not None
        self.gnss: GnssStream = recording.gnss

    def find(self, begin: float, known: Prior, course: Course) -> FirstMotion | None:
        """Return the state at a time, or later where nothing moves yet; what is `known` is known at that time."""
        last, whole = min(float(self.gnss.time[-1]), float(self.aligned.time[-1])), True
        while True:
            found = self.at(begin, known, course)
            if found is not None:
                return replace(found, decided=found.decided and whole)
            if begin + NEXT > last or begin > self.aligned.time[0] + LATEST:
                return None
            # with more of them the fixes from there on may tell it yet
            whole = whole and last > begin + LONGEST
            begin, known = begin + NEXT, Prior()

    def at(self, begin: float, known: Prior, course: Course) -> FirstMotion | None:
        """Return the state at a time by the fixes of a minute after it; None: they do not tell it."""
        epoch = int(np.searchsorted(self.aligned.time, begin))
        if epoch + 2 > len(self.aligned.time):
            return None
        time = float(self.aligned.time[epoch])
        fixes = self._fixes(time)
        if len(fixes.time) < FEWEST or (known.heading is None and not _moves(fixes)):
            return None
        search = Search(self._imu(time), fixes, known)
        until, best = 0.0, None
        for window in WINDOWS:
            count = int(np.searchsorted(fixes.time, window, "right"))
            if count < FEWEST or until >= fixes.time[-1]:
                continue
            until = float(fixes.time[count - 1])
            minima = search.over(until)
            best = minima[0]
            alone = len(minima) == 1 or minima[1].cost > best.cost + ALONE * best.unit
            std = best.std(PHI)
            enough = std[:2].max() <= LEVEL if known.heading is not None else alone and std[2] <= SURE
            whole = count + SETTLING <= len(fixes.time)
            if enough and whole:
                told = "given" if known.heading is not None else "GNSS accelerations"
                return self._motion(time, until, search, best, (told, True))
        decided = whole and window == LONGEST
        if best is None:
            return None
        if known.heading is not None:
            return self._motion(time, until, search, best, ("given", decided))
        if alone and std[2] <= LEAST:
            return self._motion(time, until, search, best, ("GNSS accelerations", decided))
        along = course(time, time + until)
        if along is None:
            return None
        there = search.with_heading(*along, until)
        if there.cost > best.cost + CONTRADICTED * best.unit or there.std(PHI)[2] > LEAST:
            return None
        return self._motion(time, until, search, there, ("GNSS course", decided))

    def _shown(self, begin: float) -> NDArray[np.intp]:
        """Return the fixes of a minute, and those after it that show whether its last ones lie."""
        time = self.gnss.time[self.gnss.time <= self.aligned.time[-1]]
        end = int(np.searchsorted(time, begin + LONGEST, "right")) + SETTLING
        return np.arange(np.searchsorted(time, begin), min(end, len(time)))

    def _fixes(self, begin: float) -> FixSeries:
        gnss, shown, geodetic = self.gnss, self._shown(begin), self.recording.geodetic
        shown = shown[agreeing(gnss, geodetic, shown)]
        given = gnss.velocity is not None and gnss.velocity_std is not None
        origin = gnss.position[shown[0]] if len(shown) else np.zeros(3)
        return FixSeries(
            time=gnss.time[shown] - begin,
            position=displacement(gnss.position[shown], origin, geodetic),
            position_std=gnss.position_std[shown],
            velocity=gnss.velocity[shown] if gnss.velocity is not None and given else None,
            velocity_std=gnss.velocity_std[shown] if gnss.velocity_std is not None and given else None,
            antenna=self.recording.rig.antenna,
            gravity=earth.gravity(float(origin[0]), float(origin[2])) if geodetic else self.recording.options.gravity,
        )

    def _imu(self, begin: float) -> MeanImu:
        part = self.aligned.between(begin, begin + LONGEST + 1.0)
        known = self.errors.mean(axis=0)[:6]
        steps = part.increments[1:][:, :, self.bodies].mean(axis=2) - known * np.diff(part.time)[:, None]
        # usual rates lie far from where the number changes: live it is that of a whole recording
        together = max(1, int(STEP * self.aligned.rate_hz + 0.3))
        count = len(steps) // together
        sums = steps[: count * together].reshape(count, together, 6).sum(axis=1)
        imus = [self.recording.rig.imus[i] for i in self.bodies]
        return MeanImu(
            time=part.time[: count * together + 1 : together] - part.time[0],
            dtheta=sums[:, :3],
            dvel=sums[:, 3:],
            point=np.mean([imu.position for imu in imus], axis=0),
            bias_std=np.sqrt(np.mean(self.error_std[:, :6] ** 2, axis=0) / len(imus)),
            walks=self._walks(),
        )

    def _walks(self) -> tuple[float, float, float]:
        grades = [self.recording.rig.imus[i].noise for i in self.bodies]

        def mean(values: list[float]) -> float:
            return float(np.mean(values)) / len(grades)

        white = mean([np.max(grade.velocity_random_walk) ** 2 for grade in grades])
        tilting = mean([(9.8 * np.max(grade.angle_random_walk)) ** 2 for grade in grades])
        force = mean([2.0 * np.max(grade.accel_bias_std) ** 2 / grade.correlation_time for grade in grades])
        turning = mean([2.0 * (9.8 * np.max(grade.gyro_bias_std)) ** 2 / grade.correlation_time for grade in grades])
        return white, tilting + force, turning

    def _motion(self, time: float, until: float, search: Search, one: Minimum, told: tuple[str, bool]) -> FirstMotion:
        C = one.C_nb
        roll, pitch = np.arctan2(C[2, 1], C[2, 2]), -np.arcsin(np.clip(C[2, 0], -1.0, 1.0))
        swing = C @ np.cross(search.imu.rate - one.x[BG], search.imu.point)
        # what is told no better than it was known errs as the heading does, which the filter does not know
        bias_std = AGAIN * one.std(BG)
        told_bias = bias_std < search.imu.bias_std[:3] / 2.0
        std = AGAIN * one.std(PHI)
        std[:2] = np.maximum(std[:2], LEAST_TILT_STD)
        return FirstMotion(
            time=time,
            until=time + until,
            attitude=np.array([roll, pitch, one.heading]),
            attitude_std=std,
            velocity=one.x[V] - swing,
            velocity_std=np.maximum(AGAIN * one.std(V), LEAST_VELOCITY_STD),
            gyro_bias=np.where(told_bias, one.x[BG], 0.0),
            gyro_bias_std=np.where(told_bias, bias_std, search.imu.bias_std[:3]),
            told_by=told[0],
            decided=told[1],
        )


def _moves(fixes: FixSeries) -> bool:
    """Whether fixes lie farther apart, or give larger velocities, than their noise explains."""
    off = (fixes.position - np.average(fixes.position, axis=0)) / fixes.position_std
    squares = [off[:, :2]]
    if fixes.velocity is not None and fixes.velocity_std is not None:
        squares.append((fixes.velocity / fixes.velocity_std)[:, :2])
    values = np.concatenate(squares)
    return bool(np.sum(values**2) > values.size + MOVES * np.sqrt(2.0 * values.size))
