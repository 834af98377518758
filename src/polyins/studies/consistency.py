"""Do the errors of a single filter fit its covariance: NEES of nine navigation states over many simulated drives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.config.units import in_si
from polyins.evaluation.consistency import nees, nees_bounds, share_inside
from polyins.kernels import covariance
from polyins.model.attitude import rotation_matrices
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import StartOptions
from polyins.navigate import batch
from polyins.navigate.state import LOG_EVERY, STRIDE
from polyins.prepare.alignment import rotation_matrix
from polyins.simulation.path import Path, Truth
from polyins.simulation.run import simulate_with_truth
from polyins.simulation.scenario import Scenario, StartStd
from polyins.studies.scenario_files import read

Array = NDArray[np.float64]

SEEDS = 50
QUICK_SEEDS = 10
STATES = 9
STARTS_AT = 1.0  # s


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run one IMU on each of fifty drives from a start with errors of its stated size, and return the document."""
    seeds = QUICK_SEEDS if quick else SEEDS
    scenario = read(Scenario, __package__, "consistency")
    errors, covariances = [], []
    for seed in range(seeds):
        error, covariance = errors_of(scenario, seed)
        errors.append(error)
        covariances.append(covariance)
        if progress:
            progress((seed + 1) / seeds)
    average = nees(np.array(errors), np.array(covariances))
    lower, upper = nees_bounds(seeds, STATES)
    return {
        "target": "consistency",
        "paper": {},
        "polyins": {
            "share_inside_95_percent": share_inside(average, seeds, STATES),
            "mean_nees": float(average.mean()),
            "states": STATES,
            "bounds": [lower, upper],
        },
        "settings": {"seeds": seeds, "scenario": scenario.model_dump(mode="json")},
    }


def errors_of(scenario: Scenario, seed: int) -> tuple[Array, Array]:
    """Return the errors at whole seconds, shape (T, 9), and the filter's covariance of them, (T, 9, 9)."""
    simulation = simulate_with_truth(scenario, seed=seed)
    start = _start(simulation.path, scenario.start_std, np.random.default_rng([seed, 1]))
    run = batch.prepare(replace(simulation.recording, start=start), "single")
    every = int(run.plan.settings[LOG_EVERY])
    stride = int(run.plan.settings[STRIDE])
    covariances = []
    for first in range(1, len(run.inputs.time) - every, every):
        run.advance(first, first + every)
        p = run.state.blocks[0, covariance.P : covariance.P + stride**2]
        covariances.append(p.reshape(stride, stride)[:STATES, :STATES].copy())
    rows = np.arange(len(covariances)) * every + every
    truth = simulation.path.truth(run.inputs.time[rows])
    return navigation_errors(run.outputs.states[rows], truth), np.array(covariances)


def _start(path: Path, claimed: StartStd, rng: np.random.Generator) -> StartOptions:
    """Return the true state with errors drawn from the standard deviations that the filter has."""
    truth = path.truth(np.array([STARTS_AT]))
    keys = ("position_m", "velocity_m_s", "attitude_deg")
    position_std, velocity_std, attitude_std = (in_si(claimed, key) for key in keys)
    metres = metres_per_unit(truth.position[0], True)
    # the error of attitude is phi: C_hat = (I - phi x) C
    phi = rng.normal(0.0, attitude_std)
    c = rotation_matrix(truth.attitude[0])
    from scipy.spatial.transform import Rotation

    heading, pitch, roll = (Rotation.from_rotvec(-phi) * Rotation.from_matrix(c)).as_euler("ZYX")
    return StartOptions(
        time=STARTS_AT,
        position=truth.position[0] + rng.normal(0.0, position_std) / metres,
        velocity=truth.velocity[0] + rng.normal(0.0, velocity_std),
        roll_pitch=np.array([roll, pitch]),
        heading=float(heading),
        position_std=position_std,
        velocity_std=velocity_std,
        attitude_std=attitude_std,
        estimate_gyro_bias=False,
    )


def navigation_errors(states: Array, truth: Truth) -> Array:
    """Return position (m), velocity (m/s) and phi (rad) errors, estimate minus truth, shape (T, 9)."""
    from scipy.spatial.transform import Rotation

    position = (states[:, 0:3] - truth.position) * metres_per_unit(truth.position, True)
    turned = rotation_matrices(states[:, 6:10]) @ rotation_matrices(truth.quaternion).transpose(0, 2, 1)
    phi = -Rotation.from_matrix(turned).as_rotvec()
    return np.hstack([position, states[:, 3:6] - truth.velocity, phi])
