"""Which axes an IMU really has, as the rates and forces of the others show: signed permutations of those it is said to.

A rotated, mirrored or swapped mount, a sign or a column that is wrong in the file, of both sensors or of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from polyins.model.axes import Axes, axes_matrix
from polyins.model.findings import Finding
from polyins.model.recording import ImuStream
from polyins.model.rig import DEG, Imu

Array = NDArray[np.float64]

WINDOW = 0.5
"""s over which rates and forces are averaged: short against a turn"""
FLOOR = np.array([0.2 * DEG, 0.3])
"""rad/s and m/s^2, by which a good IMU may differ from the others"""
EXPLAINED = 0.1
"""of the squares of what an IMU differs by may be left with the axes that explain it"""
ALIKE = 1.5
"""times the least squares: axes that fit as well as the best ones, of which the nearest to those stated are taken"""
BOTH = 4.0
"""times the squares with axes of gyro and accelerometer apart, up to which both have the same ones"""

NAMES: tuple[Axes, ...] = tuple(
    (signs[0] + order[0], signs[1] + order[1], signs[2] + order[2])
    for order in permutations("xyz")
    for signs in product(("", "-"), repeat=3)
)
TURNS = np.array([axes_matrix(axes) for axes in NAMES])
"""all signed permutations, left-handed ones too, shape (48, 3, 3)"""
AS_STATED = NAMES.index(("x", "y", "z"))
UNCHANGED = np.einsum("kii->k", TURNS)
"""how many axes each leaves as they are, less those that it turns round"""


def mount(imu: Imu, own: Array, others: Array) -> Finding | None:
    """Return the finding that an IMU has other axes than stated, or None if none explain what it differs by.

    `own`, `others`: its rates and forces and the median of the others' in windows, array axes, shape (W, 6).
    """
    cost = np.array([_squares(own[:, of], others[:, of]) for of in (slice(0, 3), slice(3, 6))])
    cost /= (np.maximum(cost.min(axis=1), len(own) * FLOOR**2))[:, None]
    together = cost.sum(axis=0)
    apart = [_nearest(one) for one in cost]
    if sum(one[k] for one, k in zip(cost, apart, strict=True)) > EXPLAINED * together[AS_STATED]:
        return None
    if together.min() <= BOTH * cost.min(axis=1).sum():
        return _finding(imu, "", _nearest(together))
    wrong = [(what, k) for what, k in zip(("gyro", "accelerometer"), apart, strict=True) if k != AS_STATED]
    return _finding(imu, *wrong[0]) if len(wrong) == 1 else None


def of_streams(imu: Imu, stream: ImuStream, others: Sequence[ImuStream]) -> Finding | None:
    """Return the finding as `mount` does, from streams on one clock in array axes."""
    begin = max(one.time[0] for one in (stream, *others))
    end = min(one.time[-1] for one in (stream, *others))
    edges = np.arange(begin, end, WINDOW)
    if len(edges) < 3:
        return None
    return mount(imu, _means(stream, edges), np.median([_means(one, edges) for one in others], axis=0))


def _means(stream: ImuStream, edges: Array) -> Array:
    total = np.cumsum(np.hstack([stream.dtheta, stream.dvel]), axis=0)
    at_edges = np.column_stack([np.interp(edges, stream.time, column) for column in total.T])
    return np.diff(at_edges, axis=0) / WINDOW


def _squares(own: Array, others: Array) -> Array:
    """Return the squares of what is left with each of `TURNS`, shape (48,)."""
    left = np.einsum("kij,wj->kwi", TURNS, own) - others
    return np.asarray((left**2).sum(axis=(1, 2)))


def _nearest(cost: Array) -> int:
    """Return of those that fit the one that changes least: without motion about an axis its sign is not seen."""
    return int(np.argmax(np.where(cost <= ALIKE * cost.min(), UNCHANGED - cost / cost.max(), -np.inf)))


def _finding(imu: Imu, what: str, k: int) -> Finding:
    now, right = _named(imu.rotation), _named(TURNS[k] @ imu.rotation)
    if now is None or right is None:
        now, right = NAMES[AS_STATED], NAMES[k]
    whose = f"those of its {what}" if what else "its axes"
    mirrored = np.linalg.det(TURNS[k]) < 0.0
    remedy = "look at the signs and columns of its file: they are mirrored" if mirrored else "say so in axes"
    if what:
        remedy = f"look at the signs and columns of the {what} in its file"
    return Finding(
        "mount",
        f"IMU {imu.name} does not move with the others: with axes [{', '.join(now)}] it differs from them, expected "
        f"mount: {whose} are [{', '.join(right)}]",
        "serious",
        stream=imu.name,
        axis=what or None,
        size=f"[{', '.join(now)}]",
        expected=f"[{', '.join(right)}]",
        remedy=remedy,
    )


def _named(matrix: Array) -> Axes | None:
    fits = np.abs(TURNS - matrix).max(axis=(1, 2)) < 1e-6
    return NAMES[int(np.argmax(fits))] if fits.any() else None
