"""The clock of a receiver, and of sensors beside it, against that of the IMUs on a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from polyins.calibration.clock_line import DRIFT_STD
from polyins.calibration.first_trajectory import Jerks, first_nodes
from polyins.calibration.leaps import MOST, Parts
from polyins.calibration.offsets import ambiguous, candidates
from polyins.calibration.preintegration import Increments
from polyins.calibration.sightings import Sightings
from polyins.calibration.trajectory import ClockTerms, Inertial, Solved, Trajectory, World
from polyins.errors import InputError
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, GnssStream, ImuStream, Offset
from polyins.model.rig import Imu, NoiseGrade
from polyins.prepare.timesync import align

LONGEST_NODE = 1.0
"""s from one node of the trajectory to the next"""
MARGIN = 2.0
"""s before the first fix and after the last that the trajectory goes on"""
OFFSET_STD = 10.0
"""s: what is known of an offset that is found at first sight"""
JERK_WINDOW = 0.5
"""s from one jerk to one that differs"""
ROUNDS = 3
NEARBY = 8
"""values to both sides of a leap, among which its place is looked for once its size is known"""
WORSE = 2.0
"""times the misfit of the best offset, from which another one is none"""
PART_S, LEAST_FIXES, MOST_PARTS = 5.0, 4, 60
"""s, fixes: what one part of a recording is at least, in which a leap is looked for; and how many at most"""


@dataclass(frozen=True)
class Body:
    """The IMUs on a body, as one at the mean of their places."""

    time: Array
    """s, shape (T,)"""
    increments: Array
    """less the errors known beforehand, shape (T, 6)"""
    noise: NoiseGrade
    start_std: Array
    """shape (12,)"""
    place: Array
    """m, in the array frame"""

    @classmethod
    def of(cls, imus: Sequence[Imu], streams: Sequence[ImuStream]) -> Body:
        """Take the mean of IMUs that share a clock."""
        aligned = align(tuple(streams))
        steps = np.diff(aligned.time, prepend=2.0 * aligned.time[0] - aligned.time[1])[:, None, None]
        known = np.array([imu.initial_errors.as_array() for imu in imus]).T
        biases, scales = known[:6], known[6:]
        increments = (aligned.increments - biases * steps - scales * aligned.increments).mean(axis=2)
        noise = NoiseGrade.typical([imu.noise for imu in imus])
        fewer = np.sqrt(len(imus))
        walks = {"angle_random_walk": noise.angle_random_walk, "velocity_random_walk": noise.velocity_random_walk}
        noise = replace(noise, **{name: walk / fewer for name, walk in walks.items()})
        std = np.sqrt(np.mean([imu.start_std() ** 2 for imu in imus], axis=0))
        return cls(aligned.time, increments, noise, std, np.mean([imu.position for imu in imus], axis=0))

    @property
    def jerks(self) -> Jerks:
        """What positions are compared with at first sight."""
        return Jerks.of_imu(self.time, self.increments)

    def within(self, begin: float, end: float) -> tuple[Array, Array]:
        """Return time and increments of a part."""
        rows = slice(*np.searchsorted(self.time, [begin, end]))
        return self.time[rows], self.increments[rows]


@dataclass(frozen=True)
class Path:
    """What a receiver says, in metres north, east, down of a tangent plane."""

    name: str
    gnss: GnssStream
    position: Array
    world: World
    arm: Array
    """of the antenna from the body's place, m"""

    @classmethod
    def of(cls, name: str, gnss: GnssStream, geodetic: bool, gravity: float, arm: Array) -> Path:
        """Lay the plane through the first fix; `gravity`, m/s^2: where the Earth's is not known."""
        from polyins.kernels.earth import gravity as normal

        origin = gnss.position[0]
        there = World(float(normal(origin[0], origin[2])), float(origin[0])) if geodetic else World(gravity, None)
        return cls(name, gnss, displacement(gnss.position, origin, geodetic), there, arm)

    @property
    def seen(self) -> list[Sightings]:
        """The fixes."""
        gnss = self.gnss
        found = [Sightings(self.name, "position", gnss.time, self.position, gnss.position_std, self.arm)]
        if gnss.velocity is not None and gnss.velocity_std is not None:
            found.append(Sightings(self.name, "velocity", gnss.time, gnss.velocity, gnss.velocity_std, self.arm))
        return found


@dataclass(frozen=True)
class Terms:
    """A clock's correction as a sum of terms, each a function of the stamp."""

    reference: float
    """stamp at which drift adds nothing, s"""
    leaps: tuple[float, ...] = ()
    """stamps from which on a constant is added, s"""

    def columns(self, stamps: Array) -> Array:
        """Return the terms: offset, drift, leaps; shape (M, 2 + L)."""
        after = [(stamps >= leap).astype(float) for leap in self.leaps]
        return np.column_stack([np.ones(len(stamps)), stamps - self.reference, *after])

    @property
    def std(self) -> Array:
        """What is known of their sizes beforehand."""
        return np.array([OFFSET_STD, DRIFT_STD, *[OFFSET_STD] * len(self.leaps)])


@dataclass(frozen=True)
class Problem:
    """A trajectory, and the one clock that is not known."""

    body: Body
    path: Path
    seen: Sequence[Sightings]
    """the fixes, and what else is measured"""
    name: str
    """of the stream whose clock is to be found"""

    @property
    def stamps(self) -> Array:
        """Those of that stream, s."""
        return next(one.stamps for one in self.seen if one.stream == self.name)

    def offset(self, first: Sequence[float]) -> Offset:
        """Find what to add to the stamps, from what may be right to half a second, s.

        Raises InputError where least squares do not converge, and where several offsets fit.
        """
        pair = f"{self.name} and the IMUs"
        terms = Terms(float(np.round(np.mean(self.stamps[[0, -1]]))))
        starts = [np.array([coarse, 0.0]) for coarse in first]
        solved, *others = sorted((self.solve(terms, values) for values in starts), key=lambda one: one.misfit)
        for other in others:
            if other.misfit < min(WORSE * solved.misfit, np.inf):
                raise ambiguous(pair, solved.clocks[self.name][0], other.clocks[self.name][0])
        for _ in range(MOST):
            leap = self._leap(solved, terms)
            if leap is None:
                break
            known = terms
            for _ in range(ROUNDS):
                terms = replace(known, leaps=tuple(sorted((*known.leaps, leap))))
                solved = self.solve(terms, np.array([*solved.clocks[self.name][:2], *[0.0] * len(terms.leaps)]))
                leap, before = self._placed(solved, terms, leap), leap
                if leap == before:
                    break
        if not np.isfinite(solved.misfit):
            raise InputError(f"time_offset: the motions of {pair} do not fit at any offset; expected one drive")
        values = solved.clocks[self.name].tolist()
        std = np.sqrt(np.diag(solved.covariance[self.name]) * max(1.0, solved.misfit)).tolist()
        leaps = tuple(zip(terms.leaps, values[2:], std[2:], strict=True))
        return Offset(self.name, values[0], std[0], None, values[1], std[1], terms.reference, leaps)

    def solve(self, terms: Terms, values: Array) -> Solved:
        """Return the likeliest trajectory and clock; the misfit is infinite where least squares do not converge."""
        gnss, begin = self.path.gnss, values
        known = np.concatenate([values[:1], np.zeros(len(values) - 1)])
        for _ in range(ROUNDS):
            time = gnss.time + (terms.columns(gnss.time) @ begin if self.name == self.path.name else 0.0)
            own, increments = self.body.within(float(time[0]) - MARGIN, float(time[-1]) + MARGIN)
            cut = Increments.of(own, increments, node_length(own, gnss.time))
            nodes = first_nodes(cut, time, self.path.position, gnss.velocity, self.path.world)
            columns = {one.key: terms.columns(one.stamps) for one in self.seen}
            clocks = {self.name: ClockTerms(columns, begin, terms.std, known)}
            inertial = Inertial(cut, self.body.noise, self.body.start_std)
            solved = Trajectory(self.path.world, inertial, self.seen, clocks, nodes).solve()
            found = solved.clocks[self.name]
            moved, begin = abs(found[0] - begin[0]), found
            if not solved.converged:
                break
            if moved < 0.5 * MARGIN:
                return solved
        return replace(solved, misfit=np.inf)

    def _leap(self, solved: Solved, terms: Terms) -> float | None:
        """Return the first stamp after a leap that the terms do not have, s."""
        stamps = self.stamps
        usual = float(np.median(np.diff(stamps)))
        length = max(PART_S, LEAST_FIXES * usual, (stamps[-1] - stamps[0]) / MOST_PARTS)
        edges = np.arange(stamps[0], stamps[-1] - 0.5 * length, length)
        rough = self._parts(solved, terms, edges).leap()
        if rough is None:
            return None
        k = int(np.searchsorted(edges, rough))
        near = stamps[(stamps > edges[k - 1]) & (stamps < (edges[k + 1] if k + 1 < len(edges) else np.inf))]
        return self._parts(solved, terms, np.union1d(edges, near[:: max(1, len(near) // MOST_PARTS)])).leap()

    def _placed(self, solved: Solved, terms: Terms, leap: float) -> float:
        """Return the stamp from which on a leap fits best, among those nearby, s."""
        values, index = solved.clocks[self.name], 2 + terms.leaps.index(leap)
        gains: dict[float, float] = {}
        for one in self.seen:
            if one.stream != self.name:
                continue
            middle = int(np.searchsorted(one.stamps, leap))
            near = one.at(np.arange(max(0, middle - NEARBY), min(middle + NEARBY, len(one.stamps))))
            columns, squares = terms.columns(near.stamps), []
            for there in (0.0, 1.0):
                columns[:, index] = there
                squares.append(solved.trajectory.misfits(near, near.stamps + columns @ values))
            # what is won by counting each and all later ones as after the leap
            won = np.cumsum((squares[0] - squares[1])[::-1])[::-1]
            for stamp, gain in zip(near.stamps.tolist(), won.tolist(), strict=True):
                gains[stamp] = gains.get(stamp, 0.0) + gain
        return max(gains, key=lambda stamp: gains[stamp])

    def _parts(self, solved: Solved, terms: Terms, edges: Array) -> Parts:
        """Return what the values from each of the stamps on tell of the clock, s, beyond the terms that are known."""
        values, columns, seen = solved.clocks[self.name], {}, []
        for one in self.seen:
            if one.stream == self.name:
                part = np.searchsorted(edges, one.stamps, "right") - 1
                columns[one.key] = (part[:, None] == np.arange(len(edges))).astype(float)
                one = replace(one, stamps=one.stamps + terms.columns(one.stamps) @ values)
            seen.append(one)
        none = np.zeros(len(edges))
        unknown = {self.name: ClockTerms(columns, none, np.full(len(edges), OFFSET_STD), none)}
        offsets, covariance = replace(solved.trajectory, seen=seen, clocks=unknown).shown(self.name)
        return Parts(edges, 0.5 * (edges + np.append(edges[1:], self.stamps[-1])), offsets, covariance)


def receiver_offset(body: Body, path: Path) -> Offset:
    """Find what to add to the stamps of a receiver to put them on the clock of the IMUs on a body.

    Its latency is part of that. Raises InputError where its motion is not that of the IMUs, or fits at several offsets.
    """
    jerks = Jerks(path.gnss.time, path.position)
    first = candidates(jerks, body.jerks, f"{path.name} and the IMUs", JERK_WINDOW)
    return Problem(body, path, path.seen, path.name).offset(first)


def node_length(time: Array, fixes: Array) -> int:
    """Return the epochs from one node to the next, so that not much happens between a node and a fix."""
    interval = float(np.median(np.diff(time)))
    return max(1, round(min(LONGEST_NODE, max(0.2, float(np.median(np.diff(fixes))))) / interval))
