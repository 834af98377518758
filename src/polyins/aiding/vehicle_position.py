"""GNSS positions on a vehicle with wheels: the antenna as a point of the vehicle that is known from outside."""

from __future__ import annotations

from polyins.aiding.centralized import add_rows, begin_update, end_update, update_all
from polyins.aiding.distributed import correct_each
from polyins.aiding.measurement import measure
from polyins.aiding.rolling import FILLED, G_KNOWN, G_POINT, G_VARIANCE, KIND, LATERAL, POINT, Joint, Rolling
from polyins.aiding.schedule import open_window
from polyins.kernels import joint, kalman
from polyins.kernels.jit import Array, scalar_kernel


@scalar_kernel
def measure_position_each(
    fix: Array, blocks: Array, groups: Array, members: Array, measurements: Array, near: Array, rolling: Rolling
) -> float:
    """Measure a GNSS position with every share that is not silent; return the mean of their NIS."""
    _prepare(fix, rolling)
    total, measuring = 0.0, 0
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            measure(s, blocks, groups, members, near, rolling, measurements[s])
            kalman.gain(groups[s], measurements[s])
            total += kalman.normalized_innovation_squared(measurements[s])
            measuring += 1
    return total / max(measuring, 1)


@scalar_kernel
def measure_position_all(
    fix: Array,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint,
) -> float:
    """Measure a GNSS position with the mean of what all shares predict, since its noise is one; return the NIS."""
    _prepare(fix, rolling)
    begin_update(blocks, groups, members, joined)
    joined.h[:] = 0.0
    measuring = 0
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            measuring += 1
    m = measurements[0]
    z0, z1, z2 = 0.0, 0.0, 0.0
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            measure(s, blocks, groups, members, near, rolling, m)
            add_rows(s, 1.0 / measuring, groups, rolling, m, joined.h)
            z0 += m[kalman.RESIDUAL] / measuring
            z1 += m[kalman.RESIDUAL + 1] / measuring
            z2 += m[kalman.RESIDUAL + 2] / measuring
    m[kalman.RESIDUAL], m[kalman.RESIDUAL + 1], m[kalman.RESIDUAL + 2] = z0, z1, z2
    joint.gain(joined.h, fix[3:6], joined.whole, joined.hp, joined.gain, m)
    return kalman.normalized_innovation_squared(m)


@scalar_kernel
def measure_position(
    fix: Array,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
) -> float:
    """Measure a GNSS position; return the NIS."""
    if joined is None:
        return measure_position_each(fix, blocks, groups, members, measurements, near, rolling)
    return measure_position_all(fix, blocks, groups, members, measurements, near, rolling, joined)


@scalar_kernel
def _prepare(fix: Array, rolling: Rolling) -> None:
    rolling.given[KIND] = POINT
    for a in range(3):
        rolling.given[G_KNOWN + a] = fix[a]
        rolling.given[G_VARIANCE + a] = fix[3 + a]
        rolling.given[G_POINT + a] = rolling.antenna[a]


@scalar_kernel
def correct_by_position(
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    now: float,
    dt: float,
) -> None:
    """Apply the GNSS position that was measured."""
    if joined is None:
        correct_each(blocks, groups, members, measurements, near, rolling, dt)
    else:
        m = measurements[0]
        update_all(-1, m[kalman.RESIDUAL : kalman.RESIDUAL + 3], blocks, members, rolling, joined, m)
        end_update(blocks, groups, members, near, rolling, joined, dt)
    # what the window holds from before the correction does not fit the states any more
    if rolling.memory[FILLED] >= 0.0:
        open_window(now, rolling.memory[LATERAL], blocks, groups, members, rolling)
