"""What the IMUs of an array have in common, from attitudes in which it lies still and the turns between them.

At rest the mean of the corrected forces is B g u + c, u the unit vector up, the same g in every attitude: an
ellipsoid, which tells the symmetric part of B and c. Its axes make a frame in which u is known in each attitude. A turn
from one to the next leads from one u to the other, where the rates are A w + b, b what the gyros show at rest: all of A
is told, also how it is turned against the accelerometers. In the end the array's axes are those of its gyros.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polyins.calibration.common_motion import CommonMotion
from polyins.calibration.relative import CLEAR_MATRIX
from polyins.model.recording import Array
from polyins.model.rig import DEG

WINDOW = 1.0
"""s: an attitude is held as long at least"""
STILL_RATE, STILL_FORCE = 0.3 * DEG, 0.05
"""rad/s, m/s^2: smoothed values vary by less, 1 sigma, while an array lies on a table"""
LARGEST_BIAS = 10.0 * DEG
"""rad/s: a larger mean rate is a turn"""
LONGEST_TURN = 20.0
"""s: in a longer one the drift of the gyros counts"""
SPARE = 3
"""equations beyond the unknowns: with fewer nothing shows how good a fit is"""
EARTH_RATE = 7.292115e-5
"""rad/s: what gyros show at rest besides their bias, in a direction that is not known here"""
ROUNDS = 5

UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""elements of a symmetric matrix"""


@dataclass(frozen=True)
class Pose:
    """An attitude that was held."""

    rows: slice
    """of the grid"""
    rate: Array
    """mean rate of the array, rad/s, shape (3,)"""
    force: Array
    """mean force, m/s^2, shape (3,)"""


@dataclass(frozen=True)
class Triad:
    """What corrects a mean of IMUs: true = matrix @ (mean - bias)."""

    matrix: Array
    """shape (3, 3)"""
    bias: Array
    """rad/s or m/s^2, shape (3,)"""
    matrix_std: Array
    """of the elements, shape (3, 3)"""
    bias_std: Array
    """shape (3,)"""


@dataclass(frozen=True)
class Common:
    """What the IMUs have in common; None: not told."""

    poses: tuple[Pose, ...]
    gyro_bias: tuple[Array, Array] | None = None
    """and its std, rad/s"""
    gyro: Triad | None = None
    accel: Triad | None = None


def held(moved: CommonMotion, rate: Array, force: Array) -> tuple[Pose, ...]:
    """Return the attitudes that were held, from the mean rate and force on the grid, shape (T, 3) each."""
    from scipy.ndimage import maximum_filter1d, uniform_filter1d

    length = max(2, round(WINDOW / moved.step))
    every = np.arange(len(rate))
    smooth = moved.smoothed(np.hstack([rate, force]), every)
    mean = uniform_filter1d(smooth, length, axis=0)
    spread = np.sqrt(np.maximum(uniform_filter1d(smooth**2, length, axis=0) - mean**2, 0.0))
    quiet = (spread[:, :3].max(axis=1) < STILL_RATE) & (spread[:, 3:].max(axis=1) < STILL_FORCE)
    quiet &= np.linalg.norm(mean[:, :3], axis=1) < LARGEST_BIAS
    quiet &= maximum_filter1d(moved.lost.astype(np.int8), length) == 0
    quiet[: length // 2] = quiet[-(length // 2) :] = False
    # the middles of still windows, one after the other
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(np.int8)))
    poses = []
    for first, last in edges.reshape(-1, 2):
        # a still window may hold the very first of a turn at its end
        rows = slice(int(first) - length // 4, int(last) + length // 4)
        poses.append(Pose(rows, rate[rows].mean(axis=0), force[rows].mean(axis=0)))
    return tuple(poses)


def common(moved: CommonMotion, rate: Array, force: Array, gravity: float) -> Common:
    """Return what the IMUs have in common, as far as the attitudes tell; arguments as for `held`, m/s^2."""
    poses = held(moved, rate, force)
    if not poses:
        return Common(poses)
    rates = np.array([pose.rate for pose in poses])
    scatter = rates.std(axis=0, ddof=1) if len(poses) > 1 else np.zeros(3)
    bias_std = np.sqrt((scatter**2 + EARTH_RATE**2 / 3.0) / len(poses))
    known = Common(poses, (rates.mean(axis=0), bias_std))
    accel = ellipsoid(np.array([pose.force for pose in poses]), gravity)
    if accel is None:
        return known
    up = (np.array([pose.force for pose in poses]) - accel.bias) @ accel.matrix.T / gravity
    fitted = _turned(moved, rate, poses, up)
    if fitted is None:
        return Common(poses, known.gyro_bias, None, accel)
    matrix, covariance = fitted
    left, sizes, right = np.linalg.svd(matrix)
    symmetric = right.T @ np.diag(sizes) @ right
    to_gyros = (left @ right).T
    swap = np.arange(9).reshape(3, 3).T.ravel()
    even, odd = (0.5 * (np.eye(9) + sign * np.eye(9)[swap]) for sign in (1.0, -1.0))
    even_std, odd_std = (np.sqrt(np.diag(part @ covariance @ part.T)).reshape(3, 3) for part in (even, odd))
    # what the frame of the accelerometers errs by is in the gyros too
    gyro = Triad(symmetric, rates.mean(axis=0), np.hypot(even_std, accel.matrix_std), bias_std)
    turned = Triad(to_gyros @ accel.matrix, accel.bias, np.hypot(accel.matrix_std, odd_std), accel.bias_std)
    return Common(poses, known.gyro_bias, gyro, turned)


def ellipsoid(forces: Array, gravity: float) -> Triad | None:
    """Return the symmetric matrix and the bias that make forces at rest, shape (P, 3), as large as gravity.

    None: too few attitudes, or too much alike. The std is that of Student's t with the equations to spare.
    """
    spare = len(forces) - 9
    if spare < SPARE:
        return None
    matrix, bias = np.eye(3), np.zeros(3)
    for _ in range(ROUNDS):
        off = forces - bias
        size = np.linalg.norm(off @ matrix, axis=1)
        up = off @ matrix / size[:, None]
        columns = [(up[:, i] * off[:, j] + up[:, j] * off[:, i]) / (1.0 + (i == j)) for i, j in UPPER]
        design = np.column_stack([*columns, -up @ matrix])
        step, *_ = np.linalg.lstsq(design, gravity - size, rcond=1e-8)
        for (i, j), value in zip(UPPER, step[:6], strict=True):
            matrix[i, j] += value
            matrix[j, i] = matrix[i, j]
        bias = bias + step[6:]
    covariance = _covariance(design, gravity - size, spare)
    std = np.sqrt(np.diag(covariance))
    matrix_std = np.zeros((3, 3))
    for (i, j), value in zip(UPPER, std[:6], strict=True):
        matrix_std[i, j] = matrix_std[j, i] = value
    return Triad(matrix, bias, matrix_std, std[6:]) if matrix_std.max() < CLEAR_MATRIX else None


def _covariance(design: Array, left: Array, spare: int) -> Array:
    """Return the covariance of a fit whose noise is known from what it left alone."""
    variance = float(np.sum(left**2)) / spare
    inverse = np.linalg.pinv(design.T @ design, rcond=1e-14, hermitian=True)
    return np.asarray(variance * spare / (spare - 2.0) * inverse)


def _turned(moved: CommonMotion, rate: Array, poses: Sequence[Pose], up: Array) -> tuple[Array, Array] | None:
    """Return the matrix that corrects the mean rate in the axes of `up`, shape (P, 3), and its covariance, (9, 9).

    None: too few turns, or too much alike.
    """
    pairs = [
        k
        for k, (one, other) in enumerate(itertools.pairwise(poses))
        if (other.rows.start - one.rows.stop) * moved.step < LONGEST_TURN
        and not moved.lost[one.rows.stop : other.rows.start].any()
    ]
    spare = 2 * len(pairs) - 9
    if spare < SPARE:
        return None
    matrix = np.eye(3)
    for _ in range(ROUNDS):
        design, left = [], []
        for k in pairs:
            between = rate[poses[k].rows.stop : poses[k + 1].rows.start]
            share = ((np.arange(len(between)) + 0.5) / len(between))[:, None]
            bias = (1.0 - share) * poses[k].rate + share * poses[k + 1].rate
            turn, response = _integrated((between - bias) @ matrix.T * moved.step)
            seen = turn @ up[k + 1]
            left.append(seen - up[k])
            design.append(np.cross(seen, response.reshape(3, 9), axisb=0, axisc=0))
        rows, rest = np.concatenate(design), np.concatenate(left)
        step = -np.linalg.lstsq(rows, rest, rcond=1e-8)[0]
        matrix = np.linalg.inv(np.eye(3) + step.reshape(3, 3)) @ matrix
    covariance = _covariance(rows, rest, spare)
    return (matrix, covariance) if np.sqrt(np.diag(covariance)).max() < CLEAR_MATRIX else None


def _integrated(turns: Array) -> tuple[Array, Array]:
    """Return the rotation from the last axes to the first, and what an error matrix of the rates turns it by.

    `turns`: rad, shape (T, 3). The second is sum R[:, j] turn[k], shape (3, 3, 3).
    """
    from scipy.spatial.transform import Rotation

    rotation, response = np.eye(3), np.zeros((3, 3, 3))
    for turn, half in zip(turns, Rotation.from_rotvec(0.5 * turns).as_matrix(), strict=True):
        middle = rotation @ half
        response += middle[:, :, None] * turn
        rotation = middle @ half
    return rotation, response
