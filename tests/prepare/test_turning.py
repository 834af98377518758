"""IMUs of a vehicle that turn otherwise than the others are named; those that only err as their figures say are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_vehicle import drive
from numpy.typing import NDArray

from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, Recording
from polyins.model.rig import DEG
from polyins.prepare.timesync import align
from polyins.prepare.turning import of_turning
from polyins.simulation.scenario import SensorErrors

FROM = 60.0
LEFT, BODY = "left1", "body1"


def recorded(seed: int = 0) -> Recording:
    return drive(errors=SensorErrors(), seed=seed)


def found(recording: Recording) -> tuple[Finding, ...]:
    return of_turning(recording.rig, align(recording.imus, bridge=False))


def with_stream(recording: Recording, stream: ImuStream) -> Recording:
    streams = tuple(stream if one.name == stream.name else one for one in recording.imus)
    return replace(recording, imus=streams)


def biased(recording: Recording, name: str, axis: int, bias: float) -> Recording:
    """Add a bias to a gyro axis from then on, rad/s."""
    (old,) = (one for one in recording.imus if one.name == name)
    dtheta: NDArray[np.float64] = old.dtheta.copy()
    dtheta[old.time > FROM, axis] += bias / old.rate_hz
    return with_stream(recording, ImuStream(name, old.time, dtheta, old.dvel))


def only(recording: Recording, *names: str) -> Recording:
    return recording.subset([i for i, imu in enumerate(recording.rig.imus) if imu.name in names])


@pytest.mark.parametrize("seed", [0, 2])
def test_good_ones_agree(seed: int) -> None:
    assert found(recorded(seed)) == ()
    assert found(only(recorded(seed), LEFT, BODY)) == ()


@pytest.mark.parametrize("size", [1.0, -5.0])
def test_body_that_turns_otherwise_is_named(size: float) -> None:
    (finding,) = found(biased(recorded(), BODY, 2, size * DEG))
    assert finding.kind == "disagreement"
    assert finding.stream == BODY
    assert finding.severity == "doubt"
    assert finding.from_s == pytest.approx(FROM, abs=10.1)
    assert isinstance(finding.size, float)
    assert abs(finding.size) == pytest.approx(abs(size), rel=0.3)


def test_two_that_differ_are_named_as_a_pair() -> None:
    (finding,) = found(only(biased(recorded(), BODY, 2, 2.0 * DEG), LEFT, BODY))
    assert set(finding.stream.split(", ")) == {LEFT, BODY}


def test_bias_across_the_axle_of_a_wheel_is_named() -> None:
    (finding,) = found(biased(recorded(), LEFT, 1, 6.0 * DEG))
    assert finding.stream == LEFT
    assert "across the axle" in finding.text


@pytest.mark.parametrize("name", [LEFT, BODY])
def test_clock_that_leaps_is_seen_by_the_turns_after_it(name: str) -> None:
    recording = recorded()
    (old,) = (one for one in recording.imus if one.name == name)
    time = np.where(old.time > FROM, old.time + 4.0, old.time)
    findings = found(with_stream(recording, ImuStream(name, time, old.dtheta, old.dvel)))
    assert [one.stream for one in findings] == [name]


def test_an_array_is_left_to_its_votes() -> None:
    from polyins.simulation.run import simulate
    from polyins.simulation.scenario import Board, Scenario

    array = simulate(Scenario(duration_s=60.0, static_s=10.0, rate_hz=50.0, imus=Board(count=3)))
    assert found(array) == ()
