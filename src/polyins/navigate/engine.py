"""The page that runs every method: propagate the bank, aid it, merge its answers.

Equation numbers are those of the papers, A and B; see docs/theory.
"""

from __future__ import annotations

import math

from polyins.aiding import kinds
from polyins.aiding.measurement import DT, GEODETIC, KIND, VALUE, VARIANCE
from polyins.aiding.wheel_speed import AT_END, DURATION, LATERAL, SPEED
from polyins.kernels import bank, covariance, dense, earth, fuse, joint, strapdown, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, entry, formula, kernel, scalar_kernel
from polyins.navigate import deviations, silence, slip, together, update, window
from polyins.navigate.state import (
    AT_REST,
    EARTH,
    INTERVAL,
    LEAPT,
    LOG_EVERY,
    MAY_BE_SILENT,
    NEXT_EVENT,
    NEXT_LOG,
    PREVIOUS,
    RADIUS,
    REJECTED_AT,
    SHARED_MECHANIZATION,
    SNAP,
    SPEED_AT_END,
    STRIDE,
    TIME,
    TOGETHER,
    VALUES,
    VIRTUAL,
    WINDOW_BEGIN,
    WINDOW_FILLED,
    WINDOW_LATERAL,
    WINDOW_TRAVEL,
    Further,
    Inputs,
    Navigators,
    Outputs,
    Plan,
    State,
    Work,
)

FARTHEST_REFERENCE = 5e-4
"""rad of latitude, up to which the earth is evaluated near a latitude"""

Dense = tuple[Array, Array] | None
"""work arrays of the papers' form of the prediction, see `kernels.dense`; None, which is not compiled, for ours"""


@entry
def run(
    navigators: Navigators,
    inputs: Inputs,
    outputs: Outputs,
    further: Further | None,
    full_matrices: Dense,
    epochs: slice,
) -> None:
    """Take those epochs; the first of a recording is 1, since epoch 0 is the start."""
    state, plan, work = navigators.state, navigators.plan, navigators.work
    snap, log_every = plan.settings[SNAP], int(plan.settings[LOG_EVERY])
    due = _next_event(state, inputs)
    for k in range(epochs.start, epochs.stop):
        now, end = inputs.time[k - 1], inputs.time[k]
        load(state, plan, inputs, k)  # increments; who is there
        arrived = False
        while not arrived or due <= end + snap:
            if not arrived:
                arrived = due >= end - snap
                until = end if arrived else due
                if arrived or until > now + snap:
                    fraction = (until - now) / (end - inputs.time[k - 1])
                    propagate(navigators, further, full_matrices, fraction, until - now)  # A (1), (3), (5);  B (2)
                    if state.scalars[WINDOW_FILLED] >= 0.0:
                        window.fill(state, plan, inputs, k, fraction, until - now)  # B (3)-(4)
                    if plan.wheels.shape[0] > 0:
                        slip.note_way(state, plan, inputs, k, fraction, until - now)
                    now = until
                if arrived and inputs.present.shape[0] > 0:
                    silence.move_silent(state, plan, work, inputs, k)
            if due <= end + snap:
                aid(navigators, further, inputs, outputs)  # A (6)-(11);  B (5)-(14)
                due = _next_event(state, inputs)
        if state.scalars[LEAPT] != 0.0:
            deviations.compare_at_leap(state, plan, work)
        write(state, plan, outputs, further, k)
        if (k - 1) % log_every == 0:
            _log(state, plan, outputs, end)
            gather_idle_lanes(state, plan)


@formula
def _next_event(state: State, inputs: Inputs) -> float:
    j = int(state.scalars[NEXT_EVENT])
    time: float = inputs.event_time[j] if j < inputs.event_time.shape[0] else math.inf
    return time


@formula
def load(state: State, plan: Plan, inputs: Inputs, k: int) -> None:
    """Put the measured increments of an epoch into the lanes, or their mean into that of a virtual IMU, A (12)-(14)."""
    now, raw = inputs.time[k - 1], inputs.increments[k]
    if plan.settings[VIRTUAL] != 0.0:
        previous = state.scalars[PREVIOUS : PREVIOUS + 4]
        fuse.average_increments(raw, inputs.time[k] - now, plan.origin, previous, state.rows)
        return
    _put_increments(state.rows, raw)
    if inputs.present.shape[0] > 0:
        silence.note_silence(state, plan, inputs.present[k], now)
        silence.weigh(state, plan, inputs.present[k])


@kernel
def _put_increments(rows: Array, raw: Array) -> None:
    """`raw` is (6, N)."""
    count = raw.shape[1]
    for k in range(6):  # row by row: memory is fetched ahead only where it is read in order
        for b in range(count // LANES):
            for i in range(LANES):
                rows[b, bank.RAW_DTHETA + k * LANES + i] = raw[k, b * LANES + i]
        for i in range(count // LANES * LANES, count):
            rows[i // LANES, bank.RAW_DTHETA + k * LANES + i % LANES] = raw[k, i]


@formula
def propagate(
    navigators: Navigators, further: Further | None, full_matrices: Dense, fraction: float, dt: float
) -> None:
    """Advance every IMU, every covariance block and the merged state by dt, a fraction of the measured interval."""
    state, plan, work = navigators.state, navigators.plan, navigators.work
    rows, blocks, spans, scalars = state.rows, state.blocks, plan.spans, state.scalars
    reference = scalars[EARTH : EARTH + 5]
    if reference[0] != 0.0 and abs(blocks[-1, covariance.POSITION] - reference[1]) > FARTHEST_REFERENCE:
        earth.move_reference(reference, blocks[-1, covariance.POSITION])
    _mechanize(state, plan, work, fraction, dt)  # A (1); B (2)
    joined = state.joint.shape[0] > 0
    for s in range(spans.shape[0]):
        block, model = blocks[s], work.covariance[s if joined else 0]
        if spans[s, 1] - spans[s, 0] > 1:
            fuse.finish_measurements(work.sums[s], block, dt)  # A (14)
        else:
            fuse.take_measurement(rows, spans[s, 0], block, dt)
        covariance.error_model(block, model, dt, reference)  # A (3)
        if full_matrices is None:
            if further is None:
                covariance.predict(block, model, dt)  # A (5)
            else:
                _predict_either(block, model, dt, int(plan.settings[STRIDE]))
        elif not joined:
            dense.predict(block, model, dt, full_matrices[0], full_matrices[1])
        if full_matrices is None and state.deviations.shape[0] > 0 and spans[s, 1] - spans[s, 0] > 1:
            deviations.drive(state, model, s, dt)
            if further is None:
                covariance.predict(state.deviations[s], model, dt)
            else:
                _predict_either(state.deviations[s], model, dt, int(plan.settings[STRIDE]))
    if plan.settings[TOGETHER] != 0.0:
        together.drive(state, plan, work.covariance[0], dt)
        if further is None:
            covariance.predict(blocks[-1], work.covariance[0], dt)
        else:
            _predict_either(blocks[-1], work.covariance[0], dt, int(plan.settings[STRIDE]))
    if full_matrices is None:
        if further is not None:
            joint.predict(blocks, work.covariance, dt, state.joint, int(plan.settings[STRIDE]))
    elif joined:
        dense.predict_joined(blocks, work.covariance, dt, state.joint, full_matrices[0], full_matrices[1])
    scalars[TIME] += dt
    scalars[INTERVAL] = dt
    for s in range(spans.shape[0]):
        if spans[s, 1] - spans[s, 0] > 1:
            fuse.finish_states(work.sums[s], blocks[s])  # A (17)
        else:
            fuse.take_state(rows, spans[s, 0], blocks[s])
    if blocks.shape[0] > spans.shape[0]:
        vehicle.merge(rows, blocks, spans, plan.lenders)  # B (7)-(8)


@formula
def _mechanize(state: State, plan: Plan, work: Work, fraction: float, dt: float) -> None:
    """Advance every IMU, and add those of blocks of several to the means over their block."""
    reference = state.scalars[EARTH : EARTH + 5]
    previous = state.scalars[INTERVAL]
    ratio = dt * dt / (6.0 * previous * (previous + dt))
    shared = plan.settings[SHARED_MECHANIZATION] != 0.0 and plan.spans[0, 1] - plan.spans[0, 0] > 1
    compared = state.deviations.shape[0] > 0
    block_before = -1
    for b in range(state.rows.shape[0]):
        lanes, s = state.rows[b], plan.row_blocks[b]
        if plan.settings[MAY_BE_SILENT] != 0.0:
            strapdown.remember_matrix(lanes)
        strapdown.compensate(lanes, fraction, dt)
        if shared:
            # simplification ii of paper A, VI: position and errors stay each IMU's own
            fuse.take_fused_velocity(lanes, state.blocks[0])
            fuse.take_fused_attitude(lanes, state.blocks[0])
        strapdown.mechanize(lanes, dt, ratio, reference)
        if s >= 0:
            fuse.project_to_point(lanes, dt)  # A (15)-(16)
            if s != block_before:
                fuse.begin_means(lanes, work.sums[s])
            fuse.add_to_means(lanes, work.sums[s])
            if compared and fuse.leaps(lanes, deviations.LEAP_TURN, deviations.LEAP_CHANGE):
                state.scalars[LEAPT] = 1.0
        block_before = s


@scalar_kernel
def _predict_either(block: Array, model: Array, dt: float, stride: int) -> None:
    if stride == covariance.STRIDE:
        covariance.predict(block, model, dt)
    else:
        covariance.predict_any(block, model, dt, stride)


@scalar_kernel
def aid(navigators: Navigators, further: Further | None, inputs: Inputs, outputs: Outputs) -> None:
    """Apply the next event to the state as it is."""
    state, plan, work = navigators.state, navigators.plan, navigators.work
    j = int(state.scalars[NEXT_EVENT])
    state.scalars[NEXT_EVENT] += 1.0
    kind, measurement = inputs.event_kind[j], work.measurement
    measurement[KIND], measurement[DT] = kind, state.scalars[INTERVAL]
    measurement[GEODETIC] = state.scalars[EARTH]
    for n in range(VALUES):
        measurement[VALUE + n] = inputs.event_value[j, n]
    for a in range(3):
        measurement[VARIANCE + a] = inputs.event_variance[j, a]
    status = update.UNUSED
    if kind == kinds.WINDOW:
        window.open_at(state, plan, state.scalars[TIME], measurement[VALUE])
    elif kind == kinds.PAUSE:
        silence.add_noise(state, plan, measurement[VALUE : VALUE + 4])
    elif kind == kinds.DEVIATIONS:
        if deviations.compare(state, plan, work, outputs.innovations[j]):
            status = update.ACCEPTED
    elif _complete(state, plan, measurement, kind):
        if kind != kinds.WHEEL_SPEED or slip.some_roll(state, plan):
            slip.leave_out(state, plan, measurement)
            status = update.apply(state, plan, work, further, outputs.innovations[j])
        else:
            status = update.SLIPPED
    if kind == kinds.WHEEL_SPEED:
        slip.conclude(state, plan, status, outputs.innovations[j])
    if kind == kinds.GNSS_POSITION:
        state.scalars[REJECTED_AT] = inputs.event_time[j] if status == update.DEWEIGHTED else -math.inf
    outputs.event_status[j] = status


@scalar_kernel
def _complete(state: State, plan: Plan, measurement: Array, kind: int) -> bool:
    """Complete what a measurement says by what only the state knows; return whether it is to be applied."""
    scalars = state.scalars
    if kind == kinds.REFERENCE_POINT:
        for a in range(3):
            measurement[VALUE + a] = state.blocks[-1, covariance.POSITION + a]
        several: bool = plan.spans.shape[0] > 1
        return several
    if kind == kinds.GNSS_VELOCITY:
        # of a fix whose position lies
        return bool(scalars[REJECTED_AT] < scalars[TIME] - plan.settings[SNAP])
    duration = scalars[TIME] - scalars[WINDOW_BEGIN]
    if kind == kinds.ZERO_RATE:
        known = measurement[VALUE] != 0.0
        rests = scalars[WINDOW_FILLED] > 0.0 and (known or window.holds_rest(state, plan, duration))
        # wheels that are locked do not turn either
        scalars[AT_REST] = rests and (known or slip.some_roll(state, plan))
        measurement[VALUE + 1] = duration
        if known:
            scalars[WINDOW_FILLED] = -1.0
        return bool(scalars[AT_REST] != 0.0)
    if kind == kinds.ZERO_VELOCITY:
        return bool(measurement[VALUE] != 0.0 or scalars[AT_REST] != 0.0)
    if kind == kinds.WHEEL_SPEED:
        filled = scalars[WINDOW_FILLED] > 0.0
        scalars[WINDOW_FILLED] = -1.0
        measurement[SPEED] = scalars[WINDOW_TRAVEL] / duration + plan.settings[RADIUS] * _earth_rate_about_axle(state)
        measurement[LATERAL], measurement[DURATION] = scalars[WINDOW_LATERAL], duration
        measurement[AT_END] = plan.settings[SPEED_AT_END]
        return bool(filled and scalars[AT_REST] == 0.0 and math.isfinite(measurement[SPEED]))
    return True


@scalar_kernel
def _earth_rate_about_axle(state: State) -> float:
    """Return what a gyro on a wheel measures beside the rate of the wheel over ground, rad/s."""
    if state.scalars[EARTH] == 0.0:
        return 0.0
    merged, sine, cosine = state.blocks[-1], state.scalars[EARTH + 2], state.scalars[EARTH + 3]
    axle_n, axle_d = merged[covariance.VEHICLE + 1], merged[covariance.VEHICLE + 7]
    rate: float = earth.EARTH_RATE_RAD_S * (axle_n * cosine - axle_d * sine)
    return rate


@entry
def begin(navigators: Navigators, raw: Array, interval: float) -> None:
    """Complete a state that holds positions, velocities, quaternions and errors.

    The increments that end at the start, (6, N), are the previous ones of the first epoch.
    """
    state, plan, work = navigators.state, navigators.plan, navigators.work
    state.scalars[INTERVAL] = interval
    reference = state.scalars[EARTH : EARTH + 5]
    if plan.settings[VIRTUAL] != 0.0:
        fuse.average_increments(raw, interval, plan.origin, state.scalars[PREVIOUS : PREVIOUS + 4], state.rows)
    else:
        _put_increments(state.rows, raw)
    for b in range(state.rows.shape[0]):
        lanes = state.rows[b]
        strapdown.update_matrix(lanes)
        strapdown.update_sensitivity(lanes)
        strapdown.evaluate_at_own_state(lanes)
        if reference[0] != 0.0:
            earth.evaluate(lanes, reference[1], reference[2], reference[3])
        else:
            earth.evaluate_plane(lanes, reference[4])
        strapdown.compensate(lanes, 1.0, interval)
    for s in range(plan.spans.shape[0]):
        first, last = plan.spans[s, 0], plan.spans[s, 1]
        if last - first > 1:
            fuse.add_all(state.rows, first, last, work.sums[s])
            fuse.finish_measurements(work.sums[s], state.blocks[s], interval)
        else:
            fuse.take_measurement(state.rows, first, state.blocks[s], interval)
    gather_idle_lanes(state, plan)
    update.update_derived(state, plan, work)


@formula
def write(state: State, plan: Plan, outputs: Outputs, further: Further | None, k: int) -> None:
    """Write row k: the merged state and its variances.

    Of several blocks that are apart the variance is their mean, or that of the mean of their errors where it is kept;
    joined, it is the latter, too.
    """
    count, stride = plan.spans.shape[0], int(plan.settings[STRIDE])
    for i in range(10):
        outputs.states[k, i] = state.blocks[-1, covariance.POSITION + i]
    variance = outputs.variances[k]
    for i in range(12):
        variance[i] = 0.0
    if plan.settings[TOGETHER] != 0.0:
        _add_variances(state.blocks[-1], stride, 1.0, variance)
    elif further is None:
        for s in range(count):
            _add_variances(state.blocks[s], stride, 1.0 / count, variance)
    else:
        joined = state.joint.shape[0] > 0
        for s in range(count):
            _add_variances(state.blocks[s], stride, 1.0 / count**2 if joined else 1.0 / count, variance)
            for t in range(s + 1, count if joined else 0):
                _add_joint_variances(state.joint, s * stride, t * stride, 2.0 / count**2, variance)


@scalar_kernel
def _add_variances(block: Array, stride: int, weight: float, variance: Array) -> None:
    p = covariance.P
    for i in range(6):
        variance[i] += weight * block[p + i * (stride + 1)]
    n = 6
    for i in range(6, 9):
        for j in range(i, 9):
            variance[n] += weight * block[p + i * stride + j]
            n += 1


@scalar_kernel
def _add_joint_variances(square: Array, row: int, column: int, weight: float, variance: Array) -> None:
    for i in range(6):
        variance[i] += weight * square[row + i, column + i]
    n = 6
    for i in range(6, 9):
        for j in range(i, 9):
            variance[n] += 0.5 * weight * (square[row + i, column + j] + square[row + j, column + i])
            n += 1


@scalar_kernel
def _log(state: State, plan: Plan, outputs: Outputs, time: float) -> None:
    row = int(state.scalars[NEXT_LOG])
    state.scalars[NEXT_LOG] += 1.0
    outputs.log_time[row] = time
    for s in range(plan.spans.shape[0]):
        for i in range(plan.spans[s, 0], plan.spans[s, 1]):
            for k in range(outputs.log.shape[2]):
                outputs.log[row, 0, k, i] = state.rows[i // LANES, bank.ERRORS + k * LANES + i % LANES]
                std = math.sqrt(deviations.variance(state, plan, s, covariance.NAV + k))
                outputs.log[row, 1, k, i] = std


@scalar_kernel
def gather_idle_lanes(state: State, plan: Plan) -> None:
    """Put the lanes without an IMU where the last one before them is: they would fall for hours otherwise."""
    rows, spans = state.rows, plan.spans
    for s in range(spans.shape[0]):
        last = spans[s, 1] - 1
        end = spans[s + 1, 0] if s + 1 < spans.shape[0] else rows.shape[0] * LANES
        for lane in range(last + 1, end):
            for field in range(0, bank.SIZE, LANES):
                if field != bank.WEIGHT:
                    rows[lane // LANES, field + lane % LANES] = rows[last // LANES, field + last % LANES]


@entry
def tidy(navigators: Navigators) -> None:
    """Do what the loop does now and then, where a window of epochs moves on."""
    gather_idle_lanes(navigators.state, navigators.plan)
