"""One measurement and the bank: what every block makes of it, whether it is believed, and what it corrects.

Apart, each block has a gain of its own, paper A (8)-(11), paper B's distributed filter. Joined, one gain corrects all,
paper B's centralized filter.
"""

from __future__ import annotations

import math

from polyins.aiding import kinds, vehicle_attitude
from polyins.aiding.measurement import KIND, METRIC, VARIANCE
from polyins.kernels import bank, covariance, earth, fuse, joint, kalman, strapdown, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.covariance import LARGEST
from polyins.kernels.jit import Array, scalar_kernel
from polyins.navigate import receiver, together, window
from polyins.navigate.state import (
    EARTH,
    GATE_LIMIT,
    INTERVAL,
    RECEIVER,
    SLIP_TRUSTED,
    STRIDE,
    TIME,
    TOGETHER,
    Further,
    Plan,
    State,
    Work,
)

UNUSED, ACCEPTED, REJECTED, RESET, DEWEIGHTED, SLIPPED = 0, 1, 2, 3, 4, 5
"""What became of a measurement: taken as it is; not taken; taken for the position, whatever the prediction; taken with
the variance of its own innovation; withheld since no wheel rolls."""

CAUTION = 4.0
"""The gate takes the standard deviations of the prediction times this: P knows nothing of misaligned chips and the
like, which in an outage or a bend make errors of many sigma."""

OWN_SHARE = 0.1
"""of the variance of a fix that joined blocks have apart after a reset to it"""

HP, K, AH = range(3)
"""places in `Further.vectors`"""
Z, R, OWNER, UPDATE = 0, 3, 6, 7
"""places in a row of `Work.residuals`"""
NIS = 6
"""place in a row of `Outputs.innovations`"""


@scalar_kernel
def apply(state: State, plan: Plan, work: Work, further: Further | None, innovation: Array) -> int:
    """Measure with all blocks, write the innovation, and correct them as far as it is believed; return its status."""
    if state.blocks.shape[0] == plan.spans.shape[0]:
        vehicle.update_attitudes(state.rows, state.blocks, plan.spans, plan.lenders)
    if further is None:
        return _apply_apart(state, plan, work, innovation)
    if state.joint.shape[0] == 0:
        return _apply_apart(state, plan, work, innovation)
    return _apply_joined(state, plan, work, further, innovation)


@scalar_kernel
def _apply_apart(state: State, plan: Plan, work: Work, innovation: Array) -> int:
    rows = _measure_each(state, plan, work)
    if rows == 0:
        return UNUSED
    _record(work, innovation, rows)
    if _uses_other_noise(state, plan, work, innovation):
        rows = _measure_each(state, plan, work)
        _record(work, innovation, rows)
    status = _decide(state, plan, work, rows, innovation)
    if status == DEWEIGHTED:
        rows = _measure_each(state, plan, work)
    if status == RESET:
        _reset_each(state, plan, work, rows)
    elif status != REJECTED:
        _correct_each(state, plan, work)
    _note(state, work, innovation, status)
    if status != REJECTED:
        window.begin_anew(state, plan, state.scalars[TIME])
    return status


@scalar_kernel
def _apply_joined(state: State, plan: Plan, work: Work, further: Further, innovation: Array) -> int:
    rows = _measure_joint(state, plan, work, further)
    if rows == 0:
        return UNUSED
    _record(work, innovation, rows)
    if _uses_other_noise(state, plan, work, innovation):
        rows = _measure_joint(state, plan, work, further)
        _record(work, innovation, rows)
    status = _decide(state, plan, work, rows, innovation)
    if status == DEWEIGHTED:
        rows = _measure_joint(state, plan, work, further)
    if status == RESET:
        _reset_joint(state, plan, work, further)
    elif status != REJECTED:
        _correct_joint(state, plan, work, further, rows)
    _note(state, work, innovation, status)
    if status != REJECTED:
        window.begin_anew(state, plan, state.scalars[TIME])
    return status


# --- what the blocks make of it ---------------------------------------------------------------------------------------


@scalar_kernel
def measure_block(state: State, plan: Plan, measurement: Array, s: int, update: Array) -> None:
    """Write design matrix, variances and residuals of a block: each member's own, and their mean."""
    block, kind = state.blocks[s], int(measurement[KIND])
    first, last = plan.spans[s, 0], plan.spans[s, 1]
    lanes, lane = state.rows[first // LANES], first % LANES
    earth.metric(
        block[covariance.POSITION : covariance.POSITION + 3],
        state.scalars[EARTH] != 0.0,
        measurement[METRIC : METRIC + 3],
    )
    kalman.clear(update)
    kinds.design(block, lanes, lane, measurement, update)
    if kinds.IN_VEHICLE[kind]:
        vehicle_attitude.add_own(block, lanes, lane, update)
    for a in range(kalman.ROWS):
        own = kind == kinds.WHEEL_SPEED
        update[kalman.R + a] = plan.speed_variance[s, a] if own else measurement[VARIANCE + a]
        update[kalman.RESIDUAL + a] = 0.0
    lent = vehicle.lent_matrix(state.blocks, plan.lenders[s])
    for i in range(first, last):
        member, j = state.rows[i // LANES], i % LANES
        z = kinds.residual(member, j, lent, measurement)
        for a in range(kalman.ROWS):
            member[bank.RESIDUAL + a * LANES + j] = z[a] if update[kalman.R + a] > 0.0 else 0.0
            update[kalman.RESIDUAL + a] += member[bank.WEIGHT + j] * member[bank.RESIDUAL + a * LANES + j]
    for a in range(kalman.ROWS):
        if not update[kalman.R + a] > 0.0:
            _leave_out(update, a)


@scalar_kernel
def _leave_out(update: Array, a: int) -> None:
    """Let nothing follow from a component."""
    update[kalman.R + a] = 1.0
    for k in range(LARGEST):
        update[kalman.H + a * LARGEST + k] = 0.0
    for k in range(kalman.ROWS):
        update[kalman.TURN + 3 * a + k] = 0.0


@scalar_kernel
def _measure_each(state: State, plan: Plan, work: Work) -> int:
    """Measure with every block that is not silent; return how many those are."""
    rows = 0
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] < 0.0:
            update = work.updates[s]
            measure_block(state, plan, work.measurement, s, update)
            kalman.gain(state.blocks[s], update, int(plan.settings[STRIDE]))
            work.residuals[rows, OWNER] = work.residuals[rows, UPDATE] = s
            rows += 1
    return rows


@scalar_kernel
def _measures(state: State, plan: Plan, s: int) -> bool:
    """Whether neither the block is silent nor the one that lends roll and pitch to it."""
    lender = plan.lenders[s]
    if lender >= 0 and state.silent[0, lender] >= 0.0:
        return False
    active: bool = state.silent[0, s] < 0.0
    return active


@scalar_kernel
def _add_design(state: State, plan: Plan, s: int, factor: float, update: Array, design: Array) -> None:
    """Add the design matrix of a block, and of the one that lends to it, times a factor to that of all states."""
    stride = int(plan.settings[STRIDE])
    for a in range(kalman.ROWS):
        for k in range(stride):
            design[a, s * stride + k] += factor * update[kalman.H + a * LARGEST + k]
    lender = plan.lenders[s]
    if lender >= 0:
        vehicle_attitude.write_lent(state.blocks, s, lender, update)
        for a in range(kalman.ROWS):
            for k in range(stride):
                design[a, lender * stride + k] += factor * update[kalman.LENT + a * LARGEST + k]


@scalar_kernel
def _measure_joint(state: State, plan: Plan, work: Work, further: Further) -> int:
    """Write design matrices in all states, residuals and variances of what is measured; return how many.

    That is the mean of what all blocks predict where the noise of a measurement is one, what each predicts where it has
    noise of its own, and otherwise the differences between them.
    """
    stride, how = int(plan.settings[STRIDE]), kinds.JOINED[int(work.measurement[KIND])]
    joint.gather(state.blocks, plan.spans.shape[0], state.joint, stride)
    rows, count, before = 0, 0, -1
    for s in range(plan.spans.shape[0]):
        count += _measures(state, plan, s)
    for s in range(plan.spans.shape[0]):
        if not _measures(state, plan, s):
            continue
        measure_block(state, plan, work.measurement, s, work.updates[s])
        if how == kinds.MEAN:
            if before < 0:
                _begin_row(work, further, 0, -1, s)
            _add_residual(work, 0, s, 1.0 / count)
            _add_design(state, plan, s, 1.0 / count, work.updates[s], further.designs[0])
            rows = 1
        elif how == kinds.EACH:
            _begin_row(work, further, rows, s, s)
            _add_residual(work, rows, s, 1.0)
            _add_design(state, plan, s, 1.0, work.updates[s], further.designs[rows])
            rows += 1
        else:
            if before >= 0:
                _begin_row(work, further, rows, -1, s)
                for one, sign in ((s, 1.0), (before, -1.0)):
                    _add_residual(work, rows, one, sign)
                    _add_design(state, plan, one, sign, work.updates[one], further.designs[rows])
                rows += 1
        before = s
    for row in range(rows):
        _gain_of_row(state, work, further, row)
    return rows


@scalar_kernel
def _begin_row(work: Work, further: Further, row: int, owner: int, s: int) -> None:
    """Begin a measurement with the variances that block s has for it."""
    for a in range(kalman.ROWS):
        for j in range(further.designs.shape[2]):
            further.designs[row, a, j] = 0.0
        work.residuals[row, Z + a] = 0.0
        work.residuals[row, R + a] = work.updates[s, kalman.R + a]
    work.residuals[row, OWNER], work.residuals[row, UPDATE] = owner, row


@scalar_kernel
def _add_residual(work: Work, row: int, s: int, factor: float) -> None:
    for a in range(kalman.ROWS):
        work.residuals[row, Z + a] += factor * work.updates[s, kalman.RESIDUAL + a]


@scalar_kernel
def _gain_of_row(state: State, work: Work, further: Further, row: int) -> None:
    """Write the gain of one measurement, and its residual and S into the work array of that number."""
    vectors, update = further.vectors, work.updates[row]
    variances = work.residuals[row, R : R + 3]
    joint.gain(further.designs[row], variances, state.joint, vectors[HP], vectors[K], update)
    for a in range(kalman.ROWS):
        update[kalman.RESIDUAL + a] = work.residuals[row, Z + a]


# --- whether it is believed -------------------------------------------------------------------------------------------


@scalar_kernel
def _record(work: Work, innovation: Array, rows: int) -> None:
    """Write the mean residual and its variance over what was measured, and the mean NIS."""
    for a in range(NIS + 1):
        innovation[a] = 0.0
    for row in range(rows):
        update = work.updates[int(work.residuals[row, UPDATE])]
        for a in range(kalman.ROWS):
            innovation[a] += update[kalman.RESIDUAL + a] / rows
            innovation[3 + a] += update[kalman.S + 4 * a] / rows
        innovation[NIS] += kalman.normalized_innovation_squared(update) / rows
    for a in range(kalman.ROWS):
        work.noise[a] = work.measurement[VARIANCE + a]


@scalar_kernel
def _uses_other_noise(state: State, plan: Plan, work: Work, innovation: Array) -> bool:
    """Whether a receiver is noisier than it states; its measurement then has the variances that were found."""
    if int(work.measurement[KIND]) != kinds.GNSS_POSITION or plan.settings[GATE_LIMIT] == math.inf:
        return False
    found: bool = receiver.use_noise(state.scalars, work.measurement, innovation)
    return found


@scalar_kernel
def _decide(state: State, plan: Plan, work: Work, rows: int, innovation: Array) -> int:
    """Return what becomes of a measurement, whose variances are raised if it weighs less."""
    kind, scalars, limit = int(work.measurement[KIND]), state.scalars, plan.settings[GATE_LIMIT]
    if kind == kinds.GNSS_POSITION:
        limit *= receiver.disagreement(scalars)
    # a receiver that has just been wrong gets no benefit of the doubt
    if kind == kinds.GNSS_POSITION and scalars[RECEIVER + receiver.DOUBTS] > 0.0:
        passes = innovation[NIS] <= min(1.0, receiver.WARY_LIMIT / plan.settings[GATE_LIMIT]) * limit
    else:
        passes = innovation[NIS] <= limit or _passes_with_caution(work, rows, limit)
    if kind != kinds.GNSS_POSITION:
        if passes or (kind == kinds.WHEEL_SPEED and scalars[TIME] <= scalars[SLIP_TRUSTED]):
            return ACCEPTED
        if not kinds.DEWEIGHTS[kind]:
            return REJECTED
        receiver.doubt(work.measurement, innovation, False)
        return DEWEIGHTED
    if plan.settings[GATE_LIMIT] == math.inf:
        return ACCEPTED
    noisy = innovation[receiver.NOISE] > 1.0
    of_series = receiver.is_of_series(scalars, innovation)
    if passes and (noisy or not of_series):
        scalars[RECEIVER + receiver.SERIES] = 0.0
        scalars[RECEIVER + receiver.DOUBTS] = max(0.0, scalars[RECEIVER + receiver.DOUBTS] - 1.0)
        receiver.note_believed(scalars, innovation, innovation[NIS])
        return ACCEPTED
    if scalars[RECEIVER + receiver.SERIES] == 0.0:
        scalars[RECEIVER + receiver.FIRST] = scalars[TIME]
    scalars[RECEIVER + receiver.DOUBTS] = min(receiver.MOST_DOUBTS, scalars[RECEIVER + receiver.DOUBTS] + 1.0)
    scalars[RECEIVER + receiver.SPEED_VARIANCE] = 0.0
    if not of_series:
        receiver.begin_series(scalars, innovation)
    if (of_series and receiver.has_lasted(scalars)) or receiver.is_locked_out(scalars, innovation):
        scalars[RECEIVER + receiver.SERIES] = scalars[RECEIVER + receiver.DOUBTS] = 0.0
        receiver.note_reset(scalars, innovation)
        return RESET
    receiver.doubt(work.measurement, innovation, of_series)
    return DEWEIGHTED


@scalar_kernel
def _note(state: State, work: Work, innovation: Array, status: int) -> None:
    """Note what a position leaves of its innovation."""
    if int(work.measurement[KIND]) != kinds.GNSS_POSITION:
        return
    receiver.note_update(state.scalars, work.measurement, innovation, work.noise)
    if status == RESET:
        for a in range(kalman.ROWS):
            state.scalars[RECEIVER + receiver.AFTER + a] = 0.0
            state.scalars[RECEIVER + receiver.SPREAD + a] = work.noise[a]


@scalar_kernel
def _passes_with_caution(work: Work, rows: int, limit: float) -> bool:
    cautious = 0.0
    for row in range(rows):
        cautious += kalman.cautious_innovation_squared(work.updates[int(work.residuals[row, UPDATE])], CAUTION)
    passes: bool = cautious <= limit * rows
    return passes


@scalar_kernel
def _reset_each(state: State, plan: Plan, work: Work, rows: int) -> None:
    """Set the position of every block to what is measured, and how sure it is; nothing else follows from it."""
    for row in range(rows):
        s = int(work.residuals[row, OWNER])
        _forget(state, plan, work, state.blocks[s])
        _shift(state, plan, s, work.updates[s, kalman.RESIDUAL : kalman.RESIDUAL + 3], work.noise)
    if plan.settings[TOGETHER] != 0.0:
        _forget(state, plan, work, state.blocks[-1])
    update_derived(state, plan, work)


@scalar_kernel
def _forget(state: State, plan: Plan, work: Work, block: Array) -> None:
    """Let a block be as sure of its position as what it is set to, and of its velocity as the receiver has shown."""
    stride, speed_variance = int(plan.settings[STRIDE]), state.scalars[RECEIVER + receiver.SPEED_VARIANCE]
    covariance.complete(block, stride)
    for a in range(kalman.ROWS):
        if work.noise[a] > 0.0:
            covariance.begin_anew(block, a, work.noise[a], stride)
    for a in range(3, 6):
        if speed_variance > 0.0:
            covariance.begin_anew(block, a, speed_variance, stride)


@scalar_kernel
def _reset_joint(state: State, plan: Plan, work: Work, further: Further) -> None:
    """Set the mean position of joined blocks to what is measured; all are then off by the error that it has."""
    stride, size = int(plan.settings[STRIDE]), state.joint.shape[0]
    for a in range(kalman.ROWS):
        if not work.noise[a] > 0.0:
            continue
        for i in range(a, size, stride):
            for j in range(size):
                state.joint[i, j] = 0.0
                state.joint[j, i] = 0.0
        for i in range(a, size, stride):
            for j in range(a, size, stride):
                state.joint[i, j] = work.noise[a] * (1.0 + OWN_SHARE * (i == j))
    speed_variance = state.scalars[RECEIVER + receiver.SPEED_VARIANCE]
    for a in range(3, 6):
        if speed_variance > 0.0:
            for i in range(a, size, stride):
                for j in range(size):
                    state.joint[i, j] = 0.0
                    state.joint[j, i] = 0.0
                state.joint[i, i] = speed_variance
    joint.scatter(state.blocks, plan.spans.shape[0], state.joint, stride)
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] < 0.0:
            _shift(state, plan, s, work.residuals[0, Z : Z + 3], work.noise)
    update_derived(state, plan, work)


@scalar_kernel
def _shift(state: State, plan: Plan, s: int, residual: Array, noise: Array) -> None:
    """Move the members of a block by what is measured of it."""
    for i in range(plan.spans[s, 0], plan.spans[s, 1]):
        lanes, lane = state.rows[i // LANES], i % LANES
        for k in range(bank.STATES):
            lanes[bank.CORRECTION + k * LANES + lane] = 0.0
        for a in range(kalman.ROWS):
            if noise[a] > 0.0:
                lanes[bank.CORRECTION + a * LANES + lane] = residual[a]
    feed_back(state, plan, s)


# --- what it corrects -------------------------------------------------------------------------------------------------


@scalar_kernel
def _correct_each(state: State, plan: Plan, work: Work) -> None:
    """Correct each member by its own residual times the gain of its block, dx = K z, paper A (11).

    Where members are compared with their mean all are corrected by its residual.
    """
    alike = state.deviations.shape[0] > 0
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] >= 0.0:
            continue
        update = work.updates[s]
        kalman.update_covariance(state.blocks[s], update, int(plan.settings[STRIDE]))
        for i in range(plan.spans[s, 0], plan.spans[s, 1]):
            member_correction(state.rows[i // LANES], i % LANES, update, int(plan.settings[STRIDE]), alike)
        feed_back(state, plan, s)
    if plan.settings[TOGETHER] != 0.0:
        together.correct(state, plan, work)
    update_derived(state, plan, work)


@scalar_kernel
def member_correction(lanes: Array, lane: int, update: Array, stride: int, alike: bool) -> None:
    """Write K z of one member, whose residual is its own, or that of all together."""
    r = bank.RESIDUAL + lane
    z0, z1, z2 = lanes[r], lanes[r + LANES], lanes[r + 2 * LANES]
    if alike:
        z0, z1, z2 = update[kalman.RESIDUAL], update[kalman.RESIDUAL + 1], update[kalman.RESIDUAL + 2]
    for k in range(min(stride, bank.STATES)):
        n = kalman.K + kalman.ROWS * k
        lanes[bank.CORRECTION + k * LANES + lane] = update[n] * z0 + update[n + 1] * z1 + update[n + 2] * z2


@scalar_kernel
def _correct_joint(state: State, plan: Plan, work: Work, further: Further, rows: int) -> None:
    """Apply the measurements of one event, all made at the same states, one after the other.

    Each residual is less what the corrections before it explain.
    """
    stride, vectors = int(plan.settings[STRIDE]), further.vectors
    size = state.joint.shape[0]
    further.correction[:] = 0.0
    for b in range(state.rows.shape[0]):
        state.rows[b, bank.CORRECTION : bank.CORRECTION + bank.STATES * LANES] = 0.0
    for row in range(rows):
        for a in range(kalman.ROWS):
            for j in range(size):
                work.residuals[row, Z + a] -= further.designs[row, a, j] * further.correction[j]
        _gain_of_row(state, work, further, row)
        for s in range(plan.spans.shape[0]):
            if state.silent[0, s] >= 0.0:
                vectors[K, :, s * stride : (s + 1) * stride] = 0.0
        variances = work.residuals[row, R : R + 3]
        design = further.designs[row]
        joint.update_covariance(design, variances, state.joint, vectors[HP], vectors[K], vectors[AH])
        _add_corrections(state, plan, further, work.residuals[row])
    joint.scatter(state.blocks, plan.spans.shape[0], state.joint, stride)
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] < 0.0:
            feed_back(state, plan, s)
    update_derived(state, plan, work)


@scalar_kernel
def _add_corrections(state: State, plan: Plan, further: Further, residual: Array) -> None:
    """Add K z to the corrections of all members; those of the block that measured differ from its mean by their own."""
    k, z, stride = further.vectors[K], residual[Z : Z + 3], int(plan.settings[STRIDE])
    for j in range(further.correction.shape[0]):
        further.correction[j] += k[0, j] * z[0] + k[1, j] * z[1] + k[2, j] * z[2]
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] >= 0.0:
            continue
        first, last = plan.spans[s, 0], plan.spans[s, 1]
        own = residual[OWNER] == s and last - first > 1
        m0, m1, m2 = 0.0, 0.0, 0.0
        if own:
            for i in range(first, last):
                lanes, r = state.rows[i // LANES], bank.RESIDUAL + i % LANES
                weight = lanes[bank.WEIGHT + i % LANES]
                m0, m1, m2 = m0 + weight * lanes[r], m1 + weight * lanes[r + LANES], m2 + weight * lanes[r + 2 * LANES]
        for i in range(first, last):
            lanes, lane = state.rows[i // LANES], i % LANES
            z0, z1, z2 = z[0], z[1], z[2]
            if own:
                r = bank.RESIDUAL + lane
                z0, z1, z2 = z0 + lanes[r] - m0, z1 + lanes[r + LANES] - m1, z2 + lanes[r + 2 * LANES] - m2
            for n in range(min(stride, bank.STATES)):
                j = s * stride + n
                lanes[bank.CORRECTION + n * LANES + lane] += k[0, j] * z0 + k[1, j] * z1 + k[2, j] * z2


@scalar_kernel
def feed_back(state: State, plan: Plan, s: int) -> None:
    """Apply the correction of each member of a block to its state."""
    block = state.blocks[s]
    metres = block[covariance.METRIC : covariance.METRIC + 3]
    place = block[covariance.POSITION : covariance.POSITION + 3]
    earth.metric(place, state.scalars[EARTH] != 0.0, metres)
    count = min(int(plan.settings[STRIDE]), bank.STATES)
    fuse.correct_members(state.rows, plan.spans[s, 0], plan.spans[s, 1], metres, count)


@scalar_kernel
def update_derived(state: State, plan: Plan, work: Work) -> None:
    """Bring everything that follows from the navigation states up to date."""
    for b in range(state.rows.shape[0]):
        strapdown.update_matrix(state.rows[b])
        strapdown.update_sensitivity(state.rows[b])
    for s in range(plan.spans.shape[0]):
        first, last = plan.spans[s, 0], plan.spans[s, 1]
        fuse.fuse_states(state.rows, first, last, state.blocks[s], work.sums[s], state.scalars[INTERVAL])
    vehicle.merge(state.rows, state.blocks, plan.spans, plan.lenders)
