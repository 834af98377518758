"""Joined covariance blocks; their prediction and updates are compared with full matrices in the tests of vehicles."""

import numpy as np
from lanes import EARTHS, Array
from test_covariance import DT, drawn

from polyins.kernels import covariance as cov
from polyins.kernels import joint
from polyins.kernels.covariance import STRIDE


def predicted_blocks() -> Array:
    """Two blocks some steps after an update: scales, noise and the lower left block are left behind."""
    both = [drawn(seed, EARTHS["wgs84"]) for seed in (1, 2)]
    for one in both:
        for _ in range(20):
            cov.predict(one.block, one.work, DT)
    return np.array([one.block for one in both])


def test_gathering_changes_no_bit_of_the_blocks_and_gives_their_covariance() -> None:
    groups = predicted_blocks()
    before, whole = groups.copy(), np.zeros((2 * STRIDE, 2 * STRIDE))
    joint.gather(groups, 2, whole, STRIDE)
    np.testing.assert_array_equal(groups, before)
    for s, g in enumerate(before.copy()):
        cov.complete(g, STRIDE)
        P = g[cov.P : cov.P + STRIDE * STRIDE].reshape(STRIDE, STRIDE)
        block = whole[s * STRIDE : (s + 1) * STRIDE, s * STRIDE : (s + 1) * STRIDE]
        np.testing.assert_allclose(block, P, rtol=1e-14)
        np.testing.assert_array_equal(block, block.T)
        assert np.any(before[s, cov.P : cov.P + P.size].reshape(P.shape) != P), "nothing was left behind"


def test_scattering_what_was_gathered_completes_the_blocks() -> None:
    groups = predicted_blocks()
    completed, whole = groups.copy(), np.zeros((2 * STRIDE, 2 * STRIDE))
    for g in completed:
        cov.complete(g, STRIDE)
    joint.gather(groups, 2, whole, STRIDE)
    joint.scatter(groups, 2, whole, STRIDE)
    np.testing.assert_allclose(groups, completed, rtol=1e-14)
