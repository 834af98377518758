"""The axes that an IMU really has are found from the others, whatever they are said to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from polyins.model.axes import axes_matrix
from polyins.model.recording import ImuStream, Recording
from polyins.model.rig import DEG
from polyins.prepare.mounts import AS_STATED, NAMES, TURNS, of_streams
from polyins.prepare.timesync import align
from polyins.prepare.votes import disagreements
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario


@pytest.fixture(scope="module", params=[3, 4])
def array(request: pytest.FixtureRequest) -> Recording:
    board = Board(count=request.param)
    return simulate(Scenario(duration_s=60.0, static_s=10.0, rate_hz=50.0, imus=board), seed=1)


def with_second(recording: Recording, gyro: np.ndarray, accel: np.ndarray) -> Recording:
    """Turn what the second IMU measures, (3, 3) each."""
    first, old, *others = recording.imus
    turned = ImuStream(old.name, old.time, old.dtheta @ gyro.T, old.dvel @ accel.T)
    return replace(recording, imus=(first, turned, *others))


@pytest.mark.parametrize("k", [k for k in range(len(NAMES)) if k != AS_STATED])
def test_any_other_axes_are_named_with_the_right_ones(array: Recording, k: int) -> None:
    """Rotated by 90 and 180 degrees, mirrored, swapped, all signs."""
    turned = with_second(array, TURNS[k], TURNS[k])
    (finding,) = disagreements(array.rig, align(turned.imus))
    assert (finding.kind, finding.stream, finding.axis, finding.severity) == ("mount", "imu2", None, "serious")
    right = TURNS[k].T
    assert finding.size == "[x, y, z]"
    assert finding.expected == f"[{', '.join(next(a for a in NAMES if np.array_equal(axes_matrix(a), right)))}]"
    assert f"expected mount: its axes are {finding.expected}" in finding.text
    assert ("mirrored" in finding.remedy) == (np.linalg.det(right) < 0.0)


@pytest.mark.parametrize("axis", range(3))
def test_the_sign_of_one_sensor_is_told_apart(array: Recording, axis: int) -> None:
    turn = np.diag([-1.0 if k == axis else 1.0 for k in range(3)])
    expected = f"[{', '.join('-' * (k == axis) + 'xyz'[k] for k in range(3))}]"
    for what, turns in (("gyro", (turn, np.eye(3))), ("accelerometer", (np.eye(3), turn))):
        (finding,) = disagreements(array.rig, align(with_second(array, *turns).imus))
        assert (finding.kind, finding.stream, finding.axis, finding.expected) == ("mount", "imu2", what, expected)


def test_the_axes_are_those_of_the_configuration(array: Recording) -> None:
    """An IMU that is upside down and said to be so, but that its x points back."""
    stated, right = axes_matrix(("x", "-y", "-z")), axes_matrix(("-x", "y", "-z"))
    imu = replace(array.rig.imus[1], rotation=stated)
    turned = with_second(array, stated @ right.T, stated @ right.T)
    first, second, *others = turned.imus
    finding = of_streams(imu, second, [first, *others])
    assert finding is not None
    assert (finding.size, finding.expected) == ("[x, -y, -z]", "[-x, y, -z]")


@pytest.mark.parametrize("size", [0.5 * DEG, 5.0 * DEG])
def test_a_bias_is_no_mount(array: Recording, size: float) -> None:
    first, old, *others = array.imus
    biased = ImuStream(old.name, old.time, old.dtheta + np.array([0.0, 0.0, size / 50.0]), old.dvel)
    (finding,) = disagreements(array.rig, align((first, biased, *others)))
    assert finding.kind == "disagreement"
    assert of_streams(array.rig.imus[1], array.imus[1], [first, *others]) is None
