"""The clock of a receiver, and of sensors beside it, against that of the IMUs on a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from polyins.calibration.first_trajectory import Jerks, first_nodes
from polyins.calibration.preintegration import Increments
from polyins.calibration.sightings import Sightings
from polyins.calibration.leaps import MOST, Parts
from polyins.calibration.offsets import ambiguous, candidates
from polyins.calibration.trajectory import ClockTerms, Inertial, Solved, Trajectory, World
from polyins.errors import InputError
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, GnssStream, ImuStream, Offset
from polyins.model.rig import PPM, Imu, NoiseGrade
from polyins.prepare.timesync import align

LONGEST_NODE = 1.0
"""s from one node of the trajectory to the next"""
MARGIN = 2.0
"""s before the first fix and after the last that the trajectory goes on"""
OFFSET_STD, DRIFT_STD = 10.0, 500.0 * PPM
"""s and relative: what is known of clocks beforehand"""
JERK_WINDOW = 0.5
"""s from one jerk to one that differs"""
ROUNDS = 3
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


def receiver_offset(body: Body, path: Path) -> Offset:
    """Find what to add to the stamps of a receiver to put them on the clock of the IMUs on a body.

    Its latency is part of that. Raises InputError where its motion is not that of the IMUs, or fits at several offsets.
    """
    gnss = path.gnss
    jerks = Jerks(gnss.time, path.position)
    pair = f"{path.name} and the IMUs"
    terms = Terms(float(np.round(np.mean(gnss.time[[0, -1]]))))
    first = [np.array([coarse, 0.0]) for coarse in candidates(jerks, body.jerks, pair, JERK_WINDOW)]
    solved, *others = sorted((solve(body, path, terms, values) for values in first), key=lambda one: one.misfit)
    if not np.isfinite(solved.misfit):
        raise InputError(f"time_offset: {path.name}: its motion does not fit that of the IMUs at any offset")
    for other in others:
        if other.misfit < WORSE * solved.misfit:
            raise ambiguous(pair, solved.clocks[path.name][0], other.clocks[path.name][0])
    for _ in range(MOST):
        leap = _leap(solved, path, terms)
        if leap is None:
            break
        terms = replace(terms, leaps=tuple(sorted((*terms.leaps, leap))))
        solved = solve(body, path, terms, np.array([*solved.clocks[path.name][:2], *[0.0] * len(terms.leaps)]))
    values = solved.clocks[path.name]
    std = np.sqrt(np.diag(solved.covariance[path.name]) * max(1.0, solved.misfit))
    leaps = zip(terms.leaps, values[2:].tolist(), std[2:].tolist(), strict=True)
    return Offset(
        path.name, float(values[0]), float(std[0]), None, float(values[1]), float(std[1]), terms.reference, tuple(leaps)
    )


def solve(body: Body, path: Path, terms: Terms, values: Array) -> Solved:
    """Return the likeliest trajectory and clock, from first values of its terms, which must be right to half a second.

    The misfit is infinite where least squares do not converge.
    """
    gnss, begin = path.gnss, values
    for _ in range(ROUNDS):
        time = gnss.time + terms.columns(gnss.time) @ begin
        own, increments = body.within(float(time[0]) - MARGIN, float(time[-1]) + MARGIN)
        cut = Increments.of(own, increments, node_length(own, gnss.time))
        nodes = first_nodes(cut, time, path.position, gnss.velocity, path.world)
        columns = {f"{one.stream}/{one.kind}": terms.columns(one.stamps) for one in path.seen}
        clocks = {path.name: ClockTerms(columns, begin, terms.std, values)}
        inertial = Inertial(cut, body.noise, body.start_std)
        solved = Trajectory(path.world, inertial, path.seen, clocks, nodes).solve()
        found = solved.clocks[path.name]
        moved, begin = abs(found[0] - begin[0]), found
        if solved.converged and moved < 0.5 * MARGIN:
            return solved
    return replace(solved, misfit=np.inf)


def node_length(time: Array, fixes: Array) -> int:
    """Return the epochs from one node to the next, so that not much happens between a node and a fix."""
    interval = float(np.median(np.diff(time)))
    return max(1, round(min(LONGEST_NODE, max(0.2, float(np.median(np.diff(fixes))))) / interval))


def _leap(solved: Solved, path: Path, terms: Terms) -> float | None:
    """Return the stamp of the first fix after a leap that the terms do not have, s."""
    stamps = path.gnss.time
    usual = float(np.median(np.diff(stamps)))
    length = max(PART_S, LEAST_FIXES * usual, (stamps[-1] - stamps[0]) / MOST_PARTS)
    edges = np.arange(stamps[0], stamps[-1] - 0.5 * length, length)
    rough = _parts(solved, path, terms, edges).leap()
    if rough is None:
        return None
    k = int(np.searchsorted(edges, rough))
    near = stamps[(stamps > edges[k - 1]) & (stamps < (edges[k + 1] if k + 1 < len(edges) else np.inf))]
    return _parts(solved, path, terms, np.union1d(edges, near)).leap()


def _parts(solved: Solved, path: Path, terms: Terms, edges: Array) -> Parts:
    """Return what the fixes from each of the stamps on tell of the clock, s, beyond the terms that are known."""
    values, clocks, seen = solved.clocks[path.name], {}, []
    for one in path.seen:
        part = np.searchsorted(edges, one.stamps, "right") - 1
        clocks[f"{one.stream}/{one.kind}"] = (part[:, None] == np.arange(len(edges))).astype(float)
        seen.append(replace(one, stamps=one.stamps + terms.columns(one.stamps) @ values))
    none = np.zeros(len(edges))
    unknown = {path.name: ClockTerms(clocks, none, np.full(len(edges), OFFSET_STD), none)}
    offsets, covariance = replace(solved.trajectory, seen=seen, clocks=unknown).shown(path.name)
    middles = 0.5 * (edges + np.append(edges[1:], path.gnss.time[-1]))
    return Parts(edges, middles, offsets, covariance)
