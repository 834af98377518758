"""Vehicles with wheels as a user meets them: what happens to the track when something is wrong, missing or unknown."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import polyins as pi
from polyins import batch, course, modules
from polyins.aiding import rolling
from polyins.errors import InputError
from polyins.kernels import bank
from polyins.kernels.bank import LANES
from polyins.methods import find_method
from polyins.recording import Recording
from polyins.simulation.run import record, true_run
from polyins.simulation.scenario import Board, Errors, Fixes, Scenario
from polyins.simulation.wheel_scenario import WheelModule
from polyins.solution import Solution

Array = NDArray[np.float64]

DEG = np.pi / 180.0
ANTENNA = (0.2, 0.1, -0.8)
PERFECT = Errors(noise=False, biases=False, scales=False)


@lru_cache(maxsize=8)
def drive(chips: int = 1, gnss: bool = False, errors: Errors = PERFECT, seed: int = 0) -> Recording:
    """Two minutes of a small car on a plane, the first ten seconds standing."""
    sides = (("left", -0.4), ("right", 0.4))
    wheel_modules = tuple(
        WheelModule(name=name, position_m=(0.0, y, 0.0), radius_m=0.25, chips=chips, lever_arm_m=(0.0, 0.02, 0.01))
        for name, y in sides
    )
    scenario = Scenario(
        duration_s=120.0,
        static_s=10.0,
        earth="plane",
        top_speed_m_s=4.0,
        imus=Board(count=1, position_m=(0.3, 0.1, -0.4)),
        wheels=wheel_modules,
        errors=errors,
        gnss=Fixes(antenna_position_m=ANTENNA) if gnss else None,
        outages=(),
    )
    return record(true_run(scenario), seed=seed).recording


def with_rolling(recording: Recording, **options: Any) -> Recording:
    rolling = replace(recording.options.rolling, **options)
    return replace(recording, options=replace(recording.options, rolling=rolling))


def changed(recording: Recording, name: str, **wheel: Any) -> Recording:
    """The rig as it is configured with another wheel than it has."""
    imus = [
        replace(imu, wheel=replace(imu.wheel, **wheel)) if imu.wheel and imu.name.startswith(name) else imu
        for imu in recording.rig.imus
    ]
    return replace(recording, rig=replace(recording.rig, imus=tuple(imus)))


def without(recording: Recording, name: str, begin: float, end: float) -> Recording:
    """The recording with a hole in one stream."""
    streams = []
    for stream in recording.imus:
        kept = (stream.time <= begin) | (stream.time > end) | (stream.name != name)
        streams.append(replace(stream, time=stream.time[kept], dtheta=stream.dtheta[kept], dvel=stream.dvel[kept]))
    return replace(recording, imus=tuple(streams))


def off(solution: Solution, recording: Recording) -> Array:
    """Horizontal errors at the reference's epochs, m."""
    reference = recording.reference
    assert reference is not None
    shown = (reference.time >= solution.time[0]) & (reference.time <= solution.time[-1])
    at = [np.interp(reference.time[shown], solution.time, solution.position[:, k]) for k in range(2)]
    return np.hypot(*(np.array(at) - reference.position[shown, :2].T))


def heading(solution: Solution) -> Array:
    return np.asarray(Rotation.from_quat(solution.attitude, scalar_first=True).as_euler("ZYX")[:, 0])


@pytest.mark.parametrize("method", ["body-ins", "body-wheel-ins", "triple-ins", "multi-wheel-ins"])
@pytest.mark.parametrize("centralized", ["", "/centralized"])
def test_error_free_imus_dead_reckon_over_hills_to_centimetres(method: str, centralized: str) -> None:
    recording = drive()
    solution = pi.run(recording, method + centralized)
    assert off(solution, recording).max() < 0.02
    assert solution.faults == ()


def test_without_a_body_hills_are_taken_for_level() -> None:
    """The way along a slope is counted as a horizontal one."""
    recording = drive()
    taken_for_level = off(pi.run(recording, "dual-wheel-ins"), recording)[-1]
    assert taken_for_level > 2.0 * off(pi.run(recording, "triple-ins"), recording)[-1]


def test_a_later_prediction_is_later() -> None:
    """The mean speed of the last tenth of a second against the velocity at its end, while speeds change."""
    recording = drive()
    late = pi.run(with_rolling(recording, predict="end"), "wheel-ins")
    assert off(late, recording).max() > 5.0 * off(pi.run(recording, "wheel-ins"), recording).max()


@pytest.mark.parametrize("method", ["wheel-ins/left", "triple-ins", "triple-ins/centralized"])
def test_equal_chips_of_a_module_are_one(method: str) -> None:
    recording = drive(chips=3)
    run = batch.prepare(recording, method)
    assert [last - first for first, last in run.state.members if run.members[first].imu.wheel] == [3] * (
        1 if "wheel" in method else 2
    )
    assert all(first % LANES == 0 for first, _ in run.state.members)
    alone = pi.run(recording, method.replace("/left", "/left1").replace("triple-ins", "triple-ins/left1/right1"))
    together = pi.run(recording, method)
    np.testing.assert_allclose(together.position, alone.position, atol=1e-9)
    np.testing.assert_allclose(together.position_variance, alone.position_variance, rtol=1e-9)
    assert together.imu_names[:3] == ("left1", "left2", "left3")


def test_chips_of_a_module_average_their_errors() -> None:
    noisy = Errors(turn_on_share=1.0)
    one, four = [], []
    for seed in range(4):
        recording = drive(chips=4, errors=noisy, seed=seed)
        one += [off(pi.run(recording, f"wheel-ins/left{k}"), recording)[-1] for k in range(1, 5)]
        four.append(off(pi.run(recording, "wheel-ins/left"), recording)[-1])
    assert np.sqrt(np.mean(np.square(four))) < 0.75 * np.sqrt(np.mean(np.square(one)))


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
    whole = drive(chips=3, errors=Errors(noise=False, scales=False))
    solution, undisturbed = (pi.run(one, method) for one in (without(whole, "left2", 50.0, 90.0), whole))
    assert re.fullmatch(r"IMU left2: silent for 40.0\d s from 50.00 s; its module went on without it", *solution.faults)
    # the mean of two that err otherwise than the mean of three, by a bias known from the standstill
    assert np.abs(solution.position[:, :2] - undisturbed.position[:, :2]).max() < 0.3
    assert np.abs(heading(solution) - heading(undisturbed)).max() < 0.1 * DEG


def test_the_summary_says_when_nobody_was_left_to_carry() -> None:
    recording = drive()
    for imu in ("left1", "right1", recording.rig.imus[0].name):
        recording = without(recording, imu, 50.0 if imu == "left1" else 50.5, 52.0)
    faults = dict(text.split(": ", 1) for text in pi.run(recording, "triple-ins").faults)
    assert re.search(r"; for 1.5\d s of it every IMU was, and the vehicle coasted", faults["IMU left1"])
    assert faults["IMU right1"].endswith("from 50.50 s; the vehicle coasted")


def test_a_wheel_alone_coasts_and_finds_its_angle_again() -> None:
    """Its roll is lost with its data; half a turn of error would let gravity take the track away."""
    recording = without(drive(), "left1", 50.0, 52.0)
    run = batch.prepare(recording, "wheel-ins/left")
    run.advance(1, len(run.inputs.time))
    whole = batch.prepare(drive(), "wheel-ins/left")
    whole.advance(1, len(whole.inputs.time))
    angles = [
        Rotation.from_quat(p.state.blocks[0, bank.QUATERNION : bank.QUATERNION + 4 * LANES : LANES], scalar_first=True)
        for p in (run, whole)
    ]
    assert (angles[0].inv() * angles[1]).magnitude() < 15.0 * DEG
    solution = pi.run(recording, "wheel-ins/left")
    assert re.fullmatch(r"IMU left1: silent for 2.0\d s from 50.00 s; the vehicle coasted", *solution.faults)
    reference = recording.reference
    assert reference is not None
    after = reference.time[reference.time >= solution.time[0]] < 54.0
    assert off(solution, recording)[after].max() < 3.0


def test_driving_straight_on_is_no_standstill() -> None:
    """A body turns as little then as at a stop: the wheels tell them apart."""
    recording = drive()
    run = batch.prepare(recording, "body-ins")
    run.advance(1, len(run.inputs.time))
    assert run.rolling is not None
    reference = recording.reference
    assert reference is not None
    assert reference.velocity is not None
    shown = reference.time > run.start.time
    standing = np.mean(np.linalg.norm(reference.velocity[shown], axis=1) < 0.01) * (reference.time[-1] - run.start.time)
    assert run.rolling.memory[rolling.STILL] == pytest.approx(standing, abs=2.5)


def test_at_a_stop_the_gyros_are_calibrated() -> None:
    recording = drive(errors=Errors(noise=True, biases=True, scales=False, turn_on_share=1.0))
    # the bias is not taken from the standstill, which is still ahead of the start
    start = replace(recording.start, time=1.0, static_interval=(0.0, 1.0), estimate_gyro_bias=False)
    recording = replace(recording, start=start)
    with_stops = pi.run(recording, "triple-ins")
    without_stops = pi.run(with_rolling(recording, standstill=False), "triple-ins")
    assert np.all(with_stops.imu_error_std[8, :, :3] < 0.75 * without_stops.imu_error_std[8, :, :3])


def test_with_gnss_the_radius_is_found() -> None:
    recording = changed(drive(gnss=True), "left", radius=0.2525, radius_std=0.02)
    solution = pi.run(recording, "wheel-ins/left")
    assert solution.mounting is not None
    assert solution.mounting_std is not None
    estimate, std = solution.mounting[-1, 0, 0], solution.mounting_std[-1, 0, 0]
    assert std < 0.002
    assert estimate == pytest.approx(-0.01 / 1.01, abs=4.0 * std + 2e-4)


def test_the_lever_arm_is_found() -> None:
    recording = changed(drive(gnss=True), "left", lever_arm=np.array([0.0, 0.015, 0.014]), lever_arm_std=0.01)
    solution = pi.run(recording, "wheel-ins/left")
    assert solution.mounting is not None
    np.testing.assert_allclose(solution.mounting[-1, 0, 1:], [0.005, -0.004], atol=1e-3)


def test_gnss_holds_the_track_and_outages_are_dead_reckoned() -> None:
    recording = replace(drive(gnss=True), outages=((60.0, 90.0),))
    solution = pi.run(recording, "triple-ins")
    assert off(solution, recording).max() < 0.3
    assert np.all(solution.innovations.accepted)
    hidden = (solution.innovations.time > 60.0) & (solution.innovations.time < 90.0)
    assert not hidden.any()


@pytest.mark.parametrize("method", ["wheel-ins", "triple-ins", "triple-ins/centralized"])
def test_the_heading_at_the_start_comes_from_gnss(method: str) -> None:
    recording = drive(gnss=True)
    truth = recording.reference
    assert truth is not None
    assert truth.attitude is not None
    assert recording.start.heading is None
    solution = pi.run(recording, method)
    assert "turned onto GNSS" in str(solution.start["heading"])
    expected = np.interp(solution.time[0], truth.time, np.unwrap(truth.attitude[:, 2]))
    assert np.sin(heading(solution)[0] - expected) == pytest.approx(0.0, abs=0.5 * DEG)


def test_a_vehicle_that_stays_has_no_heading() -> None:
    recording = drive(gnss=True)
    still = replace(recording, start=replace(recording.start, time=1.0, end_time=9.0, static_interval=(0.0, 1.0)))
    with pytest.raises(InputError, match=r"start: no heading: the vehicle goes .* m while there is GNSS"):
        pi.run(still, "wheel-ins")


def test_a_start_in_motion_is_refused() -> None:
    recording = drive()
    moving = replace(recording.start, time=60.0, static_interval=None)
    cut = [replace(s, time=s.time[10000:], dtheta=s.dtheta[10000:], dvel=s.dvel[10000:]) for s in recording.imus]
    with pytest.raises(InputError, match="a vehicle with wheels starts at one"):
        pi.run(replace(recording, imus=tuple(cut), start=moving), "triple-ins")


@pytest.mark.parametrize(
    ("method", "kept", "message"),
    [
        ("wheel-ins", [2], "needs an IMU on a wheel"),
        ("dual-wheel-ins", [0, 2], "needs 2 wheels that do not steer; this rig has 1"),
        ("triple-ins", [0, 1], "needs an IMU on the body"),
        ("multi-wheel-ins", [0], "needs two modules or more"),
        ("dual-wheel-ins/left1/left1", [0, 1], "says 'left1' twice"),
        ("wheel-ins/body1", [0, 1, 2], "has no place for 'body1'; expected modules on wheels: 1, on the body: 0"),
        ("wheel-ins/left/right", [0, 1], "has no place for 'right'"),
        ("wheel-ins/IMU9", [0, 1], "'IMU9' is no IMU or module; expected one of left, right"),
    ],
)
def test_a_method_says_what_it_lacks(method: str, kept: list[int], message: str) -> None:
    recording = drive()
    order = sorted(range(3), key=lambda i: recording.rig.imus[i].wheel is None)
    with pytest.raises(InputError, match=message):
        pi.run(recording.subset([order[k] for k in kept]), method)


def test_the_heading_is_found_from_no_more_of_the_drive_than_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = drive(gnss=True)
    ends: list[float | None] = []

    def navigate(blind: Recording) -> Solution:
        ends.append(blind.start.end_time)
        return pi.run(blind, "triple-ins")

    found = course.find(recording, 10.0, navigate)
    monkeypatch.setattr(course, "_end", lambda *given: None)
    assert course.find(recording, 10.0, navigate) == found
    assert ends[0] is not None
    assert 25.0 < ends[0] < 60.0
    assert ends[1] is None


def test_array_methods_are_not_for_vehicles() -> None:
    with pytest.raises(InputError, match="enav-fusion is for arrays; this rig has wheels"):
        pi.run(drive(), "enav-fusion")


def test_what_a_rig_allows() -> None:
    recording = drive()
    assert modules.available(recording.rig) == [
        "wheel-ins", "body-ins", "dual-wheel-ins", "body-wheel-ins", "triple-ins", "multi-wheel-ins"
    ]  # fmt: skip
    left = [i for i, imu in enumerate(recording.rig.imus) if imu.module == "left"]
    assert modules.available(recording.subset(left).rig) == ["wheel-ins"]
    with pytest.raises(InputError, match="expected nothing after 'single'"):
        find_method("single/centralized")
