"""How far the axes of a chip's triads are from their nominal directions.

A triad shows `matrix @ vector`: both triads of a chip are turned with it by one rotation, each by another of its own;
then its axes are not quite square to each other, and last comes what a calibration found. The real chips of paper A's
Group 1 turn as a whole: the rotations of gyro and accelerometers agree with a correlation of 0.92 to 1.00.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import Vector, zero_vector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TriadCalibration:
    """What a calibration found of one triad: corrected = matrix @ raw + offset."""

    matrix: Array = field(default_factory=lambda: np.eye(3))
    """shape (3, 3)"""
    offset: Vector = field(default_factory=zero_vector)
    """rad/s or m/s^2"""

    @property
    def response(self) -> Array:
        """What maps the true vector to the raw one, shape (3, 3)."""
        return np.asarray(np.linalg.inv(self.matrix), dtype=np.float64)

    @property
    def bias(self) -> Vector:
        """The raw values where the true ones are zero, rad/s or m/s^2."""
        return np.asarray(-self.response @ self.offset)


@dataclass(frozen=True)
class Chip:
    """The calibrations of a chip's two triads."""

    gyro: TriadCalibration = field(default_factory=TriadCalibration)
    accel: TriadCalibration = field(default_factory=TriadCalibration)


def product(matrix: Array, vectors: Array) -> Array:
    """Return matrix @ vector of each of the vectors, shape (T, 3)."""
    # BLAS wakes all its threads for a 3 x 3 matrix, mostly for nothing
    return vectors if np.array_equal(matrix, np.eye(3)) else np.einsum("tj,ij->ti", vectors, matrix)


def skewed(angles: Vector) -> Array:
    """Return what maps a vector to its parts along axes that are not square, shape (3, 3).

    x stays; y leans towards x by the first angle, z towards x and y by the others, rad, to first order.
    """
    matrix = np.eye(3)
    matrix[1, 0], matrix[2, 0], matrix[2, 1] = angles
    return matrix


def turned(vector: Vector) -> Array:
    """Return what maps a vector to its parts along axes turned by a rotation vector, rad, shape (3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector).as_matrix().T)
