"""Which columns of a table hold what, in which units."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from polyins.config.fields import Column, Positive, Section, ThreeColumns, blame


class TimeColumn(Section):
    """Which column of a table holds the time stamps."""

    name: Column
    """the column"""
    unit: Literal["s", "ms", "us", "ns"] = "s"
    """the unit of the stamps"""


class GyroColumns(Section):
    """Which columns of a table hold the angular rates or angle increments."""

    names: ThreeColumns
    """x, y, z in the sensor's axes"""
    unit: Literal["rad/s", "deg/s", "rad", "deg"]
    """rad/s and deg/s are mean rates over the interval that ends at the stamp, rad and deg its increments"""


class AccelColumns(Section):
    """Which columns of a table hold the specific force or velocity increments."""

    names: ThreeColumns
    """x, y, z in the sensor's axes"""
    unit: Literal["m/s^2", "g", "m/s"]
    """m/s^2 and g (9.80665 m/s^2) are mean values over the interval that ends at the stamp, m/s its increments"""


class ImuColumns(Section):
    """The columns of an IMU table."""

    time: TimeColumn | None = None
    """the stamps; may be left out where rate_hz is given"""
    gyro: GyroColumns
    """angular rates or angle increments"""
    accel: AccelColumns
    """specific force or velocity increments"""


PositionFrame = Literal["latitude-longitude-height", "north-east-down", "north-east-up", "east-north-up"]
VectorFrame = Literal["north-east-down", "north-east-up", "east-north-up"]


class PositionColumns(Section):
    """Which columns of a table hold the position."""

    names: ThreeColumns
    """in the order of `frame`"""
    frame: PositionFrame = "latitude-longitude-height"
    """what the three are; the last three kinds are metres on a local tangent plane"""
    unit: Literal["deg", "rad", "m"] | None = None
    """of latitude and longitude (deg unless said otherwise; height is always m), or m"""

    @model_validator(mode="after")
    def _unit_fits(self) -> Self:
        geodetic = self.frame == "latitude-longitude-height"
        if self.unit is not None and geodetic == (self.unit == "m"):
            fitting = "deg or rad" if geodetic else "m"
            raise ValueError(f"unit {self.unit} does not fit frame {self.frame}; expected {fitting}")
        return self


class StdColumns(Section):
    """Which columns of a table hold the standard deviations of the position or velocity."""

    names: ThreeColumns
    """in the order of the value's frame (north, east, height with latitude-longitude-height), m or m/s"""


class VelocityColumns(Section):
    """Which columns of a table hold the velocity."""

    names: ThreeColumns
    """m/s, in the order of `frame`"""
    frame: VectorFrame = "north-east-down"
    """what the three are"""


class AttitudeColumns(Section):
    """Which columns of a table hold roll (right side down is positive), pitch (nose up) and heading (clockwise)."""

    names: ThreeColumns
    """roll, pitch, heading"""
    unit: Literal["deg", "rad"] = "deg"
    """of all three"""


class HeadingColumn(Section):
    """Which column of a table holds the heading (clockwise), where there is no roll and pitch."""

    name: Column
    """the column"""
    unit: Literal["deg", "rad"] = "deg"
    """its unit"""


class RowChoice(Section):
    """Which rows of a table are used, of a receiver whose positions are repeated at the rate of another sensor."""

    first: Annotated[int, Field(ge=1, strict=True)] = 1
    """the first one that is used, counted from 1"""
    every: Annotated[int, Field(ge=1, strict=True)] = 1
    """one row of so many"""
    rate_hz: Positive
    """of all rows: without a column of stamps, row number n is at (n - 1) / rate_hz"""


class TrackColumns(Section):
    """The columns of a table of positions."""

    time: TimeColumn | None = None
    """the stamps; may be left out where rows are counted"""
    rows: RowChoice | None = None
    """which rows are used; all unless given"""
    valid: Column | None = None
    """a column that is 0 where a row is not to be used"""
    position: PositionColumns
    """the position"""
    std: StdColumns | None = None
    """its standard deviations"""
    velocity: VelocityColumns | None = None
    """the velocity"""
    velocity_std: StdColumns | None = None
    """its standard deviations"""
    attitude: AttitudeColumns | None = None
    """the attitude, of a reference"""
    heading: HeadingColumn | None = None
    """the heading, of a reference without roll and pitch"""

    @model_validator(mode="after")
    def _time_and_attitude_are_clear(self) -> Self:
        if self.time is None and self.rows is None:
            raise blame("time", "is missing; expected it, or rows to count")
        if self.attitude is not None and self.heading is not None:
            raise blame("heading", "is given with attitude; expected one of them")
        return self
