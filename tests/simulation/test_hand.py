"""An array turned by hand rests in attitudes that point everywhere."""

import numpy as np

from polyins.simulation.hand import HandTurning, turned_by_hand
from polyins.simulation.increments import increments


def test_it_rests_in_attitudes_that_point_everywhere() -> None:
    how = HandTurning(shaking=10.0)
    path = turned_by_hand(np.random.default_rng(1), how)
    moved = increments(path, 50.0)
    still = np.linalg.norm(moved.dtheta * 50.0, axis=1) < 2e-4  # the Earth turns
    begins = np.flatnonzero(np.diff(still.astype(int)) == 1)
    assert int(still[:100].all()) + len(begins) >= how.faces
    up = moved.dvel[still] / np.linalg.norm(moved.dvel[still], axis=1)[:, None]
    assert np.linalg.eigvalsh(np.cov(up.T))[0] > 0.2
    shaken = moved.time > path.duration - how.shaking
    assert np.linalg.norm(moved.dtheta[shaken] * 50.0, axis=1).max() > 2.0
    np.testing.assert_allclose(np.linalg.norm(moved.dvel[still] * 50.0, axis=1), 9.79, atol=0.01)
