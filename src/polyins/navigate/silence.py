"""Blocks whose IMUs give no data: they neither measure nor are corrected, but are moved along with the vehicle.

The answer of all blocks together stands in the last one, see `vehicle.merge`.
"""

from __future__ import annotations

import math

from polyins.kernels import bank, covariance, earth, fuse, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.covariance import NAV, P
from polyins.kernels.jit import Array, scalar_kernel
from polyins.navigate import deviations, window
from polyins.navigate.state import COMPLETED, EARTH, MEASURED, STRIDE, TOGETHER, Inputs, Plan, State, Work
from polyins.navigate.state import SILENT as NOTHING

SILENT, RETURNED, PAUSED = 0, 1, 2
"""rows of `State.silent`: since when, and the noise of pauses of all"""

REALIGNMENT = 0.5
"""s, from when a wheel's data are back until it measures again: about a turn of the wheel"""

RESEED_POSITION, RESEED_VELOCITY, RESEED_TILT, RESEED_HEADING = 0.1, 0.2, 0.1, 0.02
"""Standard deviations of a block that measures again: m, m/s, rad, rad."""


@scalar_kernel
def weigh(state: State, plan: Plan, present: Array) -> None:
    """Let those members count in the means of their block that have data, and those blocks in the merged state.

    One that is left out for how it deviates counts only where no other has data.
    """
    for s in range(plan.spans.shape[0]):
        first, last = plan.spans[s, 0], plan.spans[s, 1]
        measured, completed, agreeing = 0, 0, 0
        for i in range(first, last):
            measured += present[i] == MEASURED
            completed += present[i] == COMPLETED
            agreeing += present[i] == MEASURED and state.rows[i // LANES, bank.EXCLUDED + i % LANES] == 0.0
        wanted = MEASURED if measured > 0 else COMPLETED if completed > 0 else NOTHING
        count = measured if measured > 0 else completed if completed > 0 else last - first
        if agreeing > 0:
            count = agreeing
        for i in range(first, last):
            lanes, lane = state.rows[i // LANES], i % LANES
            counts = present[i] == wanted and (agreeing == 0 or lanes[bank.EXCLUDED + lane] == 0.0)
            lanes[bank.WEIGHT + lane] = 1.0 / count if counts else 0.0
        if state.deviations.shape[0] > 0 and count != state.blocks[s, covariance.MEMBERS]:
            deviations.recount(state, plan, s, count)
        state.blocks[s, covariance.COUNTS] = 1.0 if measured > 0 and state.silent[SILENT, s] < 0.0 else 0.0


@scalar_kernel
def note_silence(state: State, plan: Plan, present: Array, now: float) -> None:
    """Note which blocks give no data in an epoch, which begins at `now`, before it is navigated."""
    for s in range(plan.spans.shape[0]):
        having = False
        for i in range(plan.spans[s, 0], plan.spans[s, 1]):
            having = having or present[i] != NOTHING
        if not having:
            state.silent[RETURNED, s] = -1.0
            if state.silent[SILENT, s] < 0.0:
                state.silent[SILENT, s] = now
                state.blocks[s, covariance.COUNTS] = 0.0
                window.begin_anew(state, plan, now)


@scalar_kernel
def move_silent(state: State, plan: Plan, work: Work, inputs: Inputs, k: int) -> None:
    """Move silent blocks along with the vehicle in epoch k, and let those measure again whose data are back.

    How far a wheel turned in the meantime is known roughly. So the angle of an IMU on a wheel is aligned first: the
    mean force over a while, gravity and the vehicle's acceleration, says what it really is.
    """
    now = inputs.time[k]
    dt = now - inputs.time[k - 1]
    travel = inputs.travel[k, 0] if inputs.travel.shape[0] > 0 else math.nan
    _coast(state, dt)
    merged = state.blocks[-1]
    for s in range(plan.spans.shape[0]):
        if state.silent[SILENT, s] < 0.0:
            continue
        first, last = plan.spans[s, 0], plan.spans[s, 1]
        lanes, lane = state.rows[first // LANES], first % LANES
        if inputs.present[k, first] == NOTHING:
            for i in range(first, last):
                _place_on_vehicle(state.rows[i // LANES], i % LANES, merged, travel, dt)
        else:
            if state.silent[RETURNED, s] < 0.0:
                state.silent[RETURNED, s] = now
            elapsed = now - state.silent[RETURNED, s]
            for i in range(first, last):
                _add_force(state.rows[i // LANES], i % LANES, merged, elapsed, dt)
            if elapsed >= REALIGNMENT or lanes[bank.RADIUS + lane] == 0.0:
                for i in range(first, last):
                    _align_angle(state.rows[i // LANES], i % LANES, merged, elapsed)
                _reseed(state, s, int(plan.settings[STRIDE]))
                state.silent[SILENT, s] = -1.0
                state.blocks[s, covariance.COUNTS] = 1.0
                fuse.fuse_states(state.rows, first, last, state.blocks[s], work.sums[s], dt)
                window.begin_anew(state, plan, now)
        fuse.fuse_states(state.rows, first, last, state.blocks[s], work.sums[s], dt)


@scalar_kernel
def add_noise(state: State, plan: Plan, variances: Array) -> None:
    """Add what a pause of all IMUs leaves unknown of position, velocity, tilt and heading, in common to all blocks.

    A block that is still silent remembers it until it measures again.
    """
    stride = int(plan.settings[STRIDE])
    for i in range(NAV if plan.settings[TOGETHER] != 0.0 else 0):
        state.blocks[-1, P + i * (stride + 1)] += variances[3] if i == NAV - 1 else variances[i // 3]
    for s in range(plan.spans.shape[0]):
        for i in range(NAV):
            noise = variances[3] if i == NAV - 1 else variances[i // 3]
            state.blocks[s, P + i * (stride + 1)] += noise
            for t in range(s + 1, plan.spans.shape[0] if state.joint.shape[0] > 0 else 0):
                state.joint[s * stride + i, t * stride + i] += noise
        if state.silent[SILENT, s] >= 0.0:
            for k in range(4):
                state.silent[PAUSED + k, s] += variances[k]


@scalar_kernel
def _place_on_vehicle(lanes: Array, lane: int, merged: Array, travel: float, dt: float) -> None:
    """Put an IMU where the vehicle has it, and turn a wheel about its axle as far as it rolled."""
    v = vehicle.matrix_at(merged, covariance.VEHICLE)
    if lanes[bank.RADIUS + lane] == 0.0:
        vehicle.put_attitude(lanes, lane, v)
    else:
        forward = (
            v[0] * merged[covariance.VELOCITY]
            + v[3] * merged[covariance.VELOCITY + 1]
            + v[6] * merged[covariance.VELOCITY + 2]
        )
        rolled = travel if math.isfinite(travel) else forward * dt
        vehicle.put_attitude(lanes, lane, vehicle.wheel_turned(lanes, lane, v, -rolled / lanes[bank.RADIUS + lane]))
    _move_with_vehicle(lanes, lane, merged, v)


@scalar_kernel
def _move_with_vehicle(lanes: Array, lane: int, merged: Array, v: vehicle.Matrix) -> None:
    """Give an IMU the position and the velocity that the vehicle has there."""
    c = vehicle.lane_matrix(lanes, bank.MATRIX + lane)
    ln, le, ld = vehicle.rotated(c, *vehicle.lever_to_wheel(lanes, lane))
    p = bank.IN_VEHICLE + lane
    pn, pe, pd = vehicle.rotated(v, lanes[p], lanes[p + LANES], lanes[p + 2 * LANES])
    lanes[bank.POSITION + lane] = merged[covariance.POSITION] + (pn - ln) * lanes[bank.TO_LATITUDE + lane]
    lanes[bank.POSITION + LANES + lane] = merged[covariance.POSITION + 1] + (pe - le) * lanes[bank.TO_LONGITUDE + lane]
    lanes[bank.POSITION + 2 * LANES + lane] = merged[covariance.POSITION + 2] - (pd - ld)
    for k in range(3):
        lanes[bank.VELOCITY + k * LANES + lane] = merged[covariance.VELOCITY + k]


@scalar_kernel
def _add_force(lanes: Array, lane: int, merged: Array, elapsed: float, dt: float) -> None:
    """Turn an IMU on a wheel with its own data, the axle kept, and add up the force that it feels, in n."""
    v = vehicle.matrix_at(merged, covariance.VEHICLE)
    if lanes[bank.RADIUS + lane] == 0.0:
        vehicle.put_attitude(lanes, lane, v)
    else:
        vehicle.put_attitude(lanes, lane, vehicle.wheel_turned(lanes, lane, v, 0.0))
    _move_with_vehicle(lanes, lane, merged, v)
    # less what it feels for being off the wheel's centre
    x, y, z = (
        lanes[bank.DTHETA + lane] / dt,
        lanes[bank.DTHETA + LANES + lane] / dt,
        lanes[bank.DTHETA + 2 * LANES + lane] / dt,
    )
    outward = vehicle.cross(x, y, z, *vehicle.cross(x, y, z, *vehicle.lever_to_wheel(lanes, lane)))
    felt = vehicle.rotated(vehicle.lane_matrix(lanes, bank.AT_MATRIX + lane), outward[0], outward[1], outward[2])
    for k in range(3):
        if elapsed == 0.0:
            lanes[bank.TRAVELLED + k * LANES + lane] = 0.0
            lanes[bank.BEFORE_VELOCITY + k * LANES + lane] = merged[covariance.VELOCITY + k]
        else:
            lanes[bank.TRAVELLED + k * LANES + lane] += lanes[bank.DVEL_N + k * LANES + lane] + felt[k] * dt


@scalar_kernel
def _align_angle(lanes: Array, lane: int, merged: Array, elapsed: float) -> None:
    """Turn an IMU on a wheel about the axle until the force that it felt is gravity and the vehicle's acceleration."""
    if lanes[bank.RADIUS + lane] == 0.0:
        return
    v = vehicle.matrix_at(merged, covariance.VEHICLE)
    # forward and down, which the axle is perpendicular to
    fn, fe, fd = (
        lanes[bank.TRAVELLED + lane],
        lanes[bank.TRAVELLED + LANES + lane],
        lanes[bank.TRAVELLED + 2 * LANES + lane],
    )
    an = merged[covariance.VELOCITY] - lanes[bank.BEFORE_VELOCITY + lane]
    ae = merged[covariance.VELOCITY + 1] - lanes[bank.BEFORE_VELOCITY + LANES + lane]
    ad = (
        merged[covariance.VELOCITY + 2]
        - lanes[bank.BEFORE_VELOCITY + 2 * LANES + lane]
        - lanes[bank.GRAVITY + lane] * elapsed
    )
    felt_x, _, felt_z = vehicle.rotated_back(v, fn, fe, fd)
    true_x, _, true_z = vehicle.rotated_back(v, an, ae, ad)
    # about y, which turns z to x
    angle = math.atan2(true_x, true_z) - math.atan2(felt_x, felt_z)
    vehicle.put_attitude(lanes, lane, vehicle.wheel_turned(lanes, lane, v, angle))
    _move_with_vehicle(lanes, lane, merged, v)


@scalar_kernel
def _coast(state: State, dt: float) -> None:
    """With every block silent the vehicle goes on as it went."""
    for s in range(state.silent.shape[1]):
        if state.silent[SILENT, s] < 0.0:
            return
    merged = state.blocks[-1]
    metres = merged[covariance.METRIC : covariance.METRIC + 3]
    place = merged[covariance.POSITION : covariance.POSITION + 3]
    earth.metric(place, state.scalars[EARTH] != 0.0, metres)
    for k in range(3):
        merged[covariance.POSITION + k] += merged[covariance.VELOCITY + k] * dt / metres[k]


@scalar_kernel
def _reseed(state: State, s: int, stride: int) -> None:
    """Begin anew with what the vehicle says of a block; what is known of its IMU's errors stays."""
    block = state.blocks[s]
    covariance.complete(block, stride)
    noise = state.silent[PAUSED : PAUSED + 4, s]
    for k in range(3):
        covariance.begin_anew(block, k, RESEED_POSITION**2 + noise[0], stride)
        covariance.begin_anew(block, 3 + k, RESEED_VELOCITY**2 + noise[1], stride)
        heading = RESEED_HEADING**2 + noise[3]
        covariance.begin_anew(block, 6 + k, heading if k == 2 else RESEED_TILT**2 + noise[2], stride)
    noise[:] = 0.0
    for i in range(NAV):
        for j in range(state.joint.shape[0]):
            state.joint[s * stride + i, j] = 0.0
            state.joint[j, s * stride + i] = 0.0
