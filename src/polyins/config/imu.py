"""The IMUs: files, mounts, noise, errors known beforehand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from polyins.config.clock import ClockSettings
from polyins.config.columns import ImuColumns
from polyins.config.fields import (
    IDENTITY,
    ORIGIN,
    Matrix,
    NotNegative,
    PerAxis,
    Positive,
    Section,
    Spread,
    Triple,
    blame,
)
from polyins.config.rolling import WheelEntry
from polyins.config.sensor_noise import KNOWN_IMUS

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

NOISE_BY_NAME: dict[str, dict[str, float]] = NOISE_GRADES | {
    name: NOISE_GRADES[imu.grade] | {key: stated.value for key, stated in imu.figures.items()}
    for name, imu in KNOWN_IMUS.items()
}
"""What `noise` may be by name: a grade, or an IMU whose figures have a source."""

LARGEST_CORRECTION = 0.3
"""of an element of a matrix: what is off by more is a wrong unit or other axes"""

FORWARD_RIGHT_DOWN = ("x", "y", "z")


def _axis_names(value: object) -> object:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError("expected three of x, y, z with or without a minus, like [x, -y, -z]")
    return tuple(str(item) for item in value)


class Noise(Section):
    """How good an IMU is: random walks, std and correlation time of its slow errors (Gauss-Markov), turn-on biases."""

    FIELDS: ClassVar[Mapping[str, str]] = {
        name: f"{name}_std" for name in ("gyro_bias", "accel_bias", "gyro_scale", "accel_scale")
    }
    grade: str | None = None
    """fills in what is not given below: a grade, or a common IMU by name, both listed below; without it consumer-mems
    does"""
    angle_random_walk_deg_sqrt_h: Spread
    """deg/sqrt(h); the larger, the faster the attitude becomes unsure, and the more aids weigh"""
    velocity_random_walk_m_s_sqrt_h: Spread
    """m/s/sqrt(h); the larger, the faster the velocity becomes unsure, and the more aids weigh"""
    gyro_bias_deg_h: Spread
    """std of the gyro bias, deg/h; the larger, the faster the estimate may change"""
    accel_bias_mgal: Spread
    """std of the accelerometer bias, mGal (1e-5 m/s^2); the larger, the faster the estimate may change"""
    gyro_scale_ppm: Spread
    """std of the gyro scale factor, ppm; the larger, the faster the estimate may change in turns"""
    accel_scale_ppm: Spread
    """std of the accelerometer scale factor, ppm; the larger, the faster the estimate may change under acceleration"""
    correlation_time_h: Positive
    """of all four, h; the larger, the slower they change and the longer an estimate holds"""
    gyro_turn_on_deg_s: Spread = ORIGIN
    """std of the constant that the gyro bias has besides, from one switch-on to the next, deg/s; the larger, the faster
    the estimate leaves zero, to which it is not drawn back"""
    accel_turn_on_m_s2: Spread = ORIGIN
    """the same of the accelerometer bias, m/s^2"""

    @model_validator(mode="before")
    @classmethod
    def _fill_from_grade(cls, values: Any) -> Any:
        given = {"grade": values} if isinstance(values, str) else values
        if not isinstance(given, dict):
            raise ValueError(f"expected a mapping or a name: {', '.join(NOISE_BY_NAME)}")
        grade = given.get("grade")
        if grade is not None and (not isinstance(grade, str) or grade not in NOISE_BY_NAME):
            raise ValueError(f"unknown grade {grade!r}; expected one of {', '.join(NOISE_BY_NAME)}")
        said = {key: value for key, value in given.items() if value is not None}
        return {"grade": None, **NOISE_BY_NAME[grade or "consumer-mems"], **said}


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
    """deg/s, the chip's turn-on bias; the larger, the faster the estimate leaves initial_errors; unused where a
    standstill at the start shows the bias itself"""
    accel_bias_m_s2: Spread | None = None
    """m/s^2; the larger, the faster the estimate leaves initial_errors"""
    gyro_scale_ppm: Spread | None = None
    """ppm; the larger, the faster the estimate leaves initial_errors in turns"""
    accel_scale_ppm: Spread | None = None
    """ppm; the larger, the faster the estimate leaves initial_errors under acceleration"""


class ImuSettings(ClockSettings):
    """What can be said of one IMU, or under `imu_defaults` of all."""

    format: Literal["auto", "xsens-dot", "kf-gins", "wheel-ins", "table"] = "auto"
    """of the file; auto: found from its content, but for wheel-ins (binary rows of s, rad/s, m/s^2)"""
    columns: ImuColumns | None = None
    """of a table; without it the table has the columns that polyins writes"""
    rate_hz: Positive | None = None
    """take row number / rate_hz as the time and ignore the stamps"""
    gyro_range_deg_s: Positive | None = None
    """full scale of the gyro, deg/s: what reaches it is left out; the larger, the less is; without it that of the
    format, where it is known"""
    gyro_matrix: Matrix = IDENTITY
    """three rows of three, in the sensor's axes, before `axes` and mount_deg: corrected = matrix x measured; the
    diagonal corrects scale factors, the rest cross-axis errors"""
    accel_matrix: Matrix = IDENTITY
    """the same of the accelerometers"""
    axes: Annotated[tuple[str, str, str], BeforeValidator(_axis_names)] = FORWARD_RIGHT_DOWN
    """which sensor axes point forward, right and down in the array"""
    mount_deg: Triple = ORIGIN
    """roll, pitch, yaw of the sensor in the array, deg, after `axes`: C_ab = Rz(yaw) Ry(pitch) Rx(roll)"""
    position_m: Triple = ORIGIN
    """from the array's origin: forward, right, down, m; of a wheel: where its centre is"""
    wheel: WheelEntry | None = None
    """the wheel that it turns with, instead of axes and mount_deg"""
    module: str = ""
    """of the board that it shares with other chips at the same place"""
    mount_std_deg: NotNegative = 0.0
    """of pitch and yaw on a vehicle's body, deg; above zero the filter estimates them; the larger, the faster they
    leave mount_deg"""
    noise: Noise = Field(default_factory=lambda: Noise.model_validate("consumer-mems"))
    """how good the sensor is: a mapping, or just the name of a grade or of a common IMU"""
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
        raise blame("axes", f"{problem}; expected right-handed ones, like [x, -y, -z]")

    @model_validator(mode="after")
    def _matrices_correct(self) -> Self:
        for key in ("gyro_matrix", "accel_matrix"):
            off = np.abs(np.array(getattr(self, key)) - np.eye(3)).max()
            if off > LARGEST_CORRECTION:
                raise blame(key, f"differs by {off:.2g} from the unit matrix; expected at most {LARGEST_CORRECTION:g}")
        return self

    @model_validator(mode="after")
    def _wheel_or_mount(self) -> Self:
        if self.wheel is None:
            return self
        if self.axes != FORWARD_RIGHT_DOWN:
            raise blame("axes", "are given with a wheel; expected wheel.spin_axis alone")
        if self.mount_deg != ORIGIN:
            raise blame("mount_deg", "is given with a wheel; expected wheel.spin_axis and wheel.tilt_deg")
        if self.mount_std_deg:
            raise blame("mount_std_deg", "is given with a wheel; expected it of an IMU on the body")
        return self


class ImuEntry(ImuSettings):
    """One IMU."""

    name: str = ""
    """a name of its own; imu1, imu2, ... if not given"""
    stream: str = ""
    """which of the IMUs of a log; may be left out where there is only one"""
    file: str = ""
    """where its data are; `polyins live` needs it for a replay only, all else always"""


def _right_handed(axes: tuple[str, str, str]) -> bool:
    order = [name.lstrip("-") for name in axes]
    cyclic = order in (["x", "y", "z"], ["y", "z", "x"], ["z", "x", "y"])
    return cyclic == (sum(name.startswith("-") for name in axes) % 2 == 0)
