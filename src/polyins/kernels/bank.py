"""Where the numbers of eight IMUs stand in one block of the bank.

Each name is the offset of the first of eight lanes; vectors and matrices take consecutive fields, row by row.
"""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from polyins.kernels.layout import Layout

Array = npt.NDArray[Any]

LANES = 8

_layout = Layout(LANES)
_take = _layout.take


# navigation state of each IMU
POSITION = _take(3)  # latitude rad, longitude rad, height m; or north m, east m, height m
VELOCITY = _take(3)  # north, east, down, m/s
QUATERNION = _take(4)  # q_nb, scalar first
MATRIX = _take(9)  # C_nb, kept in step with the quaternion
# estimated errors: gyro bias, accelerometer bias, gyro scale, accelerometer scale
ERRORS = _take(12)
MOUNTING = _take(3)  # of a vehicle with wheels, see `share`; it follows the errors of the IMU
SENSITIVITY = _take(6)  # 1 / (1 + scale) of gyros and accelerometers, kept in step with the errors
# measured increments over the whole interval, and the corrected ones over the part that is propagated
RAW_DTHETA = _take(3)
RAW_DVEL = _take(3)
DTHETA = _take(3)
DVEL = _take(3)
PREVIOUS_DTHETA = _take(3)
PREVIOUS_DVEL = _take(3)
# geometry in array axes, m
TO_ORIGIN = _take(3)  # from the IMU to the array origin
TO_ANTENNA = _take(3)  # from the IMU to the GNSS antenna
# of a vehicle with wheels, m
WHEEL = _take(1)  # radius, 0 on the body
TO_WHEEL = _take(3)  # from the IMU to the centre of its wheel, in its axes
TO_SPEED = _take(3)  # from the IMU to the middle of the vehicle's rear axle, in its axes
IN_VEHICLE = _take(3)  # the wheel's centre, or the IMU on the body, in vehicle axes
# while a mean speed is taken: what the point of that speed travelled in vehicle axes, and the last epoch's state
TRAVELLED = _take(3)
TURNED = _take(3)  # sum of the corrected increments, rad
BEFORE_POINT = _take(3)
BEFORE_VELOCITY = _take(3)
BEFORE_VEHICLE = _take(9)
WEIGHT = _take(1)  # share in means; the weights of a bank add up to one
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
# the solution seen at the array origin
ORIGIN_POSITION = _take(3)
ORIGIN_VELOCITY = _take(3)
OFFSET = _take(16)  # weighted, of what is averaged from the same of the first IMU; see `fuse`
RESIDUAL = _take(3)  # of the last measurement
CORRECTION = _take(24)  # error state of the last update

SIZE = _layout.size


def put(w: Array, field: int, lane: int, values: Array) -> None:
    """Write the field of one IMU, a number or more."""
    w[field + lane : field + lane + len(values) * LANES : LANES] = values
