"""Which columns of a table hold what, in which units."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from polyins.config.fields import Column, PerAxis, Positive, PositiveSpread, Section, ThreeColumns, blame

ONE = (1.0, 1.0, 1.0)


def _listed(value: object) -> object:
    return tuple(value) if isinstance(value, list | tuple) else (value,)


class RowsOf(Section):
    """Which rows of a table belong to a stream, told by a column."""

    name: Column
    """the column"""
    equal: Annotated[tuple[int | float | str, ...], BeforeValidator(_listed)]
    """what stands there: a number, a text, or a list of them"""


class FineTime(Section):
    """The column that holds what a stamp is later than the one of `time` says."""

    name: Column
    """the column"""
    unit: Literal["s", "ms", "us", "ns"] = "s"
    """its unit"""
    dates: bool = False
    """it holds times of day, beside a column of days"""
    tick_s: Positive | None = None
    """length of one count of a counter, s; takes the place of unit"""
    ticks_per_s: Column | None = None
    """the column that says how many counts a second has; takes the place of unit"""


class TimeColumn(Section):
    """Which column of a table holds the time stamps."""

    name: Column
    """the column"""
    unit: Literal["s", "ms", "us", "ns"] = "s"
    """the unit of the stamps"""
    dates: bool = False
    """they are dates, which become seconds since 1970 (UTC unless they say otherwise), or times of day, which become
    seconds since midnight; without unit"""
    tick_s: Positive | None = None
    """length of one count of a counter, s; takes the place of unit"""
    wraps_at: Positive | None = None
    """the count at which a counter starts again from zero: 4294967296 of 32 bits, 604800 of seconds of the GPS week"""
    fine: FineTime | None = None
    """a second column, which is added"""


class GyroColumns(Section):
    """Which columns of a table hold the angular rates or angle increments."""

    names: ThreeColumns
    """x, y, z in the sensor's axes"""
    unit: Literal["rad/s", "deg/s", "rad", "deg"]
    """rad/s and deg/s are mean rates over the interval that ends at the stamp, rad and deg its increments"""
    scale: PerAxis = ONE
    """of raw counts: how much of the unit one is"""
    only: RowsOf | None = None
    """those of the gyro, where gyro and accelerometer have rows of their own"""


class AccelColumns(Section):
    """Which columns of a table hold the specific force or velocity increments.

    With a file, rows or time of its own the accelerometer is brought to the stamps of the gyro.
    """

    names: ThreeColumns
    """x, y, z in the sensor's axes"""
    unit: Literal["m/s^2", "g", "m/s"]
    """m/s^2 and g (9.80665 m/s^2) are mean values over the interval that ends at the stamp, m/s its increments"""
    scale: PerAxis = ONE
    """of raw counts: how much of the unit one is"""
    only: RowsOf | None = None
    """those of the accelerometer, where it has rows of its own"""
    file: str = ""
    """where its data are, if not in the gyro's file"""
    time: TimeColumn | None = None
    """its stamps, if they are not the gyro's"""

    @property
    def apart(self) -> bool:
        """Whether its values do not stand beside those of the gyro."""
        return self.only is not None or self.time is not None or bool(self.file)


class ImuColumns(Section):
    """The columns of an IMU table."""

    time: TimeColumn | None = None
    """the stamps; may be left out where rate_hz is given"""
    gyro: GyroColumns
    """angular rates or angle increments"""
    accel: AccelColumns
    """specific force or velocity increments"""
    only: RowsOf | None = None
    """those of this IMU, where there are rows of others"""

    @model_validator(mode="after")
    def _accelerometer_apart_has_stamps(self) -> Self:
        if not self.accel.apart:
            return self
        if self.time is None:
            raise blame("time", "is missing; expected it where gyro and accelerometer stand apart")
        if self.gyro.unit in ("rad", "deg") or self.accel.unit == "m/s":
            raise blame("accel", "stands apart from the gyro; expected rates rather than increments of both")
        return self


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
    scale: PerAxis = ONE
    """of whole numbers: how much of the unit one is, as [1e-7, 1e-7, 0.001]"""
    undulation: Column | None = None
    """a column with the height of the geoid above the ellipsoid, m, which is added to heights above the sea"""

    @model_validator(mode="after")
    def _unit_fits(self) -> Self:
        geodetic = self.frame == "latitude-longitude-height"
        if self.unit is not None and geodetic == (self.unit == "m"):
            fitting = "deg or rad" if geodetic else "m"
            raise ValueError(f"unit {self.unit} does not fit frame {self.frame}; expected {fitting}")
        if self.undulation is not None and not geodetic:
            raise blame("undulation", f"is given with frame {self.frame}; expected latitude-longitude-height")
        return self


class StdColumns(Section):
    """Which columns of a table hold the standard deviations of the position or velocity."""

    names: ThreeColumns
    """in the order of the value's frame (north, east, height with latitude-longitude-height), m or m/s"""
    scale: PositiveSpread = ONE
    """of whole numbers: how much of the unit one is"""
    variances: bool = False
    """they hold variances, m^2 or m^2/s^2"""


class VelocityColumns(Section):
    """Which columns of a table hold the velocity."""

    names: ThreeColumns
    """m/s, in the order of `frame`"""
    scale: PerAxis = ONE
    """of whole numbers: how many m/s one is"""
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
    only: RowsOf | None = None
    """the rows of this receiver, or of a kind of fix"""
    changed: bool = False
    """use a row only where its position is there and is another than before: positions of a receiver in the rows of an
    IMU"""
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
