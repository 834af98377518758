"""The covariance of the mean of blocks that are apart: one more block, which is corrected by the mean of their gains.

Alike filters, each with its own IMU, differ in own errors and share what aids them. Their mean m errs by

    M <- Phi M Phi' + Q_c + Q_o / N,    M <- (I - K H) M (I - K H)' + K R K'

where K is what each makes of a measurement, as if it were alone: with the mean of their gains it is exact for alike
filters. It stands in the merged block. See docs/theory.
"""

from __future__ import annotations

from polyins.kernels import covariance, kalman
from polyins.kernels.covariance import LARGEST, P
from polyins.kernels.jit import Array, scalar_kernel
from polyins.navigate.state import COMMON_SHARE, STRIDE, Plan, State, Work


@scalar_kernel
def drive(state: State, plan: Plan, model: Array, dt: float) -> None:
    """Make the error model of the last block that of the mean, with the noise of those blocks that count."""
    merged, block = state.blocks[-1], state.blocks[plan.spans.shape[0] - 1]
    count = 0.0
    for s in range(plan.spans.shape[0]):
        count += state.blocks[s, covariance.COUNTS]
    share = plan.settings[COMMON_SHARE] + (1.0 - plan.settings[COMMON_SHARE]) / max(count, 1.0)
    if count != merged[covariance.MEMBERS]:
        _recount(merged, block, count, int(plan.settings[STRIDE]))
        for k in range(covariance.NOISES):
            if plan.noise[0, k] != 0.0:
                merged[k] = share * plan.noise[0, k]
    for k in range(3):
        merged[covariance.RATE + k] = block[covariance.RATE + k]
        merged[covariance.FORCE + k] = block[covariance.FORCE + k]
    covariance.noise_terms(merged, model, dt)


@scalar_kernel
def _recount(merged: Array, block: Array, count: float, stride: int) -> None:
    """Let another number of blocks count: P of one less M is (1 - 1 / N) D, and M grows by (1 / n - 1 / N) D."""
    covariance.complete(merged, stride)
    covariance.complete(block, stride)
    before = merged[covariance.MEMBERS]
    merged[covariance.MEMBERS] = count
    if 0.0 < count < before:
        more = (1.0 / count - 1.0 / before) / (1.0 - 1.0 / before)
        for k in range(stride * stride):
            merged[P + k] += more * (block[P + k] - merged[P + k])


@scalar_kernel
def correct(state: State, plan: Plan, work: Work) -> None:
    """Correct the covariance of the mean by the mean gain of the blocks that have just been corrected."""
    merged, stride, mean = state.blocks[-1], int(plan.settings[STRIDE]), work.updates[plan.spans.shape[0]]
    count, first = 0, -1
    for s in range(plan.spans.shape[0]):
        if state.silent[0, s] < 0.0:
            count += 1
            first = s if first < 0 else first
    for k in range(kalman.ROWS * LARGEST):
        mean[kalman.H + k] = work.updates[first, kalman.H + k]
    for a in range(kalman.ROWS):
        mean[kalman.R + a] = work.updates[first, kalman.R + a]
    kalman.gain(merged, mean, stride)
    for k in range(kalman.ROWS * stride):
        total = 0.0
        for s in range(plan.spans.shape[0]):
            if state.silent[0, s] < 0.0:
                total += work.updates[s, kalman.K + k]
        mean[kalman.K + k] = total / count
    kalman.update_covariance(merged, mean, stride)
