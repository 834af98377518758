"""Solutions seen at the array origin, their mean, and the correction of each IMU: paper A (14)-(17)."""

from __future__ import annotations

import math

from polyins.kernels import bank, share
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, kernel

# field of the bank, place in the share, how many
MEASUREMENTS = ((bank.DTHETA, share.RATE, 3), (bank.DVEL, share.FORCE, 3))
STATES = (
    (bank.ORIGIN_POSITION, share.POSITION, 3),
    (bank.ORIGIN_VELOCITY, share.VELOCITY, 3),
    (bank.QUATERNION, share.QUATERNION, 4),
)


@kernel
def project_to_origin(w: Array, dt: float) -> None:
    """Shift position and velocity of each IMU of a block to the array origin, paper A (15)-(16).

    The angular rate is the mean over the last `dt` seconds; relative to the earth it is w_ib less earth rate.
    """
    for i in range(LANES):
        lx, ly, lz = w[bank.TO_ORIGIN + i], w[bank.TO_ORIGIN + LANES + i], w[bank.TO_ORIGIN + 2 * LANES + i]
        ax = w[bank.DTHETA + i] / dt
        ay = w[bank.DTHETA + LANES + i] / dt
        az = w[bank.DTHETA + 2 * LANES + i] / dt
        m = bank.MATRIX + i
        ln = w[m] * lx + w[m + LANES] * ly + w[m + 2 * LANES] * lz
        le = w[m + 3 * LANES] * lx + w[m + 4 * LANES] * ly + w[m + 5 * LANES] * lz
        ld = w[m + 6 * LANES] * lx + w[m + 7 * LANES] * ly + w[m + 8 * LANES] * lz
        rn = w[m] * ax + w[m + LANES] * ay + w[m + 2 * LANES] * az - w[bank.EARTH_RATE + i]
        re = w[m + 3 * LANES] * ax + w[m + 4 * LANES] * ay + w[m + 5 * LANES] * az
        rd = w[m + 6 * LANES] * ax + w[m + 7 * LANES] * ay + w[m + 8 * LANES] * az - w[bank.EARTH_RATE + LANES + i]
        w[bank.ORIGIN_POSITION + i] = w[bank.POSITION + i] + ln * w[bank.TO_LATITUDE + i]
        w[bank.ORIGIN_POSITION + LANES + i] = w[bank.POSITION + LANES + i] + le * w[bank.TO_LONGITUDE + i]
        w[bank.ORIGIN_POSITION + 2 * LANES + i] = w[bank.POSITION + 2 * LANES + i] - ld
        w[bank.ORIGIN_VELOCITY + i] = w[bank.VELOCITY + i] + (re * ld - rd * le)
        w[bank.ORIGIN_VELOCITY + LANES + i] = w[bank.VELOCITY + LANES + i] + (rd * ln - rn * ld)
        w[bank.ORIGIN_VELOCITY + 2 * LANES + i] = w[bank.VELOCITY + 2 * LANES + i] + (rn * le - re * ln)


@kernel
def _mean(blocks: Array, first: int, last: int, field: int, g: Array, to: int, count: int) -> None:
    """Write the weighted means of `count` fields over lanes first ... last - 1, as offsets from the first lane's.

    Members of a share begin with a block and have their blocks to themselves: lanes left over have weight 0.
    """
    for n in range(count * LANES):
        g[share.LANE_SUMS + n] = 0.0
    for b in range(first // LANES, (last + LANES - 1) // LANES):
        w = blocks[b]
        for f in range(count):
            base = blocks[first // LANES, field + f * LANES]
            for i in range(LANES):
                g[share.LANE_SUMS + f * LANES + i] += w[bank.WEIGHT + i] * (w[field + f * LANES + i] - base)
    for f in range(count):
        total = 0.0
        for i in range(LANES):
            total += g[share.LANE_SUMS + f * LANES + i]
        g[to + f] = blocks[first // LANES, field + f * LANES] + total / g[share.WEIGHTS]


@kernel
def fuse_measurements(blocks: Array, first: int, last: int, g: Array, dt: float) -> None:
    """Write the mean rate and specific force of the members, paper A (14); axes are parallel by convention."""
    if last - first == 1:
        w, lane = blocks[first // LANES], first % LANES
        for k in range(3):
            g[share.RATE + k] = w[bank.DTHETA + k * LANES + lane]
            g[share.FORCE + k] = w[bank.DVEL + k * LANES + lane]
    else:
        for field, to, count in MEASUREMENTS:
            _mean(blocks, first, last, field, g, to, count)
    per_second = 1.0 / dt
    for k in range(3):
        g[share.RATE + k] *= per_second
        g[share.FORCE + k] *= per_second


@kernel
def fuse_states(blocks: Array, first: int, last: int, g: Array) -> None:
    """Write the fused state of lanes first ... last - 1: one IMU is itself, several meet at the array origin.

    Attitudes are averaged as quaternions, which all members keep on one side of the hypersphere: the normalized sum
    is the rotation mean up to the third power of the spread, at any heading and pitch (paper A averages Euler angles).
    """
    if last - first == 1:
        block, lane = first // LANES, first % LANES
        for k in range(3):
            g[share.POSITION + k] = blocks[block, bank.POSITION + k * LANES + lane]
            g[share.VELOCITY + k] = blocks[block, bank.VELOCITY + k * LANES + lane]
        for k in range(4):
            g[share.QUATERNION + k] = blocks[block, bank.QUATERNION + k * LANES + lane]
    else:
        for field, to, count in STATES:
            _mean(blocks, first, last, field, g, to, count)
        norm = 0.0
        for k in range(4):
            norm += g[share.QUATERNION + k] * g[share.QUATERNION + k]
        for k in range(4):
            g[share.QUATERNION + k] /= math.sqrt(norm)
    quaternion_to_matrix(g, share.QUATERNION, share.MATRIX)


@kernel
def fuse_shares(blocks: Array, groups: Array, members: Array, dt: float) -> None:
    """Fuse the members of each share."""
    if members[members.shape[0] - 1, 1] > members.shape[0]:  # some share has several
        for b in range(blocks.shape[0]):
            project_to_origin(blocks[b], dt)
    for s in range(members.shape[0]):
        fuse_states(blocks, members[s, 0], members[s, 1], groups[s])


@kernel
def quaternion_to_matrix(g: Array, q: int, c: int) -> None:
    """Write the rotation matrix at offset `c` of the quaternion at offset `q`."""
    q0, q1, q2, q3 = g[q], g[q + 1], g[q + 2], g[q + 3]
    g[c] = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
    g[c + 1] = 2.0 * (q1 * q2 - q0 * q3)
    g[c + 2] = 2.0 * (q1 * q3 + q0 * q2)
    g[c + 3] = 2.0 * (q1 * q2 + q0 * q3)
    g[c + 4] = q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3
    g[c + 5] = 2.0 * (q2 * q3 - q0 * q1)
    g[c + 6] = 2.0 * (q1 * q3 - q0 * q2)
    g[c + 7] = 2.0 * (q2 * q3 + q0 * q1)
    g[c + 8] = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3


@kernel
def evaluate_at_fused_state(w: Array, g: Array) -> None:
    """Let the fused state be where the earth is evaluated and what rotates each velocity increment.

    Its velocity is projected to each IMU's point. Simplification ii of paper A, Table VI.
    """
    for i in range(LANES):
        lx, ly, lz = w[bank.TO_ORIGIN + i], w[bank.TO_ORIGIN + LANES + i], w[bank.TO_ORIGIN + 2 * LANES + i]
        c = share.MATRIX
        x, y, z = g[share.RATE], g[share.RATE + 1], g[share.RATE + 2]
        ln = g[c] * lx + g[c + 1] * ly + g[c + 2] * lz
        le = g[c + 3] * lx + g[c + 4] * ly + g[c + 5] * lz
        ld = g[c + 6] * lx + g[c + 7] * ly + g[c + 8] * lz
        rn = g[c] * x + g[c + 1] * y + g[c + 2] * z - w[bank.EARTH_RATE + i]
        re = g[c + 3] * x + g[c + 4] * y + g[c + 5] * z
        rd = g[c + 6] * x + g[c + 7] * y + g[c + 8] * z - w[bank.EARTH_RATE + LANES + i]
        w[bank.AT_VELOCITY + i] = g[share.VELOCITY] - (re * ld - rd * le)
        w[bank.AT_VELOCITY + LANES + i] = g[share.VELOCITY + 1] - (rd * ln - rn * ld)
        w[bank.AT_VELOCITY + 2 * LANES + i] = g[share.VELOCITY + 2] - (rn * le - re * ln)
    for k in range(3):
        for i in range(LANES):
            w[bank.AT_POSITION + k * LANES + i] = g[share.POSITION + k]
    for k in range(9):
        for i in range(LANES):
            w[bank.AT_MATRIX + k * LANES + i] = g[share.MATRIX + k]


@kernel
def average_increments(raw: Array, dt: float, to_origin: Array, before: Array, blocks: Array) -> None:
    """Write the increments of one virtual IMU at the array origin into lane 0, paper A (12)-(14).

    `raw` is (6, N). `to_origin` is the mean vector from the IMUs to the origin; with the mean angular rate for all,
    f + w x (w x l) + dw/dt x l depends on no other lever arm; dw is between the middles of two intervals. `before`
    holds the previous mean rate and the length of its interval, 0 if there is none; both are updated.
    """
    count = raw.shape[1]
    for k in range(6):
        total = 0.0
        for i in range(count):
            total += raw[k, i]
        blocks[0, bank.RAW_DTHETA + k * LANES] = total / count
    x = blocks[0, bank.RAW_DTHETA] / dt
    y = blocks[0, bank.RAW_DTHETA + LANES] / dt
    z = blocks[0, bank.RAW_DTHETA + 2 * LANES] / dt
    lx, ly, lz = to_origin[0], to_origin[1], to_origin[2]
    share_of_change = 2.0 * dt / (before[3] + dt) if before[3] > 0.0 else 0.0
    ax, ay, az = (x - before[0]) * share_of_change, (y - before[1]) * share_of_change, (z - before[2]) * share_of_change
    sx, sy, sz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
    blocks[0, bank.RAW_DVEL] += (y * sz - z * sy) * dt + (ay * lz - az * ly)
    blocks[0, bank.RAW_DVEL + LANES] += (z * sx - x * sz) * dt + (az * lx - ax * lz)
    blocks[0, bank.RAW_DVEL + 2 * LANES] += (x * sy - y * sx) * dt + (ax * ly - ay * lx)
    before[0], before[1], before[2], before[3] = x, y, z, dt


@kernel
def correct_members(blocks: Array, first: int, last: int, metres: Array) -> None:
    """Feed each member's own error state back into its state; `metres` is the metric D of its position."""
    for i in range(first, last):
        w = blocks[i // LANES]
        lane = i % LANES
        for k in range(3):
            w[bank.POSITION + k * LANES + lane] -= w[bank.CORRECTION + k * LANES + lane] / metres[k]
            w[bank.VELOCITY + k * LANES + lane] -= w[bank.CORRECTION + (3 + k) * LANES + lane]
        for k in range(15):
            w[bank.ERRORS + k * LANES + lane] += w[bank.CORRECTION + (9 + k) * LANES + lane]
        _rotate(w, lane)


@kernel
def _rotate(w: Array, lane: int) -> None:
    """Q = q(phi) q."""
    x = w[bank.CORRECTION + 6 * LANES + lane]
    y = w[bank.CORRECTION + 7 * LANES + lane]
    z = w[bank.CORRECTION + 8 * LANES + lane]
    angle = math.sqrt(x * x + y * y + z * z)
    c = math.cos(0.5 * angle)
    s = 0.5 if angle < 1e-9 else math.sin(0.5 * angle) / angle
    x, y, z = s * x, s * y, s * z
    q = bank.QUATERNION + lane
    q0, q1, q2, q3 = w[q], w[q + LANES], w[q + 2 * LANES], w[q + 3 * LANES]
    w[q] = c * q0 - x * q1 - y * q2 - z * q3
    w[q + LANES] = c * q1 + x * q0 + y * q3 - z * q2
    w[q + 2 * LANES] = c * q2 + y * q0 + z * q1 - x * q3
    w[q + 3 * LANES] = c * q3 + z * q0 + x * q2 - y * q1
