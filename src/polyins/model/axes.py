"""Sensor axes that point forward, right and down, by name."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

Axes = tuple[str, str, str]
"""which sensor axes point forward, right, down, e.g. `(x, -y, -z)`"""


def right_handed_axes() -> list[Axes]:
    """Return all 24 ways to name forward, right, down by sensor axes."""
    signed = [(*order,) for order in permutations("xyz")]
    named = [
        (first + order[0], second + order[1], third + order[2])
        for order in signed
        for first, second, third in product(("", "-"), repeat=3)
    ]
    return [axes for axes in named if np.linalg.det(axes_matrix(axes)) > 0.0]


def axes_matrix(axes: Axes) -> NDArray[np.float64]:
    """Return the matrix that maps sensor vectors to the axes named, e.g. `(x, -y, -z)`, shape (3, 3)."""
    matrix = np.zeros((3, 3))
    for row, axis in enumerate(axes):
        matrix[row, "xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return matrix


def composed(outer: Axes, inner: Axes) -> Axes:
    """Return the sensor axes that point along `outer` of the axes that `inner` makes of the sensor's."""
    matrix = axes_matrix(outer) @ axes_matrix(inner)
    first, second, third = (("-" if row.sum() < 0.0 else "") + "xyz"[int(np.argmax(np.abs(row)))] for row in matrix)
    return first, second, third
