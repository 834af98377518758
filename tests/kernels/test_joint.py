"""Joined covariance blocks; their prediction and updates are compared with full matrices in the tests of vehicles."""

import numpy as np
from lanes import EARTHS, Array
from test_share import DT, random_group

from polyins.kernels import joint, share


def predicted_shares() -> Array:
    """Two shares some steps after an update: scales, noise and the lower left block are left behind."""
    groups = np.array([random_group(seed, EARTHS["wgs84"])[0] for seed in (1, 2)])
    for g in groups:
        for _ in range(20):
            share.predict(g, DT)
    return groups


def test_gathering_changes_no_bit_of_the_shares_and_gives_their_covariance() -> None:
    groups = predicted_shares()
    before, whole = groups.copy(), np.zeros((2 * share.STATES, 2 * share.STATES))
    joint.gather(groups, 2, whole)
    np.testing.assert_array_equal(groups, before)
    for s, g in enumerate(before.copy()):
        share.complete(g)
        P = g[share.P : share.P + share.STATES * share.STRIDE].reshape(share.STATES, share.STRIDE)
        block = whole[s * share.STATES : (s + 1) * share.STATES, s * share.STATES : (s + 1) * share.STATES]
        np.testing.assert_allclose(block, P, rtol=1e-14)
        np.testing.assert_array_equal(block, block.T)
        assert np.any(before[s, share.P : share.P + P.size].reshape(P.shape) != P), "nothing was left behind"


def test_scattering_what_was_gathered_completes_the_shares() -> None:
    groups = predicted_shares()
    completed, whole = groups.copy(), np.zeros((2 * share.STATES, 2 * share.STATES))
    for g in completed:
        share.complete(g)
    joint.gather(groups, 2, whole)
    joint.scatter(groups, 2, whole)
    np.testing.assert_allclose(groups, completed, rtol=1e-14)
