"""How far a receiver of positions is believed: its noise from fix to fix, and steps that it makes.

From one fix to the next the IMUs know the way far better than the receiver. So the change of the innovation,
d = z before an update - z after the one before, is the receiver's own: its variance is twice that of a fix. Where it
is more than the receiver states, the noise that was found is used. A fix that neither the stated noise nor an error of
the prediction explains begins a series; while the innovation stays what it was the fixes of the series agree with each
other and not with the past, and weigh next to nothing. If the series lasts, the receiver is right: the position, and
nothing else, is set to it.
"""

from __future__ import annotations

from polyins.aiding.measurement import VARIANCE
from polyins.kernels.jit import Array, scalar_kernel
from polyins.navigate.state import RECEIVER, TIME

RING = 11
"""changes of which the median is taken"""
LEAST_KNOWN = 5
MEDIAN_OF_SQUARES = 0.4549 * 2.0
"""median of d^2 over the variance of a fix, for normal noise"""
TOO_SURE = 16.0
"""times the stated variance, from which the one that was found is used"""
LONGEST = 5.0
"""s between two fixes from which noise is told"""
SAME = 0.5
"""part of the innovation that began a series by which a later one may differ and be of it"""
SMALL, SMALL_LASTS, LASTS = 20.0, 10.0, 15.5
"""A series of offsets up to that many metres is believed after so many s, one of larger ones after so many."""

CHANGES, COUNT, AFTER, SPREAD, KNOWN, LAST, SERIES, SINCE, OFFSET, DOUBTS = 0, 33, 34, 37, 40, 41, 42, 43, 44, 47
"""places in the receiver's part of the scalars: squares of changes, how many were noted; the innovation, and its
variance by the prediction, after the last update; whether there was one, and when; whether a series lasts, since when,
and what began it; how many fixes have to be good until one that is wrong is an exception again"""

MOST_DOUBTS = 10.0
WARY_LIMIT = 25.0
"""of the normalized innovation squared, five sigma, while there are doubts"""

D, NOISE = 7, 10
"""places in a row of `Outputs.innovations`: the change from fix to fix, and the ratio of the noise that is used"""


@scalar_kernel
def use_noise(scalars: Array, measurement: Array, innovation: Array) -> bool:
    """Note the change since the last fix; raise the variances of a measurement to what is found of them."""
    now, found = scalars[TIME], False
    near = scalars[RECEIVER + KNOWN] != 0.0 and now - scalars[RECEIVER + LAST] <= LONGEST
    row = int(scalars[RECEIVER + COUNT]) % RING
    scalars[RECEIVER + COUNT] += near
    innovation[NOISE] = 1.0
    count = int(min(scalars[RECEIVER + COUNT], float(RING)))
    for a in range(3):
        variance = measurement[VARIANCE + a]
        if near and variance > 0.0:
            change = innovation[a] - scalars[RECEIVER + AFTER + a]
            growth = max(0.0, innovation[3 + a] - variance - scalars[RECEIVER + SPREAD + a])
            scalars[RECEIVER + CHANGES + 3 * row + a] = max(0.0, change * change - growth)
            innovation[D + a] = change
    if count < LEAST_KNOWN:
        return False
    level = 0.5 * (_median(scalars, 0, count) + _median(scalars, 1, count)) / MEDIAN_OF_SQUARES
    for a in range(3):
        variance = measurement[VARIANCE + a]
        own = level if a < 2 else _median(scalars, 2, count) / MEDIAN_OF_SQUARES
        if variance > 0.0 and own > TOO_SURE * variance:
            innovation[NOISE] = max(innovation[NOISE], own / variance)
            measurement[VARIANCE + a] = own
            found = True
    return found


@scalar_kernel
def _median(scalars: Array, a: int, count: int) -> float:
    """Return the median of the squares of an axis: the value that half of the others are not above."""
    for i in range(count):
        value, below, equal = scalars[RECEIVER + CHANGES + 3 * i + a], 0, 0
        for j in range(count):
            other = scalars[RECEIVER + CHANGES + 3 * j + a]
            below += other < value
            equal += other == value
        if below <= count // 2 < below + equal:
            return float(value)
    return 0.0


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
