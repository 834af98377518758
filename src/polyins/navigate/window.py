"""The window over which the mean speed of wheels, or the mean rate of an IMU at rest, is taken."""

from __future__ import annotations

import math

from polyins.aiding import wheel_speed
from polyins.kernels import bank, covariance, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import scalar_kernel
from polyins.model.states import place
from polyins.navigate.state import (
    RADIUS,
    STILL_RATE,
    STRIDE,
    WINDOW_BEGIN,
    WINDOW_FILLED,
    WINDOW_LATERAL,
    WINDOW_TRAVEL,
    Inputs,
    Plan,
    State,
)

STILL_SPEED = 0.01
"""m/s"""
SURE_SPEED = 0.25
"""m/s: where the filter is less sure of its velocity it cannot tell rest from a smooth drive"""
SLOW_SPEED = 0.1
"""m/s, and twice its standard deviation: faster than this is no rest"""

VELOCITY = place("velocity")


@scalar_kernel
def open_at(state: State, plan: Plan, now: float, lateral: float) -> None:
    """Begin to take a mean, of the speed of a point `lateral` m to the right of the axle's middle."""
    state.scalars[WINDOW_FILLED] = state.scalars[WINDOW_TRAVEL] = 0.0
    state.scalars[WINDOW_BEGIN], state.scalars[WINDOW_LATERAL] = now, lateral
    for s in range(plan.spans.shape[0]):
        lent = vehicle.lent_matrix(state.blocks, plan.lenders[s])
        for i in range(plan.spans[s, 0], plan.spans[s, 1] if state.silent[0, s] < 0.0 else 0):
            wheel_speed.open_window(state.rows[i // LANES], i % LANES, lent, lateral)


@scalar_kernel
def begin_anew(state: State, plan: Plan, now: float) -> None:
    """Forget what an open window holds: it does not fit the states any more."""
    if state.scalars[WINDOW_FILLED] >= 0.0:
        open_at(state, plan, now, state.scalars[WINDOW_LATERAL])


@scalar_kernel
def fill(state: State, plan: Plan, inputs: Inputs, k: int, fraction: float, dt: float) -> None:
    """Add to an open window what was travelled in the last `dt` seconds, this fraction of epoch k."""
    scalars = state.scalars
    scalars[WINDOW_FILLED] += fraction
    if inputs.travel.shape[0] > 0:
        scalars[WINDOW_TRAVEL] += fraction * inputs.travel[k, 0]
    for s in range(plan.spans.shape[0]):
        lent = vehicle.lent_matrix(state.blocks, plan.lenders[s])
        for i in range(plan.spans[s, 0], plan.spans[s, 1] if state.silent[0, s] < 0.0 else 0):
            wheel_speed.fill_window(state.rows[i // LANES], i % LANES, lent, scalars[WINDOW_LATERAL], dt)


@scalar_kernel
def _hardly_moves(state: State, plan: Plan) -> bool:
    last, block = state.blocks[-1], state.blocks[0]
    stride = int(plan.settings[STRIDE])
    speed = variance = 0.0
    for k in range(3):
        speed += last[covariance.VELOCITY + k] ** 2
        variance = max(variance, covariance.variance(block, VELOCITY + k, stride))
    std = math.sqrt(variance)
    hardly: bool = std < SURE_SPEED and math.sqrt(speed) < SLOW_SPEED + 2.0 * std
    return hardly


@scalar_kernel
def holds_rest(state: State, plan: Plan, duration: float) -> bool:
    """Whether no wheel has rolled and no IMU that measures has turned during the window.

    Without wheels the filter itself has to know that it hardly moves: what the IMUs feel in a smooth drive is the same.
    """
    if not abs(state.scalars[WINDOW_TRAVEL]) < STILL_SPEED * duration:
        return False
    if plan.settings[RADIUS] == 0.0 and not _hardly_moves(state, plan):
        return False
    limit = plan.settings[STILL_RATE] * duration
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] < 0.0:
            lanes, t = state.rows[plan.spans[s, 0] // LANES], bank.TURNED + plan.spans[s, 0] % LANES
            if lanes[t] ** 2 + lanes[t + LANES] ** 2 + lanes[t + 2 * LANES] ** 2 > limit * limit:
                return False
    return True
