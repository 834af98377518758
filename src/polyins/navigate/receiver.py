"""How far a receiver of positions is believed: its noise from fix to fix, and steps that it makes.

From one fix to the next the IMUs know the way far better than the receiver, but for an error that goes on. The change
of the innovation, d = z before an update - z after the one before, is their steady error and the receiver's noise; the
difference of two changes is the noise alone, of three fixes, and its variance six times that of one. Where it is more
than the receiver states, the noise that was found is used. A fix that neither the stated noise nor an error of
the prediction explains begins a series; while the innovation stays what it was the fixes of the series agree with each
other and not with the past, and weigh next to nothing. If the series lasts, the receiver is right: the position, and
nothing else, is set to it. Where fixes go on to disagree by many sigma, or reset follows reset, it is not the position
that is wrong: the state is given up, and the run begins anew, see `restart`.

What the prediction states is measured by the fixes before: where those that were believed disagreed with it by many
times what was stated, as they do if they are late or the heading is wrong, a fix that disagrees as much is no news, and
to withhold it would leave a prediction that is known to be wrong to itself.
"""

from __future__ import annotations

import math

import numpy as np

from polyins.aiding.measurement import VARIANCE
from polyins.kernels.jit import Array, scalar_kernel
from polyins.navigate.state import RECEIVER, TIME

RING = 11
"""changes of which the median is taken"""
LEAST_KNOWN = 5
"""of them: a jump is in two"""
MEDIAN_OF_SQUARES = 0.4549 * 6.0
"""median of the squared difference of two changes over the variance of a fix, for normal noise"""
MEDIAN_OF_NIS = 2.366
"""of three components, for innovations that are what is stated"""
WRONG = 9.0
"""times that median, from which it is the prediction that disagrees: innovations are three times as large as stated"""
LOST = 138.6
"""horizontal NIS from which a reset has not helped a fix: a hundred times the median of two components"""
HELPED = 33.0
"""fixes after a reset of which most did not disagree so: at first its own variances cover much"""
MOST_RESETS = 3
"""in a row: what they leave as it is, velocity, attitude and biases, is wrong"""
TOO_SURE = 16.0
"""times the stated variance, from which the one that was found is used"""
LEAST_VARIANCE = 0.005**2
"""m^2: no receiver on a vehicle is better; one that states less is believed when its noise has shown it"""
LONGEST = 5.0
"""s between two fixes from which noise is told"""
SAME = 0.5
"""part of the innovation that began a series by which a later one may differ and be of it"""
SMALL, SMALL_LASTS, LASTS = 20.0, 10.0, 14.95
"""A series of offsets up to that many metres is believed after so many s, one of larger ones after so many."""

CHANGES, COUNT, AFTER, SPREAD, KNOWN, LAST = 0, 33, 34, 37, 40, 41
SERIES, SINCE, OFFSET, DOUBTS, BEFORE, CHANGED, FIRST, SPEED_VARIANCE = 42, 43, 44, 47, 48, 51, 52, 53
BELIEVED, DISAGREED = 54, 55
RESETS, SINCE_RESET, IS_HOPELESS, HOPELESS_AT, LOST_SINCE = 66, 67, 68, 69, 70
"""places in the receiver's part of the scalars: differences of changes, how many were noted; the innovation, and its
variance by the prediction, after the last update; whether there was one, and when; whether a series lasts, since when,
and what began it; how many fixes have to be good until one that is wrong is an exception again; the last change, and
whether there was one; when the first of the latest doubts was; the variance that a reset gives the velocity, or 0; how
many fixes were believed, and by how many sigma each of the last ones disagreed with the prediction; resets of which
none has helped yet, and fixes that were believed since the last one; whether the state is given up, and when; how many
of those fixes disagree"""

LOCKED_OUT = 30.0
"""s of doubts without a fix that is believed, after which it is the prediction that is wrong"""
MOST_DOUBTS = 10.0
WARY_LIMIT = 25.0
"""of the normalized innovation squared, five sigma, while there are doubts"""

D, NOISE = 7, 10
"""places in a row of `Outputs.innovations`: the change from fix to fix, and the ratio of the noise that is used"""


def expect(scalars: Array, std: Array) -> None:
    """Begin with what is known of the noise of fixes, m (3,), as if five changes had shown it."""
    shown = np.sqrt(MEDIAN_OF_SQUARES) * np.array([np.hypot(std[0], std[1]) / np.sqrt(2.0)] * 2 + [std[2]])
    place = RECEIVER + CHANGES
    scalars[place : place + 3 * LEAST_KNOWN] = np.tile(shown, LEAST_KNOWN)
    scalars[RECEIVER + COUNT] = LEAST_KNOWN


@scalar_kernel
def use_noise(scalars: Array, measurement: Array, innovation: Array) -> bool:
    """Note the change since the last fix; raise the variances of a measurement to what is found of them."""
    now, found = scalars[TIME], False
    near = scalars[RECEIVER + KNOWN] != 0.0 and now - scalars[RECEIVER + LAST] <= LONGEST
    both = near and scalars[RECEIVER + CHANGED] != 0.0
    row = int(scalars[RECEIVER + COUNT]) % RING
    for a in range(3):
        change = innovation[a] - scalars[RECEIVER + AFTER + a] if near else 0.0
        scalars[RECEIVER + CHANGES + 3 * row + a] = change - scalars[RECEIVER + BEFORE + a]
        scalars[RECEIVER + BEFORE + a] = innovation[D + a] = change
    scalars[RECEIVER + CHANGED] = near
    scalars[RECEIVER + COUNT] += both
    innovation[NOISE] = 1.0
    count = int(min(scalars[RECEIVER + COUNT], float(RING)))
    if count < LEAST_KNOWN:
        return _limit(measurement)
    level = 0.5 * (_median(scalars, CHANGES, 3, count) + _median(scalars, CHANGES + 1, 3, count)) / MEDIAN_OF_SQUARES
    for a in range(3):
        variance = measurement[VARIANCE + a]
        own = level if a < 2 else _median(scalars, CHANGES + 2, 3, count) / MEDIAN_OF_SQUARES
        if variance > 0.0 and own > max(TOO_SURE * variance, LEAST_VARIANCE):
            innovation[NOISE] = max(innovation[NOISE], own / variance)
            measurement[VARIANCE + a] = own
            found = True
    return found


@scalar_kernel
def _limit(measurement: Array) -> bool:
    """Raise variances that are below the least one; return whether there are any."""
    raised = False
    for a in range(3):
        if 0.0 < measurement[VARIANCE + a] < LEAST_VARIANCE:
            measurement[VARIANCE + a] = LEAST_VARIANCE
            raised = True
    return raised


@scalar_kernel
def _median(scalars: Array, first: int, apart: int, count: int) -> float:
    """Return the median of squares, of which one is every so many places: what half of the others are not above."""
    for i in range(count):
        value, below, equal = scalars[RECEIVER + first + apart * i] ** 2, 0, 0
        for j in range(count):
            other = scalars[RECEIVER + first + apart * j] ** 2
            below += other < value
            equal += other == value
        if below <= count // 2 < below + equal:
            return float(value)
    return 0.0


@scalar_kernel
def note_believed(scalars: Array, innovation: Array, nis: float) -> None:
    """Note by how much a fix that is believed disagrees with the prediction.

    To begin anew takes the heading, which only what is horizontal can tell to be wrong.
    """
    row = int(scalars[RECEIVER + BELIEVED]) % RING
    scalars[RECEIVER + DISAGREED + row] = math.sqrt(nis)
    scalars[RECEIVER + BELIEVED] += 1.0
    scalars[RECEIVER + SINCE_RESET] += 1.0
    horizontal = innovation[0] ** 2 / max(innovation[3], 1e-30) + innovation[1] ** 2 / max(innovation[4], 1e-30)
    scalars[RECEIVER + LOST_SINCE] += horizontal > LOST
    if scalars[RECEIVER + RESETS] == 0.0 or scalars[RECEIVER + SINCE_RESET] < RING:
        return
    if 2.0 * scalars[RECEIVER + LOST_SINCE] > scalars[RECEIVER + SINCE_RESET]:
        _give_up(scalars)
    elif scalars[RECEIVER + SINCE_RESET] >= HELPED:
        scalars[RECEIVER + RESETS] = 0.0


@scalar_kernel
def note_reset(scalars: Array, innovation: Array) -> None:
    """Note that the position was set to a fix."""
    scalars[RECEIVER + RESETS] += innovation[0] ** 2 + innovation[1] ** 2 > innovation[2] ** 2
    scalars[RECEIVER + SINCE_RESET] = scalars[RECEIVER + LOST_SINCE] = 0.0
    if scalars[RECEIVER + RESETS] >= MOST_RESETS:
        _give_up(scalars)


@scalar_kernel
def _give_up(scalars: Array) -> None:
    if scalars[RECEIVER + IS_HOPELESS] == 0.0:
        scalars[RECEIVER + IS_HOPELESS], scalars[RECEIVER + HOPELESS_AT] = 1.0, scalars[TIME]


@scalar_kernel
def disagreement(scalars: Array) -> float:
    """Return how many times larger than stated the squares of the innovations usually are; 1 if that is not many."""
    count = int(min(scalars[RECEIVER + BELIEVED], float(RING)))
    if count < LEAST_KNOWN:
        return 1.0
    usual = _median(scalars, DISAGREED, 1, count) / MEDIAN_OF_NIS
    return usual if usual > WRONG else 1.0


@scalar_kernel
def is_of_series(scalars: Array, innovation: Array) -> bool:
    """Whether a fix agrees with those of a series that lasts."""
    if scalars[RECEIVER + SERIES] == 0.0:
        return False
    size, apart = 0.0, 0.0
    for a in range(3):
        offset = scalars[RECEIVER + OFFSET + a]
        size += offset * offset
        apart += (innovation[a] - offset) ** 2
    return apart <= SAME * SAME * size


@scalar_kernel
def begin_series(scalars: Array, innovation: Array) -> None:
    """Note what a series begins with."""
    scalars[RECEIVER + SERIES], scalars[RECEIVER + SINCE] = 1.0, scalars[TIME]
    for a in range(3):
        scalars[RECEIVER + OFFSET + a] = innovation[a]


@scalar_kernel
def has_lasted(scalars: Array) -> bool:
    """Whether the receiver has kept to an offset for so long that it is right."""
    size = 0.0
    for a in range(3):
        size += scalars[RECEIVER + OFFSET + a] ** 2
    lasts = SMALL_LASTS if size <= SMALL * SMALL else LASTS
    return bool(scalars[TIME] - scalars[RECEIVER + SINCE] >= lasts)


@scalar_kernel
def is_locked_out(scalars: Array, innovation: Array) -> bool:
    """Whether no fix was believed for so long that the prediction is wrong, and its velocity by as much."""
    waited = scalars[TIME] - scalars[RECEIVER + FIRST]
    if waited < LOCKED_OUT:
        return False
    size = innovation[0] ** 2 + innovation[1] ** 2 + innovation[2] ** 2
    scalars[RECEIVER + SPEED_VARIANCE] = size / (waited * waited)
    return True


@scalar_kernel
def doubt(measurement: Array, innovation: Array, steady: bool) -> None:
    """Give a measurement the variance of its innovation, or if it is a steady offset each component that of its own."""
    size = innovation[0] ** 2 + innovation[1] ** 2 + innovation[2] ** 2
    for a in range(3):
        if measurement[VARIANCE + a] > 0.0:
            measurement[VARIANCE + a] = max(measurement[VARIANCE + a], innovation[a] ** 2 if steady else size)


@scalar_kernel
def note_update(scalars: Array, measurement: Array, innovation: Array, noise: Array) -> None:
    """Note what an update with the variances of the measurement leaves of the innovation.

    `noise`: the variances with which the innovation was recorded, (3,).
    """
    scalars[RECEIVER + KNOWN], scalars[RECEIVER + LAST] = 1.0, scalars[TIME]
    for a in range(3):
        variance, predicted = measurement[VARIANCE + a], max(0.0, innovation[3 + a] - noise[a])
        share = variance / max(predicted + variance, 1e-30)
        scalars[RECEIVER + AFTER + a] = innovation[a] * share
        scalars[RECEIVER + SPREAD + a] = predicted * share
