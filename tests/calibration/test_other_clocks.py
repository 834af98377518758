"""Clocks of receivers and other sensors against that of the IMUs, in simulation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polyins.calibration.other_clocks import Movers
from polyins.calibration.receiver_clock import Body
from polyins.errors import InputError
from polyins.model.clock import Clock
from polyins.model.recording import AidingStream, Offset, Recording, Reference
from polyins.simulation.run import Simulation, simulate_with_truth
from polyins.simulation.scenario import Scenario

TRUE = Clock(-2.3, 120e-6, 60.0)
LEAPS = Clock(1.5, -40e-6, 60.0, ((52.3, -0.2),))
"""it leaps while the vehicle drives: at rest no place is better than another"""


@pytest.fixture(scope="module")
def driven() -> Simulation:
    scenario = {
        "duration_s": 120,
        "static_s": 2,
        "rate_hz": 50,
        "imus": {"count": 2},
        "outages": [],
        "noise": "industrial-mems",
    }
    return simulate_with_truth(Scenario.model_validate(scenario), seed=4)


def movers(recording: Recording) -> Movers:
    return Movers(recording.rig.imus, recording.imus, recording.options.gravity)


def of_receiver(recording: Recording, clock: Clock) -> Offset:
    assert recording.gnss is not None
    fixes = replace(recording.gnss, time=clock.inverse.common(recording.gnss.time))
    return movers(recording).of_positions("GNSS", fixes, recording.geodetic, recording.rig.antenna)


def assert_right(found: Offset, clock: Clock, largest_s: float) -> None:
    off = found.clock.common(found.reference_s) - clock.common(found.reference_s)
    assert abs(off) < min(4.0 * found.std_s + 1e-4, largest_s)
    assert abs(found.drift - clock.drift) < 4.0 * found.drift_std + 1e-6


@pytest.mark.parametrize("clock", [TRUE, LEAPS])
def test_receiver(driven: Simulation, clock: Clock) -> None:
    found = of_receiver(driven.recording, clock)
    assert_right(replace(found, leaps=()), replace(clock, leaps=()), 6e-3)
    assert found.drift_std < 100e-6
    assert found.correlation is None
    assert len(found.leaps) == len(clock.leaps)
    for (stamp, size, std), (at, true) in zip(found.leaps, clock.leaps, strict=True):
        assert abs(stamp - at) < 1.1  # from one fix to the next
        assert abs(size - true) < min(4.0 * std, 0.015)


def test_a_receiver_with_velocities_without_gravity_or_earth_known(driven: Simulation) -> None:
    recording = driven.recording
    assert recording.gnss is not None
    truth = driven.path.truth(recording.gnss.time, recording.rig.antenna)
    std = np.full((len(recording.gnss.time), 3), 0.05)
    noise = np.random.default_rng(2).normal(0.0, 0.05, std.shape)
    moving = replace(recording.gnss, velocity=truth.velocity + noise, velocity_std=std)
    both, alone = of_receiver(replace(recording, gnss=moving), TRUE), of_receiver(recording, TRUE)
    assert_right(both, TRUE, 6e-3)
    assert both.std_s < 1.02 * alone.std_s


def test_fixes_of_another_drive_are_refused(driven: Simulation) -> None:
    scenario = Scenario.model_validate({"duration_s": 120, "static_s": 2, "rate_hz": 20, "outages": []})
    other = simulate_with_truth(scenario, seed=6)
    assert other.recording.gnss is not None
    strange = other.recording.gnss
    fixes = replace(strange, time=strange.time).at(strange.time > 50.0)
    with pytest.raises(InputError, match=r"time_offset: .*GNSS"):
        of_receiver(replace(driven.recording, gnss=fixes), Clock())


TIME = np.arange(1.0, 118.0, 0.1)


def shown(driven: Simulation, kind: str, std: float) -> AidingStream:
    """What a sensor at the array's origin shows, by a clock of its own."""
    truth, stamps = driven.path.truth(TIME), TRUE.inverse.common(TIME)
    matrices = Rotation.from_euler("ZYX", truth.attitude[:, ::-1]).as_matrix()
    speed = np.einsum("ti,tij->tj", truth.velocity, matrices)
    values = {"heading": truth.attitude[:, 2], "odometer": speed[:, 0], "height": truth.position[:, 2] - 20.0}[kind]
    noise = np.random.default_rng(3).normal(0.0, std, len(TIME))
    return AidingStream(kind, stamps, values + noise, np.full((len(TIME), 1), std))


@pytest.mark.parametrize(("kind", "std", "largest"), [("heading", 3e-3, 3e-3), ("odometer", 0.02, 5e-3)])
def test_sensors_by_a_trajectory(driven: Simulation, kind: str, std: float, largest: float) -> None:
    recording = driven.recording
    assert recording.gnss is not None
    path = movers(recording).path(recording.gnss, recording.geodetic, recording.rig.antenna)
    found = movers(recording).of_sensor(shown(driven, kind, std), np.zeros(3), path)
    assert_right(found, TRUE, largest)
    assert found.correlation is None


@pytest.mark.parametrize(("kind", "std", "largest"), [("heading", 3e-3, 0.01), ("odometer", 0.02, 0.15)])
def test_sensors_without_gnss(driven: Simulation, kind: str, std: float, largest: float) -> None:
    found = movers(driven.recording).of_sensor(shown(driven, kind, std), np.zeros(3), None)
    assert_right(found, TRUE, largest)
    assert found.correlation is not None


def test_heights_by_those_of_gnss(driven: Simulation) -> None:
    recording = driven.recording
    assert recording.gnss is not None
    path = movers(recording).path(recording.gnss, recording.geodetic, recording.rig.antenna)
    assert_right(movers(recording).of_sensor(shown(driven, "height", 0.02), np.zeros(3), path), TRUE, 0.2)
    with pytest.raises(InputError, match="expected a section gnss"):
        movers(driven.recording).of_sensor(shown(driven, "height", 0.02), np.zeros(3), None)


def test_attitudes_of_a_reference(driven: Simulation) -> None:
    truth = driven.path.truth(TIME)
    reference = Reference(TRUE.inverse.common(TIME), truth.position, attitude=truth.attitude)
    assert_right(movers(driven.recording).of_reference(reference, True), TRUE, 2e-3)


def test_a_body_of_several_is_quieter(driven: Simulation) -> None:
    recording = driven.recording
    one = Body.of(recording.rig.imus[:1], recording.imus[:1])
    two = Body.of(recording.rig.imus, recording.imus)
    assert two.noise.angle_random_walk == pytest.approx(one.noise.angle_random_walk / np.sqrt(2.0))
    np.testing.assert_allclose(two.start_std, one.start_std)
