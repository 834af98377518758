"""What a run with wheels is told, and what it remembers of them from one epoch to the next."""

from __future__ import annotations

from typing import NamedTuple

from polyins.kernels.jit import Array

SPEED, POINT, ZERO_VELOCITY, ZERO_RATE = 0.0, 1.0, 2.0, 3.0
"""Kinds of measurement, which stand in `Rolling.given`: as arguments they would be compiled one by one."""

# places in `Rolling.settings`
SPEED_INTERVAL, SPEED_WINDOW, POINT_INTERVAL, AT_END, STANDSTILL = range(5)
POINT_VARIANCE, ZERO_VELOCITY_VARIANCE, ZERO_RATE_VARIANCE, STILL_RATE = range(5, 9)
RADIUS = 9
"""m, mean of the wheels that give the speed"""
SETTINGS = 10

# places in `Rolling.memory`
LAST_SPEED, LAST_POINT, OPENED, FILLED, TRAVEL, LATERAL, STILL = range(7)
MEMORY = 7

# places in `Rolling.given`
KIND, G_SPEED, G_LATERAL, G_DURATION, G_DT = range(5)
G_KNOWN, G_POINT, G_VARIANCE, G_METRES = 5, 8, 11, 14
GIVEN = 17


class Rolling(NamedTuple):
    """What a run with wheels is told, and what it remembers of them."""

    lenders: Array
    """int64 (shares,): the share that lends roll and pitch; -1: none, or on the body"""
    noise: Array
    """(shares, 3): variances of the velocity, (m/s)^2 forward, right, down"""
    settings: Array
    antenna: Array
    """m, in vehicle axes"""
    travel: Array
    """(T, 2): m that the wheels rolled in the interval that ends at each epoch, NaN where none measures; m to the right
    of the axle's middle, the mean place of the wheels that do"""
    present: Array
    """uint8 (T, shares): whether the IMUs of a share give data; (0, shares): they always do"""
    memory: Array
    silent: Array
    """(shares,): since when, s; below zero: not silent"""
    returned: Array
    """(shares,): since when a silent one has data again, s; below zero: not"""
    given: Array
    """what the measurement that is being applied needs"""


class Joint(NamedTuple):
    """The covariance of all shares together and its work arrays, see `kernels.joint`."""

    whole: Array
    h: Array
    hp: Array
    gain: Array
    ah: Array
    rows: Array
    """(shares, 3, .): design matrices of one epoch's measurements"""
    correction: Array
    """sum of the corrections of one epoch's measurements so far, the error states"""
    z: Array
    work: Array
