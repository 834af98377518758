"""Clocks from a whole recording: the likeliest trajectory, errors of the IMU, and what the clocks of others are off.

A position that is measured tau later than its stamp says lies velocity x tau ahead. Part of that the trajectory can
take up: its own start, its velocity, tilts and biases. What remains tells tau. So all are unknowns of one least-squares
problem: nodes every second, between them what the IMU measured with its random walks, at the fixes what the receiver
measured, and for each clock the terms of its correction. Gauss-Newton steps solve it; the inverse of the normal matrix,
with all but the clocks eliminated, is their covariance, which no other unbiased estimate goes below (Cramer-Rao).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from polyins.calibration.preintegration import Increments, Preintegrated, cross, rotation, rotation_vector
from polyins.calibration.sightings import POSITION, SLOW, STATES, TURN, VELOCITY, Instants, Nodes, Predicted, Sightings
from polyins.model.recording import Array
from polyins.model.rig import NoiseGrade

ROUNDS = 40
STILL = 1e-3
"""of its std: clocks that move less have converged"""
HUBER = 3.0
"""standard deviations, from which a value weighs less"""
VAGUE = (1e3, 1e2, 2.0)
"""m, m/s, rad: of the first node"""
EARTH_RATE = 7.292115e-5  # rad/s
EARTH_RADIUS = 6.371e6  # m


@dataclass(frozen=True)
class World:
    """Where the tangent plane lies."""

    gravity: float
    """m/s^2"""
    latitude: float | None
    """rad; None: a plane that does not turn"""

    @property
    def turns(self) -> Array:
        """The Earth's rate, rad/s north, east, down."""
        if self.latitude is None:
            return np.zeros(3)
        return EARTH_RATE * np.array([np.cos(self.latitude), 0.0, -np.sin(self.latitude)])

    def pull(self, position: Array) -> Array:
        """Return gravity at positions on the plane, shape (N, 3): it points to the middle of the Earth."""
        pull = np.zeros_like(position)
        pull[:, 2] = self.gravity
        if self.latitude is not None:
            pull[:, :2] = -self.gravity / EARTH_RADIUS * position[:, :2]
            pull[:, 2] += 2.0 * self.gravity / EARTH_RADIUS * position[:, 2]
        return pull


@dataclass(frozen=True)
class Inertial:
    """The IMU and what is known of it."""

    increments: Increments
    noise: NoiseGrade
    start_std: Array
    """of its slow errors, shape (12,)"""


@dataclass(frozen=True)
class ClockTerms:
    """The terms of what is added to the stamps of a stream, one column each."""

    columns: Mapping[str, Array]
    """by the key of what they stamp, shape (M, P) each"""
    values: Array
    """shape (P,)"""
    std: Array
    """known beforehand, shape (P,)"""
    about: Array
    """what they were known to be about, shape (P,)"""


@dataclass(frozen=True)
class Solved:
    """The likeliest trajectory and clocks."""

    trajectory: Trajectory
    clocks: Mapping[str, Array]
    """the values of the terms"""
    covariance: Mapping[str, Array]
    """of the terms of each clock, as the noise figures have it"""
    misfit: float
    """the least sum of squares over what it is with right noise figures"""
    converged: bool


@dataclass
class _Normal:
    """The normal equations: blocks of nodes, of neighbours, and what all share."""

    own: Array
    """shape (N, 21, 21)"""
    next: Array
    """shape (N - 1, 21, 21): rows of a node, columns of the next"""
    shared: Array
    """shape (N, 21, P)"""
    right: Array
    """shape (N, 21)"""
    corner: Array
    """shape (P, P)"""
    corner_right: Array
    """shape (P,)"""
    cost: float = 0.0

    def solve(self, damping: float) -> tuple[Array, Array, Array]:
        """Return the steps of nodes, (N, 21), of what is shared, (P,), and the covariance of the latter."""
        count, size = self.right.shape
        shared = self.corner.shape[0]
        bordered = np.concatenate([self.shared, self.right[:, :, None]], axis=2)
        corner = np.column_stack([self.corner, self.corner_right])
        solved: list[Array] = []
        block = carried = np.zeros(0)
        for k in range(count):
            own = self.own[k] + damping * np.diag(np.diag(self.own[k]))
            right = bordered[k]
            if k:
                own, right = own - self.next[k - 1].T @ block, right - self.next[k - 1].T @ carried
            wide = np.concatenate([self.next[k], right], axis=1) if k < count - 1 else right
            scale = 1.0 / np.sqrt(np.diag(own))
            answer = scale[:, None] * np.linalg.solve(own * np.outer(scale, scale), scale[:, None] * wide)
            block, carried = answer[:, : wide.shape[1] - shared - 1], answer[:, wide.shape[1] - shared - 1 :]
            corner = corner - right[:, :shared].T @ carried
            solved.append(answer)
        covariance = np.asarray(np.linalg.inv(corner[:, :shared]), dtype=np.float64)
        step = covariance @ corner[:, shared]
        nodes = np.zeros((count, size))
        for k in range(count - 1, -1, -1):
            answer = solved[k]
            nodes[k] = answer[:, -1] - answer[:, -1 - shared : -1] @ step
            if k < count - 1:
                nodes[k] -= answer[:, :size] @ nodes[k + 1]
        return nodes, np.asarray(step, dtype=np.float64), covariance


@dataclass(frozen=True)
class Trajectory:
    """The problem: an IMU, what others measured, and what is unknown of their clocks."""

    world: World
    imu: Inertial
    seen: Sequence[Sightings]
    clocks: Mapping[str, ClockTerms]
    nodes: Nodes
    offsets: Mapping[str, Array] = field(default_factory=dict)
    """constant errors of sensors, by the keys of what they show"""

    def solve(self) -> Solved:
        """Return the least-squares solution, by damped Gauss-Newton steps."""
        problem, damping, eases = self, 1e-4, 0.1
        normal = problem._normal()
        for _ in range(ROUNDS):
            nodes, step, covariance = normal.solve(damping)
            trial = problem._moved(nodes, step)
            after = trial._normal()
            # a step that gains nothing is one too far, or the end
            if not after.cost < normal.cost * (1.0 + 1e-9):
                if damping > 1e6:
                    break
                damping, eases = 10.0 * damping, 1.0
                continue
            done = bool(np.all(np.abs(step) <= STILL * np.sqrt(np.diag(covariance)))) and damping < 1e-2
            problem, normal, damping, eases = trial, after, max(eases * damping, 1e-9), 0.1
            if done:
                break
        else:
            done = False
        return problem._solved(normal, done)

    def misfits(self, seen: Sightings, time: Array) -> Array:
        """Return the squares of the residuals of values, each over its std, if they are measured then, shape (M,)."""
        measured = self.imu.increments.preintegrated(self.nodes.errors[:-1])
        at = Instants.at(np.clip(time, measured.time[0, 0], measured.time[-1, -1]), self.nodes, measured)
        residual = seen.predicted(at, self._offsets(seen)).residual
        return np.asarray(np.sum((residual / seen.std) ** 2, axis=1))

    def _solved(self, normal: _Normal, converged: bool) -> Solved:
        covariance = normal.solve(0.0)[2]
        where = self._columns()
        of_clocks = {name: covariance[where[name], where[name]] for name in self.clocks}
        values = {name: clock.values for name, clock in self.clocks.items()}
        # as many equations as unknowns, but for the values that were measured
        expected = sum(seen.std.size for seen in self.seen)
        return Solved(self, values, of_clocks, normal.cost / max(expected, 1), converged)

    def shown(self, name: str) -> tuple[Array, Array]:
        """Return a Gauss-Newton step of the terms of a clock, (P,), and its covariance, (P, P)."""
        _, step, covariance = self._normal().solve(0.0)
        where = self._columns()[name]
        return step[where], covariance[where, where]

    def _columns(self) -> dict[str, slice]:
        """Return where the unknowns that are no node's stand: clocks, then constant errors."""
        where, begin = {}, 0
        sizes = {name: len(clock.values) for name, clock in self.clocks.items()}
        sizes |= {seen.key: len(seen.offset_std) for seen in self.seen}
        for name, size in sizes.items():
            where[name], begin = slice(begin, begin + size), begin + size
        return where

    def _moved(self, nodes: Array, step: Array) -> Trajectory:
        where = self._columns()
        clocks = {name: replace(clock, values=clock.values + step[where[name]]) for name, clock in self.clocks.items()}
        offsets = {seen.key: self._offsets(seen) + step[where[seen.key]] for seen in self.seen}
        return replace(self, nodes=self.nodes.moved(nodes), clocks=clocks, offsets=offsets)

    def _offsets(self, seen: Sightings) -> Array:
        return np.asarray(self.offsets.get(seen.key, np.zeros(len(seen.offset_std))))

    def _normal(self) -> _Normal:
        count, where = len(self.nodes.position), self._columns()
        shared = max((columns.stop for columns in where.values()), default=0)
        normal = _Normal(
            np.zeros((count, STATES, STATES)), np.zeros((count - 1, STATES, STATES)),
            np.zeros((count, STATES, shared)), np.zeros((count, STATES)), np.zeros((shared, shared)), np.zeros(shared),
        )  # fmt: skip
        measured = self.imu.increments.preintegrated(self.nodes.errors[:-1])
        self._add_start(normal)
        self._add_motion(normal, measured)
        for seen in self.seen:
            self._add_seen(normal, seen, measured)
        for name, clock in self.clocks.items():
            _add_prior(normal, where[name], clock.values - clock.about, clock.std)
        for seen in self.seen:
            _add_prior(normal, where[seen.key], self._offsets(seen), seen.offset_std)
        return normal

    def _add_start(self, normal: _Normal) -> None:
        std = np.concatenate([np.repeat(VAGUE, 3), np.maximum(self.imu.start_std, 1e-9)])
        off = np.concatenate([np.zeros(9), -self.nodes.errors[0]])
        normal.own[0] += np.diag(1.0 / std**2)
        normal.right[0] += off / std**2
        normal.cost += float(np.sum((off / std) ** 2))

    def _add_motion(self, normal: _Normal, measured: Preintegrated) -> None:
        """Add what ties each node to the next."""
        nodes, noise = self.nodes, self.imu.noise
        span = (measured.time[:, -1] - measured.time[:, 0])[:, None]
        turned, velocity, position = measured.turned[:, -1], measured.velocity[:, -1], measured.position[:, -1]
        first, gravity = nodes.attitude[:-1], nodes.gravity[:-1]
        turns = self.world.turns
        middle = rotation(-0.5 * span * turns) @ first
        forced = gravity - 2.0 * np.cross(turns, 0.5 * (nodes.velocity[1:] + nodes.velocity[:-1]))
        predicted = rotation(-span * turns) @ first @ turned
        residual = np.concatenate(
            [
                nodes.position[1:] - nodes.position[:-1] - nodes.velocity[:-1] * span - 0.5 * forced * span**2
                - np.einsum("kab,kb->ka", middle, position),
                nodes.velocity[1:] - nodes.velocity[:-1] - forced * span - np.einsum("kab,kb->ka", middle, velocity),
                rotation_vector(predicted.mT @ nodes.attitude[1:]),
                nodes.errors[1:] - np.exp(-span / noise.correlation_time) * nodes.errors[:-1],
            ],
            axis=1,
        )  # fmt: skip
        count = len(span)
        before, after = np.zeros((count, STATES, STATES)), np.tile(np.eye(STATES), (count, 1, 1))
        before[:, POSITION, POSITION] = before[:, VELOCITY, VELOCITY] = -np.eye(3)
        before[:, POSITION, VELOCITY] = -span[:, :, None] * np.eye(3)
        before[:, POSITION, TURN] = middle @ cross(position)
        before[:, VELOCITY, TURN] = middle @ cross(velocity)
        before[:, TURN, TURN] = -turned.mT
        before[:, POSITION, SLOW] = -middle @ measured.position_by[:, -1]
        before[:, VELOCITY, SLOW] = -middle @ measured.velocity_by[:, -1]
        before[:, TURN, SLOW] = -measured.turned_by[:, -1]
        before[:, SLOW, SLOW] = -np.exp(-span / noise.correlation_time)[:, :, None] * np.eye(SLOW.stop - SLOW.start)
        root = _root_of_weight(span[:, 0], noise)
        before, after, residual = root @ before, root @ after, np.einsum("kab,kb->ka", root, residual)
        normal.own[:-1] += before.mT @ before
        normal.own[1:] += after.mT @ after
        normal.next += before.mT @ after
        normal.right[:-1] -= np.einsum("kba,kb->ka", before, residual)
        normal.right[1:] -= np.einsum("kba,kb->ka", after, residual)
        normal.cost += float(np.sum(residual**2))

    def _predicted(
        self, seen: Sightings, measured: Preintegrated
    ) -> tuple[Sightings, tuple[Instants, Array], Predicted]:
        """Return the values within the trajectory, their instants, the terms of their clock, and what is predicted."""
        clock = self.clocks.get(seen.stream)
        columns = np.zeros((len(seen.stamps), 0)) if clock is None else clock.columns[seen.key]
        time = seen.stamps if clock is None else seen.stamps + columns @ clock.values
        within = (time >= measured.time[0, 0]) & (time <= measured.time[-1, -1])
        part = seen.at(within)
        at = Instants.at(time[within], self.nodes, measured)
        return part, (at, columns[within]), part.predicted(at, self._offsets(seen))

    def _add_seen(self, normal: _Normal, seen: Sightings, measured: Preintegrated) -> None:
        part, (at, columns), predicted = self._predicted(seen, measured)
        where = self._columns()
        size = np.sqrt(np.mean((predicted.residual / part.std) ** 2, axis=1))
        weight = np.minimum(1.0, HUBER / np.maximum(size, 1e-300))
        root = np.sqrt(weight)[:, None] / part.std
        residual, by = predicted.residual * root, predicted.by_states * root[:, :, None]
        shared = np.zeros((*residual.shape, normal.corner.shape[0]))
        if seen.stream in self.clocks:
            shared[:, :, where[seen.stream]] = (predicted.by_time * root)[:, :, None] * columns[:, None, :]
        shared[:, :, where[seen.key]] = predicted.by_offsets * root[:, :, None]
        np.add.at(normal.own, at.node, by.mT @ by)
        np.add.at(normal.shared, at.node, by.mT @ shared)
        np.add.at(normal.right, at.node, np.einsum("mdb,md->mb", by, residual))
        normal.corner += np.einsum("mda,mdb->ab", shared, shared)
        normal.corner_right += np.einsum("mda,md->a", shared, residual)
        dim = residual.shape[1]
        normal.cost += float(dim * np.sum(np.where(size < HUBER, size**2, HUBER * (2.0 * size - HUBER))))


def _add_prior(normal: _Normal, where: slice, values: Array, std: Array) -> None:
    rows = np.arange(where.start, where.stop)
    normal.corner[rows, rows] += 1.0 / std**2
    normal.corner_right[where] -= values / std**2
    normal.cost += float(np.sum((values / std) ** 2))


def _root_of_weight(span: Array, noise: NoiseGrade) -> Array:
    """Return the matrices that make the residuals between nodes white, shape (K, 21, 21)."""
    covariance = np.zeros((len(span), STATES, STATES))
    velocity = float(np.mean(noise.velocity_random_walk**2))
    for axis in range(3):
        covariance[:, axis, axis] = velocity * span**3 / 3.0
        covariance[:, axis, 3 + axis] = covariance[:, 3 + axis, axis] = velocity * span**2 / 2.0
        covariance[:, 3 + axis, 3 + axis] = velocity * span
        covariance[:, 6 + axis, 6 + axis] = noise.angle_random_walk[axis] ** 2 * span
    forgets = -np.expm1(-2.0 * span / noise.correlation_time)
    for i, std in enumerate(noise.steady_std()):
        covariance[:, SLOW.start + i, SLOW.start + i] = np.maximum(std, 1e-12) ** 2 * forgets
    scale = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    scaled = covariance / (scale[:, :, None] * scale[:, None, :])
    return np.asarray(np.linalg.inv(np.linalg.cholesky(scaled)) / scale[:, None, :])
