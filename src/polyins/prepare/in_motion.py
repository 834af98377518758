r"""In-motion alignment: attitude, velocity and gyro bias at an instant, by least squares over the fixes after it.

With C(t), what the gyros turned since that instant, and the integrals of C f in the axes of the body there, an antenna
at l goes

    p(t) = p + v t + R (iint C f + C l) + g t^2 / 2,        v(t) = v + R (int C f + C (w x l)) + g t

(Wu and Pan, "Velocity/Position Integration Formula", IEEE Trans. Aerosp. Electron. Syst. 49, 2013). Gravity shows roll
and pitch, and what the fixes accelerate the heading, wherever the vehicle looks. The biases bend C and f. Gauss-Newton
starts from several headings, for the sum of squares has several minima: where two are nearly as good, the heading is
not told.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.model.attitude import euler_jacobian, of_rotation_vectors, product, quaternions, rotation_matrices, wrap
from polyins.model.rig import DEG

Array = NDArray[np.float64]

MOST = 200
"""fixes that are used; of more every second or third"""
HEADINGS = 8
"""from which the search begins"""
ITERATIONS = 12
SETTLED = 1e-3
"""of the sum of squares: a smaller change ends the iteration"""
BEHIND = 60.0
"""in the sum of squares: a minimum that much worse is given up"""
BAD = 4.0
"""sigma of the sum of squares: a worse fit has more noise than is stated"""
BY_CHANCE = 3.0
"""sigma of the sum of squares that noise alone may have"""
REFITS = 8
"""by which the noise of the IMUs grows until it explains the fit"""
APART = 20.0 * DEG
"""headings that differ by less are one minimum"""
GRID = 40
"""instants at which the noise of the IMUs enters"""
ROUNDING = 1e-14
"""of the trace of a covariance"""
ANY_HEADING = 180.0 * DEG
"""std that keeps a heading, which nothing tells, where it is"""
P, V, PHI, BG, BA = (slice(k, k + 3) for k in range(0, 15, 3))
DOWN = PHI.stop - 1


@dataclass(frozen=True)
class MeanImu:
    """The mean of the IMUs that turn with the body, from an instant on, and how good it is."""

    time: Array
    """s since that instant, shape (T + 1,), from zero on"""
    dtheta: Array
    """rad, shape (T, 3)"""
    dvel: Array
    """m/s, shape (T, 3)"""
    point: Array
    """where it is, m in the array frame, shape (3,)"""
    bias_std: Array
    """of gyros and accelerometers, rad/s and m/s^2, shape (6,)"""
    walks: tuple[float, float, float]
    """spectral densities of white force, of its integral and of the integral of that, m/s^2 and per s each, squared
    and per Hz: of accelerometers; of what tilts by the gyros' noise and drifts of force; of the gyros' drift"""

    def until(self, time: float) -> MeanImu:
        """Return it up to a time."""
        count = min(len(self.dtheta), int(np.searchsorted(self.time, time)) + 1)
        return replace(self, time=self.time[: count + 1], dtheta=self.dtheta[:count], dvel=self.dvel[:count])

    def noisier(self, times: float) -> MeanImu:
        """Return it with noise whose variance is that many times as large."""
        white, tilting, turning = (times * density for density in self.walks)
        return replace(self, walks=(white, tilting, turning))

    @property
    def rate(self) -> Array:
        """The rate at the beginning, rad/s, shape (3,)."""
        first = slice(0, min(5, len(self.dtheta)))
        return np.asarray(self.dtheta[first].sum(axis=0) / (self.time[first.stop] - self.time[0]))


@dataclass(frozen=True)
class FixSeries:
    """Fixes of an antenna, m and m/s north, east, down."""

    time: Array
    """s since the instant, shape (M,)"""
    position: Array
    """shape (M, 3)"""
    position_std: Array
    """shape (M, 3)"""
    velocity: Array | None
    """shape (M, 3)"""
    velocity_std: Array | None
    """shape (M, 3)"""
    antenna: Array
    """m in the array frame, shape (3,)"""
    gravity: float
    """m/s^2"""

    def until(self, time: float) -> FixSeries:
        """Return those up to a time, thinned out where they are many."""
        count = int(np.searchsorted(self.time, time, "right"))
        part = slice(0, count, max(1, -(-count // MOST)))

        def of(values: Array | None) -> Array | None:
            return None if values is None else values[part]

        return replace(
            self,
            time=self.time[part],
            position=self.position[part],
            position_std=self.position_std[part],
            velocity=of(self.velocity),
            velocity_std=of(self.velocity_std),
        )


@dataclass(frozen=True)
class Prior:
    """What is known at the instant from elsewhere; None: nothing."""

    heading: float | None = None
    """rad"""
    heading_std: float = ANY_HEADING
    velocity: Array | None = None
    """m/s, shape (3,)"""
    velocity_std: float = 0.0
    """m/s"""


@dataclass(frozen=True)
class Minimum:
    """One minimum of the sum of squares."""

    cost: float
    rows: int
    """that were fitted"""
    x: Array
    """position m, velocity m/s, zero, gyro bias rad/s, accelerometer bias m/s^2, shape (15,)"""
    C_nb: Array
    """shape (3, 3)"""
    covariance: Array
    """of x, with phi of the attitude in its place, shape (15, 15)"""

    @property
    def heading(self) -> float:
        """Of the body, rad."""
        return float(np.arctan2(self.C_nb[1, 0], self.C_nb[0, 0]))

    @property
    def unit(self) -> float:
        """What the sum of squares is measured by: the mean square of a row where the fit is worse than the noise."""
        return max(1.0, self.cost / max(1, self.rows - 9))

    @property
    def is_too_bad(self) -> bool:
        """Whether the fit is worse than the noise explains."""
        free = max(1, self.rows - 9)
        return bool(self.cost > free + BAD * np.sqrt(2.0 * free))

    def std(self, part: slice) -> Array:
        """Return the std of a part of x; where the fit is worse than the noise, as much larger."""
        return np.asarray(np.sqrt(self.unit * np.diag(self.covariance)[part]))


class Search:
    """The minima over ever more fixes, each search beginning where the one before ended."""

    def __init__(self, imu: MeanImu, fixes: FixSeries, known: Prior = Prior()) -> None:
        self.imu, self.fixes, self.known = imu, fixes, known
        headings = np.arange(HEADINGS) * 2.0 * np.pi / HEADINGS
        self.lanes = [self._guess(float(h)) for h in ([known.heading] if known.heading is not None else headings)]

    def over(self, time: float) -> list[Minimum]:
        """Return the minima over the fixes up to a time, s, the best first."""
        found = self._solved(time)
        for _ in range(REFITS):
            if not found[0].is_too_bad:
                break
            # the data do not say whose noise it is: that of the IMUs lasts, and so leaves the heading less sure
            self.imu = self.imu.noisier(found[0].unit)
            found = self._solved(time)
        kept: list[Minimum] = []
        for one in found:
            if one.cost < found[0].cost + BEHIND * found[0].unit and all(_apart(one, other) > APART for other in kept):
                kept.append(one)
        self.lanes = [(one.x, one.C_nb) for one in kept]
        return kept

    def _solved(self, time: float) -> list[Minimum]:
        problem = _Problem(self.imu.until(time), self.fixes.until(time), self.known)
        return sorted((problem.solved(x, C_nb) for x, C_nb in self.lanes), key=lambda one: one.cost)

    def with_heading(self, heading: float, std: float, time: float) -> Minimum:
        """Return the minimum near a heading that is known besides, rad."""
        known = replace(self.known, heading=heading, heading_std=std)
        problem = _Problem(self.imu.until(time), self.fixes.until(time), known)
        begins = [self._guess(heading)]
        nearest = min(self.lanes, key=lambda lane: abs(_turn(lane[1], heading)), default=None)
        if nearest is not None:
            begins.append((nearest[0], _rotation(np.array([0.0, 0.0, _turn(nearest[1], heading)])) @ nearest[1]))
        return min((problem.solved(*begin) for begin in begins), key=lambda one: one.cost)

    def _guess(self, heading: float) -> tuple[Array, Array]:
        """Return where a search begins: levelled by the force of the first second."""
        soon = max(1, int(np.searchsorted(self.imu.time, 1.0)))
        down = -self.imu.dvel[:soon].sum(axis=0)
        roll = np.arctan2(down[1], down[2])
        pitch = np.arctan2(-down[0], np.hypot(down[1], down[2]))
        x = np.zeros(15)
        x[P] = self.fixes.position[0]
        if self.known.velocity is not None:
            x[V] = self.known.velocity
        elif self.fixes.velocity is not None:
            x[V] = self.fixes.velocity[0]
        elif len(self.fixes.time) > 1:
            few = min(len(self.fixes.time) - 1, max(1, int(np.searchsorted(self.fixes.time, self.fixes.time[0] + 2.0))))
            x[V] = (self.fixes.position[few] - self.fixes.position[0]) / (self.fixes.time[few] - self.fixes.time[0])
        return x, rotation_matrices(quaternions(np.array([[roll, pitch, heading]])))[0]


class _Problem:
    """The sum of squares over some fixes."""

    def __init__(self, imu: MeanImu, fixes: FixSeries, known: Prior) -> None:
        self.imu, self.fixes, self.known = imu, fixes, known
        self.lever = fixes.antenna - imu.point
        covariances = [_covariances(imu, fixes, axis) for axis in range(3)]
        self.whitening = [np.linalg.inv(_root(imus + gnss)) for imus, gnss in covariances]
        self.shares = [w @ imus @ w.T for w, (imus, _) in zip(self.whitening, covariances, strict=True)]
        """of the IMUs in the whitened errors"""

    def solved(self, x: Array, C_nb: Array) -> Minimum:
        """Return the minimum near a state: Levenberg's and Marquardt's way."""
        damping, heading = 1e-3, np.arctan2(C_nb[1, 0], C_nb[0, 0])
        rows, residual = self._rows(x, C_nb, heading)
        cost = float(residual @ residual)
        for _ in range(ITERATIONS):
            normal, right = rows.T @ rows, rows.T @ residual
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), right)
            further, turned = x + step, _rotation(np.asarray(step[PHI])) @ C_nb
            further[PHI] = 0.0
            new_rows, new_residual = self._rows(further, turned, heading)
            new_cost = float(new_residual @ new_residual)
            if not new_cost < cost:
                damping *= 10.0
                if damping > 1e4:
                    break
                continue
            gained, damping = cost - new_cost, 0.2 * damping
            x, C_nb, rows, residual, cost = further, turned, new_rows, new_residual, new_cost
            if gained < SETTLED:
                break
        return Minimum(cost, len(rows) - 15, x, C_nb, self._covariance(rows))

    def _covariance(self, rows: Array) -> Array:
        """Return the covariance of the state, (15, 15), without what is not told of the heading.

        A turn moves the antenna across what the IMUs feel, which is in part their noise: that part of the information,
        as much as remains of it beside the other states and at its largest, is none.
        """
        covariance = np.linalg.inv(rows.T @ rows)
        others = np.delete(rows, DOWN, axis=1)
        inverse = np.linalg.inv(others.T @ others)
        north, east = self.shares[:2]
        first = others[: len(north)]
        second = others[len(north) : len(north) + len(east)]
        seen = first.T @ north @ first + second.T @ east @ second
        noise = float(np.trace(north) + np.trace(east) - np.trace(inverse @ seen))
        noise += BY_CHANCE * np.sqrt(2.0 * max(0.0, noise))
        variance = covariance[DOWN, DOWN]
        told = 1.0 / max(1.0 / variance - noise, 1.0 / ANY_HEADING**2)
        along = covariance[:, DOWN] / variance
        return np.asarray(covariance + max(0.0, told - variance) * np.outer(along, along))

    def _rows(self, x: Array, C_nb: Array, kept: float) -> tuple[Array, Array]:
        """Return the whitened design, (K, 15), and residual, (K,); `kept`: the heading where nothing tells one."""
        fixes, sums = self.fixes, _sums(self.imu, self.fixes.time, x[BG], x[BA], self.lever)
        time, gravity = fixes.time[:, None], np.array([0.0, 0.0, fixes.gravity])
        moved, gained = sums.moved @ C_nb.T, sums.gained @ C_nb.T
        count, one = len(time), np.eye(3)
        design = np.zeros((count, 3, 15))
        design[:, :, P], design[:, :, V] = one, time[:, :, None] * one
        design[:, :, PHI] = -_skew(moved)
        design[:, :, BG], design[:, :, BA] = C_nb @ sums.moved_by_gyro, C_nb @ sums.moved_by_accel
        off = fixes.position - (x[P] + x[V] * time + moved + 0.5 * gravity * time**2)
        if fixes.velocity is not None:
            second = np.zeros((count, 3, 15))
            second[:, :, V] = one
            second[:, :, PHI] = -_skew(gained)
            second[:, :, BG], second[:, :, BA] = C_nb @ sums.gained_by_gyro, C_nb @ sums.gained_by_accel
            design = np.concatenate([design, second])
            off = np.concatenate([off, fixes.velocity - (x[V] + gained + gravity * time)])
        rows = [self.whitening[k] @ design[:, k] for k in range(3)]
        residual = [self.whitening[k] @ off[:, k] for k in range(3)]
        prior, expected = self._prior(x, C_nb, kept)
        return np.concatenate([*rows, prior]), np.concatenate([*residual, expected])

    def _prior(self, x: Array, C_nb: Array, kept: float) -> tuple[Array, Array]:
        known = self.known
        std = np.full(15, 1e4)
        std[BG], std[BA] = self.imu.bias_std[:3], self.imu.bias_std[3:]
        expected = -x / std
        rows = np.diag(1.0 / std)
        if known.velocity is not None:
            rows[V, V] = np.eye(3) / known.velocity_std
            expected[V] = (known.velocity - x[V]) / known.velocity_std
        attitude = np.array([[np.arctan2(C_nb[2, 1], C_nb[2, 2]), -np.arcsin(np.clip(C_nb[2, 0], -1.0, 1.0)), 0.0]])
        attitude[0, 2] = np.arctan2(C_nb[1, 0], C_nb[0, 0])
        heading, heading_std = (kept, ANY_HEADING) if known.heading is None else (known.heading, known.heading_std)
        rows[PHI, PHI] = 0.0
        rows[DOWN, PHI] = euler_jacobian(attitude)[0, 2] / heading_std
        expected[PHI] = 0.0
        expected[DOWN] = wrap(heading - attitude[0, 2]) / heading_std
        return rows, expected


@dataclass(frozen=True)
class _Sums:
    """What the antenna moves and gains since the instant, in the axes of the body there, and what biases change."""

    moved: Array
    """m, shape (M, 3)"""
    gained: Array
    """m/s, shape (M, 3)"""
    moved_by_gyro: Array
    """m per rad/s, shape (M, 3, 3)"""
    gained_by_gyro: Array
    moved_by_accel: Array
    gained_by_accel: Array


def _sums(imu: MeanImu, time: Array, gyro_bias: Array, accel_bias: Array, lever: Array) -> _Sums:
    """Integrate the increments, less biases, up to some times.

    A gyro bias b turns C to (I - (int C b) x) C, and so bends all that follows.
    """
    dt = np.diff(imu.time)
    dtheta, dvel = imu.dtheta - gyro_bias * dt[:, None], imu.dvel - accel_bias * dt[:, None]
    C = rotation_matrices(_in_turn(of_rotation_vectors(dtheta)))
    force = np.einsum("tij,tj->ti", C[:-1], dvel + 0.5 * _cross(dtheta, dvel))
    speed = _summed(force)
    way = _summed((speed[:-1] + 0.5 * force) * dt[:, None])
    turns = _summed(0.5 * (C[:-1] + C[1:]) * dt[:, None, None])
    turned_ways = _summed(0.5 * (turns[:-1] + turns[1:]) * dt[:, None, None])
    bent = _skew(force) @ (0.5 * (turns[:-1] + turns[1:]))
    bent_speed = _summed(bent)
    bent_way = _summed((bent_speed[:-1] + 0.5 * bent) * dt[:, None, None])
    k = np.clip(np.searchsorted(imu.time, time, "right") - 1, 0, len(dt) - 1)
    share = (time - imu.time[k]) / dt[k]

    def at(values: Array) -> Array:
        part = share.reshape(-1, *([1] * (values.ndim - 1)))
        return np.asarray(values[k] + part * (values[k + 1] - values[k]))

    now = C[k] @ rotation_matrices(of_rotation_vectors(dtheta[k] * share[:, None]))
    arm, swing = now @ lever, np.einsum("tij,tj->ti", now, _cross(dtheta[k] / dt[k, None], lever))
    after = (time - imu.time[k])[:, None]
    moved = way[k] + speed[k] * after + 0.5 * force[k] / dt[k, None] * after**2
    turns_now = at(turns)
    return _Sums(
        moved=moved + arm,
        gained=at(speed) + swing,
        moved_by_gyro=at(bent_way) + _skew(arm) @ turns_now,
        gained_by_gyro=at(bent_speed) + _skew(swing) @ turns_now + now @ _skew(lever[None, :])[0],
        moved_by_accel=-at(turned_ways),
        gained_by_accel=-turns_now,
    )


def _summed(steps: Array) -> Array:
    """Return the sums before each step and after the last."""
    return np.concatenate([np.zeros((1, *steps.shape[1:])), np.cumsum(steps, axis=0)])


def _in_turn(rotations: Array) -> Array:
    """Return the products of the first 0, 1, ... quaternions, shape (T + 1, 4), by doubling."""
    found = np.concatenate([[[1.0, 0.0, 0.0, 0.0]], rotations])
    reach = 1
    while reach < len(found):
        found = np.concatenate([found[:reach], product(found[:-reach], found[reach:])])
        reach *= 2
    return found


def _covariances(imu: MeanImu, fixes: FixSeries, axis: int) -> tuple[Array, Array]:
    """Return the covariances of positions, then velocities, of an axis by the noise of the IMUs and of the fixes.

    The noise of the IMUs since the instant is in all later fixes: it enters on a grid of instants.
    """
    time, count = fixes.time, len(fixes.time)
    edges = np.linspace(0.0, time[-1], GRID + 1)
    since = np.maximum(time[:, None] - 0.5 * (edges[1:] + edges[:-1]), 0.0)
    width = edges[1] - edges[0]
    variance = [fixes.position_std[:, axis] ** 2]
    if fixes.velocity_std is not None:
        variance.append(fixes.velocity_std[:, axis] ** 2)
    size = len(variance) * count
    covariance = np.zeros((size, size))
    responses = ((since, (since > 0.0) * 1.0), (since**2 / 2.0, since), (since**3 / 6.0, since**2 / 2.0))
    for density, (of_position, of_velocity) in zip(imu.walks, responses, strict=True):
        response = np.concatenate([of_position, of_velocity][: len(variance)])
        covariance += density * width * response @ response.T
    return covariance, np.diag(np.concatenate(variance))


def _root(covariance: Array) -> Array:
    """Return the Cholesky factor; over minutes what IMUs do to positions outgrows good fixes by all digits."""
    try:
        return np.asarray(np.linalg.cholesky(covariance))
    except np.linalg.LinAlgError:
        rounding = ROUNDING * float(np.trace(covariance))
        return np.asarray(np.linalg.cholesky(covariance + rounding * np.eye(len(covariance))))


def _skew(vector: Array) -> Array:
    """Return the matrices of the cross product, shape (T, 3, 3), of vectors, shape (T, 3)."""
    x, y, z = vector.T
    found = np.zeros((len(vector), 3, 3))
    found[:, 0, 1], found[:, 0, 2], found[:, 1, 2] = -z, y, -x
    found[:, 1, 0], found[:, 2, 0], found[:, 2, 1] = z, -y, x
    return found


def _cross(one: Array, other: Array) -> Array:
    """Return the cross products of vectors, shape (T, 3) and (T, 3) or (3,): that of NumPy takes five times as long."""
    a, b, c = one.T
    x, y, z = other.T
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)


def _rotation(vector: Array) -> Array:
    return np.asarray(rotation_matrices(of_rotation_vectors(vector[None, :]))[0])


def _turn(C_nb: Array, heading: float) -> float:
    """Return by how much a heading is farther than that of an attitude, rad."""
    return float(wrap(heading - np.arctan2(C_nb[1, 0], C_nb[0, 0])))


def _apart(one: Minimum, other: Minimum) -> float:
    """Return the angle between two attitudes, rad."""
    trace = np.trace(one.C_nb.T @ other.C_nb)
    return float(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))
