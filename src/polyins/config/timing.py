"""Start and outages."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from polyins.config.fields import Number, Pair, Positive, Section, Spread, Triple, number
from polyins.model.rig import DEG

ROUNDING_S = 1e-6
"""what time stamps such as GPS seconds of the week are exact to"""


class StartPosition(Section):
    """Where the array's origin is: geodetic, or on the local tangent plane."""

    latitude_deg: Annotated[float, BeforeValidator(number), Field(ge=-90.0, le=90.0)] | None = None
    """deg"""
    longitude_deg: Annotated[float, BeforeValidator(number), Field(ge=-360.0, le=360.0)] | None = None
    """deg"""
    north_m: Number | None = None
    """m"""
    east_m: Number | None = None
    """m"""
    height_m: Number = 0.0
    """m above the ellipsoid, or above the local plane's zero"""

    @property
    def geodetic(self) -> bool:
        """Whether latitude and longitude are given."""
        return self.latitude_deg is not None

    def coordinates(self) -> NDArray[np.float64]:
        """Return latitude, longitude, rad, and height, or north, east and height, m, shape (3,)."""
        if self.latitude_deg is not None and self.longitude_deg is not None:
            return np.array([self.latitude_deg * DEG, self.longitude_deg * DEG, self.height_m])
        return np.array([self.north_m, self.east_m, self.height_m], dtype=float)

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [self.latitude_deg, self.longitude_deg, self.north_m, self.east_m]
        if [value is not None for value in given] not in ([True, True, False, False], [False, False, True, True]):
            raise ValueError("expected latitude_deg and longitude_deg, or north_m and east_m")
        return self


class StartEntry(Section):
    """How the navigation state is found at the start; what is not given is found from the data."""

    time_s: Number | None = None
    """s, on the clock of the recording; without it the first instant at which all that is needed is there"""
    end_time_s: Number | None = None
    """s; without it the end of the data"""
    position: StartPosition | None = None
    """of the array's origin"""
    velocity_m_s: Triple | None = None
    """north, east, down, m/s"""
    roll_pitch_deg: Pair | None = None
    """deg"""
    heading_deg: Number | None = None
    """deg, clockwise from north"""
    heading_time_s: Number | None = None
    """s: when the heading was that; the gyros carry it to the start; without it at the start"""
    heading_from: Literal["auto", "value", "gnss-course", "reference"] = "auto"
    """auto: the first of the others that the data allow"""
    static_interval_s: Pair | None = None
    """the array stands still from, to, s; without it looked for"""
    position_std_m: Spread | None = None
    """north, east, down, m; the larger, the faster aids correct the position at the start"""
    velocity_std_m_s: Spread | None = None
    """north, east, down, m/s; the larger, the faster aids correct the velocity at the start"""
    attitude_std_deg: Spread | None = None
    """roll, pitch, heading, deg; the larger, the faster aids correct the attitude at the start"""
    estimate_gyro_bias: bool = True
    """take the mean of the gyros over a static interval as their bias"""


class OutageSchedule(Section):
    """GNSS is withheld again and again."""

    length_s: Positive
    """how long each outage lasts, s"""
    every_s: Positive
    """from the beginning of one outage to that of the next, s"""
    first_after_s: Number | None = None
    """from start.time_s, else the first usable fix, to the first outage, s; every_s - length_s unless given"""

    @model_validator(mode="after")
    def _outages_end(self) -> Self:
        if self.every_s <= self.length_s:
            raise ValueError(f"every_s is {self.every_s:g}; expected more than length_s, {self.length_s:g}")
        return self

    def first_begin(self, start: float) -> float:
        """Return when the first outage begins if GNSS is there from `start`, s."""
        return start + (self.every_s - self.length_s if self.first_after_s is None else self.first_after_s)

    def intervals(self, start: float, end: float) -> tuple[tuple[float, float], ...]:
        """Return from and to of the outages that are over before `end`, s, if GNSS is there from `start`."""
        first = self.first_begin(start)
        count = math.ceil((end - ROUNDING_S - self.length_s - first) / self.every_s)
        begins = [first + k * self.every_s for k in range(count)]
        return tuple((begin, begin + self.length_s) for begin in begins)


def _outage_kind(value: object) -> str:
    return "schedule" if isinstance(value, dict | OutageSchedule) else "list"


Outages = Annotated[
    Annotated[OutageSchedule, Tag("schedule")] | Annotated[tuple[Pair, ...], Tag("list")], Discriminator(_outage_kind)
]
