"""Vehicles with wheels as a user meets them: what happens to the track when something is wrong, missing or unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_vehicle import DEG, changed, drive, heading, off, with_rolling

import polyins as pi
from polyins.errors import InputError
from polyins.kernels.bank import LANES
from polyins.model.methods import find_method
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.navigate import batch, choice
from polyins.prepare import course
from polyins.simulation.scenario import SensorErrors


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
    recording = drive(chips=3).as_published()
    run = batch.prepare(recording, method)
    assert [last - first for first, last in run.bank.spans if run.bank.members[first].imu.wheel] == [3] * (
        1 if "wheel" in method else 2
    )
    assert all(first % LANES == 0 for first, _ in run.bank.spans)
    alone = pi.run(recording, method.replace("/left", "/left1").replace("triple-ins", "triple-ins/left1/right1"))
    together = pi.run(recording, method)
    np.testing.assert_allclose(together.position, alone.position, atol=1e-9)
    np.testing.assert_allclose(together.position_variance, alone.position_variance, rtol=1e-9)
    assert together.imu_names[:3] == ("left1", "left2", "left3")


def test_chips_of_a_module_average_their_errors() -> None:
    noisy = SensorErrors(turn_on_share=1.0)
    one, four = [], []
    for seed in range(4):
        recording = drive(chips=4, errors=noisy, seed=seed)
        one += [off(pi.run(recording, f"wheel-ins/left{k}"), recording)[-1] for k in range(1, 5)]
        four.append(off(pi.run(recording, "wheel-ins/left"), recording)[-1])
    assert np.sqrt(np.mean(np.square(four))) < 0.75 * np.sqrt(np.mean(np.square(one)))


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


def test_a_method_of_arrays_takes_the_imus_on_the_body() -> None:
    recording = drive()
    together = pi.run(recording, "enav-fusion")
    assert set(together.imu_names) == {imu.name for imu in recording.rig.imus if imu.wheel is None}
    assert off(together, recording)[-1] < 1.5 * off(pi.run(recording, "body-ins"), recording)[-1]
    wheels = [i for i, imu in enumerate(recording.rig.imus) if imu.wheel is not None]
    with pytest.raises(InputError, match="enav-fusion needs an IMU on the body; expected one without `wheel`"):
        pi.run(recording.subset(wheels), "enav-fusion")


def test_what_a_rig_allows() -> None:
    recording = drive()
    assert choice.available(recording.rig) == [
        "wheel-ins", "body-ins", "dual-wheel-ins", "body-wheel-ins", "triple-ins", "multi-wheel-ins"
    ]  # fmt: skip
    left = [i for i, imu in enumerate(recording.rig.imus) if imu.module == "left"]
    assert choice.available(recording.subset(left).rig) == ["wheel-ins"]
    with pytest.raises(InputError, match="single has one covariance block: expected several to be joined"):
        find_method("single/centralized")
