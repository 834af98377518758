"""Wheels: what an IMU turns with, and how wheels aid the filter."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from polyins.config.fields import ORIGIN, NotNegative, Pair, Positive, PositiveSpread, Section, Triple, blame
from polyins.model.recording import RollingOptions
from polyins.model.rig import Vector

SPEED = RollingOptions()

SpinAxis = Literal["x", "y", "z", "-x", "-y", "-z"]


def _three(vector: Vector) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


class WheelEntry(Section):
    """The wheel that an IMU turns with; the module's axes: x along the axle to the right, y and z in the wheel."""

    radius_m: Positive
    """rolling, m: forward speed = -radius x rate about the axle to the right, as the gyro shows it"""
    spin_axis: SpinAxis
    """which sensor axis points to the right along the axle: one that points outward is z on the right and -z on the
    left"""
    side: Literal["left", "right"] | None = None
    """of the vehicle; checked against position_m"""
    tilt_deg: Pair = (0.0, 0.0)
    """of the true spin axis: its components along the two sensor axes that follow in the order x, y, z, x, y; of z: x
    and y, of -z as well; small angles, deg"""
    lever_arm_m: Triple = ORIGIN
    """from the IMU to the wheel's centre, in the module's axes, m"""
    steering: bool = False
    """it is steered: it gives no speed and does not navigate"""
    radius_std: NotNegative = 0.0
    """relative; above zero the filter estimates the radius; the larger, the faster it leaves radius_m"""
    lever_arm_std_m: NotNegative = 0.0
    """of both components in the wheel, m; above zero the filter estimates them; the larger, the faster they leave
    lever_arm_m"""


class Rolling(Section):
    """How wheels aid the filter; the defaults are paper B's."""

    speed_interval_s: Positive = SPEED.speed_interval
    """from one update by wheel speed to the next, s; the larger, the less wheels weigh"""
    speed_window_s: Positive = SPEED.speed_window
    """the speed is the mean over this time before the update, s; the larger, the smoother and the later it is"""
    predict: Literal["window", "end"] = "window"
    """compare the mean speed with the mean velocity over the same window, or with the velocity at its end"""
    wheel_speed_std_m_s: PositiveSpread = _three(SPEED.wheel_speed_std)
    """forward, right, down, of IMUs on wheels, m/s; the larger, the less speed and rolling without slip weigh"""
    body_speed_std_m_s: PositiveSpread = _three(SPEED.body_speed_std)
    """forward, right, down, of IMUs on the body, m/s; the larger, the less the wheels' speed weighs there"""
    constraint_interval_s: Positive = SPEED.constraint_interval
    """from one update by the reference point to the next, s; the larger, the farther modules drift apart between"""
    constraint_std_m: Positive = SPEED.constraint_std
    """of each component of the reference point, m; the larger, the looser modules are held together"""
    standstill: bool = SPEED.standstill
    """look for standstills and update by zero velocity and zero rate there"""

    @model_validator(mode="after")
    def _window_fits(self) -> Self:
        window, interval = self.speed_window_s, self.speed_interval_s
        if window <= interval:
            return self
        raise blame("speed_window_s", f"is {window:g}; expected at most speed_interval_s, {interval:g}")
