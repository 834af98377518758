"""One measurement of one share, whatever its kind: design matrix, variances, residuals; and what a correction changes.

`Rolling.given` says which measurement it is.
"""

from __future__ import annotations

from polyins.aiding import reference_point, standstill, vehicle_attitude, wheel_speed
from polyins.aiding.rolling import (
    AT_END,
    G_DT,
    G_DURATION,
    G_KNOWN,
    G_LATERAL,
    G_METRES,
    G_POINT,
    G_SPEED,
    G_VARIANCE,
    KIND,
    POINT,
    SPEED,
    ZERO_VELOCITY,
    Rolling,
)
from polyins.kernels import bank, earth, fuse, kalman, share, strapdown, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel


@scalar_kernel
def update_derived(blocks: Array, groups: Array, members: Array, rolling: Rolling, dt: float) -> None:
    """Bring everything that follows from the navigation states up to date."""
    for b in range(blocks.shape[0]):
        strapdown.update_matrix(blocks[b])
        strapdown.update_sensitivity(blocks[b])
    fuse.fuse_shares(blocks, groups, members, dt)
    vehicle.merge(blocks, groups, members, rolling.lenders, rolling.silent)


@scalar_kernel
def _residual(w: Array, lane: int, lent: vehicle.Matrix, rolling: Rolling, near: Array) -> vehicle.Three:
    given = rolling.given
    kind = given[KIND]
    if kind == SPEED:
        if rolling.settings[AT_END] != 0.0:
            return wheel_speed.residual_at_end(w, lane, lent, given[G_LATERAL], given[G_SPEED], given[G_DT])
        return wheel_speed.residual_of_window(w, lane, given[G_SPEED], given[G_DURATION])
    if kind == POINT:
        known, point = given[G_KNOWN : G_KNOWN + 3], given[G_POINT : G_POINT + 3]
        metres = given[G_METRES : G_METRES + 3]
        return reference_point.residual(w, lane, lent, point, known, metres, near[0] != 0.0)
    if kind == ZERO_VELOCITY:
        return standstill.velocity_residual(w, lane)
    return standstill.rate_residual(w, lane, given[G_DURATION])


@scalar_kernel
def _design(g: Array, w: Array, lane: int, rolling: Rolling, m: Array) -> None:
    given = rolling.given
    kind = given[KIND]
    if kind == SPEED:
        wheel_speed.design(g, w, lane, given[G_LATERAL], given[G_SPEED], m)
    elif kind == POINT:
        reference_point.design(g, w, lane, given[G_POINT : G_POINT + 3], m)
    elif kind == ZERO_VELOCITY:
        standstill.velocity_design(m)
    else:
        standstill.rate_design(g, m)


@scalar_kernel
def measure(s: int, blocks: Array, groups: Array, members: Array, near: Array, rolling: Rolling, m: Array) -> None:
    """Write design matrix, variances and residuals of a share: each member's own, and their mean."""
    kind = rolling.given[KIND]
    g = groups[s]
    first, last = members[s, 0], members[s, 1]
    w, lane = blocks[first // LANES], first % LANES
    metres = rolling.given[G_METRES : G_METRES + 3]
    earth.metric(g[share.POSITION : share.POSITION + 3], near[0] != 0.0, metres)
    _design(g, w, lane, rolling, m)
    if kind in (SPEED, POINT):
        vehicle_attitude.add_own(g, w, lane, m)
    lent = vehicle.lent_matrix(groups, rolling.lenders[s])
    for a in range(3):
        m[kalman.R + a] = rolling.noise[s, a] if kind == SPEED else rolling.given[G_VARIANCE + a]
        m[kalman.RESIDUAL + a] = 0.0
    for i in range(first, last):
        z = _residual(blocks[i // LANES], i % LANES, lent, rolling, near)
        for a in range(3):
            blocks[i // LANES, bank.RESIDUAL + a * LANES + i % LANES] = z[a]
            m[kalman.RESIDUAL + a] += z[a] / (last - first)


@scalar_kernel
def feed_back(s: int, blocks: Array, groups: Array, members: Array, near: Array) -> None:
    """Apply the correction of each member of a share to its state."""
    g = groups[s]
    metres = g[share.METRIC : share.METRIC + 3]
    earth.metric(g[share.POSITION : share.POSITION + 3], near[0] != 0.0, metres)
    fuse.correct_members(blocks, members[s, 0], members[s, 1], metres)
