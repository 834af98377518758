"""IMUs that disagree are named, with the axis and the size; those that only err as their figures say are not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from polyins.model.recording import ImuStream, Recording
from polyins.model.rig import DEG
from polyins.prepare.timesync import align
from polyins.prepare.votes import disagreements
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario

Array = NDArray[np.float64]
RATE_HZ = 50.0


def array(count: int, seed: int = 0) -> Recording:
    return simulate(Scenario(duration_s=90.0, static_s=20.0, rate_hz=RATE_HZ, imus=Board(count=count)), seed=seed)


def with_fault(recording: Recording, imu: int, fault: Callable[[Array, Array], None]) -> Recording:
    """Change the increments of one IMU from 50 s on."""
    streams = list(recording.imus)
    old = streams[imu]
    dtheta, dvel = old.dtheta.copy(), old.dvel.copy()
    late = old.time > 50.0
    angles, speeds = dtheta[late], dvel[late]
    fault(angles, speeds)
    dtheta[late], dvel[late] = angles, speeds
    streams[imu] = ImuStream(old.name, old.time, dtheta, dvel)
    return replace(recording, imus=tuple(streams))


def add(axis: int, size: float) -> Callable[[Array, Array], None]:
    def fault(dtheta: Array, dvel: Array) -> None:
        (dtheta if axis < 3 else dvel)[:, axis % 3] += size / RATE_HZ

    return fault


@pytest.mark.parametrize("count", [3, 4, 16])
@pytest.mark.parametrize(
    ("axis", "size", "name", "shown"),
    [(2, 0.5 * DEG, "gyro z", 0.5), (0, -3.0 * DEG, "gyro x", -3.0), (4, 0.6, "accelerometer y", 0.6)],
)
def test_who_disagrees_is_named(count: int, axis: int, size: float, name: str, shown: float) -> None:
    recording = with_fault(array(count), 1, add(axis, size))
    (finding,) = disagreements(recording.rig, align(recording.imus))
    assert finding.kind == "disagreement"
    assert finding.stream == "imu2"
    assert finding.axis == name
    assert isinstance(finding.size, float)
    assert finding.size == pytest.approx(shown, rel=0.2)
    assert finding.from_s == pytest.approx(50.0, abs=5.1)
    assert finding.severity == "doubt"


def test_two_that_disagree_are_named_as_a_pair() -> None:
    recording = with_fault(array(2), 0, add(2, 2.0 * DEG))
    (finding,) = disagreements(recording.rig, align(recording.imus))
    assert finding.stream == "imu1, imu2"
    assert isinstance(finding.size, float)
    assert finding.size == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize("count", [2, 3, 4, 16])
def test_good_ones_agree(count: int) -> None:
    for seed in range(5):
        recording = array(count, seed)
        assert disagreements(recording.rig, align(recording.imus)) == ()


def test_a_bias_that_is_stated_is_no_disagreement() -> None:
    recording = with_fault(array(3), 1, add(2, 2.0 * DEG))
    imus = list(recording.rig.imus)
    errors = imus[1].initial_errors
    imus[1] = replace(imus[1], initial_errors=replace(errors, gyro_bias=np.array([0.0, 0.0, 2.0 * DEG])))
    rig = replace(recording.rig, imus=tuple(imus))
    found = disagreements(rig, align(recording.imus))
    assert not found or found[0].to_s < 56.0  # before 50 s it is not there yet
