"""Slip: whether wheels roll as fast as each other, the rate of turn and the IMUs have it.

Judged are the two parts of the time since the last speed: before its window opened, and within it. In each, wheel i has
a mean speed v_i, which the mean rate of turn w takes from its place y_i to the middle of the axle,

    u_i = (1 + speed scale) v_i + w y_i,

and the IMUs have gone ahead with the mean speed p, tau s after the last speed:

    e_i = u_i - p - a t,

where a is the acceleration by which they were off lately, and t = tau and the time in which none was believed. Wheels
disagree if the u_i spread by `SURE` times what is expected of wheels that roll. They are off together if the mean of
e_i is by `SURE` times what is usual, and by |a| t, and no block of IMUs is off the others by half of that. From then on
they are until it is less than half of what it was, or no more than the IMUs may be off by then. A slip that lasts as
long as it is from one speed to the next covers one of the two parts whole.
"""

from __future__ import annotations

import math

from polyins.aiding.wheel_speed import SPEED
from polyins.kernels import bank, covariance, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place
from polyins.navigate import update
from polyins.navigate.state import (
    FORWARD,
    GATE_LIMIT,
    SLIP,
    SLIP_BELIEVED,
    SLIP_COUNT,
    SLIP_LEAP,
    SLIP_SINCE,
    SLIP_TRUSTED,
    SLIP_USUAL,
    STRIDE,
    TIME,
    WINDOW_FILLED,
    Inputs,
    Plan,
    State,
)

SECONDS, TURNED, AHEAD, ROLLED = range(4)
"""places in a row of `State.rolled`: how long, s; rad to the right; m ahead as the IMUs have it; from here on m of each
wheel, NaN where it does not measure, and then m ahead as each block has it, NaN where it does not count"""
BEFORE, WITHIN = 0, 1
"""its rows: before the window of the speed, and within it"""

LEFT_OUT, OFF, EXPECTED, MEAN_OFF, OFFSET, PER_SECOND, DRIFT = range(7)
"""places in `state.SLIP`: which wheels are left out, a bit for each; by how much the speed of the worst of them is off,
and the speed of the IMUs, m/s; mean e of the latest part, m/s, and over the std of the speed, NaN if it is not judged;
that e over tau, and a, m/s^2"""
UNEXPLAINED, USED_AGAIN = 40, 41
"""bits: wheels disagree, and none is nearer to the IMUs; none was believed for so long that all are again"""
FOUND = 7
"""place of the first three in a row of `Outputs.innovations`"""

SURE, STAYS = 6.0, 2.0
"""times what is usual, by which wheels are off together, and stay so once they were"""
ROUGH, ROUGH_SHARE = 0.005, 0.0025
"""m/s, and of the speed: by how much wheels that roll are expected to differ; those of a car on a road do by half of
it, rms, and by four times that at most"""
LEAST = 0.0225
"""of the variance of the speed: by a smaller square the IMUs are always taken to be off"""
SOON, MEMORY = 4.0, 60.0
"""speeds that the first guess of what is usual counts for, and over which it is found"""
OUTLIER = 9.0
"""times what is usual: a larger square counts as that for what is"""
LATELY = 0.3
"""share of the latest speed in the acceleration by which the IMUs are off"""
NEARER, ODDS = 3.0, 7.0
"""times that a wheel which is believed is nearer to what the IMUs have than one that is not, and the logarithm of how
much likelier it is"""
MOVING, SHORTEST = 0.3, 0.05
"""m/s, s: slower wheels, and shorter parts, are not judged"""
LONGEST, QUIET = 6.0, 8.0
"""s without a wheel that is believed, after which it is as likely the IMUs that are wrong; and s for which all are
believed after that if they are off, and within which a slip that was believed may end: then the IMUs are off"""
HALF, BACK = 0.5, 2.0
"""times that by which wheels were off when they began to be withheld: off by less they roll again; and when they were
believed: off by less the other way they have come back"""
OF_ONE = 0.5
"""of what wheels are off: farther from the mean of all blocks, one of them may be what is wrong"""

_VELOCITY, _SPEED_SCALE = place("velocity"), place("speed_scale")


@scalar_kernel
def note_way(state: State, plan: Plan, inputs: Inputs, k: int, fraction: float, dt: float) -> None:
    """Add what wheels rolled and IMUs went in the last `dt` seconds, this fraction of epoch k."""
    scalars, merged, p = state.scalars, state.blocks[-1], covariance.VELOCITY
    v = vehicle.matrix_at(merged, covariance.VEHICLE)
    forward = v[0] * merged[p] + v[3] * merged[p + 1] + v[6] * merged[p + 2]
    part = state.rolled[WITHIN if scalars[WINDOW_FILLED] >= 0.0 else BEFORE]
    part[SECONDS] += dt
    part[TURNED] += dt * _rate_of_turn(state, plan)
    part[AHEAD] += 0.5 * dt * (forward + scalars[FORWARD])
    scalars[FORWARD] = forward
    for i in range(plan.wheels.shape[0]):
        part[ROLLED + i] += fraction * inputs.travel[k, 2 + i]
    first = ROLLED + plan.wheels.shape[0]
    for s in range(plan.spans.shape[0]):
        block = state.blocks[s]
        part[first + s] += dt * block[covariance.FORWARD] if block[covariance.COUNTS] != 0.0 else math.nan


@scalar_kernel
def _rate_of_turn(state: State, plan: Plan) -> float:
    """Return the mean rate about the vertical of the IMUs on the body, or without them of those on wheels, rad/s.

    Of these the spin is left out: the axle is level but for what the vehicle rolls.
    """
    for on_wheels in (False, True):
        total, count = 0.0, 0
        for s in range(plan.spans.shape[0]):
            first = plan.spans[s, 0]
            spins = state.rows[first // LANES, bank.RADIUS + first % LANES] != 0.0
            if spins == on_wheels and state.silent[0, s] < 0.0:
                block, c, r = state.blocks[s], covariance.MATRIX + 6, covariance.RATE
                total += block[c + 1] * block[r + 1] + block[c + 2] * block[r + 2]
                total += 0.0 if spins else block[c] * block[r]
                count += 1
        if count > 0:
            return total / count
    return 0.0


@scalar_kernel
def _variance(state: State, plan: Plan, speed: float) -> float:
    """Return the variance of a wheel's speed as the blocks predict it, their mean, (m/s)^2."""
    total, count, stride = 0.0, 0, int(plan.settings[STRIDE])
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] < 0.0:
            block = state.blocks[s]
            north = covariance.variance(block, _VELOCITY, stride)
            east = covariance.variance(block, _VELOCITY + 1, stride)
            scale = covariance.variance(block, _SPEED_SCALE, stride)
            total += 0.5 * (north + east) + scale * speed * speed + plan.speed_variance[s, 0]
            count += 1
    return total / count if count > 0 else math.inf


@scalar_kernel
def _judge(state: State, plan: Plan, part: Array, since: float, alone: float) -> None:
    """Add what is found in one part, whose middle is `since` s after the last speed; none was believed for `alone` s.

    Of wheels that disagree those are believed that roll as the one that is nearest to the IMUs. None is if the IMUs
    cannot tell it from the one that is farthest, or went as both of them in the mean: it may be the rate of turn that
    is wrong, or the radii. Then the mean of all is the best that there is.
    """
    scalars, count, first = state.scalars, 0, plan.spans[0, 0]
    scalars[SLIP + OFFSET] = math.nan
    if part[SECONDS] < SHORTEST:
        return
    scale = (1.0 + state.rows[first // LANES, bank.SPEED_SCALE + first % LANES]) / part[SECONDS]
    turning = part[TURNED] / part[SECONDS]
    p = part[AHEAD] / part[SECONDS] + scalars[SLIP + DRIFT] * (alone + since)
    low, high, near, far, nearest, fast = math.inf, -math.inf, math.inf, 0.0, 0.0, abs(p)
    off = 0.0
    for i in range(plan.wheels.shape[0]):
        if math.isfinite(part[ROLLED + i]):
            u = scale * part[ROLLED + i] + turning * plan.wheels[i]
            low, high, fast = min(low, u), max(high, u), max(fast, abs(u))
            far = max(far, abs(u - p))
            if abs(u - p) < near:
                near, nearest = abs(u - p), u
            off, count = off + u - p, count + 1
    if count == 0 or fast < MOVING:
        return
    spread, off, rough = high - low, off / count, ROUGH + ROUGH_SHARE * fast
    std = math.sqrt(_variance(state, plan, fast) + rough * rough)
    scalars[SLIP + MEAN_OFF], scalars[SLIP + OFFSET], scalars[SLIP + PER_SECOND] = off, off / std, off / since
    usual = std * math.sqrt(max(LEAST, scalars[SLIP_USUAL]))
    limit = SURE * usual if scalars[SLIP_SINCE] == math.inf else max(STAYS * usual, HALF * abs(scalars[SLIP_LEAP]))
    limit = max(limit, abs(scalars[SLIP + DRIFT]) * (alone + since))
    if abs(off) > limit and _come_back(scalars, off):
        scalars[SLIP_TRUSTED] = max(scalars[SLIP_TRUSTED], scalars[TIME])
    if abs(off) > limit and _farthest(plan, part) > OF_ONE * abs(off):
        limit = math.inf
    differ = SURE * rough
    if spread <= differ and abs(off) <= limit:
        return
    if near > limit or spread <= differ:
        differ = -1.0
    elif far < NEARER * near or far * far - near * near < 2.0 * ODDS * usual * usual:
        _add(scalars, UNEXPLAINED, spread, p)
        return
    for i in range(plan.wheels.shape[0]):
        if math.isfinite(part[ROLLED + i]):
            u = scale * part[ROLLED + i] + turning * plan.wheels[i]
            if abs(u - nearest) > differ:
                _add(scalars, i, u - p, p)


@scalar_kernel
def _come_back(scalars: Array, off: float) -> bool:
    """Whether wheels are off since a slip ends that was believed, and the IMUs have its speed."""
    believed, lately = scalars[SLIP_BELIEVED], scalars[TIME] - scalars[SLIP_BELIEVED + 1] <= QUIET
    back: bool = lately and believed * off < 0.0 and abs(off) < BACK * abs(believed)
    return back


@scalar_kernel
def _farthest(plan: Plan, part: Array) -> float:
    """Return by how much the mean speed of a block is off that of all at most, m/s."""
    first, total, count, farthest = ROLLED + plan.wheels.shape[0], 0.0, 0, 0.0
    for s in range(plan.spans.shape[0]):
        if math.isfinite(part[first + s]):
            total, count = total + part[first + s], count + 1
    for s in range(plan.spans.shape[0]):
        if math.isfinite(part[first + s]):
            farthest = max(farthest, abs(part[first + s] - total / count))
    mean: float = farthest / part[SECONDS]
    return mean


@scalar_kernel
def _add(scalars: Array, bit: int, off: float, expected: float) -> None:
    scalars[SLIP + LEFT_OUT] = int(scalars[SLIP + LEFT_OUT]) | (1 << bit)
    if abs(off) > abs(scalars[SLIP + OFF]):
        scalars[SLIP + OFF], scalars[SLIP + EXPECTED] = off, expected


@scalar_kernel
def some_roll(state: State, plan: Plan) -> bool:
    """Judge the wheels; return whether any of them is believed, or has to be."""
    scalars, part, any_slips = state.scalars, state.rolled[WITHIN], False
    scalars[SLIP + LEFT_OUT] = scalars[SLIP + OFF] = scalars[SLIP + EXPECTED] = 0.0
    if plan.settings[GATE_LIMIT] == math.inf:
        return True
    before, within = state.rolled[BEFORE, SECONDS], part[SECONDS]
    alone = max(0.0, scalars[TIME] - before - within - scalars[SLIP_SINCE])
    _judge(state, plan, state.rolled[BEFORE], 0.5 * before, alone)
    _judge(state, plan, part, before + 0.5 * within, alone)
    if scalars[TIME] - scalars[SLIP_SINCE] > LONGEST:
        scalars[SLIP_TRUSTED] = scalars[TIME]
    if scalars[TIME] <= scalars[SLIP_TRUSTED]:
        return True
    for i in range(plan.wheels.shape[0]):
        slips = int(scalars[SLIP + LEFT_OUT]) >> i & 1 != 0
        if math.isfinite(part[ROLLED + i]) and not slips:
            return True
        any_slips = any_slips or slips
    return not any_slips


@scalar_kernel
def leave_out(state: State, plan: Plan, measurement: Array) -> None:
    """Make the mean speed that of the wheels that are believed, still as the point between all of them has it."""
    left_out, part = int(state.scalars[SLIP + LEFT_OUT]), state.rolled[WITHIN]
    if left_out & ((1 << plan.wheels.shape[0]) - 1) == 0 or state.scalars[TIME] <= state.scalars[SLIP_TRUSTED]:
        return
    every, some, count, kept = 0.0, 0.0, 0, 0
    for i in range(plan.wheels.shape[0]):
        if math.isfinite(part[ROLLED + i]):
            v = (part[ROLLED + i] + part[TURNED] * plan.wheels[i]) / part[SECONDS]
            every, count = every + v, count + 1
            if left_out >> i & 1 == 0:
                some, kept = some + v, kept + 1
    if kept > 0:
        measurement[SPEED] += some / kept - every / count


@scalar_kernel
def conclude(state: State, plan: Plan, status: int, innovation: Array) -> None:
    """Write what was found of a speed that became this, learn what is usual, and begin anew."""
    scalars, every = state.scalars, (1 << plan.wheels.shape[0]) - 1
    if status == update.UNUSED:
        scalars[SLIP + LEFT_OUT] = scalars[SLIP + OFF] = scalars[SLIP + EXPECTED] = 0.0
        scalars[SLIP + OFFSET] = math.nan
    left_out = int(scalars[SLIP + LEFT_OUT])
    if status in (update.SLIPPED, update.REJECTED):
        if scalars[SLIP_SINCE] == math.inf:
            scalars[SLIP_LEAP] = scalars[SLIP + MEAN_OFF]
        began = scalars[TIME] - state.rolled[BEFORE, SECONDS] - state.rolled[WITHIN, SECONDS]
        scalars[SLIP_SINCE] = min(scalars[SLIP_SINCE], began)
    elif status != update.UNUSED:
        off = scalars[SLIP_LEAP] if scalars[SLIP_SINCE] < math.inf else scalars[SLIP + MEAN_OFF]
        scalars[SLIP_SINCE] = math.inf
        if scalars[TIME] <= scalars[SLIP_TRUSTED] and left_out & every != 0:
            left_out |= 1 << USED_AGAIN
            scalars[SLIP_TRUSTED] = scalars[TIME] + QUIET
            if _come_back(scalars, off):
                scalars[SLIP_BELIEVED] = off = 0.0
        lately = scalars[TIME] - scalars[SLIP_BELIEVED + 1] <= QUIET
        if not lately or abs(off) > abs(scalars[SLIP_BELIEVED]):
            scalars[SLIP_BELIEVED], scalars[SLIP_BELIEVED + 1] = off, scalars[TIME]
    if math.isfinite(scalars[SLIP + OFFSET]) and (left_out == 0 or left_out >> USED_AGAIN != 0):
        _learn(scalars)
    innovation[FOUND] = left_out
    innovation[FOUND + 1], innovation[FOUND + 2] = scalars[SLIP + OFF], scalars[SLIP + EXPECTED]
    scalars[SLIP + LEFT_OUT] = scalars[SLIP + OFF] = scalars[SLIP + EXPECTED] = scalars[SLIP + MEAN_OFF] = 0.0
    scalars[SLIP + OFFSET] = math.nan
    for row in range(2):
        for n in range(state.rolled.shape[1]):
            state.rolled[row, n] = 0.0


@scalar_kernel
def _learn(scalars: Array) -> None:
    """Take what was found within the latest window to be usual, as far as it is no outlier."""
    scalars[SLIP_COUNT] = min(scalars[SLIP_COUNT] + 1.0, MEMORY)
    usual, square = scalars[SLIP_USUAL], scalars[SLIP + OFFSET] ** 2
    most = OUTLIER * max(LEAST, usual)
    scalars[SLIP + DRIFT] += LATELY * scalars[SLIP + PER_SECOND] * min(1.0, math.sqrt(most / max(square, most)))
    scalars[SLIP_USUAL] += (min(square, most) - usual) / scalars[SLIP_COUNT]
