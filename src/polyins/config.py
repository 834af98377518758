"""The configuration as typed, validated models: what a polyins YAML file may say, with units and defaults.

A key whose unit is not SI carries it. An unknown key is an error that names the nearest known one.
"""

from __future__ import annotations

import difflib
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, ValidationError, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from polyins.errors import InputError
from polyins.io.yaml_document import Document, Key


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("expected a number")
    return float(value)


def _three(value: object) -> tuple[float, ...]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError("expected three numbers, like [0, 0, 0]")
    return tuple(_number(item) for item in value)


def _one_or_three(value: object) -> tuple[float, ...]:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (float(value),) * 3
    try:
        return _three(value)
    except ValueError as error:
        raise ValueError("expected one number or three, like [0, 0, 0]") from error


def _two(value: object) -> tuple[float, ...]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError("expected two numbers, like [0, 10]")
    return tuple(_number(item) for item in value)


def _not_negative(value: Any) -> Any:
    if min(value) < 0.0:
        raise ValueError("expected no negative number")
    return value


def _positive(value: float) -> float:
    if value <= 0.0:
        raise ValueError("expected a number above zero")
    return value


def _axis_names(value: object) -> object:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError("expected three of x, y, z with or without a minus, like [x, -y, -z]")
    return tuple(str(item) for item in value)


Number = Annotated[float, BeforeValidator(_number)]
Positive = Annotated[float, BeforeValidator(lambda value: _positive(_number(value)))]
Pair = Annotated[tuple[float, float], BeforeValidator(_two)]
Triple = Annotated[tuple[float, float, float], BeforeValidator(_three)]
PerAxis = Annotated[tuple[float, float, float], BeforeValidator(_one_or_three)]
"""One number or three; held as three."""
Spread = Annotated[tuple[float, float, float], BeforeValidator(lambda value: _not_negative(_one_or_three(value)))]
"""Standard deviations: one number or three, none negative; held as three."""
Column = str | int
"""A column's name, or its number counted from 1 where a file has no header."""
ThreeColumns = tuple[Column, Column, Column]

ORIGIN = (0.0, 0.0, 0.0)


class Section(BaseModel):
    """A mapping in the file."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)

    @model_validator(mode="before")
    @classmethod
    def _know_every_key(cls, values: Any) -> Any:
        for key in values if isinstance(values, dict) else ():
            if key not in cls.model_fields:
                near = difflib.get_close_matches(key, cls.model_fields, n=1, cutoff=0.5)
                hint = f"did you mean {near[0]}?" if near else f"expected one of {', '.join(cls.model_fields)}"
                raise PydanticCustomError("unknown_key", "unknown key; {hint}", {"key": key, "hint": hint})
        return values


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


class TrackColumns(Section):
    """The columns of a table of positions."""

    time: TimeColumn
    """the stamps"""
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


NOISE_GRADES: dict[str, dict[str, float]] = {
    "consumer-mems": {
        "angle_random_walk_deg_sqrt_h": 0.24,
        "velocity_random_walk_m_s_sqrt_h": 0.24,
        "gyro_bias_deg_h": 50.0,
        "accel_bias_mgal": 250.0,
        "gyro_scale_ppm": 1000.0,
        "accel_scale_ppm": 1000.0,
        "correlation_time_h": 1.0,
    },
    "industrial-mems": {
        "angle_random_walk_deg_sqrt_h": 0.15,
        "velocity_random_walk_m_s_sqrt_h": 0.08,
        "gyro_bias_deg_h": 10.0,
        "accel_bias_mgal": 100.0,
        "gyro_scale_ppm": 500.0,
        "accel_scale_ppm": 500.0,
        "correlation_time_h": 1.0,
    },
    "tactical": {
        "angle_random_walk_deg_sqrt_h": 0.03,
        "velocity_random_walk_m_s_sqrt_h": 0.03,
        "gyro_bias_deg_h": 1.0,
        "accel_bias_mgal": 50.0,
        "gyro_scale_ppm": 200.0,
        "accel_scale_ppm": 200.0,
        "correlation_time_h": 4.0,
    },
}
"""Typical figures by class of sensor. The first is an ICM-20602 as in the enav-fusion paper's public settings."""


class Noise(Section):
    """How good an IMU is: random walks, and the std and correlation time of its slow errors (Gauss-Markov)."""

    grade: Literal["consumer-mems", "industrial-mems", "tactical"] | None = None
    """fills in what is not given below; without it consumer-mems does"""
    angle_random_walk_deg_sqrt_h: Spread
    """deg/sqrt(h)"""
    velocity_random_walk_m_s_sqrt_h: Spread
    """m/s/sqrt(h)"""
    gyro_bias_deg_h: Spread
    """std of the gyro bias, deg/h"""
    accel_bias_mgal: Spread
    """std of the accelerometer bias, mGal (1e-5 m/s^2)"""
    gyro_scale_ppm: Spread
    """std of the gyro scale factor, ppm"""
    accel_scale_ppm: Spread
    """std of the accelerometer scale factor, ppm"""
    correlation_time_h: Positive
    """of all four, h"""

    @model_validator(mode="before")
    @classmethod
    def _fill_from_grade(cls, values: Any) -> Any:
        given = {"grade": values} if isinstance(values, str) else values
        if not isinstance(given, dict):
            raise ValueError(f"expected a mapping or the name of a grade: {', '.join(NOISE_GRADES)}")
        grade = given.get("grade")
        if grade is not None and grade not in NOISE_GRADES:
            raise ValueError(f"unknown grade {grade!r}; expected one of {', '.join(NOISE_GRADES)}")
        said = {key: value for key, value in given.items() if value is not None}
        return {"grade": None, **NOISE_GRADES[grade or "consumer-mems"], **said}


class InitialErrors(Section):
    """The slow errors known beforehand, in array axes."""

    gyro_bias_deg_s: PerAxis = ORIGIN
    """deg/s"""
    accel_bias_m_s2: PerAxis = ORIGIN
    """m/s^2"""
    gyro_scale_ppm: PerAxis = ORIGIN
    """ppm"""
    accel_scale_ppm: PerAxis = ORIGIN
    """ppm"""


class InitialStd(Section):
    """How sure the initial errors are, 1 sigma; what is not given is as in `noise`."""

    gyro_bias_deg_s: Spread | None = None
    """deg/s"""
    accel_bias_m_s2: Spread | None = None
    """m/s^2"""
    gyro_scale_ppm: Spread | None = None
    """ppm"""
    accel_scale_ppm: Spread | None = None
    """ppm"""


class ImuSettings(Section):
    """What can be said of one IMU, or under `imu_defaults` of all."""

    format: Literal["auto", "xsens-dot", "kf-gins", "table"] = "auto"
    """of the file; auto: found from its content"""
    columns: ImuColumns | None = None
    """of a table; without it the table has the columns that polyins writes"""
    rate_hz: Positive | None = None
    """take row number / rate_hz as the time and ignore the stamps"""
    clock_offset_s: Number = 0.0
    """added to the stamps, s"""
    axes: Annotated[tuple[str, str, str], BeforeValidator(_axis_names)] = ("x", "y", "z")
    """which sensor axes point forward, right and down in the array"""
    mount_deg: Triple = ORIGIN
    """roll, pitch, yaw of the sensor in the array, deg, after `axes`: C_ab = Rz(yaw) Ry(pitch) Rx(roll)"""
    position_m: Triple = ORIGIN
    """from the array's origin: forward, right, down, m"""
    noise: Noise = Field(default_factory=lambda: Noise.model_validate("consumer-mems"))
    """how good the sensor is: a mapping, or just the name of a grade"""
    initial_errors: InitialErrors = InitialErrors()
    """slow errors known beforehand"""
    initial_std: InitialStd = InitialStd()
    """how sure they are"""

    @model_validator(mode="after")
    def _axes_are_right_handed(self) -> Self:
        if sorted(name.lstrip("-") for name in self.axes) != ["x", "y", "z"] or any(len(a) > 2 for a in self.axes):
            problem = f"axes {list(self.axes)} are not a permutation of x, y, z"
        elif not _right_handed(self.axes):
            problem = f"axes {list(self.axes)} are left-handed"
        else:
            return self
        raise PydanticCustomError(
            "axes", "{problem}; expected right-handed ones, like [x, -y, -z]", {"key": "axes", "problem": problem}
        )


class ImuEntry(ImuSettings):
    """One IMU."""

    name: str = ""
    """a name of its own; imu1, imu2, ... if not given"""
    file: str
    """where its data are"""


class GnssEntry(Section):
    """The positions that aid the filter."""

    file: str
    """where the data are"""
    format: Literal["auto", "kf-gins", "rtklib-pos", "table"] = "auto"
    """of the file; auto: found from its content"""
    columns: TrackColumns | None = None
    """of a table; without it the table has the columns that polyins writes"""
    clock_offset_s: Number = 0.0
    """added to the stamps, s"""
    antenna_position_m: Triple = ORIGIN
    """of the antenna from the array's origin: forward, right, down, m"""
    position_std_m: Spread | None = None
    """north, east, down, m; takes the place of what the file says"""
    rate_hz: Positive | None = None
    """thin the fixes to this rate"""
    height: Literal["ellipsoidal", "sea-level"] = "ellipsoidal"
    """what heights count from"""
    geoid_height_m: Number | None = None
    """height of the geoid above the ellipsoid, m; needed with sea-level heights"""


class ReferenceEntry(Section):
    """What the solution is judged by."""

    file: str
    """where the data are"""
    format: Literal["auto", "kf-gins-nav", "kf-gins", "rtklib-pos", "table"] = "auto"
    """of the file; auto: found from its content"""
    columns: TrackColumns | None = None
    """of a table; without it the table has the columns that polyins writes"""
    clock_offset_s: Number = 0.0
    """added to the stamps, s"""
    position_lag_s: Number = 0.0
    """position and velocity belong to an instant that much later than the attitude of the same row, s"""
    point_m: Triple = ORIGIN
    """the point that the positions describe, from the array's origin: forward, right, down, m"""
    height: Literal["ellipsoidal", "sea-level"] = "ellipsoidal"
    """what heights count from"""
    geoid_height_m: Number | None = None
    """height of the geoid above the ellipsoid, m; needed with sea-level heights"""


class StartPosition(Section):
    """Where the array's origin is: geodetic, or on the local tangent plane."""

    latitude_deg: Annotated[float, BeforeValidator(_number), Field(ge=-90.0, le=90.0)] | None = None
    """deg"""
    longitude_deg: Annotated[float, BeforeValidator(_number), Field(ge=-360.0, le=360.0)] | None = None
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

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [self.latitude_deg, self.longitude_deg, self.north_m, self.east_m]
        if [value is not None for value in given] not in ([True, True, False, False], [False, False, True, True]):
            raise ValueError("expected latitude_deg and longitude_deg, or north_m and east_m")
        return self


class Start(Section):
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
    heading_from: Literal["auto", "value", "gnss-course", "reference"] = "auto"
    """auto: the first of the others that the data allow"""
    static_interval_s: Pair | None = None
    """the array stands still from, to, s; without it looked for"""
    position_std_m: Spread | None = None
    """north, east, down, m"""
    velocity_std_m_s: Spread | None = None
    """north, east, down, m/s"""
    attitude_std_deg: Spread | None = None
    """roll, pitch, heading, deg"""
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


def _outage_kind(value: object) -> str:
    return "schedule" if isinstance(value, dict | OutageSchedule) else "list"


Outages = Annotated[
    Annotated[OutageSchedule, Tag("schedule")] | Annotated[tuple[Pair, ...], Tag("list")], Discriminator(_outage_kind)
]


class Filter(Section):
    """What the filter is told beyond the sensors."""

    gate_limit: Positive | None = 50.0
    """a fix whose normalized innovation squared exceeds this is rejected; null: none is"""
    gate_reopen_after: Annotated[int, Field(ge=1, strict=True)] = 5
    """after that many rejections in a row the next fix is believed"""
    gnss_snap_s: Annotated[float, BeforeValidator(_number), Field(ge=0.0)] = 1e-4
    """a fix nearer than this to an IMU epoch is applied at that epoch, s"""
    gravity_m_s2: Positive = 9.80665
    """on a local tangent plane only, m/s^2"""


class Config(Section):
    """The whole file."""

    name: str = ""
    """of the recording; without it the file's"""
    dataset: str | None = None
    """relative paths count from this data set's folder instead of the file's"""
    imu_defaults: ImuSettings | None = None
    """holds for each IMU that does not say otherwise"""
    imus: Annotated[tuple[ImuEntry, ...], Field(min_length=1)]
    """the IMUs of the array"""
    gnss: GnssEntry | None = None
    """the positions that aid the filter"""
    reference: ReferenceEntry | None = None
    """what the solution is judged by"""
    start: Start = Start()
    """how the navigation state is found at the start"""
    outages: Outages = ()
    """intervals in which GNSS is withheld: a schedule, or a list of [from, to] in s"""
    filter: Filter = Filter()
    """what the filter is told beyond the sensors"""

    @model_validator(mode="before")
    @classmethod
    def _fill_imus(cls, values: Any) -> Any:
        """Complete each IMU by the defaults and by a name."""
        if not isinstance(values, dict) or not isinstance(values.get("imus"), list):
            return values
        defaults = values.get("imu_defaults")
        imus = [
            {"name": f"imu{number}", **_merged(defaults, imu)} if isinstance(imu, dict) else imu
            for number, imu in enumerate(values["imus"], 1)
        ]
        return {**values, "imus": imus}

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [imu.name for imu in self.imus]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise ValueError(f"imus: two are named {name!r}; expected a name of its own for each")
        return self


def parse(document: Document) -> Config:
    """Validate what a YAML file says.

    Raises InputError that names file, line and key of the first thing wrong.
    """
    if document.duplicate:
        raise InputError(f"{document.duplicate}; expected each key once")
    try:
        return Config.model_validate(document.values)
    except ValidationError as error:
        raise InputError(_explain(error.errors()[0], document)) from error


def _merged(defaults: object, given: dict[str, Any]) -> dict[str, Any]:
    """Lay `given` over `defaults`, mappings key by key."""
    if not isinstance(defaults, dict):
        return given
    both = {**defaults, **given}
    for key, value in given.items():
        if isinstance(value, dict):
            both[key] = _merged(defaults.get(key), value)
    return both


def _right_handed(axes: tuple[str, str, str]) -> bool:
    order = [name.lstrip("-") for name in axes]
    cyclic = order in (["x", "y", "z"], ["y", "z", "x"], ["z", "x", "y"])
    return cyclic == (sum(name.startswith("-") for name in axes) % 2 == 0)


def _explain(error: ErrorDetails, document: Document) -> str:
    """Say in the user's words where validation failed and what was expected."""
    context = error.get("ctx", {})
    keys: list[Key] = [key for key in error["loc"] if key not in ("schedule", "list", "str", "int")]
    if "key" in context:
        keys.append(context["key"])
    place = document.place(keys)
    kind = error["type"]
    if kind == "missing":
        return f"{place}: is missing; expected it in this mapping"
    if kind == "literal_error":
        return f"{place}: is {error['input']!r}; expected {context['expected']}"
    if kind == "too_short":
        return f"{place}: is empty; expected at least one"
    if kind in ("tuple_type", "model_type", "dict_type"):
        return f"{place}: is {error['input']!r}; expected a {'list' if kind == 'tuple_type' else 'mapping'}"
    message = error["msg"].removeprefix("Value error, ")
    if kind in ("unknown_key", "axes") or not message.startswith(("expected", "Input should be")):
        return f"{place}: {message[0].lower()}{message[1:]}"
    return f"{place}: is {error['input']!r}; {message.replace('Input should be', 'expected')}"
