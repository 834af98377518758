"""The table of error states: what a filter may estimate, in which unit, and how it goes on from epoch to epoch.

Sizes, places, columns of files and what decays follow from it. A filter takes the states up to the last one that it
needs, in whole vectors of eight (`strides`): the others would be multiplied for nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

EIGHT = 8


@dataclass(frozen=True)
class ErrorState:
    """One row of the table."""

    name: str
    size: int
    unit: str
    process: Literal["navigation", "gauss-markov", "random-walk"]
    """errors of position, velocity and attitude; what decays towards zero; what stays but for a noise, if it has one"""


TABLE = (
    ErrorState("position", 3, "m", "navigation"),
    ErrorState("velocity", 3, "m/s", "navigation"),
    ErrorState("phi", 3, "rad", "navigation"),
    ErrorState("gyro_bias", 3, "rad/s", "gauss-markov"),
    ErrorState("accel_bias", 3, "m/s^2", "gauss-markov"),
    ErrorState("gyro_scale", 3, "1", "gauss-markov"),
    ErrorState("accel_scale", 3, "1", "gauss-markov"),
    # relative, of a speed measured by wheels or an odometer
    ErrorState("speed_scale", 1, "1", "random-walk"),
    # of an IMU on a wheel its lever arm y, z (m); of one on the body pitch and yaw of its mount (rad)
    ErrorState("mount", 2, "m or rad", "random-walk"),
    # what a stream of heights shows less the height
    ErrorState("height_bias", 1, "m", "random-walk"),
    # what a stream of headings shows less the heading
    ErrorState("heading_offset", 1, "rad", "random-walk"),
)


def place(name: str) -> int:
    """Return the index of the first component of a state."""
    total = 0
    for row in TABLE:
        if row.name == name:
            return total
        total += row.size
    raise KeyError(name)


STATES = sum(row.size for row in TABLE)
NAVIGATION = sum(row.size for row in TABLE if row.process == "navigation")
IMU_ERRORS = sum(row.size for row in TABLE if row.process == "gauss-markov")
ERRORS = STATES - NAVIGATION
"""all that is estimated beside the navigation state"""


def stride_for(count: int) -> int:
    """Return the length of the rows of a covariance of that many states: whole vectors of eight."""
    return -(-count // EIGHT) * EIGHT
