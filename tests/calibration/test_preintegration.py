"""Increments between nodes."""

import numpy as np

from polyins.calibration.preintegration import Increments, rotation, rotation_vector

RNG = np.random.default_rng(2)
TIME = 0.02 * np.arange(41)
MEASURED = np.hstack([RNG.normal(0.0, 0.02, (41, 3)), RNG.normal([0.0, 0.0, -0.2], 0.1, (41, 3))])


def test_derivatives_by_errors_of_the_imu() -> None:
    cut = Increments.of(TIME, MEASURED, 20)
    errors = RNG.normal(0.0, 0.01, (2, 12))
    at = cut.preintegrated(errors)
    for k in range(12):
        step = 1e-6 * np.eye(12)[k]
        before, after = cut.preintegrated(errors - step), cut.preintegrated(errors + step)
        for name in ("velocity", "position"):
            slope = (getattr(after, name) - getattr(before, name)) / 2e-6
            np.testing.assert_allclose(getattr(at, f"{name}_by")[..., k], slope, atol=2e-3 * np.abs(slope).max())
        turned = rotation_vector(before.turned.mT @ after.turned) / 2e-6
        # of the second order in what is turned within a step
        np.testing.assert_allclose(at.turned_by[..., k], turned, atol=1e-3 * np.abs(turned).max())


def test_a_steady_turn_and_force_add_up() -> None:
    rate, force, length = np.array([0.0, 0.0, 0.5]), np.array([2.0, 0.0, 0.0]), 100
    time = 0.01 * np.arange(length + 1)
    cut = Increments.of(time, np.tile(np.concatenate([rate, force]) * 0.01, (length + 1, 1)), length)
    found = cut.preintegrated(np.zeros((1, 12)))
    np.testing.assert_allclose(found.turned[0, -1], rotation(rate), atol=1e-12)
    expected = 2.0 / 0.5 * np.array([np.sin(0.5), 1.0 - np.cos(0.5), 0.0])
    np.testing.assert_allclose(found.velocity[0, -1], expected, atol=2e-5)
    np.testing.assert_allclose(found.position[0, -1, 0], 2.0 / 0.25 * (1.0 - np.cos(0.5)), atol=2e-5)


def test_rotation_vectors_lead_back() -> None:
    vectors = RNG.normal(0.0, 1.0, (20, 3))
    np.testing.assert_allclose(rotation_vector(rotation(vectors)), vectors, atol=1e-12)
