"""How the IMUs of a rigid array differ from one another, from any motion that they share.

With the matrices A, B, biases b, c and place l of an IMU, at an instant t + delay of a body that turns with w and whose
origin feels f,

    rates = A w + b,    forces = B (f + K l) + c,    K = [dw/dt x] + [w x][w x].

w and f are the means of what the corrected IMUs show: no IMU is a reference, and the noise of an IMU that is in the
mean too cancels against that of the others. What an IMU differs from the mean is then linear in what its matrix, bias,
place and delay are off by, and is fitted until nothing is left to correct. What all have in common cannot be seen so:
the mean of the matrices, biases and places of the IMUs stays as configured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.common_motion import CommonMotion, common_motion
from polyins.calibration.regression import huber
from polyins.errors import InputError
from polyins.model.recording import Array, ImuStream
from polyins.model.rig import DEG, STANDARD_GRAVITY

ALIKE = 20.0 * DEG
"""IMUs whose axes, as configured, are nearer than this to each other make the frame"""
BLOCKS = 50
"""left out in turn for the uncertainty; each has as much time and motion as any"""
FIRST_ROUNDS, ROUNDS = 3, 20
SETTLED = 1e-8
"""relative, rad or m: smaller corrections end the rounds"""
SHIFTS, CLOSE = 4, 1e-5
"""s: streams are shifted by their delays until less is left"""
_HELD = np.concatenate([np.full(9, 0.1**-2), np.zeros(3), np.full(3, 1.0)])
"""of error matrix, bias and places, m, or delay, s: chips and hands do not err by more than 0.1 and 1"""
CORRELATED = 2.0
"""neighbouring instants count for so many fewer, roughly, where it is judged what can be told at all"""
CLEAR_MATRIX, CLEAR_PLACE, CLEAR_DELAY = 5e-3, 0.01, 2e-3
"""std, relative, m and s, above which the motion does not tell: real chips differ by less"""
CONFIGURED = 0.05
"""share of the mean square of all rates, or of gravity's, that about an axis shows more than lever arms do"""
NEAR_GRAVITY = 3.0
"""m/s^2: a force of another size has more than gravity in it"""
LEAST_TURN = 0.5 * DEG
"""rad/s, rms: less is no motion"""


@dataclass(frozen=True)
class Fitted:
    """What corrects the IMUs' values in array axes: corrected = matrix @ value - bias."""

    matrix: Array
    """shape (N, 3, 3)"""
    bias: Array
    """rad/s or m/s^2, after the matrix, shape (N, 3)"""
    extra: Array
    """delays, s, shape (N, 1), or places from their mean, m, shape (N, 3)"""
    errors: Array
    """what leaving out a block adds to the error matrix, row by row, bias and extra, shape (BLOCKS, N, 12 + E)"""
    told: Array
    """directions of the input in which the matrices are told, columns, shape (3, K)"""
    extra_told: Array
    """likewise of places, or of the delay, shape (E, K)"""
    before: float
    """rms by which the IMUs differ from their mean as configured, rad/s or m/s^2"""
    after: float
    """the same, corrected"""

    @property
    def std(self) -> Array:
        """Standard deviations of error matrix, bias and extra, shape (N, 12 + E)."""
        return jackknife_std(self.errors)

    def mean(self, values: Array) -> Array:
        """Return the mean over the IMUs of corrected values, shape (T, N, 3) to (T, 3)."""
        turned = np.einsum("nij,tnj->ti", self.matrix, values) / len(self.matrix)
        return np.asarray(turned - self.bias.mean(axis=0))


@dataclass(frozen=True)
class Differences:
    """How the IMUs differ from their mean."""

    gyros: Fitted
    accels: Fitted
    motion: CommonMotion
    """on a grid, with the delays put right"""
    alike: NDArray[np.bool_]
    """which of them make the frame, shape (N,)"""

    def rate(self) -> Array:
        """Return the mean of the corrected rates on the grid, rad/s, shape (T, 3)."""
        return self.gyros.mean(self.motion.rate)

    def force(self) -> Array:
        """Return the mean of the corrected forces on the grid, m/s^2, shape (T, 3); at rest it holds no lever arms."""
        return self.accels.mean(self.motion.force)

    def with_places(self, rate: Array, accel: Array) -> Differences:
        """Return the same with what all have in common known.

        `rate`: of the body on the grid, rad/s, shape (T, 3); `accel`: what corrects the mean force, shape (3, 3). Rates
        that all gyros show too large by a share make places too near by twice that.
        """
        lever = lever_matrices(rate, self.motion, self.motion.instants)
        begun = _State(self.accels.matrix, self.accels.bias, self.accels.extra, self.alike)
        added = np.linalg.inv(accel) @ lever
        extra = _by_place(added, self.motion, self.gyros)
        fitted = _settled(self.motion.smoothed(self.motion.force, self.motion.instants), begun, extra)
        return replace(self, accels=replace(fitted, before=self.accels.before))


def jackknife_std(left_out: Array) -> Array:
    """Return standard deviations from leave-one-out values, shape (B, ...)."""
    count = len(left_out)
    return np.asarray(np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0)))


def differences(streams: Sequence[ImuStream], positions: Array) -> Differences:
    """Compare IMUs by the motion that they share; `positions`: as configured, m, shape (N, 3).

    Raises InputError if there is hardly any motion.
    """
    count = len(streams)
    if count == 1:
        moved = common_motion(streams)
        return Differences(_alone(1), _alone(3), moved, np.ones(1, dtype=bool))
    delay, shifted = np.zeros(count), list(streams)
    for _ in range(SHIFTS):
        moved = common_motion(shifted)
        rows = moved.instants
        rate, force = moved.smoothed(moved.rate, rows), moved.smoothed(moved.force, rows)
        start, alike = _start(rate, force)
        gyros = _gyros(moved, rows, start, alike)
        step = gyros.extra[:, 0]
        delay = delay + step
        if np.abs(step).max() < CLOSE:
            break
        shifted = [replace(one, time=one.time + late) for one, late in zip(streams, delay, strict=True)]
    places = positions - positions[alike].mean(axis=0)
    accels = _accels(moved, rows, gyros, _State(start, np.zeros((count, 3)), places, alike))
    return Differences(replace(gyros, extra=delay[:, None]), accels, moved, alike)


def _alone(extras: int) -> Fitted:
    """Return what there is to correct of an IMU that is compared with itself."""
    none = np.zeros((BLOCKS, 1, 12 + extras))
    return Fitted(np.eye(3)[None], np.zeros((1, 3)), np.zeros((1, extras)), none, np.eye(3), np.eye(extras), 0.0, 0.0)


def _start(rate: Array, force: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return rotations from the axes of each IMU to those of the array, and which IMUs' axes agree as configured."""
    if float(np.sqrt(np.mean((rate - rate.mean(axis=0)) ** 2))) < LEAST_TURN:
        raise InputError("calibrate: the array hardly turns; expected it turned about all axes, by hand or under way")
    count = rate.shape[1]
    upright = np.abs(np.linalg.norm(force, axis=2).mean(axis=1) - STANDARD_GRAVITY) < NEAR_GRAVITY
    turning, pull = rate - rate.mean(axis=0), force[upright] / STANDARD_GRAVITY
    size = np.sqrt(np.mean(turning**2)) * np.sqrt(3.0 * len(turning))
    vectors = np.concatenate([turning / size, pull / np.sqrt(max(len(pull), 1))])
    # where motion hardly tells, axes are as configured
    as_configured = np.broadcast_to(np.sqrt(CONFIGURED) * np.eye(3)[:, None], (3, count, 3))
    vectors = np.concatenate([vectors, as_configured])
    between = np.array([[_rotation(vectors[:, i], vectors[:, j]) for j in range(count)] for i in range(count)])
    agrees = np.trace(between, axis1=2, axis2=3) > 1.0 + 2.0 * np.cos(ALIKE)
    first = int(np.argmax(agrees.sum(axis=1)))
    alike = agrees[first]
    onto_first = between[:, first]
    frame = _nearest_rotation(onto_first[alike].mean(axis=0))
    return np.where(alike[:, None, None], np.eye(3), frame.T @ onto_first), alike


def _rotation(one: Array, other: Array) -> Array:
    """Return the rotation that maps the vectors `one`, shape (M, 3), to `other`."""
    return _nearest_rotation(other.T @ one)


def _nearest_rotation(matrix: Array) -> Array:
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)


@dataclass(frozen=True)
class _Extra:
    """What is fitted beside matrices and biases: delays or places."""

    added: Callable[[Array], Array]
    """gives what each adds at the instants, shape (M, 3, E), from the matrices, shape (N, 3, 3)"""
    noise: float
    """of that, squared, along all axes: it looks like motion and tells nothing"""
    clear: float
    """std above which the motion does not tell"""


def _gyros(moved: CommonMotion, rows: NDArray[np.intp], start: Array, alike: NDArray[np.bool_]) -> Fitted:
    """Fit matrices, biases and delays of the gyros."""
    change = moved.smoothed(moved.rate, rows, 1)

    def by_delay(matrix: Array) -> Array:
        return np.asarray(np.einsum("nij,tnj->ti", matrix, change) / len(matrix))[:, :, None]

    begun = _State(start, np.zeros((len(start), 3)), np.zeros((len(start), 1)), alike)
    extra = _Extra(by_delay, 3.0 * _noise(_mean_and_rest(change)[1]), CLEAR_DELAY)
    return _settled(moved.smoothed(moved.rate, rows), begun, extra)


def _accels(moved: CommonMotion, rows: NDArray[np.intp], gyros: Fitted, begun: _State) -> Fitted:
    """Fit matrices, biases and places of the accelerometers."""
    lever = lever_matrices(gyros.mean(moved.rate), moved, rows)
    return _settled(moved.smoothed(moved.force, rows), begun, _by_place(lever, moved, gyros))


def _by_place(lever: Array, moved: CommonMotion, gyros: Fitted) -> _Extra:
    rows = moved.instants
    change = np.einsum("nij,tnj->tni", gyros.matrix, moved.smoothed(moved.rate, rows, 1))
    return _Extra(lambda _: lever, 2.0 * _noise(_mean_and_rest(change)[1]), CLEAR_PLACE)


def _noise(left: Array) -> float:
    """Return the variance of the mean's noise along an axis from what IMUs differ by, shape (M, N, 3)."""
    return float(np.mean(left**2) / (left.shape[1] - 1))


def lever_matrices(rate: Array, moved: CommonMotion, rows: NDArray[np.intp]) -> Array:
    """Return K, smoothed, which makes of a place what a force there has beside that of the origin, 1/s^2, (M, 3, 3).

    `rate`: of the body on the grid, rad/s, shape (T, 3).
    """
    change = np.gradient(rate, moved.step, axis=0)
    # the mean of the square over a cell is larger than the square of the mean
    square = _squared(rate) + moved.step**2 / 12.0 * _squared(change)
    x, y, z = moved.smoothed(rate, rows, 1).T
    none = np.zeros_like(x)
    cross = np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)
    return np.asarray(moved.smoothed(square, rows) + cross)


def _squared(vectors: Array) -> Array:
    """Return [v x][v x] of vectors, shape (T, 3) to (T, 3, 3)."""
    square = np.sum(vectors**2, axis=1)[:, None, None]
    return np.asarray(vectors[:, :, None] * vectors[:, None, :] - square * np.eye(3))


@dataclass(frozen=True)
class _State:
    """What is known so far: corrected = matrix @ value - bias - regressors @ extra."""

    matrix: Array
    bias: Array
    extra: Array
    alike: NDArray[np.bool_]

    def corrected(self, values: Array, added: Array) -> Array:
        turned = np.einsum("nij,tnj->tni", self.matrix, values)
        return np.asarray(turned - self.bias - np.einsum("tae,ne->tna", added, self.extra))

    def off(self, other: _State) -> float:
        """Return the largest difference from another one."""
        parts = ((self.matrix, other.matrix), (self.bias, other.bias), (self.extra, other.extra))
        return max(float(np.abs(one - two).max()) for one, two in parts)

    def stepped(self, step: Array) -> _State:
        """Take off what the corrected values still err by, shape (N, 12 + E), keeping the means of those alike."""
        count = len(step)
        back = np.linalg.inv(np.eye(3) + step[:, :9].reshape(count, 3, 3))
        matrix = back @ self.matrix
        bias = np.einsum("nij,nj->ni", back, self.bias + step[:, 9:12])
        common = np.linalg.inv(matrix[self.alike]).mean(axis=0)
        bias, extra = bias @ common.T, self.extra + step[:, 12:]
        return _State(
            common @ matrix,
            bias - bias[self.alike].mean(axis=0),
            extra - extra[self.alike].mean(axis=0),
            self.alike,
        )


def _settled(values: Array, begun: _State, extra: _Extra) -> Fitted:
    """Fit what differs between values, shape (M, N, 3), twice: the first time shows what is told at all."""
    extras = begun.extra.shape[1]
    told, extra_told = np.eye(3), np.eye(extras)
    before = _mean_and_rest(begun.corrected(values, extra.added(begun.matrix)))[1]
    for rounds in (FIRST_ROUNDS, ROUNDS):
        state = begun
        basis = _basis(told, extra_told)
        # the first time nothing that is not told may grow
        held = _HELD[: 12 + extras] if rounds == FIRST_ROUNDS else np.zeros(basis.shape[1])
        for _ in range(rounds):
            added = extra.added(state.matrix)
            mean, left = _mean_and_rest(state.corrected(values, added))
            design = _design(mean, added) @ basis
            whole = np.array([0, len(mean)])
            step = np.array([_solved(*_normal(design, one, whole), held)[0] for one in left.transpose(1, 0, 2)])
            last, state = state, state.stepped(step @ basis.T)
            if state.off(last) < SETTLED:
                break
        if rounds == FIRST_ROUNDS:
            told = _told_inputs(mean, left)
            extra_told = _told_extras(_design(mean, added), told, left, extra)
    edges = _block_edges(mean)
    left_out = np.array([_solved(*_normal(design, one, edges), held)[1:] for one in left.transpose(1, 0, 2)])
    errors = (left_out @ basis.T).transpose(1, 0, 2)
    errors = errors - errors[:, begun.alike].mean(axis=1, keepdims=True)
    rms = [float(np.sqrt(np.mean((one - one.mean(axis=0)) ** 2))) for one in (before, left)]
    return Fitted(state.matrix, state.bias, state.extra, errors, told, extra_told, rms[0], rms[1])


def _mean_and_rest(values: Array) -> tuple[Array, Array]:
    mean = values.mean(axis=1)
    return mean, values - mean[:, None]


def _design(mean: Array, added: Array) -> Array:
    """Return what error matrix, bias and extra of an IMU add to the mean, shape (M, 3, 12 + E)."""
    matrix = np.einsum("ab,tk->tabk", np.eye(3), mean).reshape(len(mean), 3, 9)
    bias = np.broadcast_to(np.eye(3), (len(mean), 3, 3))
    return np.concatenate([matrix, bias, added], axis=2)


def _basis(told: Array, extra_told: Array) -> Array:
    """Return the parameters, 12 + E, that change where only some directions are told, as columns."""
    parts = [np.kron(np.eye(3), told), np.eye(3), extra_told]
    basis = np.zeros((sum(len(part) for part in parts), sum(part.shape[1] for part in parts)))
    row = column = 0
    for part in parts:
        basis[row : row + len(part), column : column + part.shape[1]] = part
        row, column = row + len(part), column + part.shape[1]
    return basis


def _told_inputs(mean: Array, left: Array) -> Array:
    """Return the directions in which the mean varies enough, by more than noise, columns."""
    varies, directions = np.linalg.eigh(np.cov(mean.T))
    return np.asarray(directions[:, _std(left, len(mean) * (varies - _noise(left))) < CLEAR_MATRIX])


def _told_extras(design: Array, told: Array, left: Array, extra: _Extra) -> Array:
    """Return the directions of the extra parameters that can be told beside all others, columns."""
    extras = design.shape[2] - 12
    basis = _basis(told, np.eye(extras))
    flat = (design @ basis).reshape(-1, basis.shape[1])
    normal, split = flat.T @ flat, basis.shape[1] - extras
    cross = normal[:split, split:]
    alone = normal[split:, split:] - cross.T @ np.linalg.pinv(normal[:split, :split], hermitian=True) @ cross
    known, directions = np.linalg.eigh(alone)
    return np.asarray(directions[:, _std(left, known - len(design) * extra.noise) < extra.clear])


def _std(left: Array, information: Array) -> Array:
    """Return the std of what rests on sums of squares, from what is left; infinite where there are none."""
    variance = CORRELATED * np.mean(left**2) / np.maximum(information, np.finfo(float).tiny)
    return np.asarray(np.sqrt(variance))


def _normal(design: Array, left: Array, edges: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return normal matrices and right sides of the blocks between edges, shapes (B, P, P) and (B, P).

    Axes count by what is left on them, instants that do not fit less (Huber).
    """
    spread = np.sqrt(np.mean(left**2, axis=0)) + np.finfo(float).tiny
    weights = np.sqrt(huber(np.linalg.norm(left / spread, axis=1)))[:, None] / spread
    rows, observed = design * weights[:, :, None], left * weights
    normal, right = [], []
    for first, last in pairwise(edges.tolist()):
        part = rows[first:last].reshape(-1, rows.shape[2])
        normal.append(part.T @ part)
        right.append(part.T @ observed[first:last].reshape(-1))
    return np.array(normal), np.array(right)


def _block_edges(mean: Array) -> NDArray[np.intp]:
    """Return where blocks of consecutive instants begin and end that share time and motion evenly, (BLOCKS + 1,)."""
    motion = np.sum((mean - mean.mean(axis=0)) ** 2, axis=1)
    share = np.cumsum(motion / motion.sum() + 1.0 / len(mean)) / 2.0
    return np.concatenate([[0], np.searchsorted(share, np.arange(1, BLOCKS) / BLOCKS), [len(mean)]])


def _solved(normal: Array, right: Array, held: Array) -> Array:
    """Return the solution of all blocks, and what leaving out each one changes, shape (1 + B, P).

    `held`: what is known beforehand of each parameter, that it is nought, as information, shape (P,).
    """
    whole, aim = normal.sum(axis=0) + np.diag(held), right.sum(axis=0)
    scale = 1.0 / np.sqrt(np.diag(whole) + np.finfo(float).tiny)
    both = np.concatenate([whole[None], whole - normal]) * scale[:, None] * scale
    sides = np.concatenate([aim[None], aim - right]) * scale
    inverse = np.linalg.pinv(both, rcond=1e-10, hermitian=True)
    return np.asarray(np.einsum("bij,bj->bi", inverse, sides) * scale)
