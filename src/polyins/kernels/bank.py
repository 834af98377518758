"""Where the numbers of eight IMUs stand in one row of the bank.

Each name is the offset of the first of eight lanes; vectors and matrices take consecutive fields, row by row.
"""

from __future__ import annotations

from polyins.kernels.jit import Array
from polyins.kernels.layout import Layout
from polyins.model import states

LANES = 8

_layout = Layout(LANES)
_take = _layout.take


# navigation state of each IMU
POSITION = _take(3)  # latitude rad, longitude rad, height m; or north m, east m, height m
VELOCITY = _take(3)  # north, east, down, m/s
QUATERNION = _take(4)  # q_nb, scalar first
MATRIX = _take(9)  # C_nb, kept in step with the quaternion
ERRORS = _take(states.ERRORS)  # estimates of all that is estimated beside it, in the order of the table of states
SENSITIVITY = _take(6)  # 1 / (1 + scale) of gyros and accelerometers, kept in step with the errors
# measured increments over the whole interval, and the corrected ones over the part that is propagated
RAW_DTHETA = _take(3)
RAW_DVEL = _take(3)
DTHETA = _take(3)
DVEL = _take(3)
PREVIOUS_DTHETA = _take(3)
PREVIOUS_DVEL = _take(3)
# the mount: on a wheel or fixed to the body, m
RADIUS = _take(1)  # of its wheel; 0 on the body
TO_WHEEL = _take(3)  # from the IMU to the centre of its wheel, in its axes
IN_VEHICLE = _take(3)  # the wheel's centre, or the IMU on the body, in vehicle axes
TO_POINT = _take(3)  # from the IMU to the point whose state its block fuses, in its axes
WEIGHT = _take(1)  # in the means of its block, where they add up to one; 0: silent, excluded or padding
# while a mean speed is taken: what the point of that speed travelled in vehicle axes, and the last epoch's state
TRAVELLED = _take(3)
TURNED = _take(3)  # sum of the corrected increments, rad
BEFORE_POINT = _take(3)
BEFORE_VELOCITY = _take(3)
BEFORE_VEHICLE = _take(9)
# intermediates of one mechanization: where the earth is evaluated and what it gives
AT_POSITION = _take(3)
AT_VELOCITY = _take(3)
AT_MATRIX = _take(9)
GRAVITY = _take(1)
EARTH_RATE = _take(2)  # north, down
TRANSPORT_RATE = _take(3)
TO_LATITUDE = _take(1)  # rad (or m on a plane) per metre north
TO_LONGITUDE = _take(1)
ROTATION = _take(3)  # rotation vector of the body over the interval
DVEL_N = _take(3)  # velocity increment of the specific force in n
# the solution seen at the point of its block
POINT_POSITION = _take(3)
POINT_VELOCITY = _take(3)
OFFSET = _take(16)  # weighted, of what is averaged from the same of the first IMU; see `fuse`
LEAP = _take(1)  # by how much the last increments of one IMU moved the mean, over what is looked at, squared
RESIDUAL = _take(3)  # of the last measurement
DEVIATION = _take(27)  # from the mean of the block, whitened: the newest, and means over a shorter and a longer while
AXES = _take(3)  # how its axes lie against those of the mean of its block, rad
EXCLUDED = _take(1)  # 1: it does not count, whatever it has
AGREED = _take(1)  # s for which one that does not count has agreed
CORRECTION = _take(states.STATES)  # error state of the last update

SIZE = _layout.size
STATES = states.STATES

SPEED_SCALE, MOUNT = (ERRORS + (states.place(name) - states.NAVIGATION) * LANES for name in ("speed_scale", "mount"))
HEIGHT_BIAS, HEADING_OFFSET = (
    ERRORS + (states.place(name) - states.NAVIGATION) * LANES for name in ("height_bias", "heading_offset")
)


def put(lanes: Array, field: int, lane: int, values: Array) -> None:
    """Write the field of one IMU, a number or more."""
    lanes[field + lane : field + lane + len(values) * LANES : LANES] = values
