"""Attitudes that were held: the ellipsoid of forces, and what an error of the rates turns."""

import numpy as np

from polyins.calibration.common_motion import CommonMotion
from polyins.calibration.poses import _integrated, ellipsoid, held

GRAVITY = 9.81
MATRIX = np.array([[1.01, 0.004, -0.003], [0.004, 0.99, 0.002], [-0.003, 0.002, 1.003]])
BIAS = np.array([0.3, -0.2, 0.1])


def directions(count: int, seed: int = 3) -> np.ndarray:
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def measured(up: np.ndarray) -> np.ndarray:
    """Forces whose correction is MATRIX @ (force - BIAS)."""
    return GRAVITY * up @ np.linalg.inv(MATRIX).T + BIAS


def test_the_ellipsoid_of_forces_is_found() -> None:
    found = ellipsoid(measured(directions(20)), GRAVITY)
    assert found is not None
    np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-9)
    np.testing.assert_allclose(found.bias, BIAS, atol=1e-8)


def test_its_std_is_that_of_many_draws() -> None:
    up, rng = directions(20), np.random.default_rng(4)
    off = []
    for _ in range(200):
        found = ellipsoid(measured(up) + rng.normal(0.0, 1e-3, (20, 3)), GRAVITY)
        assert found is not None
        off.append(((found.matrix - MATRIX) / found.matrix_std)[np.triu_indices(3)])
    assert np.mean(np.abs(off) < 3.0) > 0.99
    assert 0.7 < np.sqrt(np.mean(np.square(off))) < 1.2


def test_attitudes_that_are_few_or_alike_tell_nothing() -> None:
    assert ellipsoid(measured(directions(11)), GRAVITY) is None
    alike = np.array([0.0, 0.0, -1.0]) + 0.02 * directions(30)
    noise = np.random.default_rng(5).normal(0.0, 1e-3, (30, 3))
    assert ellipsoid(measured(alike / np.linalg.norm(alike, axis=1)[:, None]) + noise, GRAVITY) is None


def test_what_an_error_matrix_turns_is_its_finite_difference() -> None:
    rng = np.random.default_rng(6)
    turns = 0.01 * rng.normal(size=(200, 3)).cumsum(axis=0) * 0.1
    rotation, response = _integrated(turns)
    for j in range(3):
        for k in range(3):
            error = np.zeros((3, 3))
            error[j, k] = 1e-6
            changed = _integrated(turns @ (np.eye(3) + error).T)[0]
            around = (changed @ rotation.T - np.eye(3))[[2, 0, 1], [1, 2, 0]] / 1e-6
            np.testing.assert_allclose(around, response[:, j, k], atol=2e-4)


def test_attitudes_are_where_nothing_moves() -> None:
    time = np.arange(0.005, 20.0, 0.01)
    turning = (time > 5.0) & (time < 8.0)
    rate = np.column_stack([turning * np.sin(np.pi * (time - 5.0) / 3.0), 0.0 * time, 0.0 * time]) + 0.01
    force = np.tile([0.0, 0.0, -GRAVITY], (len(time), 1))
    lost = (time > 12.0) & (time < 12.1)
    moved = CommonMotion(time, 0.01, rate[:, None], force[:, None], lost)
    poses = held(moved, rate, force)
    spans = [(time[pose.rows][0], time[pose.rows][-1]) for pose in poses]
    assert len(poses) == 3
    assert spans[0][1] < 5.0 < 8.0 < spans[1][0] < spans[1][1] < 12.0 < spans[2][0]
    np.testing.assert_allclose([pose.rate for pose in poses], 3 * [[0.01] * 3], atol=1e-9)
