"""What a sensor says at one instant."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class ImuSample(NamedTuple):
    """Increments of one IMU over the interval that ends at its stamp."""

    imu: str
    """its name in the configuration"""
    time: float
    """s, on the sensor's clock"""
    dtheta: Array
    """rad, shape (3,)"""
    dvel: Array
    """m/s, shape (3,)"""


class GnssFix(NamedTuple):
    """A fix of the antenna."""

    time: float
    """s, on the receiver's clock"""
    position: Array
    """(latitude rad, longitude rad, height m), or (north m, east m, height m) on a local plane, shape (3,)"""
    position_std: Array | None
    """m north, east, down, shape (3,); None: the source does not say"""
    velocity: Array | None = None
    """m/s north, east, down, shape (3,)"""
    velocity_std: Array | None = None
    """m/s, shape (3,)"""
    geodetic: bool = True
    above_sea: bool = False
    """the height counts from the sea, not from the ellipsoid"""


class SensorSample(NamedTuple):
    """What a sensor of height, heading or speed shows."""

    kind: str
    """height, heading or odometer"""
    time: float
    """s, on the sensor's clock"""
    value: float
    """m, rad or m/s"""
    std: Array
    """of the value, shape (1,); of an odometer forward, right and down, m/s, shape (3,), where zero is not measured"""


Sample = ImuSample | GnssFix | SensorSample
