"""Updates of each share by itself: paper B's distributed filter."""

from __future__ import annotations

from polyins.aiding.measurement import feed_back, measure, update_derived
from polyins.aiding.rolling import Rolling
from polyins.kernels import bank, kalman
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import STATES


@scalar_kernel
def correct_each(
    blocks: Array, groups: Array, members: Array, measurements: Array, near: Array, rolling: Rolling, dt: float
) -> None:
    """Apply what was measured and whose gain is known to every share that is not silent."""
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            m = measurements[s]
            kalman.update_covariance(groups[s], m)
            for i in range(members[s, 0], members[s, 1]):
                _member_correction(blocks[i // LANES], i % LANES, m)
            feed_back(s, blocks, groups, members, near)
    update_derived(blocks, groups, members, rolling, dt)


@scalar_kernel
def _member_correction(w: Array, lane: int, m: Array) -> None:
    z0, z1, z2 = w[bank.RESIDUAL + lane], w[bank.RESIDUAL + LANES + lane], w[bank.RESIDUAL + 2 * LANES + lane]
    for k in range(STATES):
        r = kalman.K + kalman.ROWS * k
        w[bank.CORRECTION + k * LANES + lane] = m[r] * z0 + m[r + 1] * z1 + m[r + 2] * z2


@scalar_kernel
def aid_each(
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    dt: float,
) -> None:
    """One measurement of every share, paper B's distributed filter."""
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            measure(s, blocks, groups, members, near, rolling, measurements[s])
            kalman.gain(groups[s], measurements[s])
    correct_each(blocks, groups, members, measurements, near, rolling, dt)
