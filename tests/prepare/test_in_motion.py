"""In-motion alignment: the design is the derivative of the model, the minimum is the truth, noise tells no heading."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from polyins.model.geodesy import displacement
from polyins.model.rig import DEG
from polyins.prepare.in_motion import BA, BG, PHI, FixSeries, MeanImu, P, Prior, Search, V, _Problem, _rotation
from polyins.simulation.increments import increments
from polyins.simulation.motions import sideways
from polyins.simulation.path import Path

Array = NDArray[np.float64]

LEVER = np.array([0.4, -0.2, -0.9])
DURATION = 20.0
BIAS_STD = np.array([0.02, 0.02, 0.02, 0.05, 0.05, 0.05])


@pytest.fixture(scope="module")
def truth() -> Path:
    """It goes where it likes, at some m/s, and looks elsewhere."""
    return sideways(np.random.default_rng(4), DURATION + 2.0)


def measured(truth: Path, biases: Array, noise: float = 0.0, velocities: bool = True) -> tuple[MeanImu, FixSeries]:
    exact = increments(truth, 50.0)
    time = np.concatenate([[0.0], exact.time])
    dt = np.diff(time)[:, None]
    dvel = exact.dvel + biases[3:] * dt
    dvel += noise * np.sqrt(dt) * np.random.default_rng(5).standard_normal(dvel.shape)
    walks = (max(noise, 1e-3) ** 2, 1e-8, 1e-10)
    imu = MeanImu(time, exact.dtheta + biases[:3] * dt, dvel, np.zeros(3), BIAS_STD, walks)
    at = np.arange(0.0, DURATION, 0.5)
    fixed = truth.truth(at, LEVER)
    std = np.full((len(at), 3), 0.02)
    return imu, FixSeries(
        time=at,
        position=displacement(fixed.position, fixed.position[0], True),
        position_std=std,
        velocity=fixed.velocity if velocities else None,
        velocity_std=2.0 * std if velocities else None,
        antenna=LEVER,
        gravity=9.80,
    )


@pytest.mark.parametrize("known", [Prior(), Prior(heading=1.0, heading_std=0.1, velocity=np.ones(3), velocity_std=0.5)])
def test_the_design_is_the_derivative_of_the_residual(truth: Path, known: Prior) -> None:
    problem = _Problem(*measured(truth, np.zeros(6)), known)
    x = np.zeros(15)
    x[V], x[BG], x[BA] = [1.0, -2.0, 0.1], [0.01, -0.02, 0.015], [0.1, -0.05, 0.02]
    C_nb = _rotation(np.array([0.1, -0.2, 1.3]))
    design, residual = problem._rows(x, C_nb, 1.3)
    for column in range(15):
        step = np.zeros(15)
        step[column] = 1e-6
        further = x + step
        further[PHI] = 0.0
        moved = problem._rows(further, _rotation(step[PHI]) @ C_nb, 1.3)[1]
        np.testing.assert_allclose((residual - moved) / 1e-6, design[:, column], atol=2e-3 * np.abs(design).max())


@pytest.mark.parametrize("velocities", [True, False])
def test_the_minimum_is_the_truth_wherever_the_body_looks(truth: Path, velocities: bool) -> None:
    biases = np.array([0.02, -0.01, 0.015, 0.02, -0.03, 0.01])
    search = Search(*measured(truth, biases, velocities=velocities))
    minima = search.over(10.0)
    best = search.over(DURATION)[0]
    assert minima[0].rows > 9
    there = truth.truth(np.array([0.0]))
    heading = there.attitude[0, 2]
    assert abs((best.heading - heading + np.pi) % (2.0 * np.pi) - np.pi) < 1.0 * DEG
    np.testing.assert_allclose(best.x[V], there.velocity[0], atol=0.05)
    np.testing.assert_allclose(best.x[BG], biases[:3], atol=1e-3)
    np.testing.assert_allclose(best.x[P], truth.truth(np.array([0.0])).position[0] * 0.0, atol=1.5)


def test_noise_alone_tells_no_heading() -> None:
    """Once stated and once not: force that fixes do not follow shows nothing of where the body looks."""
    rng = np.random.default_rng(6)
    time = np.arange(0.0, DURATION + 1.0, 0.05)
    dvel = 0.05 * np.sqrt(0.05) * rng.standard_normal((len(time) - 1, 3)) + [0.0, 0.0, -9.8 * 0.05]
    at = np.arange(0.0, DURATION, 1.0)
    std = np.full((len(at), 3), 0.02)
    fixes = FixSeries(at, 0.02 * rng.standard_normal((len(at), 3)), std, None, None, np.zeros(3), 9.8)
    for stated in (0.05**2, 0.002**2):
        imu = MeanImu(time, np.zeros_like(dvel), dvel, np.zeros(3), BIAS_STD, (stated, 1e-8, 1e-10))
        assert Search(imu, fixes).over(DURATION)[0].std(PHI)[2] > 15.0 * DEG
