"""Solutions seen at the array origin, their mean, and the correction of each IMU: paper A (14)-(17)."""

from __future__ import annotations

import math

from polyins.kernels import bank, share
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, formula, kernel

Three = tuple[float, float, float]


@kernel
def project_to_origin(w: Array, dt: float) -> None:
    """Shift position and velocity of each IMU of a block to the array origin, paper A (15)-(16).

    The angular rate is the mean over the last `dt` seconds; relative to the earth it is w_ib less earth rate.
    """
    per_second = 1.0 / dt
    for i in range(LANES):
        lx, ly, lz = w[bank.TO_ORIGIN + i], w[bank.TO_ORIGIN + LANES + i], w[bank.TO_ORIGIN + 2 * LANES + i]
        ax = w[bank.DTHETA + i] * per_second
        ay = w[bank.DTHETA + LANES + i] * per_second
        az = w[bank.DTHETA + 2 * LANES + i] * per_second
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
def begin_means(w: Array, g: Array) -> None:
    """Begin means over blocks of which this is the first: its first IMU is what offsets are taken from."""
    for k in range(3):
        g[share.BASES + k] = w[bank.ORIGIN_POSITION + k * LANES]
        g[share.BASES + 3 + k] = w[bank.ORIGIN_VELOCITY + k * LANES]
        g[share.BASES + 10 + k] = w[bank.DTHETA + k * LANES]
        g[share.BASES + 13 + k] = w[bank.DVEL + k * LANES]
    for k in range(4):
        g[share.BASES + 6 + k] = w[bank.QUATERNION + k * LANES]
    for n in range(16 * LANES):
        g[share.LANE_SUMS + n] = 0.0


@kernel
def _three(g: Array, x: int) -> Three:
    return g[x], g[x + 1], g[x + 2]


@formula
def _write_offset(w: Array, i: int, field: int, base: Three, n: int) -> None:
    """Write how far a vector of one lane is from the base, weighted, as the n-th number and those after it."""
    weight = w[bank.WEIGHT + i]
    w[bank.OFFSET + n * LANES + i] = weight * (w[field + i] - base[0])
    w[bank.OFFSET + (n + 1) * LANES + i] = weight * (w[field + LANES + i] - base[1])
    w[bank.OFFSET + (n + 2) * LANES + i] = weight * (w[field + 2 * LANES + i] - base[2])


@kernel
def add_to_means(w: Array, g: Array) -> None:
    """Add the IMUs of a block to the means of states and measurements. Lanes without an IMU have weight 0."""
    r, v = _three(g, share.BASES), _three(g, share.BASES + 3)
    q, last = _three(g, share.BASES + 6), g[share.BASES + 9]
    rate, force = _three(g, share.BASES + 10), _three(g, share.BASES + 13)
    for i in range(LANES):
        _write_offset(w, i, bank.ORIGIN_POSITION, r, 0)
        _write_offset(w, i, bank.ORIGIN_VELOCITY, v, 3)
        _write_offset(w, i, bank.QUATERNION, q, 6)
        w[bank.OFFSET + 9 * LANES + i] = w[bank.WEIGHT + i] * (w[bank.QUATERNION + 3 * LANES + i] - last)
        _write_offset(w, i, bank.DTHETA, rate, 10)
        _write_offset(w, i, bank.DVEL, force, 13)
    # not in the loop over lanes, which would not vectorize with another array in it
    for n in range(16 * LANES):
        g[share.LANE_SUMS + n] += w[bank.OFFSET + n]


@kernel
def _finish_means(g: Array, n: int, to: int, count: int, factor: float) -> None:
    """Write `count` means from the n-th on, times a factor."""
    scale = 1.0 / g[share.WEIGHTS]
    for f in range(count):
        total = 0.0
        for i in range(LANES):
            total += g[share.LANE_SUMS + (n + f) * LANES + i]
        g[to + f] = (g[share.BASES + n + f] + total * scale) * factor


@kernel
def finish_measurements(g: Array, dt: float) -> None:
    """Write the mean rate and specific force, paper A (14); axes are parallel by convention."""
    _finish_means(g, 10, share.RATE, 3, 1.0 / dt)
    _finish_means(g, 13, share.FORCE, 3, 1.0 / dt)


@kernel
def finish_states(g: Array) -> None:
    """Write the mean state at the array origin, paper A (17).

    Attitudes are averaged as quaternions, which all members keep on one side of the hypersphere: the normalized sum
    is the rotation mean up to the third power of the spread, at any heading and pitch (paper A averages Euler angles).
    """
    _finish_means(g, 0, share.POSITION, 3, 1.0)
    _finish_means(g, 3, share.VELOCITY, 3, 1.0)
    _finish_means(g, 6, share.QUATERNION, 4, 1.0)
    _normalize(g)
    quaternion_to_matrix(g, share.QUATERNION, share.MATRIX)


@kernel
def _add_all(blocks: Array, first: int, last: int, g: Array) -> None:
    """Means over lanes first ... last - 1, which begin with a block and have their blocks to themselves."""
    begin_means(blocks[first // LANES], g)
    for b in range(first // LANES, (last + LANES - 1) // LANES):
        add_to_means(blocks[b], g)


@kernel
def fuse_measurements(blocks: Array, first: int, last: int, g: Array, dt: float) -> None:
    """Write the mean rate and specific force of lanes first ... last - 1."""
    if last - first > 1:
        _add_all(blocks, first, last, g)
        finish_measurements(g, dt)
        return
    w, lane = blocks[first // LANES], first % LANES
    per_second = 1.0 / dt
    for k in range(3):
        g[share.RATE + k] = w[bank.DTHETA + k * LANES + lane] * per_second
        g[share.FORCE + k] = w[bank.DVEL + k * LANES + lane] * per_second


@kernel
def fuse_states(blocks: Array, first: int, last: int, g: Array) -> None:
    """Write the fused state of lanes first ... last - 1: one IMU is itself, several meet at the array origin."""
    if last - first > 1:
        _add_all(blocks, first, last, g)
        finish_states(g)
        return
    w, lane = blocks[first // LANES], first % LANES
    for k in range(3):
        g[share.POSITION + k] = w[bank.POSITION + k * LANES + lane]
        g[share.VELOCITY + k] = w[bank.VELOCITY + k * LANES + lane]
    for k in range(4):
        g[share.QUATERNION + k] = w[bank.QUATERNION + k * LANES + lane]
    for k in range(9):
        g[share.MATRIX + k] = w[bank.MATRIX + k * LANES + lane]


@kernel
def _normalize(g: Array) -> None:
    norm = 0.0
    for k in range(4):
        norm += g[share.QUATERNION + k] * g[share.QUATERNION + k]
    scale = 1.0 / math.sqrt(norm)
    for k in range(4):
        g[share.QUATERNION + k] *= scale


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
def take_fused_velocity(w: Array, g: Array) -> None:
    """Give each IMU of a block the fused velocity, as seen from where it is."""
    for k in range(3):
        for i in range(LANES):
            w[bank.VELOCITY + k * LANES + i] += g[share.VELOCITY + k] - w[bank.ORIGIN_VELOCITY + k * LANES + i]


@kernel
def take_fused_attitude(w: Array, g: Array) -> None:
    """Give each IMU of a block the fused attitude."""
    for k in range(4):
        for i in range(LANES):
            w[bank.QUATERNION + k * LANES + i] = g[share.QUATERNION + k]
    for k in range(9):
        for i in range(LANES):
            w[bank.MATRIX + k * LANES + i] = g[share.MATRIX + k]


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
