"""An IMU on a wheel: from the sensor's axes to the module's, by what is known of its spin axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.config import WheelEntry
from polyins.model.rig import DEG


def wheel_rotation(entry: WheelEntry) -> NDArray[np.float64]:
    """Return the matrix that maps sensor vectors to the module's axes, x along the axle to the right, shape (3, 3).

    The sensor is turned by the smallest angle that brings the true spin axis onto the nominal one; then its axes are
    exchanged, in cyclic order for a positive spin axis and in the other one for a negative.
    """
    k = "xyz".index(entry.spin_axis[-1])
    one, two = (k + 1) % 3, (k + 2) % 3
    if entry.spin_axis.startswith("-"):
        return _axes(-1.0, k, two, one) @ _tilt_removed(entry.tilt_deg, k)
    return _axes(1.0, k, one, two) @ _tilt_removed(entry.tilt_deg, k)


def _axes(sign: float, x: int, y: int, z: int) -> NDArray[np.float64]:
    """Return the matrix whose rows are sensor axes x (with that sign), y and z, shape (3, 3)."""
    matrix = np.zeros((3, 3))
    matrix[0, x], matrix[1, y], matrix[2, z] = sign, 1.0, 1.0
    return matrix


def _tilt_removed(tilt_deg: tuple[float, float], k: int) -> NDArray[np.float64]:
    """Return the smallest rotation that maps the true spin axis to sensor axis k."""
    spin = np.zeros(3)
    spin[[k, (k + 1) % 3, (k + 2) % 3]] = 1.0, tilt_deg[0] * DEG, tilt_deg[1] * DEG
    spin /= np.linalg.norm(spin)
    nominal = np.eye(3)[k]
    cross = np.cross(spin, nominal)
    skew = np.array([[0.0, -cross[2], cross[1]], [cross[2], 0.0, -cross[0]], [-cross[1], cross[0], 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + spin[k]))
