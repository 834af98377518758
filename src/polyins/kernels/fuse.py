"""Solutions seen at the point of their block, their mean, and the correction of each IMU: paper A (14)-(17)."""

from __future__ import annotations

import math

from polyins.kernels import bank, covariance
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, formula, kernel
from polyins.kernels.layout import Layout
from polyins.model.states import EIGHT

Three = tuple[float, float, float]

MEANS = 16
"""numbers that are averaged: position 3, velocity 3, quaternion 4, increments 6"""

_layout = Layout()
BASES = _layout.take(MEANS)  # of the first IMU, from which offsets are taken
LANE_SUMS = _layout.take(MEANS * EIGHT)  # of weighted offsets, lane by lane

SUMS = _layout.size
"""length of the work array `sums` of the means over one block"""


@kernel
def project_to_point(lanes: Array, dt: float) -> None:
    """Shift position and velocity of each IMU of a row to the point of its block, paper A (15)-(16).

    The angular rate is the mean over the last `dt` seconds; relative to the earth it is w_ib less earth rate.
    """
    per_second = 1.0 / dt
    for i in range(LANES):
        lx, ly, lz = lanes[bank.TO_POINT + i], lanes[bank.TO_POINT + LANES + i], lanes[bank.TO_POINT + 2 * LANES + i]
        ax = lanes[bank.DTHETA + i] * per_second
        ay = lanes[bank.DTHETA + LANES + i] * per_second
        az = lanes[bank.DTHETA + 2 * LANES + i] * per_second
        m = bank.MATRIX + i
        ln = lanes[m] * lx + lanes[m + LANES] * ly + lanes[m + 2 * LANES] * lz
        le = lanes[m + 3 * LANES] * lx + lanes[m + 4 * LANES] * ly + lanes[m + 5 * LANES] * lz
        ld = lanes[m + 6 * LANES] * lx + lanes[m + 7 * LANES] * ly + lanes[m + 8 * LANES] * lz
        rn = lanes[m] * ax + lanes[m + LANES] * ay + lanes[m + 2 * LANES] * az - lanes[bank.EARTH_RATE + i]
        re = lanes[m + 3 * LANES] * ax + lanes[m + 4 * LANES] * ay + lanes[m + 5 * LANES] * az
        rd = (
            lanes[m + 6 * LANES] * ax
            + lanes[m + 7 * LANES] * ay
            + lanes[m + 8 * LANES] * az
            - lanes[bank.EARTH_RATE + LANES + i]
        )
        lanes[bank.POINT_POSITION + i] = lanes[bank.POSITION + i] + ln * lanes[bank.TO_LATITUDE + i]
        lanes[bank.POINT_POSITION + LANES + i] = lanes[bank.POSITION + LANES + i] + le * lanes[bank.TO_LONGITUDE + i]
        lanes[bank.POINT_POSITION + 2 * LANES + i] = lanes[bank.POSITION + 2 * LANES + i] - ld
        lanes[bank.POINT_VELOCITY + i] = lanes[bank.VELOCITY + i] + (re * ld - rd * le)
        lanes[bank.POINT_VELOCITY + LANES + i] = lanes[bank.VELOCITY + LANES + i] + (rd * ln - rn * ld)
        lanes[bank.POINT_VELOCITY + 2 * LANES + i] = lanes[bank.VELOCITY + 2 * LANES + i] + (rn * le - re * ln)


@kernel
def begin_means(lanes: Array, sums: Array) -> None:
    """Begin means over rows of which this is the first: its first IMU is what offsets are taken from."""
    for k in range(3):
        sums[BASES + k] = lanes[bank.POINT_POSITION + k * LANES]
        sums[BASES + 3 + k] = lanes[bank.POINT_VELOCITY + k * LANES]
        sums[BASES + 10 + k] = lanes[bank.DTHETA + k * LANES]
        sums[BASES + 13 + k] = lanes[bank.DVEL + k * LANES]
    for k in range(4):
        sums[BASES + 6 + k] = lanes[bank.QUATERNION + k * LANES]
    for n in range(MEANS * LANES):
        sums[LANE_SUMS + n] = 0.0


@kernel
def _three(array: Array, x: int) -> Three:
    return array[x], array[x + 1], array[x + 2]


@formula
def _write_offset(lanes: Array, i: int, field: int, base: Three, n: int) -> None:
    """Write how far a vector of one lane is from the base, weighted, as the n-th number and those after it."""
    weight = lanes[bank.WEIGHT + i]
    lanes[bank.OFFSET + n * LANES + i] = weight * (lanes[field + i] - base[0])
    lanes[bank.OFFSET + (n + 1) * LANES + i] = weight * (lanes[field + LANES + i] - base[1])
    lanes[bank.OFFSET + (n + 2) * LANES + i] = weight * (lanes[field + 2 * LANES + i] - base[2])


@kernel
def add_to_means(lanes: Array, sums: Array) -> None:
    """Add the IMUs of a row to the means of states and measurements. Lanes that do not count have weight 0."""
    r, v = _three(sums, BASES), _three(sums, BASES + 3)
    q, last = _three(sums, BASES + 6), sums[BASES + 9]
    rate, force = _three(sums, BASES + 10), _three(sums, BASES + 13)
    for i in range(LANES):
        _write_offset(lanes, i, bank.POINT_POSITION, r, 0)
        _write_offset(lanes, i, bank.POINT_VELOCITY, v, 3)
        _write_offset(lanes, i, bank.QUATERNION, q, 6)
        lanes[bank.OFFSET + 9 * LANES + i] = lanes[bank.WEIGHT + i] * (lanes[bank.QUATERNION + 3 * LANES + i] - last)
        _write_offset(lanes, i, bank.DTHETA, rate, 10)
        _write_offset(lanes, i, bank.DVEL, force, 13)
    # not in the loop over lanes, which would not vectorize with another array in it
    for n in range(MEANS * LANES):
        sums[LANE_SUMS + n] += lanes[bank.OFFSET + n]


@kernel
def leaps(lanes: Array, turn: float, change: float) -> bool:
    """Whether one IMU of a row, whose offsets were just written, moves the mean by more than that, rad or m/s."""
    by_turn, by_change = 1.0 / (turn * turn), 1.0 / (change * change)
    for i in range(LANES):
        g0, g1, g2 = _three_of(lanes, bank.OFFSET + 10 * LANES + i)
        a0, a1, a2 = _three_of(lanes, bank.OFFSET + 13 * LANES + i)
        lanes[bank.LEAP + i] = (g0 * g0 + g1 * g1 + g2 * g2) * by_turn + (a0 * a0 + a1 * a1 + a2 * a2) * by_change
    found = False
    for i in range(LANES):
        found = found or lanes[bank.LEAP + i] > 1.0
    return found


@formula
def _three_of(lanes: Array, x: int) -> Three:
    return lanes[x], lanes[x + LANES], lanes[x + 2 * LANES]


@kernel
def _finish_means(sums: Array, block: Array, n: int, to: int, count: int, factor: float) -> None:
    """Write `count` means from the n-th on, times a factor; the weights of a block add up to one."""
    for f in range(count):
        total = 0.0
        for i in range(LANES):
            total += sums[LANE_SUMS + (n + f) * LANES + i]
        block[to + f] = (sums[BASES + n + f] + total) * factor


@kernel
def finish_measurements(sums: Array, block: Array, dt: float) -> None:
    """Write the mean rate and specific force, paper A (14); axes are parallel by convention."""
    _finish_means(sums, block, 10, covariance.RATE, 3, 1.0 / dt)
    _finish_means(sums, block, 13, covariance.FORCE, 3, 1.0 / dt)


@kernel
def finish_states(sums: Array, block: Array) -> None:
    """Write the mean state at the point of the block, paper A (17).

    Attitudes are averaged as quaternions, which all members keep on one side of the hypersphere: the normalized sum
    is the rotation mean up to the third power of the spread, at any heading and pitch (paper A averages Euler angles).
    """
    _finish_means(sums, block, 0, covariance.POSITION, 3, 1.0)
    _finish_means(sums, block, 3, covariance.VELOCITY, 3, 1.0)
    _finish_means(sums, block, 6, covariance.QUATERNION, 4, 1.0)
    normalize(block)
    quaternion_to_matrix(block, covariance.QUATERNION, covariance.MATRIX)


@kernel
def add_all(rows: Array, first: int, last: int, sums: Array) -> None:
    """Add up lanes first ... last - 1, which begin with a row and have their rows to themselves."""
    begin_means(rows[first // LANES], sums)
    for b in range(first // LANES, (last + LANES - 1) // LANES):
        add_to_means(rows[b], sums)


@formula
def take_measurement(rows: Array, lane: int, block: Array, dt: float) -> None:
    """Write the rate and specific force of the only member of a block."""
    lanes, i = rows[lane // LANES], lane % LANES
    per_second = 1.0 / dt
    for k in range(3):
        block[covariance.RATE + k] = lanes[bank.DTHETA + k * LANES + i] * per_second
        block[covariance.FORCE + k] = lanes[bank.DVEL + k * LANES + i] * per_second


@formula
def take_state(rows: Array, lane: int, block: Array) -> None:
    """Write the state of the only member of a block: its own, where it is."""
    lanes, i = rows[lane // LANES], lane % LANES
    for k in range(3):
        block[covariance.POSITION + k] = lanes[bank.POSITION + k * LANES + i]
        block[covariance.VELOCITY + k] = lanes[bank.VELOCITY + k * LANES + i]
    for k in range(4):
        block[covariance.QUATERNION + k] = lanes[bank.QUATERNION + k * LANES + i]
    for k in range(9):
        block[covariance.MATRIX + k] = lanes[bank.MATRIX + k * LANES + i]


@kernel
def fuse_states(rows: Array, first: int, last: int, block: Array, sums: Array, dt: float) -> None:
    """Write the fused state of lanes first ... last - 1: one IMU is itself, several meet at the point of the block."""
    if last - first > 1:
        for b in range(first // LANES, (last + LANES - 1) // LANES):
            project_to_point(rows[b], dt)
        add_all(rows, first, last, sums)
        finish_states(sums, block)
        return
    take_state(rows, first, block)


@kernel
def normalize(block: Array) -> None:
    """Make a unit quaternion of the fused one."""
    norm = 0.0
    for k in range(4):
        norm += block[covariance.QUATERNION + k] * block[covariance.QUATERNION + k]
    scale = 1.0 / math.sqrt(norm)
    for k in range(4):
        block[covariance.QUATERNION + k] *= scale


@kernel
def quaternion_to_matrix(block: Array, q: int, c: int) -> None:
    """Write the rotation matrix at offset `c` of the quaternion at offset `q`."""
    q0, q1, q2, q3 = block[q], block[q + 1], block[q + 2], block[q + 3]
    block[c] = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
    block[c + 1] = 2.0 * (q1 * q2 - q0 * q3)
    block[c + 2] = 2.0 * (q1 * q3 + q0 * q2)
    block[c + 3] = 2.0 * (q1 * q2 + q0 * q3)
    block[c + 4] = q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3
    block[c + 5] = 2.0 * (q2 * q3 - q0 * q1)
    block[c + 6] = 2.0 * (q1 * q3 - q0 * q2)
    block[c + 7] = 2.0 * (q2 * q3 + q0 * q1)
    block[c + 8] = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3


@kernel
def take_fused_velocity(lanes: Array, block: Array) -> None:
    """Give each IMU of a row the fused velocity, as seen from where it is."""
    for k in range(3):
        for i in range(LANES):
            lanes[bank.VELOCITY + k * LANES + i] += (
                block[covariance.VELOCITY + k] - lanes[bank.POINT_VELOCITY + k * LANES + i]
            )


@kernel
def take_fused_attitude(lanes: Array, block: Array) -> None:
    """Give each IMU of a row the fused attitude."""
    for k in range(4):
        for i in range(LANES):
            lanes[bank.QUATERNION + k * LANES + i] = block[covariance.QUATERNION + k]
    for k in range(9):
        for i in range(LANES):
            lanes[bank.MATRIX + k * LANES + i] = block[covariance.MATRIX + k]


@kernel
def average_increments(raw: Array, dt: float, to_origin: Array, previous: Array, rows: Array) -> None:
    """Write the increments of one virtual IMU at the array origin into lane 0, paper A (12)-(14).

    `raw` is (6, N). `to_origin` is the mean vector from the IMUs to the origin; with the mean angular rate for all,
    f + w x (w x l) + dw/dt x l depends on no other lever arm; dw is between the middles of two intervals. `previous`
    holds the previous mean rate and the length of its interval, 0 if there is none; both are updated.
    """
    count = raw.shape[1]
    for k in range(6):
        total = 0.0
        for i in range(count):
            total += raw[k, i]
        rows[0, bank.RAW_DTHETA + k * LANES] = total / count
    x = rows[0, bank.RAW_DTHETA] / dt
    y = rows[0, bank.RAW_DTHETA + LANES] / dt
    z = rows[0, bank.RAW_DTHETA + 2 * LANES] / dt
    lx, ly, lz = to_origin[0], to_origin[1], to_origin[2]
    of_change = 2.0 * dt / (previous[3] + dt) if previous[3] > 0.0 else 0.0
    ax, ay, az = (x - previous[0]) * of_change, (y - previous[1]) * of_change, (z - previous[2]) * of_change
    sx, sy, sz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
    rows[0, bank.RAW_DVEL] += (y * sz - z * sy) * dt + (ay * lz - az * ly)
    rows[0, bank.RAW_DVEL + LANES] += (z * sx - x * sz) * dt + (az * lx - ax * lz)
    rows[0, bank.RAW_DVEL + 2 * LANES] += (x * sy - y * sx) * dt + (ax * ly - ay * lx)
    previous[0], previous[1], previous[2], previous[3] = x, y, z, dt


@kernel
def correct_members(rows: Array, first: int, last: int, metres: Array, states: int) -> None:
    """Feed each member's own error state back into its state; `metres` is the metric D of its position."""
    for i in range(first, last):
        lanes, lane = rows[i // LANES], i % LANES
        for k in range(3):
            lanes[bank.POSITION + k * LANES + lane] -= lanes[bank.CORRECTION + k * LANES + lane] / metres[k]
            lanes[bank.VELOCITY + k * LANES + lane] -= lanes[bank.CORRECTION + (3 + k) * LANES + lane]
        for k in range(covariance.NAV, states):
            lanes[bank.ERRORS + (k - covariance.NAV) * LANES + lane] += lanes[bank.CORRECTION + k * LANES + lane]
        _rotate(lanes, lane)


@kernel
def _rotate(lanes: Array, lane: int) -> None:
    """Q = q(phi) q."""
    x = lanes[bank.CORRECTION + 6 * LANES + lane]
    y = lanes[bank.CORRECTION + 7 * LANES + lane]
    z = lanes[bank.CORRECTION + 8 * LANES + lane]
    angle = math.sqrt(x * x + y * y + z * z)
    c = math.cos(0.5 * angle)
    s = 0.5 if angle < 1e-9 else math.sin(0.5 * angle) / angle
    x, y, z = s * x, s * y, s * z
    q = bank.QUATERNION + lane
    q0, q1, q2, q3 = lanes[q], lanes[q + LANES], lanes[q + 2 * LANES], lanes[q + 3 * LANES]
    lanes[q] = c * q0 - x * q1 - y * q2 - z * q3
    lanes[q + LANES] = c * q1 + x * q0 + y * q3 - z * q2
    lanes[q + 2 * LANES] = c * q2 + y * q0 + z * q1 - x * q3
    lanes[q + 3 * LANES] = c * q3 + z * q0 + x * q2 - y * q1
