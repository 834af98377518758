"""Updates of all shares as one filter whose covariance is joined: paper B's centralized filter."""

from __future__ import annotations

from polyins.aiding import vehicle_attitude
from polyins.aiding.measurement import feed_back, measure, update_derived
from polyins.aiding.rolling import KIND, POINT, Joint, Rolling
from polyins.kernels import bank, joint, kalman
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import STATES, STRIDE


@scalar_kernel
def add_rows(s: int, sign: float, groups: Array, rolling: Rolling, m: Array, h: Array) -> None:
    """Add the design matrix of a share, and of the one that lends to it, to that of all states."""
    for a in range(3):
        for k in range(STATES):
            h[a, s * STATES + k] += sign * m[kalman.H + a * STRIDE + k]
    lender = rolling.lenders[s]
    if lender >= 0:
        vehicle_attitude.write_lent(groups, s, lender, m)
        for a in range(3):
            for k in range(STATES):
                h[a, lender * STATES + k] += sign * m[kalman.LENT + a * STRIDE + k]


@scalar_kernel
def update_all(
    measured: int, z: Array, blocks: Array, members: Array, rolling: Rolling, joined: Joint, m: Array
) -> None:
    """Update the joined covariance and add to every member's correction; the gain of all states is known.

    `z` is the residual. A member of the share `measured` differs from its mean by its own.
    """
    for s in range(members.shape[0]):
        if rolling.silent[s] >= 0.0:
            joined.gain[:, s * STATES : (s + 1) * STATES] = 0.0
    joint.update(joined.h, m[kalman.R : kalman.R + 3], joined.whole, joined.hp, joined.gain, joined.ah)
    k = joined.gain
    for s in range(members.shape[0]):
        if rolling.silent[s] >= 0.0:
            continue
        for n in range(STATES):
            j = s * STATES + n
            joined.correction[j] += k[0, j] * z[0] + k[1, j] * z[1] + k[2, j] * z[2]
        for i in range(members[s, 0], members[s, 1]):
            w, lane = blocks[i // LANES], i % LANES
            z0, z1, z2 = z[0], z[1], z[2]
            if s == measured:
                z0 += w[bank.RESIDUAL + lane] - m[kalman.RESIDUAL]
                z1 += w[bank.RESIDUAL + LANES + lane] - m[kalman.RESIDUAL + 1]
                z2 += w[bank.RESIDUAL + 2 * LANES + lane] - m[kalman.RESIDUAL + 2]
            for n in range(STATES):
                j = s * STATES + n
                w[bank.CORRECTION + n * LANES + lane] += k[0, j] * z0 + k[1, j] * z1 + k[2, j] * z2


@scalar_kernel
def begin_update(blocks: Array, groups: Array, members: Array, joined: Joint) -> None:
    """Gather the joined covariance; nothing is corrected yet."""
    joint.gather(groups, members.shape[0], joined.whole)
    joined.correction[:] = 0.0
    for b in range(blocks.shape[0]):
        blocks[b, bank.CORRECTION : bank.CORRECTION + STATES * LANES] = 0.0


@scalar_kernel
def end_update(
    blocks: Array, groups: Array, members: Array, near: Array, rolling: Rolling, joined: Joint, dt: float
) -> None:
    """Give each share its part of the joined covariance and each IMU its correction."""
    joint.scatter(groups, members.shape[0], joined.whole)
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            feed_back(s, blocks, groups, members, near)
    update_derived(blocks, groups, members, rolling, dt)


@scalar_kernel
def aid_all(
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint,
    dt: float,
) -> None:
    """One measurement of every share, or of the differences of their points, as if all were one.

    All are measured at the same states and then applied one after the other, each residual less what the
    corrections before it explain.
    """
    pairs = rolling.given[KIND] == POINT
    begin_update(blocks, groups, members, joined)
    joined.rows[:] = 0.0
    for s in range(members.shape[0]):
        if measures(s, rolling):
            measure(s, blocks, groups, members, near, rolling, measurements[s])
            add_rows(s, 1.0, groups, rolling, measurements[s], joined.rows[s])
    before = -1
    for s in range(members.shape[0]):
        if not measures(s, rolling):
            continue
        m = measurements[s]
        if not pairs or before >= 0:
            for a in range(3):
                joined.z[a] = m[kalman.RESIDUAL + a]
                for j in range(joined.h.shape[1]):
                    joined.h[a, j] = joined.rows[s, a, j]
                if pairs:
                    joined.z[a] -= measurements[before, kalman.RESIDUAL + a]
                    for j in range(joined.h.shape[1]):
                        joined.h[a, j] -= joined.rows[before, a, j]
                for j in range(joined.h.shape[1]):
                    joined.z[a] -= joined.h[a, j] * joined.correction[j]
            joint.gain(joined.h, m[kalman.R : kalman.R + 3], joined.whole, joined.hp, joined.gain, m)
            update_all(-1 if pairs else s, joined.z, blocks, members, rolling, joined, m)
        before = s
    end_update(blocks, groups, members, near, rolling, joined, dt)


@scalar_kernel
def measures(s: int, rolling: Rolling) -> bool:
    """Whether neither the share is silent nor the one that lends roll and pitch to it."""
    lender = rolling.lenders[s]
    if lender >= 0 and rolling.silent[lender] >= 0.0:
        return False
    active: bool = rolling.silent[s] < 0.0
    return active
