"""The one loop over the timeline: propagate the bank, aid it, merge its answers.

Everything that a run remembers from one epoch to the next lives in the arrays of a `State`, so that a run can be
cut anywhere: in chunks, or into single epochs of a live stream.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from polyins.aiding import gnss, measurement, schedule, silence, vehicle_position
from polyins.aiding.rolling import Joint, Rolling
from polyins.kernels import bank, dense, earth, fuse, joint, kalman, share, strapdown, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, entry, kernel, scalar_kernel

UNUSED, ACCEPTED, REJECTED, REOPENED = 0, 1, 2, 3
"""What became of a fix."""

VELOCITY_REJECTED = 4
"""Added where the position of a fix was accepted and its velocity was not."""


CAUTION = 4.0
"""The gate takes the standard deviations of the prediction times this: P knows nothing of misaligned chips and the
like, which in an outage or a bend make errors of many sigma."""

MOST_GROWTH = 100.0
"""of the covariance when the gate reopens: standard deviations tenfold"""


class State(NamedTuple):
    """What a run remembers."""

    blocks: Array
    """the bank, (blocks, bank.SIZE)"""
    groups: Array
    """a row per share, and one more for the merged state where there are several shares, (., share.SIZE)"""
    members: Array
    """int64 (shares, 2): first lane of each share and the one after its last"""
    measurements: Array
    """work of the Kalman update, (shares, kalman.SIZE)"""
    near: Array
    """geodetic, latitude, its sine and cosine, plane gravity; see `earth.evaluate`"""
    before: Array
    """previous mean rate and the length of its interval; see `fuse.average_increments`"""
    clock: Array
    """time of the state, s; length of the last interval, s"""
    counters: Array
    """int64: index of the next fix; fixes rejected in a row; next row of the log of IMU errors"""


class Plan(NamedTuple):
    """What a run is told."""

    virtual: bool
    """average the IMUs into one before navigation"""
    shared_mechanization: bool
    gate_limit: float
    reopen_after: int
    gnss_snap: float
    log_every: int
    """epochs between rows of the log of IMU errors"""


class Inputs(NamedTuple):
    """The aligned recording."""

    time: Array
    """(T,), the first is the start"""
    increments: Array
    """(T, 6, N): dtheta and dvel over the interval that ends at `time`; the first row is only a previous one"""
    fix_time: Array
    """(M,)"""
    fixes: Array
    """(M, 6): position 3, its variance 3"""
    velocities: Array | None
    """(M, 6): velocity 3, its variance 3, not positive where a fix has none; None, which spares compiling their update,
    where no fix has one"""


class Outputs(NamedTuple):
    """What a run writes, a row per epoch, fix, or row of the log."""

    states: Array
    """(T, 10): position, velocity, quaternion"""
    variances: Array
    """(T, 12): of position and velocity; covariance of phi NN, NE, ND, EE, ED, DD"""
    fix_status: Array
    """int8 (M,)"""
    innovations: Array
    """(M, 7): residual 3, its variance 3, NIS"""
    log_time: Array
    """(K,)"""
    log: Array
    """(K, 2, E, N): slow errors and their std; E is 12, or 15 with those of the mounting"""


@kernel
def propagate(
    blocks: Array,
    groups: Array,
    members: Array,
    near: Array,
    clock: Array,
    shared_mechanization: bool,
    fraction: float,
    dt: float,
    work: tuple[Array, Array] | None,
    origin: Array | None,
    rolling: Rolling | None,
    joined: Joint | None,
) -> None:
    """Advance every IMU, every covariance block and the fused states by dt, a fraction of the measured interval.

    Takes the arrays of a `State` one by one: passing the whole costs more than some of the steps.
    """
    if near[0] != 0.0 and abs(groups[-1, share.POSITION] - near[1]) > 5e-4:
        move_near(near, groups[-1, share.POSITION])
    ratio = dt * dt / (6.0 * clock[1] * (clock[1] + dt))
    several = members[members.shape[0] - 1, 1] > 1
    for b in range(blocks.shape[0]):
        w = blocks[b]
        if rolling is not None and rolling.present.shape[0] > 0:
            strapdown.remember_matrix(w)
        strapdown.compensate(w, fraction, dt)
        if shared_mechanization:
            # simplification ii of paper A, VI: position and errors stay each IMU's own
            fuse.take_fused_velocity(w, groups[0])
            fuse.take_fused_attitude(w, groups[0])
        strapdown.mechanize(w, dt, ratio, near)
        if origin is not None and several:
            fuse.project_to_origin(w, dt)
            if b == 0:
                fuse.begin_means(w, groups[-1])
            fuse.add_to_means(w, groups[-1])
    for s in range(members.shape[0]):
        g = groups[s]
        if origin is not None and members[s, 1] - members[s, 0] > 1:
            fuse.finish_measurements(g, dt)
        else:
            fuse.fuse_measurements(blocks, members[s, 0], members[s, 1], g, dt)
        share.error_model(g, dt, near)
        if work is None:
            share.predict(g, dt)
        elif joined is None:
            dense.predict(g, dt, work[0], work[1])
    if work is not None and joined is not None:
        dense.predict_joined(groups, members.shape[0], dt, joined.whole, work[0], work[1])
    if work is None and joined is not None:
        for s in range(members.shape[0]):
            share.scale_terms(groups[s])
        for s in range(members.shape[0]):
            for other in range(s + 1, members.shape[0]):
                joint.predict(groups, s, other, dt, joined.whole, joined.work)
    clock[0] += dt
    clock[1] = dt
    if origin is not None:
        _finish_merging(blocks, groups, members)
    if rolling is not None:
        fuse.fuse_shares(blocks, groups, members, dt)
        vehicle.merge(blocks, groups, members, rolling.lenders, rolling.silent)


@scalar_kernel
def move_near(near: Array, latitude: float) -> None:
    """Make a latitude the one near which the earth is evaluated."""
    near[1] = latitude
    near[2] = math.sin(latitude)
    near[3] = math.cos(latitude)


@scalar_kernel
def merge(blocks: Array, groups: Array, members: Array, dt: float) -> None:
    """Fuse the members of each share, and all IMUs of an array into the last row of the groups."""
    if members[members.shape[0] - 1, 1] > 1:
        for b in range(blocks.shape[0]):
            fuse.project_to_origin(blocks[b], dt)
            if b == 0:
                fuse.begin_means(blocks[b], groups[-1])
            fuse.add_to_means(blocks[b], groups[-1])
    _finish_merging(blocks, groups, members)


@scalar_kernel
def _finish_merging(blocks: Array, groups: Array, members: Array) -> None:
    """Write the fused states of an array, which has one share for all, or one for each IMU and then the mean of all."""
    if members[0, 1] - members[0, 0] == 1:
        for s in range(members.shape[0]):
            fuse.fuse_states(blocks, members[s, 0], members[s, 1], groups[s])
    if members[members.shape[0] - 1, 1] > 1:
        fuse.finish_states(groups[-1])


@scalar_kernel
def _measure_position(state: State, fix: Array) -> float:
    """Measure a GNSS position with every share; return the mean of their NIS."""
    geodetic = state.near[0] != 0.0
    nis = 0.0
    for s in range(state.members.shape[0]):
        g, m = state.groups[s], state.measurements[s]
        first, last = state.members[s, 0], state.members[s, 1]
        metres = g[share.METRIC : share.METRIC + 3]
        earth.metric(g[share.POSITION : share.POSITION + 3], geodetic, metres)
        gnss.position_design(g, m)
        gnss.position_residuals(state.blocks, first, last, fix, metres, geodetic, m)
        for a in range(3):
            m[kalman.R + a] = fix[3 + a]
        kalman.gain(g, m)
        nis += kalman.normalized_innovation_squared(m) / state.members.shape[0]
    return nis


@scalar_kernel
def aid_by_position(
    state: State,
    plan: Plan,
    fix: Array,
    innovation: Array,
    origin: Array | None,
    rolling: Rolling | None,
    joined: Joint | None,
) -> int:
    """Update every share by a GNSS position; return what became of it."""
    blocks, groups, members, measurements = state.blocks, state.groups, state.members, state.measurements
    nis = 0.0
    if origin is not None:
        nis = _measure_position(state, fix)
    if rolling is not None:
        nis = vehicle_position.measure_position(fix, blocks, groups, members, measurements, state.near, rolling, joined)
    _record(state, nis, innovation, rolling, joined)
    status = ACCEPTED
    if not _passes_gate(state, plan, nis, rolling, joined):
        state.counters[1] += 1
        if state.counters[1] <= plan.reopen_after:
            return REJECTED
        if joined is None:
            _reopen(state, plan, nis, rolling)
        else:
            _reopen_all(state, plan, nis, joined)
        status = REOPENED
    state.counters[1] = 0
    if origin is not None:
        _correct(state)
    if rolling is not None:
        dt = state.clock[1]
        now = state.clock[0]
        vehicle_position.correct_by_position(
            blocks, groups, members, measurements, state.near, rolling, joined, now, dt
        )
    return status


@scalar_kernel
def _reopen_all(state: State, plan: Plan, nis: float, joined: Joint) -> None:
    """Let the joined covariance grow as `_reopen` lets that of a share; a jump is one for all shares."""
    growth = min(nis / 3.0, MOST_GROWTH)
    m, shares = state.measurements[0], state.members.shape[0]
    for i in range(joined.whole.shape[0]):
        for j in range(joined.whole.shape[0]):
            joined.whole[i, j] *= growth
    joint.gain(joined.h, m[kalman.R : kalman.R + 3], joined.whole, joined.hp, joined.gain, m)
    if kalman.normalized_innovation_squared(m) > plan.gate_limit:
        for a in range(3):
            for s in range(shares):
                for t in range(shares):
                    joined.whole[s * share.STATES + a, t * share.STATES + a] += m[kalman.RESIDUAL + a] ** 2
        joint.gain(joined.h, m[kalman.R : kalman.R + 3], joined.whole, joined.hp, joined.gain, m)


@scalar_kernel
def aid_by_velocity(state: State, plan: Plan, fix: Array) -> bool:
    """Update every share by a GNSS velocity; return whether the gate let it pass."""
    nis = 0.0
    for s in range(state.members.shape[0]):
        g, m = state.groups[s], state.measurements[s]
        w, lane = state.blocks[state.members[s, 0] // LANES], state.members[s, 0] % LANES
        gnss.velocity_design(g, m, w[bank.EARTH_RATE + lane], w[bank.EARTH_RATE + LANES + lane])
        gnss.velocity_residuals(state.blocks, state.members[s, 0], state.members[s, 1], fix, state.clock[1], m)
        for a in range(3):
            m[kalman.R + a] = fix[3 + a]
        kalman.gain(g, m)
        nis += kalman.normalized_innovation_squared(m) / state.members.shape[0]
    if not _passes_gate(state, plan, nis, None, None):
        return False
    _correct(state)
    return True


@kernel
def _has_measured(s: int, rolling: Rolling | None, joined: Joint | None) -> bool:
    """Whether the measurement of a share is of this fix: silent ones have none, joined ones the first for all."""
    if joined is not None:
        return s == 0
    if rolling is not None:
        return bool(rolling.silent[s] < 0.0)
    return True


@scalar_kernel
def _passes_gate(state: State, plan: Plan, nis: float, rolling: Rolling | None, joined: Joint | None) -> bool:
    if nis <= plan.gate_limit:
        return True
    cautious, measured = 0.0, 0
    for s in range(state.members.shape[0]):
        if _has_measured(s, rolling, joined):
            cautious += kalman.cautious_innovation_squared(state.measurements[s], CAUTION)
            measured += 1
    return cautious <= plan.gate_limit * measured


@scalar_kernel
def _record(state: State, nis: float, innovation: Array, rolling: Rolling | None, joined: Joint | None) -> None:
    innovation[:] = 0.0
    measured = 0
    for s in range(state.members.shape[0]):
        if _has_measured(s, rolling, joined):
            measured += 1
            for a in range(3):
                innovation[a] += state.measurements[s, kalman.RESIDUAL + a]
                innovation[3 + a] += state.measurements[s, kalman.S + 4 * a]
    for a in range(6):
        innovation[a] /= max(measured, 1)
    innovation[6] = nis


@scalar_kernel
def _reopen(state: State, plan: Plan, nis: float, rolling: Rolling | None) -> None:
    """Let the covariance grow until the fix is believable.

    The filter is surer of itself than it should be, in velocity and attitude as much as in position, so P is scaled
    as a whole; what is left of a jump that no error of this size explains goes to the position alone.
    """
    growth = min(nis / 3.0, MOST_GROWTH)
    for s in range(state.members.shape[0]):
        if not _has_measured(s, rolling, None):
            continue
        g, m = state.groups[s], state.measurements[s]
        share.complete(g)
        for i in range(share.STATES * share.STRIDE):
            g[share.P + i] *= growth
        kalman.gain(g, m)
        if kalman.normalized_innovation_squared(m) > plan.gate_limit:
            for a in range(3):
                g[share.P + a * (share.STRIDE + 1)] += m[kalman.RESIDUAL + a] ** 2
            kalman.gain(g, m)


@scalar_kernel
def _correct(state: State) -> None:
    for s in range(state.members.shape[0]):
        g, m = state.groups[s], state.measurements[s]
        first, last = state.members[s, 0], state.members[s, 1]
        kalman.update_covariance(g, m)
        gnss.residuals_to_corrections(state.blocks, first, last, m)
        fuse.correct_members(state.blocks, first, last, g[share.METRIC : share.METRIC + 3])
    for b in range(state.blocks.shape[0]):
        w = state.blocks[b]
        strapdown.update_matrix(w)
        strapdown.update_sensitivity(w)
    merge(state.blocks, state.groups, state.members, state.clock[1])


@scalar_kernel
def aid(
    state: State,
    plan: Plan,
    fixes: Array,
    outputs: Outputs,
    velocities: Array | None,
    origin: Array | None,
    rolling: Rolling | None,
    joined: Joint | None,
) -> None:
    """Apply the next fix to the state as it is."""
    j = state.counters[0]
    state.counters[0] += 1
    status = aid_by_position(state, plan, fixes[j], outputs.innovations[j], origin, rolling, joined)
    if velocities is not None:
        velocity = velocities[j]
        if status != REJECTED and velocity[3] > 0.0 and not aid_by_velocity(state, plan, velocity):
            status += VELOCITY_REJECTED
    outputs.fix_status[j] = status


@kernel
def load(blocks: Array, raw: Array) -> None:
    """Put the measured increments of one epoch, (6, N), into the lanes."""
    count = raw.shape[1]
    for k in range(6):  # row by row: memory is fetched ahead only where it is read in order
        for b in range(count // LANES):
            for i in range(LANES):
                blocks[b, bank.RAW_DTHETA + k * LANES + i] = raw[k, b * LANES + i]
        for i in range(count // LANES * LANES, count):
            blocks[i // LANES, bank.RAW_DTHETA + k * LANES + i % LANES] = raw[k, i]


@entry
def begin(state: State, plan: Plan, raw: Array, interval: float, origin: Array | None, rolling: Rolling | None) -> None:
    """Complete a state that holds positions, velocities, quaternions and errors.

    The increments that end at the start are the previous ones of the first epoch.
    """
    if origin is not None and plan.virtual:
        fuse.average_increments(raw, interval, origin, state.before, state.blocks)
    else:
        load(state.blocks, raw)
    for b in range(state.blocks.shape[0]):
        w = state.blocks[b]
        strapdown.update_matrix(w)
        strapdown.update_sensitivity(w)
        strapdown.evaluate_at_own_state(w)
        if state.near[0] != 0.0:
            earth.evaluate(w, state.near[1], state.near[2], state.near[3])
        else:
            earth.evaluate_plane(w, state.near[4])
        strapdown.compensate(w, 1.0, interval)
    for s in range(state.members.shape[0]):
        fuse.fuse_measurements(state.blocks, state.members[s, 0], state.members[s, 1], state.groups[s], interval)
    gather_idle_lanes(state.blocks, state.members)
    if origin is not None:
        merge(state.blocks, state.groups, state.members, state.clock[1])
    if rolling is not None:
        measurement.update_derived(state.blocks, state.groups, state.members, rolling, state.clock[1])


@kernel
def write(groups: Array, members: Array, states: Array, variances: Array, k: int) -> None:
    """Write row k: the merged state and its variances; the variance of several shares is their mean."""
    for i in range(10):
        states[k, i] = groups[-1, share.POSITION + i]
    variance = variances[k]
    for i in range(12):
        variance[i] = 0.0
    for s in range(members.shape[0]):
        _add_variances(groups[s], 1.0 / members.shape[0], variance)


@scalar_kernel
def _add_variances(g: Array, weight: float, variance: Array) -> None:
    for i in range(6):
        variance[i] += weight * g[share.P + i * (share.STRIDE + 1)]
    n = 6
    for i in range(6, 9):
        for j in range(i, 9):
            variance[n] += weight * g[share.P + i * share.STRIDE + j]
            n += 1


@scalar_kernel
def _log(state: State, outputs: Outputs, time: float) -> None:
    row = state.counters[2]
    state.counters[2] += 1
    outputs.log_time[row] = time
    for s in range(state.members.shape[0]):
        g = state.groups[s]
        for i in range(state.members[s, 0], state.members[s, 1]):
            for k in range(outputs.log.shape[2]):
                outputs.log[row, 0, k, i] = state.blocks[i // LANES, bank.ERRORS + k * LANES + i % LANES]
                outputs.log[row, 1, k, i] = math.sqrt(share.variance(g, share.NAV + k))


@entry
def gather_idle_lanes(blocks: Array, members: Array) -> None:
    """Put the lanes without an IMU where the last one before them is: they would fall for hours otherwise."""
    for s in range(members.shape[0]):
        last = members[s, 1] - 1
        end = members[s + 1, 0] if s + 1 < members.shape[0] else blocks.shape[0] * LANES
        for lane in range(last + 1, end):
            for field in range(0, bank.SIZE, LANES):
                if field != bank.WEIGHT:
                    blocks[lane // LANES, field + lane % LANES] = blocks[last // LANES, field + last % LANES]


@entry
def run_epochs(
    state: State,
    plan: Plan,
    inputs: Inputs,
    outputs: Outputs,
    first: int,
    last: int,
    fixes: Array | None,
    work: tuple[Array, Array] | None,
    origin: Array | None,
    rolling: Rolling | None,
    joined: Joint | None,
) -> None:
    """Take epochs first ... last - 1; the first of a recording is 1, since epoch 0 is the start.

    A fix inside an interval splits it. What is None is neither compiled nor done: `fixes` (of the inputs) without
    GNSS; `work` but for dense covariances; `origin`, the mean vector from the IMUs of an array to its origin, m, on a
    vehicle with wheels, and `rolling` without them; `joined` but for joined covariance blocks.
    """
    blocks, groups, members, near, clock = state.blocks, state.groups, state.members, state.near, state.clock
    time, increments, fix_time, counters = inputs.time, inputs.increments, inputs.fix_time, state.counters
    states, variances = outputs.states, outputs.variances
    virtual, snap = plan.virtual, plan.gnss_snap
    # one IMU shares with nobody: its fused state is its own, at its own place
    shared = plan.shared_mechanization and members[0, 1] - members[0, 0] > 1
    next_fix = fix_time[counters[0]] if counters[0] < len(fix_time) else math.inf
    for k in range(first, last):
        now, end = time[k - 1], time[k]
        interval = end - now
        if rolling is not None:
            silence.note_silence(k, now, rolling)
        if not virtual:
            load(blocks, increments[k])
        if origin is not None and virtual:
            fuse.average_increments(increments[k], interval, origin, state.before, blocks)
        arrived = False
        while not arrived or next_fix <= end + snap:
            if not arrived:
                arrived = next_fix >= end - snap
                until = end if arrived else next_fix
                dt = until - now
                fraction = dt / interval
                if arrived or until > now + snap:
                    propagate(blocks, groups, members, near, clock, shared, fraction, dt, work, origin, rolling, joined)
                    now = until
                if arrived and rolling is not None:
                    measurements = state.measurements
                    schedule.fill_window(k, fraction, blocks, groups, members, rolling, dt)
                    if rolling.present.shape[0] > 0:
                        silence.move_silent(k, end, blocks, groups, members, near, rolling, joined, interval)
                    schedule.step(k, end, blocks, groups, members, measurements, near, rolling, joined, dt, interval)
            if next_fix <= end + snap:
                if fixes is not None:
                    aid(state, plan, fixes, outputs, inputs.velocities, origin, rolling, joined)
                next_fix = fix_time[counters[0]] if counters[0] < len(fix_time) else math.inf
        write(groups, members, states, variances, k)
        if (k - 1) % plan.log_every == 0:
            _log(state, outputs, end)
            gather_idle_lanes(blocks, members)
