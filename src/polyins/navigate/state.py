"""What the engine works on: what a run remembers, is told, is given, writes, and needs as work arrays.

Each is a tuple of arrays. All that a run remembers lies in one array of which those of `State` are parts, so that a run
can be cut anywhere, kept as a copy of that array, and taken up again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from polyins.aiding import measurement
from polyins.kernels import bank, covariance, fuse, kalman, layout
from polyins.kernels.jit import Array
from polyins.kernels.layout import Layout
from polyins.model.states import EIGHT

_layout = Layout()
_take = _layout.take

# --- places in `State.scalars`
TIME = _take(1)  # of the state, s
INTERVAL = _take(1)  # length of the last interval, s
NEXT_EVENT = _take(1)  # its index
NEXT_LOG = _take(1)  # row of the log
REJECTED_AT = _take(1)  # time of the last GNSS position that was not taken as it is, s
RECEIVER = _take(71)  # how far its positions are believed, see `navigate.receiver`
LEAPT = _take(1)  # whether one IMU has moved the mean of its block in the last epoch
LEFT_OUT = _take(4)  # what is yet to be told of the IMU that such a leap has left out, see `navigate.deviations`
AT_REST = _take(1)  # whether the vehicle stood in the last window
WINDOW_BEGIN = _take(1)  # s; of the window over which a mean speed or rate is taken
WINDOW_FILLED = _take(1)  # epochs in it; below zero: none is open
WINDOW_TRAVEL = _take(1)  # what the wheels rolled in it, m
WINDOW_LATERAL = _take(1)  # m to the right of the axle's middle: the mean place of the wheels that give the speed
FORWARD = _take(1)  # speed of the vehicle at the last epoch, m/s
SLIP = _take(7)  # what is found of the wheels at a speed, see `navigate.slip`
SLIP_USUAL = _take(1)  # mean square by which wheels are off together, over the variance of their speed
SLIP_COUNT = _take(1)  # speeds from which that is known
SLIP_LEAP = _take(1)  # by how much all were off when they began to be withheld, m/s
SLIP_BELIEVED = _take(2)  # by how much all were off at most that were believed lately, m/s, and when, s
SLIP_SINCE = _take(1)  # since when no wheel is believed, s; infinity: some are
SLIP_TRUSTED = _take(1)  # until when all are believed whatever the IMUs have, s
PREVIOUS = _take(4)  # mean rate of a virtual IMU and the length of its interval, see `fuse.average_increments`
EARTH = _take(5)  # see `earth.evaluate`: geodetic, latitude, its sine and cosine, plane gravity
SCALARS = _layout.size

# --- places in `Plan.settings`
(
    VIRTUAL,  # average the IMUs into one before navigation
    SHARED_MECHANIZATION,
    GATE_LIMIT,
    SNAP,  # s: an event this near to an epoch is at it
    LOG_EVERY,  # epochs between rows of the log of IMU errors
    STRIDE,  # length of a row of P
    MAY_BE_SILENT,  # whether IMUs may have no data
    STILL_RATE,  # rad/s: an IMU that turns more does not stand
    RADIUS,  # m, mean of the wheels that give the speed
    SPEED_AT_END,  # predict the velocity at the end of a window instead of the mean
    COMMON_SHARE,  # of the variances of noise and slow errors, what members of a block have in common
    COMPARED_EVERY,  # s between comparisons of members with their mean
    EXCLUDES,  # whether a member that deviates from the others counts no more
    ADAPTS,  # whether the own noise follows from how members deviate
    TOGETHER,  # whether the covariance of the mean of all blocks is kept, see `navigate.together`
    HELD,  # three variances: how well members keep together in position, velocity and attitude
) = range(16)
SETTINGS = 18

INNOVATION = 11
"""numbers that are told of an event"""

VALUES = measurement.VARIANCE - measurement.VALUE
"""numbers that the value of an event may have"""

SILENT, MEASURED, COMPLETED = 0, 1, 2
"""What an IMU has in an epoch: nothing; data; or what those that it is rigidly joined with make of it."""


class State(NamedTuple):
    """What a run remembers."""

    rows: Array
    """the bank, (rows of eight lanes, bank.SIZE)"""
    blocks: Array
    """covariance blocks, and behind them the merged state unless a single block has it, (., see block_size)"""
    deviations: Array
    """(blocks, .): of each the covariance D of how members deviate, see `navigate.deviations`; (0, .): none do"""
    joint: Array
    """covariance of all blocks together, square; empty unless they are joined"""
    scalars: Array
    silent: Array
    """(6, blocks): since when each is silent, and since when a silent one has data again, s; below zero: not; and while
    it is, the variances of position, velocity, tilt and heading that pauses of all IMUs have added"""
    rolled: Array
    """(2, 3 + wheels + blocks): the way since the last speed, see `navigate.slip`"""


class Plan(NamedTuple):
    """What a run is told."""

    spans: Array
    """int64 (blocks, 2): first lane of each block and the one after its last"""
    lenders: Array
    """int64 (blocks,): the block that lends roll and pitch; -1: none, or on the body"""
    row_blocks: Array
    """int64 (rows,): the block of several IMUs that a row belongs to; -1: blocks of one"""
    noise: Array
    """(blocks, covariance.NOISES): of one member of each"""
    speed_variance: Array
    """(blocks, 3): of the velocity that wheels give, (m/s)^2 forward, right, down"""
    wheels: Array
    """(wheels that give the speed,): m to the right of the axle's middle"""
    origin: Array
    """mean vector from the IMUs to the origin, m, for a virtual one"""
    settings: Array


class Inputs(NamedTuple):
    """The aligned recording."""

    time: Array
    """s (T,), the first is the start"""
    increments: Array
    """(T, 6, N): dtheta and dvel over the interval that ends at `time`; the first row is only a previous one"""
    present: Array
    """uint8 (T, N): what each IMU has; (0, N): all have data throughout"""
    travel: Array
    """(T, 2 + wheels): m that the wheels rolled in the interval that ends at each epoch, NaN where none measures; m to
    the right of the axle's middle, the mean place of the wheels that do; m of each, or NaN; (0, 2): without wheels"""
    event_time: Array
    """s (M,), in order"""
    event_kind: Array
    """int8 (M,), see `aiding.kinds`"""
    event_value: Array
    """(M, VALUES)"""
    event_variance: Array
    """(M, 3), not positive for what is not measured"""


class Outputs(NamedTuple):
    """What a run writes, a row per epoch, event, or row of the log."""

    states: Array
    """(T, 10): position, velocity, quaternion"""
    variances: Array
    """(T, 12): of position and velocity; covariance of phi NN, NE, ND, EE, ED, DD"""
    event_status: Array
    """int8 (M,)"""
    innovations: Array
    """(M, INNOVATION): residual 3, its variance 3, NIS; of a GNSS position its change since the last one 3, and the
    ratio of the variance that was used to the stated one; of a wheel speed what is found of slip 3"""
    log_time: Array
    """s (K,)"""
    log: Array
    """(K, 2, E, N): what is estimated beside the navigation state, and its std"""


class Work(NamedTuple):
    """Arrays that a run computes in; nothing in them is remembered."""

    covariance: Array
    """(1, .), or a row for each block if they are joined"""
    sums: Array
    """(blocks, .), see `fuse`"""
    updates: Array
    """(blocks + 1, kalman.SIZE): the last is of all together"""
    measurement: Array
    """(measurement.SIZE,)"""
    told: Array
    """(INNOVATION,): what a comparison says that is no event"""
    noise: Array
    """(3,): the variances with which an innovation was recorded"""
    residuals: Array
    """(blocks, 8) of one event's measurements: residual, its variances; the block whose members differ from it, or -1;
    which of `updates` is its own"""


class Further(NamedTuple):
    """What a run needs besides whose blocks are joined or that has more states than most.

    Most have None instead: what is only for others is then left out of what is compiled.
    """

    vectors: Array
    """(3, 3, size of the joint covariance): H P, the transposed gain, A H'"""
    designs: Array
    """(blocks, 3, size of the joint covariance): of one event's measurements"""
    correction: Array
    """(size of the joint covariance,): sum of the corrections of one event so far"""


class Navigators(NamedTuple):
    """The bank of navigators: all of a run but its data."""

    state: State
    plan: Plan
    work: Work


def block_size(stride: int) -> int:
    """Return the length of a covariance block whose P has rows of that length, in whole vectors of eight."""
    return -(-(covariance.P + stride * stride) // EIGHT) * EIGHT


def empty_state(
    rows: int, blocks: int, wheels: int, *, merged: bool, stride: int, joined: bool, compared: bool
) -> tuple[Array, State]:
    """Return the array of all that a run remembers, and the parts of it, which are zero."""
    joint = blocks * stride if joined else 0
    shapes = (
        (rows, bank.SIZE),
        (blocks + merged, block_size(stride)),
        (blocks if compared else 0, block_size(stride)),
        (joint, joint),
        (SCALARS,),
        (6, blocks),
        (2, 3 + wheels + blocks),
    )
    ends = np.cumsum([-(-math.prod(shape) // EIGHT) * EIGHT for shape in shapes])
    memory = layout.zeros(int(ends[-1]))
    parts = [
        memory[begin : begin + math.prod(shape)].reshape(shape)
        for shape, begin in zip(shapes, [0, *ends], strict=False)
    ]
    return memory, State(*parts)


def empty_work(blocks: int, joined: bool) -> Work:
    """Return the work arrays of a run."""
    return Work(
        covariance=layout.zeros(blocks if joined else 1, covariance.WORK),
        sums=layout.zeros(blocks, fuse.SUMS),
        updates=layout.zeros(blocks + 1, kalman.SIZE),
        measurement=layout.zeros(measurement.SIZE),
        told=layout.zeros(INNOVATION),
        noise=layout.zeros(3),
        residuals=np.zeros((blocks, 8)),
    )


def further_work(state: State, plan: Plan) -> Further | None:
    """Return what a run needs besides."""
    size, count = len(state.joint), len(plan.spans)
    if size == 0 and plan.settings[STRIDE] == covariance.STRIDE:
        return None
    return Further(np.zeros((3, 3, size)), np.zeros((count, 3, size)), np.zeros(size))
