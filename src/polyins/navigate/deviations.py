"""How IMUs of one block deviate from their mean: the covariance of it, comparisons, and which of them do not count.

Alike IMUs err by x_i = m + d_i, of which the mean m has covariance M, the block's, and the deviations have

    Cov(d_i) = (1 - 1/N) D,    Cov(d_i, d_j) = -D / N,    Cov(m, d_i) = 0

Own noise drives D as that of one IMU does and M by 1/N; what they have in common drives M alone. A measurement from
outside corrects all by the same, and so the mean only; a comparison with the mean, position, velocity and attitude at
the point of the block, corrects deviations only. Both stay independent, and together they are the filter of all N
states at once. See docs/theory.
"""

from __future__ import annotations

import math

from polyins.kernels import bank, covariance, earth, kalman, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.covariance import INERTIAL, LARGEST, NAV, RATE, P
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place
from polyins.navigate import update
from polyins.navigate.state import (
    ADAPTS,
    COMMON_SHARE,
    COMPARED_EVERY,
    EARTH,
    EXCLUDES,
    HELD,
    INTERVAL,
    LEAPT,
    LEFT_OUT,
    STRIDE,
    Plan,
    State,
    Work,
)

SCALES, TURNED = place("gyro_scale"), place("speed_scale")
"""in D, that of a speed and those of a mount stand for how the axes of an IMU lie against those of the mean"""
ATTITUDE = 2
"""the third group of three"""
COMPARED = 9
"""numbers that are compared of each IMU: position, velocity, attitude"""
SHORT, LONG = 0.5, 10.0
"""s over which what IMUs deviate by is averaged, besides the newest"""
MOST = 25.0
"""times what the others deviate by in the middle, squared, from which on an IMU does not count"""
MOST_OF_FEW = 32.0
"""the same of fewer than `FEW` IMUs, of which the middle says little"""
FEW = 6
AGREEING = 3.0
"""times the same, below which an IMU that does not count agrees"""
PATIENCE = 30.0
"""s that it agrees for until it counts again"""
LOST = 1e6
"""squared whitened deviation from which on an IMU is put where the mean is"""
ADAPTED_IN = 60.0
"""s in which the scale of the own noise follows"""
FASTEST_GROWTH = 4.0
"""of the scale, at most asked for by one comparison"""

LEAP_TURN, LEAP_CHANGE = 0.002, 0.2
"""rad, m/s, by which one IMU moves the mean in an epoch: then all are compared at once"""
TOLD = 3
"""of `scalars[LEFT_OUT]`: whether something is yet to be told"""

WHO, STATISTIC, GROUP, BACK, SCALE, SQUARE = range(6)
"""places in a row of `Outputs.innovations`: the lane that counts no more, or -1; by how much over the limit; whether
position, velocity or attitude; the lane that counts again, or -1; the scale of the own noise; and the mean square of
the deviations over what is expected"""


@scalar_kernel
def share_noise(state: State, plan: Plan, s: int) -> None:
    """Tell a block and its deviations the noise of members of which those with a weight count."""
    block, own, stride = state.blocks[s], state.deviations[s], int(plan.settings[STRIDE])
    covariance.complete(block, stride)
    covariance.complete(own, stride)
    common = plan.settings[COMMON_SHARE]
    alone = (1.0 - common) * block[covariance.OWN_SCALE]
    together = common + alone / block[covariance.MEMBERS]
    for k in range(covariance.NOISES):
        own[k] = alone * plan.noise[s, k]
        # what drives the offsets of other sensors is not of the IMUs
        if plan.noise[s, k] != 0.0:
            block[k] = together * plan.noise[s, k]


@scalar_kernel
def drive(state: State, model: Array, s: int, dt: float) -> None:
    """Make the error model of a block, just written, that of its deviations, which have noise of their own."""
    block, own = state.blocks[s], state.deviations[s]
    for k in range(RATE - covariance.MATRIX + 6):
        own[covariance.MATRIX + k] = block[covariance.MATRIX + k]
    covariance.noise_terms(own, model, dt)


@scalar_kernel
def recount(state: State, plan: Plan, s: int, count: int) -> None:
    """Note that another number of members counts: M <- M + (1/n - 1/N) D if fewer do.

    Where more do M stays: what those that come back have in common with the others is not remembered, and M lies
    between what it would be with all of it and with nothing.
    """
    block, own, stride = state.blocks[s], state.deviations[s], int(plan.settings[STRIDE])
    covariance.complete(block, stride)
    covariance.complete(own, stride)
    more = 1.0 / count - 1.0 / block[covariance.MEMBERS]
    if more > 0.0:
        # what D has beyond is how axes lie, where M has other states
        for i in range(INERTIAL):
            for j in range(INERTIAL):
                block[P + i * stride + j] += more * own[P + i * stride + j]
    block[covariance.MEMBERS] = count
    share_noise(state, plan, s)


@scalar_kernel
def variance(state: State, plan: Plan, s: int, k: int) -> float:
    """Return the variance of a state of one member of a block."""
    stride = int(plan.settings[STRIDE])
    total: float = covariance.variance(state.blocks[s], k, stride)
    if state.deviations.shape[0] > 0 and plan.spans[s, 1] - plan.spans[s, 0] > 1 and k < INERTIAL:
        total += (1.0 - 1.0 / state.blocks[s, covariance.MEMBERS]) * covariance.variance(state.deviations[s], k, stride)
    return total


# --- comparisons ------------------------------------------------------------------------------------------------------


@scalar_kernel
def compare(state: State, plan: Plan, work: Work, innovation: Array) -> bool:
    """Compare the members of each block with their mean, judge them, and correct what they deviate by.

    Returns whether there is a block whose members can be compared.
    """
    innovation[WHO] = innovation[BACK] = -1.0
    told = state.scalars[LEFT_OUT : LEFT_OUT + TOLD + 1]
    if told[TOLD] != 0.0:
        for k in range(TOLD):
            innovation[k] = told[k]
        told[TOLD] = 0.0
    some = False
    for s in range(plan.spans.shape[0]):
        if plan.spans[s, 1] - plan.spans[s, 0] > 1 and state.silent[0, s] < 0.0:
            some = True
            _compare_block(state, plan, work, s, innovation, True)
    if some:
        update.update_derived(state, plan, work)
    return some


@scalar_kernel
def compare_at_leap(state: State, plan: Plan, work: Work) -> None:
    """Compare at once after a leap; who is left out for it is told with the next comparison that is due."""
    state.scalars[LEAPT] = 0.0
    told = state.scalars[LEFT_OUT : LEFT_OUT + TOLD + 1]
    if told[TOLD] != 0.0:
        return
    work.told[WHO] = -1.0
    for s in range(plan.spans.shape[0]):
        if plan.spans[s, 1] - plan.spans[s, 0] > 1 and state.silent[0, s] < 0.0:
            _compare_block(state, plan, work, s, work.told, False)
    update.update_derived(state, plan, work)
    if work.told[WHO] >= 0.0:
        for k in range(TOLD):
            told[k] = work.told[k]
        told[TOLD] = 1.0


@scalar_kernel
def _compare_block(state: State, plan: Plan, work: Work, s: int, innovation: Array, due: bool) -> None:
    first, last, stride = plan.spans[s, 0], plan.spans[s, 1], int(plan.settings[STRIDE])
    own, gains = state.deviations[s], work.updates[s]
    _write_deviations(state, plan, s)
    for group in range(3):
        kalman.clear(gains)
        for a in range(kalman.ROWS):
            gains[kalman.H + a * LARGEST + kalman.ROWS * group + a] = 1.0
            gains[kalman.R + a] = plan.settings[HELD + group]
            for k in range(kalman.ROWS if group == ATTITUDE else 0):
                gains[kalman.H + a * LARGEST + TURNED + k] = state.blocks[s, covariance.MATRIX + 3 * a + k]
        kalman.gain(own, gains, stride)
        for i in range(first, last):
            _correct_by(state.rows[i // LANES], i % LANES, group, gains, stride)
        kalman.update_covariance(own, gains, stride)
    _judge(state, plan, s, innovation, due)
    _apply(state, plan, s)
    update.feed_back(state, plan, s)


@scalar_kernel
def _write_deviations(state: State, plan: Plan, s: int) -> None:
    """Write by how much position, velocity and attitude of each member differ from the mean, and no correction."""
    block = state.blocks[s]
    metres = block[covariance.METRIC : covariance.METRIC + 3]
    earth.metric(block[covariance.POSITION : covariance.POSITION + 3], state.scalars[EARTH] != 0.0, metres)
    c = vehicle.matrix_at(block, covariance.MATRIX)
    first, last = plan.spans[s, 0], plan.spans[s, 1]
    _centre(state, first, last, bank.AXES, 3)
    for i in range(first, last):
        lanes, lane = state.rows[i // LANES], i % LANES
        for k in range(3):
            position = lanes[bank.POINT_POSITION + k * LANES + lane] - block[covariance.POSITION + k]
            lanes[bank.DEVIATION + k * LANES + lane] = position * metres[k]
            velocity = lanes[bank.POINT_VELOCITY + k * LANES + lane] - block[covariance.VELOCITY + k]
            lanes[bank.DEVIATION + (3 + k) * LANES + lane] = velocity
        # C of the mean times C' of the member is I + phi x, phi that of the member less that of the mean
        m = vehicle.lane_matrix(lanes, bank.MATRIX + lane)
        phi = (
            0.5 * (_product(c, m, 2, 1) - _product(c, m, 1, 2)),
            0.5 * (_product(c, m, 0, 2) - _product(c, m, 2, 0)),
            0.5 * (_product(c, m, 1, 0) - _product(c, m, 0, 1)),
        )
        turned = vehicle.rotated(c, *_three(lanes, bank.AXES, lane))
        for k in range(3):
            lanes[bank.DEVIATION + (6 + k) * LANES + lane] = phi[k] - turned[k]
        for k in range(bank.STATES):
            lanes[bank.CORRECTION + k * LANES + lane] = 0.0
    # so that no correction moves the mean, not by what is of second order in the deviations either
    _centre(state, first, last, bank.DEVIATION, COMPARED)


@scalar_kernel
def _centre(state: State, first: int, last: int, begin: int, count: int) -> None:
    """Take from so many numbers, from an offset on, their mean over the members that count."""
    for k in range(count):
        field, mean = begin + k * LANES, 0.0
        for i in range(first, last):
            lanes = state.rows[i // LANES]
            mean += lanes[bank.WEIGHT + i % LANES] * lanes[field + i % LANES]
        for i in range(first, last):
            state.rows[i // LANES, field + i % LANES] -= mean


@scalar_kernel
def _product(a: vehicle.Matrix, b: vehicle.Matrix, i: int, j: int) -> float:
    """Return an element of A B'."""
    return a[3 * i] * b[3 * j] + a[3 * i + 1] * b[3 * j + 1] + a[3 * i + 2] * b[3 * j + 2]


@scalar_kernel
def _correct_by(lanes: Array, lane: int, group: int, gains: Array, stride: int) -> None:
    """Add K nu to the correction of a member, and leave nu whitened where it was.

    nu is the deviation less what the groups before it explain.
    """
    d, x = bank.DEVIATION + kalman.ROWS * group * LANES + lane, bank.CORRECTION + kalman.ROWS * group * LANES + lane
    n0 = lanes[d] - lanes[x]
    n1 = lanes[d + LANES] - lanes[x + LANES]
    n2 = lanes[d + 2 * LANES] - lanes[x + 2 * LANES]
    if group == ATTITUDE:
        t0, t1, t2 = _three(lanes, bank.CORRECTION + TURNED * LANES, lane)
        h = kalman.H + TURNED
        n0 -= gains[h] * t0 + gains[h + 1] * t1 + gains[h + 2] * t2
        n1 -= gains[h + LARGEST] * t0 + gains[h + LARGEST + 1] * t1 + gains[h + LARGEST + 2] * t2
        n2 -= gains[h + 2 * LARGEST] * t0 + gains[h + 2 * LARGEST + 1] * t1 + gains[h + 2 * LARGEST + 2] * t2
    for k in range(min(stride, bank.STATES)):
        n = kalman.K + kalman.ROWS * k
        lanes[bank.CORRECTION + k * LANES + lane] += gains[n] * n0 + gains[n + 1] * n1 + gains[n + 2] * n2
    # S = L L'
    l00 = math.sqrt(gains[kalman.S])
    l10, l20 = gains[kalman.S + 3] / l00, gains[kalman.S + 6] / l00
    l11 = math.sqrt(gains[kalman.S + 4] - l10 * l10)
    l21 = (gains[kalman.S + 7] - l20 * l10) / l11
    l22 = math.sqrt(gains[kalman.S + 8] - l20 * l20 - l21 * l21)
    w0 = n0 / l00
    w1 = (n1 - l10 * w0) / l11
    lanes[d], lanes[d + LANES] = w0, w1
    lanes[d + 2 * LANES] = (n2 - l20 * w0 - l21 * w1) / l22


@scalar_kernel
def _apply(state: State, plan: Plan, s: int) -> None:
    """Turn corrections of the point into those of each member, which sits l from it, and apply them.

    dr = dr_p - (C l) x phi,  dv = dv_p - (C (w x l)) x phi - C (b_g x l)
    """
    interval = state.scalars[INTERVAL]
    for i in range(plan.spans[s, 0], plan.spans[s, 1]):
        lanes, lane = state.rows[i // LANES], i % LANES
        c = vehicle.lane_matrix(lanes, bank.MATRIX + lane)
        lx, ly, lz = _three(lanes, bank.TO_POINT, lane)
        px, py, pz = _three(lanes, bank.CORRECTION + 6 * LANES, lane)
        bx, by, bz = _three(lanes, bank.CORRECTION + NAV * LANES, lane)
        wx, wy, wz = _three(lanes, bank.DTHETA, lane)
        moved = vehicle.cross(*vehicle.rotated(c, lx, ly, lz), px, py, pz)
        spun = vehicle.cross(wx / interval, wy / interval, wz / interval, lx, ly, lz)
        turned = vehicle.cross(*vehicle.rotated(c, spun[0], spun[1], spun[2]), px, py, pz)
        of_bias = vehicle.cross(bx, by, bz, lx, ly, lz)
        biased = vehicle.rotated(c, of_bias[0], of_bias[1], of_bias[2])
        for k in range(3):
            lanes[bank.CORRECTION + k * LANES + lane] -= moved[k]
            lanes[bank.CORRECTION + (3 + k) * LANES + lane] -= turned[k] + biased[k]
            lanes[bank.AXES + k * LANES + lane] += lanes[bank.CORRECTION + (TURNED + k) * LANES + lane]
        for k in range(TURNED, bank.STATES):
            lanes[bank.CORRECTION + k * LANES + lane] = 0.0


@scalar_kernel
def _three(lanes: Array, field: int, lane: int) -> vehicle.Three:
    return lanes[field + lane], lanes[field + LANES + lane], lanes[field + 2 * LANES + lane]


# --- judgement --------------------------------------------------------------------------------------------------------


@scalar_kernel
def _judge(state: State, plan: Plan, s: int, innovation: Array, due: bool) -> None:
    """Find who deviates by more than the others do, in the newest comparison and in two means over more of them.

    One that is not due, after a leap, stands for itself: means and times are of those that come at an even interval.
    """
    first, last, block = plan.spans[s, 0], plan.spans[s, 1], state.blocks[s]
    counting = _counting(state, first, last)
    square = _mean_square(state, first, last, counting)
    if due:
        _remember(state, first, last, plan.settings[COMPARED_EVERY])
        block[covariance.COMPARISONS] += 1.0
    suspected = _suspect(state, plan, s, counting, 3 if due else 1, innovation)
    for i in range(first, last):
        if state.rows[i // LANES, bank.EXCLUDED + i % LANES] != 0.0:
            _keep(block, state.rows[i // LANES], i % LANES)
            if due:
                _consider(state, plan, s, i, counting - suspected, innovation)
    _weigh(state, plan, s)
    if due and not suspected and plan.settings[ADAPTS] != 0.0:
        _adapt(state, plan, s, square)
    innovation[SCALE], innovation[SQUARE] = block[covariance.OWN_SCALE], square


@scalar_kernel
def _suspect(state: State, plan: Plan, s: int, counting: int, lengths: int, innovation: Array) -> bool:
    """Leave out the worst if it deviates by too much; one in a comparison, so that each is on record."""
    first, last = plan.spans[s, 0], plan.spans[s, 1]
    if plan.settings[EXCLUDES] == 0.0 or innovation[WHO] >= 0.0 or counting <= (last - first) // 2 + 1:
        return False
    interval, comparisons = plan.settings[COMPARED_EVERY], state.blocks[s, covariance.COMPARISONS]
    for length in range(lengths):
        i = _worst(state, first, last, length)
        over = _over(state, first, last, length, i, counting, _spread(length, interval, comparisons))
        if over > 1.0:
            _note(state.rows[i // LANES], i, length, over, innovation)
            _leave_out(state, first, last, i, counting)
            return True
    return False


@scalar_kernel
def _remember(state: State, first: int, last: int, interval: float) -> None:
    """Take the newest deviations into the means over more of them."""
    short, long = 1.0 - math.exp(-interval / SHORT), 1.0 - math.exp(-interval / LONG)
    for i in range(first, last):
        lanes, lane = state.rows[i // LANES], i % LANES
        for k in range(COMPARED):
            newest = lanes[bank.DEVIATION + k * LANES + lane]
            f = bank.DEVIATION + (COMPARED + k) * LANES + lane
            lanes[f] += short * (newest - lanes[f])
            f += COMPARED * LANES
            lanes[f] += long * (newest - lanes[f])


@scalar_kernel
def _spread(length: int, interval: float, comparisons: float) -> float:
    """Return the variance of each number of a mean of white ones of variance 1, which began at zero."""
    if length == 0:
        return 1.0
    kept = math.exp(-interval / (SHORT if length == 1 else LONG))
    spread: float = (1.0 - kept) / (1.0 + kept) * (1.0 - kept ** (2.0 * comparisons))
    return spread


@scalar_kernel
def _counting(state: State, first: int, last: int) -> int:
    count = 0
    for i in range(first, last):
        count += state.rows[i // LANES, bank.WEIGHT + i % LANES] > 0.0
    return count


@scalar_kernel
def _square(lanes: Array, lane: int, length: int) -> float:
    total = 0.0
    for k in range(COMPARED):
        u = lanes[bank.DEVIATION + (COMPARED * length + k) * LANES + lane]
        total += u * u
    return total


@scalar_kernel
def _mean_square(state: State, first: int, last: int, counting: int) -> float:
    """Return the mean square of the newest deviations over what is expected."""
    total = 0.0
    for i in range(first, last):
        if state.rows[i // LANES, bank.WEIGHT + i % LANES] > 0.0:
            total += _square(state.rows[i // LANES], i % LANES, 0)
    return total / (COMPARED * max(counting - 1, 1))


@scalar_kernel
def _worst(state: State, first: int, last: int, length: int) -> int:
    worst, largest = first, -1.0
    for i in range(first, last):
        square = _square(state.rows[i // LANES], i % LANES, length)
        if state.rows[i // LANES, bank.WEIGHT + i % LANES] > 0.0 and not square <= largest:
            worst, largest = i, square
    return worst


@scalar_kernel
def _over(state: State, first: int, last: int, length: int, worst: int, counting: int, spread: float) -> float:
    """Return by how much the worst deviates over the limit, which is a multiple of what the others do without it."""
    limit = MOST_OF_FEW if last - first < FEW else MOST
    own = _square(state.rows[worst // LANES], worst % LANES, length) / ((1.0 - 1.0 / counting) * spread)
    if not own > limit * COMPARED:
        return own / (limit * COMPARED)
    share = 1.0 / (counting - 1)
    for i in range(first, last):
        lanes, lane, total = state.rows[i // LANES], i % LANES, 0.0
        for k in range(COMPARED):
            f = bank.DEVIATION + (COMPARED * length + k) * LANES
            u = lanes[f + lane] + share * state.rows[worst // LANES, f + worst % LANES]
            total += u * u
        lanes[bank.OFFSET + lane] = total / ((1.0 - share) * spread)
    return own / (limit * max(float(COMPARED), _middle(state, first, last, worst, (counting - 1) // 2)))


@scalar_kernel
def _middle(state: State, first: int, last: int, worst: int, rank: int) -> float:
    """Return the number of that rank, from 0 on, among those of `_over` of all that count but the worst."""
    for i in range(first, last):
        if i == worst or not state.rows[i // LANES, bank.WEIGHT + i % LANES] > 0.0:
            continue
        own: float = state.rows[i // LANES, bank.OFFSET + i % LANES]
        below, same = 0, 0
        for j in range(first, last):
            if j != worst and state.rows[j // LANES, bank.WEIGHT + j % LANES] > 0.0:
                below += state.rows[j // LANES, bank.OFFSET + j % LANES] < own
                same += state.rows[j // LANES, bank.OFFSET + j % LANES] == own
        if below <= rank < below + same:
            return own
    return 0.0


@scalar_kernel
def _note(lanes: Array, i: int, length: int, over: float, innovation: Array) -> None:
    """Write who counts no more, and of what it deviates most."""
    innovation[WHO], innovation[STATISTIC] = i, over
    largest = -1.0
    for group in range(3):
        total = 0.0
        for k in range(kalman.ROWS):
            u = lanes[bank.DEVIATION + (COMPARED * length + kalman.ROWS * group + k) * LANES + i % LANES]
            total += u * u
        if total > largest:
            largest = total
            innovation[GROUP] = group


@scalar_kernel
def _leave_out(state: State, first: int, last: int, worst: int, counting: int) -> None:
    """Let an IMU count no more: the others deviate from a mean without it, and so do what corrects them."""
    gone, lane = state.rows[worst // LANES], worst % LANES
    gone[bank.WEIGHT + lane], gone[bank.EXCLUDED + lane], gone[bank.AGREED + lane] = 0.0, 1.0, 0.0
    share = 1.0 / (counting - 1)
    for i in range(first, last):
        if i != worst:
            lanes = state.rows[i // LANES]
            for k in range(3 * COMPARED):
                f = bank.DEVIATION + k * LANES
                lanes[f + i % LANES] += share * gone[f + lane]
            for k in range(bank.STATES):
                f = bank.CORRECTION + k * LANES
                lanes[f + i % LANES] += share * gone[f + lane]
    for k in range(3 * COMPARED):
        gone[bank.DEVIATION + k * LANES + lane] *= 1.0 + share
    for k in range(bank.STATES):
        gone[bank.CORRECTION + k * LANES + lane] *= 1.0 + share


@scalar_kernel
def _consider(state: State, plan: Plan, s: int, i: int, counting: int, innovation: Array) -> None:
    """Let an IMU that was left out count again when it has agreed for a while."""
    lanes, lane, interval = state.rows[i // LANES], i % LANES, plan.settings[COMPARED_EVERY]
    largest = 0.0
    for length in range(3):
        spread = _spread(length, interval, state.blocks[s, covariance.COMPARISONS])
        largest = max(largest, _square(lanes, lane, length) / ((1.0 + 1.0 / counting) * spread))
    lanes[bank.AGREED + lane] = lanes[bank.AGREED + lane] + interval if largest < AGREEING * COMPARED else 0.0
    if lanes[bank.AGREED + lane] >= PATIENCE and innovation[BACK] < 0.0:
        lanes[bank.EXCLUDED + lane] = 0.0
        lanes[bank.WEIGHT + lane] = 1.0 / (counting + 1)
        innovation[BACK] = i


@scalar_kernel
def _keep(block: Array, lanes: Array, lane: int) -> None:
    """Keep an IMU that was left out with the others.

    What is wrong with it is no scale: as one it would grow without bounds where a gyro is stuck.
    """
    for k in range(SCALES, bank.STATES):
        lanes[bank.CORRECTION + k * LANES + lane] = 0.0
    if not _square(lanes, lane, 0) < LOST:
        _join_mean(block, lanes, lane)


@scalar_kernel
def _join_mean(block: Array, lanes: Array, lane: int) -> None:
    """Give an IMU position, velocity and attitude of the mean, as seen from where it is."""
    c = vehicle.matrix_at(block, covariance.MATRIX)
    vehicle.put_attitude(lanes, lane, c)
    lx, ly, lz = _three(lanes, bank.TO_POINT, lane)
    wx, wy, wz = block[covariance.RATE], block[covariance.RATE + 1], block[covariance.RATE + 2]
    arm = vehicle.rotated(c, lx, ly, lz)
    spun = vehicle.cross(wx, wy, wz, lx, ly, lz)
    swept = vehicle.rotated(c, spun[0], spun[1], spun[2])
    for k in range(3):
        lanes[bank.POSITION + k * LANES + lane] = block[covariance.POSITION + k] - arm[k] / block[covariance.METRIC + k]
        lanes[bank.AXES + k * LANES + lane] = 0.0
        lanes[bank.VELOCITY + k * LANES + lane] = block[covariance.VELOCITY + k] - swept[k]
    for k in range(bank.STATES):
        lanes[bank.CORRECTION + k * LANES + lane] = 0.0
    for k in range(3 * COMPARED):
        lanes[bank.DEVIATION + k * LANES + lane] = math.sqrt(LOST)


@scalar_kernel
def _weigh(state: State, plan: Plan, s: int) -> None:
    """Let those members that count weigh the same."""
    first, last = plan.spans[s, 0], plan.spans[s, 1]
    counting = _counting(state, first, last)
    if counting == state.blocks[s, covariance.MEMBERS]:
        return
    for i in range(first, last):
        lanes, lane = state.rows[i // LANES], bank.WEIGHT + i % LANES
        lanes[lane] = 1.0 / counting if lanes[lane] > 0.0 else 0.0
    recount(state, plan, s, counting)


@scalar_kernel
def _adapt(state: State, plan: Plan, s: int, square: float) -> None:
    """Scale the own noise such that the IMUs deviate by what is expected, and at least as much as is stated."""
    block = state.blocks[s]
    rate = max(plan.settings[COMPARED_EVERY] / ADAPTED_IN, 1.0 / (1.0 + block[covariance.COMPARISONS]))
    asked = min(max(square, 1.0 / FASTEST_GROWTH), FASTEST_GROWTH)
    scale = max(1.0, block[covariance.OWN_SCALE] * math.exp(rate * math.log(asked)))
    if scale != block[covariance.OWN_SCALE]:
        block[covariance.OWN_SCALE] = scale
        share_noise(state, plan, s)
