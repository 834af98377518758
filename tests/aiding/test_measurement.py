"""Design matrices against differences of the residuals, both as compiled, for a vehicle that drives over hills."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from driven_vehicle import DEG, Array, drive

from polyins.aiding import measurement, rolling
from polyins.kernels import bank, earth, fuse, kalman, share
from polyins.kernels.bank import LANES
from polyins.navigate import batch
from polyins.navigate.batch import Prepared

STEPS = {"position": (range(3), 1e-3), "velocity": (range(3, 6), 1e-4), "phi": (range(6, 9), 1e-5)}
MOUNT = (range(share.INERTIAL, share.INERTIAL + 3), 1e-5)
BODY = 2


@cache
def driving() -> Prepared:
    """Triple INS in a bend on a slope, each IMU a little off where the others have it."""
    recording = drive()
    imus = tuple(replace(imu, mount_std=0.0 if imu.wheel else 0.5 * DEG) for imu in recording.rig.imus)
    options = replace(recording.options, rolling=replace(recording.options.rolling, predict="end"))
    run = batch.prepare(replace(recording, rig=replace(recording.rig, imus=imus), options=options), "triple-ins")
    run.advance(1, int(60.0 / np.median(np.diff(run.inputs.time))))
    return run


def measured(kind: float, s: int, corrected: int, correction: Array) -> Array:
    """Return the work array of share s after a correction of another, or of its own."""
    run = driving()
    dt = float(run.state.clock[1])
    blocks, groups = run.state.blocks.copy(), run.state.groups.copy()
    lane = int(run.state.members[corrected, 0])
    blocks[lane // LANES, bank.CORRECTION + lane % LANES : bank.CORRECTION + 24 * LANES : LANES] = correction
    metres = groups[corrected, share.METRIC : share.METRIC + 3]
    earth.metric(groups[corrected, share.POSITION : share.POSITION + 3], False, metres)
    fuse.correct_members(blocks, lane, lane + 1, metres)
    assert run.rolling is not None
    measurement.update_derived(blocks, groups, run.state.members, run.rolling, dt)
    given = run.rolling.given
    given[:] = 0.0
    given[rolling.KIND], given[rolling.G_SPEED], given[rolling.G_DT], given[rolling.G_DURATION] = kind, 3.0, dt, 0.1
    given[rolling.G_POINT : rolling.G_POINT + 3] = [0.2, 0.1, -0.8]
    m = run.state.measurements[s].copy()
    measurement.measure(s, blocks, groups, run.state.members, run.state.near, run.rolling, m)
    if run.rolling.lenders[s] >= 0:
        measurement.vehicle_attitude.write_lent(groups, s, run.rolling.lenders[s], m)
    return m


def columns(kind: float, s: int, corrected: int, states: range, step: float) -> Array:
    """Return what corrections of these states do to the residual, per unit, shape (3, len(states))."""
    found = np.zeros((3, len(states)))
    for k, state in enumerate(states):
        for sign in (1.0, -1.0):
            correction = np.zeros(24)
            correction[state] = sign * step
            residual = measured(kind, s, corrected, correction)[kalman.RESIDUAL : kalman.RESIDUAL + 3]
            found[:, k] -= sign * residual / (2.0 * step)
    return found


def design(kind: float, s: int, at: int, states: range) -> Array:
    m = measured(kind, s, s, np.zeros(24))
    return m[at : at + 3 * share.STRIDE].reshape(3, share.STRIDE)[:, states.start : states.stop]


@pytest.mark.parametrize("s", [0, 1, BODY])
@pytest.mark.parametrize("kind", [rolling.SPEED, rolling.POINT, rolling.ZERO_VELOCITY])
@pytest.mark.parametrize("what", STEPS)
def test_own_columns(kind: float, s: int, what: str) -> None:
    states, step = STEPS[what]
    differences = columns(kind, s, s, states, step)
    np.testing.assert_allclose(design(kind, s, kalman.H, states), differences, atol=1e-6)
    assert np.abs(differences).max() > 0.5 or (kind, what) in {
        (rolling.SPEED, "position"), (rolling.POINT, "velocity"), (rolling.POINT, "phi"),
        (rolling.ZERO_VELOCITY, "position"), (rolling.ZERO_VELOCITY, "phi"),
    }  # fmt: skip


@pytest.mark.parametrize("s", [0, 1, BODY])
@pytest.mark.parametrize("kind", [rolling.SPEED, rolling.POINT])
def test_columns_of_radius_lever_arm_and_mount(kind: float, s: int) -> None:
    differences = columns(kind, s, s, *MOUNT)
    np.testing.assert_allclose(design(kind, s, kalman.H, MOUNT[0]), differences, atol=2e-4)
    assert np.abs(differences).max() > 0.1


@pytest.mark.parametrize("s", [0, 1])
@pytest.mark.parametrize("kind", [rolling.SPEED, rolling.POINT])
def test_columns_of_the_roll_and_pitch_that_the_body_lends(kind: float, s: int) -> None:
    states, step = STEPS["phi"]
    differences = columns(kind, s, BODY, states, step)
    np.testing.assert_allclose(design(kind, s, kalman.LENT, states), differences, atol=1e-6)
    assert np.abs(differences).max() > 0.1
