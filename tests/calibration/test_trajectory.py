"""The trajectory as one least-squares problem."""

import numpy as np

from polyins.calibration.trajectory import _Normal


def test_blocks_solve_the_whole() -> None:
    rng = np.random.default_rng(5)
    count, size, shared = 6, 21, 3
    rows = [rng.normal(0.0, 1.0, (40, 2 * size + shared)) for _ in range(count - 1)]
    whole = np.zeros((count * size + shared,) * 2)
    right = rng.normal(0.0, 1.0, len(whole))
    normal = _Normal(
        np.zeros((count, size, size)),
        np.zeros((count - 1, size, size)),
        np.zeros((count, size, shared)),
        right[: count * size].reshape(count, size),
        np.eye(shared),
        right[count * size :],
    )
    whole[-shared:, -shared:] += np.eye(shared)
    for k, block in enumerate(rows):
        places = np.r_[k * size : (k + 2) * size, count * size : len(whole)]
        square = block.T @ block + np.diag([1.0] * 2 * size + [0.0] * shared)
        whole[np.ix_(places, places)] += square
        normal.own[k] += square[:size, :size]
        normal.own[k + 1] += square[size : 2 * size, size : 2 * size]
        normal.next[k] += square[:size, size : 2 * size]
        normal.shared[k] += square[:size, 2 * size :]
        normal.shared[k + 1] += square[size : 2 * size, 2 * size :]
        normal.corner += square[2 * size :, 2 * size :]
    nodes, step, covariance = normal.solve(0.0)
    np.testing.assert_allclose(np.concatenate([nodes.ravel(), step]), np.linalg.solve(whole, right), atol=1e-9)
    np.testing.assert_allclose(covariance, np.linalg.inv(whole)[-shared:, -shared:], atol=1e-12)
