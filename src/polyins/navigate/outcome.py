"""What became of measurements, a row of each: batch has them at its end, live keeps them as its window moves on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from polyins.aiding import kinds
from polyins.model.comparisons import NOBODY, Comparisons
from polyins.model.rig import Rig
from polyins.model.solution import Innovations
from polyins.navigate import deviations, receiver, slip, update
from polyins.navigate.choice import Choice
from polyins.navigate.state import INNOVATION, Inputs, Outputs

Array = NDArray[np.float64]

TIME, KIND, VARIANCE, STATUS, EPOCH, VELOCITY_BEFORE, VELOCITY, INNOVATIONS = 0, 1, 2, 5, 6, 7, 10, 13
WIDTH = INNOVATIONS + INNOVATION
"""numbers of a row: when, what, its variances, what was made of it; the epoch at which it was taken or the next one,
the velocity at the epoch before that and there; and what the engine writes of it"""

FIX = (kinds.GNSS_POSITION, kinds.GNSS_VELOCITY)
AIDING = (kinds.GNSS_POSITION, kinds.WHEEL_SPEED, kinds.ODOMETER)
"""kinds without which a run coasts"""
_AIDS = np.isin(np.arange(len(kinds.KINDS)), AIDING)


def rows_of(inputs: Inputs, outputs: Outputs, shown: slice, last: int) -> Array:
    """Return a row of each of some events that says something, (M, WIDTH); the run has taken epochs up to `last`."""
    kind, status = inputs.event_kind[shown], outputs.event_status[shown]
    kept = (status != update.UNUSED) | np.isin(kind, FIX)
    time = inputs.event_time[shown][kept]
    at = np.clip(np.searchsorted(inputs.time[: last + 1], time), 1, last)
    velocity = outputs.states[:, 3:6]
    columns = [time, kind[kept], inputs.event_variance[shown][kept], status[kept], inputs.time[at]]
    return np.column_stack([*columns, velocity[at - 1], velocity[at], outputs.innovations[shown][kept]])


def aided_at(kind: NDArray[np.int8], status: NDArray[np.int8], time: Array) -> Array:
    """Return when a position or a speed was accepted, s, of the kinds, what was made of them, and times of events."""
    return np.asarray(time[_AIDS[kind] & ((status == update.ACCEPTED) | (status == update.RESET))])


def speed_wheels(choice: Choice, rig: Rig) -> tuple[str, ...]:
    """Return the names of the IMUs on the wheels that give the speed."""
    return tuple(rig.imus[module[0]].name for module in choice.speed)


def innovations_of(rows: Array, wheels: tuple[str, ...]) -> dict[str, Innovations]:
    """Return what became of the measurements, by kind; of GNSS positions in any case. `wheels`: that give a speed."""
    every, taken = rows[:, KIND], rows[:, STATUS]
    lost = rows[(every == kinds.GNSS_VELOCITY) & (taken != update.ACCEPTED), TIME]
    found = {}
    for number, kind in enumerate(kinds.KINDS):
        of_fix = number == kinds.GNSS_POSITION
        shown = rows[(every == number) & (of_fix | (taken != update.UNUSED))]
        if not of_fix and (not len(shown) or not kind.axes):
            continue
        time, status, told, axes = shown[:, TIME], shown[:, STATUS], shown[:, INNOVATIONS:], len(kind.axes)
        found[kind.name] = Innovations(
            time=time,
            residual=told[:, :axes],
            std=np.sqrt(told[:, 3 : 3 + axes]),
            nis=told[:, 6],
            accepted=np.isin(status, (update.ACCEPTED, update.RESET)),
            reset=status == update.RESET,
            velocity_rejected=np.isin(time, lost) if of_fix else np.zeros(len(shown), dtype=bool),
            change=told[:, receiver.D : receiver.D + axes] if of_fix else None,
            noise_ratio=told[:, receiver.NOISE] if of_fix else None,
            gained=_gained(shown) if of_fix else None,
            slip=told[:, slip.FOUND : slip.FOUND + 3] if number == kinds.WHEEL_SPEED else None,
            wheels=wheels,
            rows=(shown[:, VARIANCE : VARIANCE + 3] > 0.0).sum(axis=1),
            axes=kind.axes,
            unit=kind.unit,
        )
    return found


def comparisons_of(rows: Array, lanes: Sequence[int]) -> Comparisons:
    """Return how the IMUs of blocks kept together; `lanes`: of the navigators."""
    shown = rows[(rows[:, KIND] == kinds.DEVIATIONS) & (rows[:, STATUS] != update.UNUSED)]
    told = shown[:, INNOVATIONS:]
    place = {-1: NOBODY, **{lane: number for number, lane in enumerate(lanes)}}

    def who(column: int) -> NDArray[np.int64]:
        return np.array([place[int(lane)] for lane in told[:, column]], dtype=np.int64)

    return Comparisons(
        time=shown[:, TIME],
        left_out=who(deviations.WHO),
        taken_back=who(deviations.BACK),
        statistic=told[:, deviations.STATISTIC],
        by_gyro=told[:, deviations.GROUP] == deviations.ATTITUDE,
        own_noise=told[:, deviations.SCALE],
        mean_square=told[:, deviations.SQUARE],
    )


def _gained(rows: Array) -> Array:
    """Return what the velocity gained from fix to fix, up to the epoch before each: none of it is from the fixes."""
    velocity, gained = rows[:, VELOCITY : VELOCITY + 3], np.zeros((len(rows), 3))
    before = rows[:, VELOCITY_BEFORE : VELOCITY_BEFORE + 3]
    apart = rows[1:, EPOCH, None] > rows[:-1, EPOCH, None]
    gained[1:] = np.where(apart, before[1:], velocity[:-1]) - velocity[:-1]
    return gained
