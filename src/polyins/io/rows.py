"""What every reader returns: rows in the sensor's own axes and on its own clock."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from polyins.recording import Array


@dataclass(frozen=True)
class Source:
    """Where rows came from, so that a message can name the line."""

    path: str
    first_line: int | None = None
    """line of the first row, counted from 1; None: the file has no lines"""

    def place(self, row: int) -> str:
        """Name a row (counted from 0) as a user finds it: by line in a text file, else by row."""
        if self.first_line is None:
            return f"{self.path}, row {row + 1}"
        return f"{self.path}, line {self.first_line + row}"


@dataclass(frozen=True)
class ImuRows:
    """Increments over the interval that ends at the stamp, in sensor axes."""

    source: Source
    time: Array
    """s, shape (T,)"""
    dtheta: Array
    """rad, shape (T, 3)"""
    dvel: Array
    """m/s, shape (T, 3)"""
    gyro_unit: str = "rad"
    """the unit in the file: rad or deg are increments, rad/s or deg/s rates"""
    accel_unit: str = "m/s"
    """m/s is increments, m/s^2 or g rates"""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Track:
    """Positions, and what else a receiver or a reference system gives."""

    source: Source
    time: Array
    """s, shape (M,)"""
    position: Array
    """(latitude rad, longitude rad, height m) or (north m, east m, height m), shape (M, 3)"""
    geodetic: bool = True
    above_sea: bool = False
    """heights are above the sea (geoid), not above the ellipsoid"""
    position_std: Array | None = None
    """m north, east, down, shape (M, 3)"""
    velocity: Array | None = None
    """m/s north, east, down, shape (M, 3)"""
    velocity_std: Array | None = None
    """m/s, shape (M, 3)"""
    attitude: Array | None = None
    """roll, pitch, heading, rad, shape (M, 3)"""
    angle_unit: str = "deg"
    """the unit of latitude and longitude in the file"""
    quality: dict[str, int] = field(default_factory=dict)
    """how many fixes of each kind the receiver reports"""
    warnings: tuple[str, ...] = ()


def intervals(time: Array) -> Array:
    """Return the length of the interval that ends at each stamp, s; the first is taken as the median of the others."""
    steps = np.diff(time)
    return np.concatenate([[np.median(steps)], steps]) if len(steps) else np.zeros(len(time))
