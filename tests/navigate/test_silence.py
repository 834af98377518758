"""What happens to the track of a vehicle while IMUs give no data, and once they do again."""

from __future__ import annotations

import re

import numpy as np
import pytest
from driven_vehicle import DEG, drive, heading, off, without
from scipy.spatial.transform import Rotation

import polyins as pi
from polyins.kernels import bank
from polyins.kernels.bank import LANES
from polyins.navigate import batch
from polyins.simulation.scenario import SensorErrors


@pytest.mark.parametrize("method", ["dual-wheel-ins", "triple-ins", "triple-ins/centralized"])
def test_a_silent_wheel_is_carried_along(method: str) -> None:
    recording = without(drive(), "right1", 50.0, 52.5)
    solution = pi.run(recording, method)
    assert re.fullmatch(r"IMU right1: silent for 2.5\d s from 50.00 s; the others carried it along", *solution.faults)
    assert off(solution, recording).max() < 0.1
    whole = pi.run(drive(), method)
    before = solution.time < 50.0
    np.testing.assert_allclose(solution.position[before], whole.position[before], atol=1e-9)
    # only those with data navigate: what the other wheel says holds for the vehicle
    lost = np.linalg.norm(solution.velocity - np.column_stack(
        [np.interp(solution.time, whole.time, whole.velocity[:, k]) for k in range(3)]
    ), axis=1)  # fmt: skip
    assert lost[(solution.time > 50.0) & (solution.time < 53.0)].max() < 0.1


@pytest.mark.parametrize("method", ["wheel-ins/left", "body-ins/left", "triple-ins"])
def test_one_silent_chip_does_not_silence_its_module(method: str) -> None:
    whole = drive(chips=3, errors=SensorErrors(noise=False, scales=False))
    solution, undisturbed = (pi.run(one, method) for one in (without(whole, "left2", 50.0, 90.0), whole))
    assert re.fullmatch(r"IMU left2: silent for 40.0\d s from 50.00 s; its module went on without it", *solution.faults)
    # the mean of two that err otherwise than the mean of three, by a bias known from the standstill
    assert np.abs(solution.position[:, :2] - undisturbed.position[:, :2]).max() < 0.3
    assert np.abs(heading(solution) - heading(undisturbed)).max() < 0.1 * DEG


def test_the_summary_says_when_nobody_was_left_to_carry() -> None:
    recording = drive()
    for imu in ("left1", "right1", recording.rig.imus[0].name):
        recording = without(recording, imu, 49.0 if imu == "left1" else 50.0, 50.5)
    faults = dict(text.split(": ", 1) for text in pi.run(recording, "triple-ins").faults)
    assert re.search(r"; for 0.5\d s of it every IMU was, and the vehicle coasted", faults["IMU left1"])
    assert faults["IMU right1"].endswith("from 50.00 s; the vehicle coasted")


def test_a_wheel_alone_coasts_and_finds_its_angle_again() -> None:
    """Its roll is lost with its data; half a turn of error would let gravity take the track away."""
    recording = without(drive(), "left1", 50.0, 52.0)
    run = batch.prepare(recording, "wheel-ins/left")
    run.advance(1, len(run.inputs.time))
    whole = batch.prepare(drive(), "wheel-ins/left")
    whole.advance(1, len(whole.inputs.time))
    angles = [
        Rotation.from_quat(p.state.rows[0, bank.QUATERNION : bank.QUATERNION + 4 * LANES : LANES], scalar_first=True)
        for p in (run, whole)
    ]
    assert (angles[0].inv() * angles[1]).magnitude() < 15.0 * DEG
    solution = pi.run(without(drive(), "left1", 50.0, 50.5), "wheel-ins/left")
    assert re.fullmatch(r"IMU left1: silent for 0.5\d s from 50.00 s; the vehicle coasted", *solution.faults)
    reference = recording.reference
    assert reference is not None
    after = reference.time[reference.time >= solution.time[0]] < 54.0
    assert off(solution, recording)[after].max() < 0.75
