"""The table of kinds of measurement: a new one is a row here, a branch of `design` and `residual`, and its file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from polyins.aiding import heading, height, odometer, point, velocity, wheel_speed, zero_rate, zero_velocity
from polyins.aiding.measurement import KIND
from polyins.kernels import vehicle
from polyins.kernels.jit import Array, scalar_kernel

(
    GNSS_POSITION,
    GNSS_VELOCITY,
    WHEEL_SPEED,
    REFERENCE_POINT,
    ZERO_VELOCITY,
    ZERO_RATE,
    HEIGHT,
    HEADING,
    ODOMETER,
    WINDOW,
    PAUSE,
    DEVIATIONS,
) = range(12)

MEAN: Final = 0
EACH: Final = 1
DIFFERENCES: Final = 2
"""How joined blocks take it: its noise is one, so that the mean of what all predict is measured; each block has noise
of its own; or what the blocks predict is compared between them."""


@dataclass(frozen=True)
class Kind:
    """What is known of a kind of measurement beside its formulas."""

    name: str
    unit: str
    """of its residual"""
    axes: tuple[str, ...]
    """of its residual; those of the kinds with fewer than three come first"""
    joined: Literal[0, 1, 2] = MEAN
    deweights: bool = False
    """whether one that the gate does not pass is taken all the same, with the variance of its own innovation"""
    in_vehicle: bool = False
    """whether it depends on the attitude of the vehicle, beyond that of the IMU"""
    offset: str = ""
    """the state that stands for its sensor's offset or scale"""


NORTH_EAST_DOWN, FORWARD_RIGHT_DOWN = ("north", "east", "down"), ("forward", "right", "down")

KINDS = (
    Kind("GNSS position", "m", NORTH_EAST_DOWN, deweights=True, in_vehicle=True),
    Kind("GNSS velocity", "m/s", NORTH_EAST_DOWN, deweights=True, in_vehicle=True),
    Kind("wheel speed", "m/s", FORWARD_RIGHT_DOWN, joined=EACH, in_vehicle=True),
    Kind("reference point", "m", NORTH_EAST_DOWN, joined=DIFFERENCES, in_vehicle=True),
    Kind("zero velocity", "m/s", NORTH_EAST_DOWN, joined=EACH),
    Kind("zero rate", "rad/s", ("x", "y", "z"), joined=EACH),
    Kind("height", "m", ("down",), deweights=True, in_vehicle=True, offset="height_bias"),
    Kind("heading", "rad", ("about down",), deweights=True, in_vehicle=True, offset="heading_offset"),
    Kind("odometer", "m/s", FORWARD_RIGHT_DOWN, deweights=True, in_vehicle=True, offset="speed_scale"),
    # not a measurement: from here on the mean speed of the next one is taken
    Kind("window", "", ()),
    # nor is this: no IMU had data until now, see `navigate.bridging`
    Kind("pause", "", ()),
    # nor is this: the IMUs of a block are compared with their mean, see `navigate.deviations`
    Kind("deviations", "", ()),
)

JOINED = tuple(kind.joined for kind in KINDS)
DEWEIGHTS = tuple(kind.deweights for kind in KINDS)
IN_VEHICLE = tuple(kind.in_vehicle for kind in KINDS)


def number(name: str) -> int:
    """Return the place of a kind in the table."""
    return [kind.name for kind in KINDS].index(name)


@scalar_kernel
def design(block: Array, lanes: Array, lane: int, measurement: Array, update: Array) -> None:
    """Write the design matrix of a measurement at the fused state of a block, whose first member is that lane."""
    kind = int(measurement[KIND])
    if kind in (GNSS_POSITION, REFERENCE_POINT):
        point.design(block, lanes, lane, measurement, update)
    elif kind == GNSS_VELOCITY:
        velocity.design(block, lanes, lane, measurement, update)
    elif kind == WHEEL_SPEED:
        wheel_speed.design(block, lanes, lane, measurement, update)
    elif kind == ODOMETER:
        odometer.design(block, lanes, lane, measurement, update)
    elif kind == HEIGHT:
        height.design(block, lanes, lane, measurement, update)
    elif kind == HEADING:
        heading.design(block, update)
    elif kind == ZERO_VELOCITY:
        zero_velocity.design(update)
    else:
        zero_rate.design(block, update)


@scalar_kernel
def residual(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> vehicle.Three:
    """Return predicted less measured, as one IMU has it."""
    kind = int(measurement[KIND])
    if kind in (GNSS_POSITION, REFERENCE_POINT):
        return point.residual(lanes, lane, lent, measurement)
    if kind == GNSS_VELOCITY:
        return velocity.residual(lanes, lane, lent, measurement)
    if kind == WHEEL_SPEED:
        return wheel_speed.residual(lanes, lane, lent, measurement)
    if kind == ODOMETER:
        return odometer.residual(lanes, lane, lent, measurement)
    if kind == HEIGHT:
        return height.residual(lanes, lane, lent, measurement)
    if kind == HEADING:
        return heading.residual(lanes, lane, lent, measurement)
    if kind == ZERO_VELOCITY:
        return zero_velocity.residual(lanes, lane)
    return zero_rate.residual(lanes, lane, measurement)
