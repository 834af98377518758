"""A recording that pauses: what follows begins anew, with the IMUs' errors as they were known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import driven_vehicle
import numpy as np
import pytest
from playing import Event, events, feed, navigator_for, play, rows

from polyins.evaluation.errors import compare_to_reference
from polyins.model.attitude import euler_angles, euler_variance
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import GnssStream, ImuStream, Recording
from polyins.model.status import STATUSES
from polyins.navigate import batch, restart
from polyins.navigate.navigator import Navigator
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario

COASTED = (60.0, 62.9)
"""s: longer than the intervals at which blocks of a vehicle are compared"""


@pytest.fixture(scope="module")
def drive() -> Recording:
    return simulate(Scenario(duration_s=300.0, static_s=20.0, rate_hz=50.0, imus=Board(count=3), outages=(), seed=4))


def paused(recording: Recording, begin: float, end: float, imus: tuple[int, ...] = (0, 1, 2)) -> Recording:
    streams = list(recording.imus)
    for i in imus:
        stream = streams[i]
        kept = (stream.time <= begin) | (stream.time >= end)
        streams[i] = ImuStream(stream.name, stream.time[kept], stream.dtheta[kept], stream.dvel[kept])
    return replace(recording, imus=tuple(streams))


@pytest.mark.parametrize("length", [12.0, 45.0, 120.0])
@pytest.mark.parametrize("method", ["single", "enav-fusion"])
def test_after_a_pause_the_errors_are_within_their_std(drive: Recording, length: float, method: str) -> None:
    recording = paused(drive, 100.0, 100.0 + length)
    solution = batch.run(recording, method)
    (finding,) = [one for one in solution.findings if one.kind == "restart"]
    assert finding.from_s == pytest.approx(100.0, abs=0.1)
    assert finding.size == pytest.approx(length, abs=0.1)
    errors = compare_to_reference(solution, recording.reference)
    assert solution.time[-1] > 299.0
    assert solution.time[np.searchsorted(solution.time, 100.5)] < 100.0 + length + 5.0
    std = np.sqrt(euler_variance(euler_angles(solution.attitude), solution.phi_covariance))[errors.covered]
    late = errors.time > 100.0 + length
    assert (np.abs(errors.attitude[late]) < 4.0 * std[late] + np.radians(0.05)).mean() > 0.98
    position_std = np.sqrt(solution.position_variance)[errors.covered]
    assert (np.abs(errors.position[late]) < 4.0 * position_std[late] + 0.02).mean() > 0.97
    assert errors.horizontal[errors.time > 100.0 + length + 40.0].max() < 0.5


def test_what_gives_no_start_is_left_out_and_named(drive: Recording) -> None:
    assert drive.gnss is not None
    kept = drive.gnss.time < 100.0
    gnss = GnssStream(drive.gnss.time[kept], drive.gnss.position[kept], drive.gnss.position_std[kept])
    solution = batch.run(replace(paused(drive, 100.0, 150.0), gnss=gnss), "enav-fusion")
    assert solution.time[-1] <= 100.0
    (finding,) = [one for one in solution.findings if one.kind == "pause"]
    assert "what follows is left out" in finding.text


def navigator(recording: Recording) -> Navigator:
    return Navigator(recording.rig, recording.start, options=recording.options, delay=0.5)


@pytest.mark.parametrize("length", [0.7, 2.0, 40.0])
def test_live_a_pause_is_what_it_is_in_a_batch_run(drive: Recording, length: float) -> None:
    recording = paused(drive, 60.0, 60.0 + length)
    one, whole = navigator(recording), batch.run(recording, "enav-fusion")
    states = play(one, recording, until(recording, 140.0))
    time = np.array(list(states))
    place = np.searchsorted(whole.time, time)
    np.testing.assert_array_equal(whole.time[place], time)
    np.testing.assert_array_equal(list(states.values()), rows(whole)[place])
    assert np.count_nonzero(time < 60.0) > 1000
    assert np.count_nonzero(time > 60.0 + length) > 1000
    assert {found.kind for found in whole.findings} == {"restart" if length > restart.HOPELESS else "gap"}
    assert set(one.findings) == set(whole.findings)
    for name, told in one.measurements.items():
        expected = whole.measurements[name]
        assert told.time.size > 60
        for column in ("time", "residual", "nis", "accepted", "rows", "gained", "change"):
            live, batched = getattr(told, column), getattr(expected, column)
            np.testing.assert_array_equal(live, batched if batched is None else batched[: len(live)])
    status = [STATUSES.index(state.status) for state in one.history()]
    assert whole.status is not None
    np.testing.assert_array_equal(status, whole.status[place[-1] + 1 - len(status) : place[-1] + 1])


def until(recording: Recording, end: float) -> list[Event]:
    return [event for event in events(recording) if event.arrives < end]


@pytest.mark.parametrize("at", [55.0, 120.0])
def test_a_checkpoint_is_resumed_after_the_pause(drive: Recording, at: float, tmp_path: Path) -> None:
    """What lies between the checkpoint and the end of the pause is lost, or nothing is."""
    recording = paused(drive, 60.0, 90.0)
    whole = navigator(recording)
    played = until(recording, 130.0)
    for event in played:
        feed(whole, recording, event)
    first = navigator(recording)
    for event in played:
        if event.arrives < at:
            feed(first, recording, event)
    first.save(tmp_path / "checkpoint")
    saved = Navigator.resume(tmp_path / "checkpoint")
    for event in played:
        if event.arrives >= (at if at > 90.0 else 90.0):
            feed(saved, recording, event)
    (found,) = [one for one in saved.findings if one.kind == "restart"]
    assert found.from_s == pytest.approx(min(at, 60.0), abs=0.05)
    state, expected = saved.state, whole.state
    assert state is not None
    assert expected is not None
    assert state.time == expected.time
    if at > 90.0:
        np.testing.assert_array_equal(state.position, expected.position)
    np.testing.assert_allclose(state.velocity, expected.velocity, atol=0.2)


def test_a_pause_of_some_or_a_short_one_is_none(drive: Recording) -> None:
    assert restart.pauses(drive) == []
    assert restart.pauses(paused(drive, 100.0, 150.0, (0, 1))) == []
    assert restart.pauses(paused(drive, 100.0, 100.9)) == []
    (one,) = restart.pauses(paused(drive, 100.0, 150.0))
    np.testing.assert_allclose((one.begin, one.end), (100.0, 150.0), atol=0.03)


@pytest.mark.parametrize("method", ["enav-fusion", "nav-fusion", "nav-fusion/centralized", "imu-fusion"])
def test_a_bridged_pause_is_covered(drive: Recording, method: str) -> None:
    for begin in (60.0, 110.3, 201.7):
        recording = paused(drive, begin, begin + 0.9)
        solution = batch.run(recording, method)
        errors = compare_to_reference(solution, recording.reference)
        near = (errors.time > begin + 0.02) & (errors.time < begin + 5.0)
        std = np.sqrt(euler_variance(euler_angles(solution.attitude), solution.phi_covariance))[errors.covered]
        position_std = np.sqrt(solution.position_variance)[errors.covered]
        assert np.abs(errors.attitude[near] / std[near]).max() < 5.0
        assert np.abs(errors.position[near] / position_std[near]).max() < 5.0
        assert std[near][0, 2] > np.radians(1.0)


def over_std(solution: batch.Solution, recording: Recording) -> np.ndarray:
    """The larger one of horizontal position and heading over its standard deviation."""
    assert recording.reference is not None
    errors = compare_to_reference(solution, recording.reference)
    assert errors.attitude is not None
    rows = errors.covered
    variance = euler_variance(euler_angles(solution.attitude[rows]), solution.phi_covariance[rows])
    heading = np.abs(errors.attitude[:, 2]) / np.sqrt(variance[:, 2])
    return np.maximum(heading, errors.horizontal / np.sqrt(solution.position_variance[rows, :2].sum(axis=1)))


@pytest.mark.parametrize("length", [0.9, 2.3, 12.0])
@pytest.mark.parametrize("method", ["triple-ins", "body-ins", "triple-ins/centralized"])
def test_wheels_without_gnss_go_on_as_unsure_as_a_pause_leaves_them(method: str, length: float) -> None:
    recording = paused(driven_vehicle.drive(), 60.0, 60.0 + length)
    solution = batch.run(recording, method)
    (finding,) = [one for one in solution.findings if one.kind == "restart"]
    assert finding.severity == ("note" if length < restart.STRAIGHT else "serious")
    after = solution.time > 60.0 + length
    assert solution.time[after][0] < 60.0 + length + 0.6
    assert solution.time[-1] > 119.0
    assert over_std(solution, recording)[after].max() < 4.0
    heading_std = np.sqrt(solution.phi_covariance[after, 5])
    assert heading_std.min() > 0.9 * min(restart.TURN_RATE * length, restart.ANY_HEADING)
    assert np.sqrt(solution.position_variance[after, :2].sum(axis=1)).min() > 0.4 * length


def test_live_wheels_go_on_as_in_a_batch_run(tmp_path: Path) -> None:
    recording = paused(driven_vehicle.drive(), *COASTED)
    prepared, whole = batch.prepare(recording, "triple-ins"), batch.run(recording, "triple-ins")
    played = events(prepared.recording)
    one = navigator_for(prepared)
    states = play(one, prepared.recording, [event for event in played if event.arrives < 90.0])
    one.save(tmp_path / "checkpoint")
    resumed = Navigator.resume(tmp_path / "checkpoint")
    states |= play(resumed, prepared.recording, [event for event in played if event.arrives >= 90.0])
    time = np.array(list(states))
    place = np.searchsorted(whole.time, time)
    np.testing.assert_array_equal(whole.time[place], time)
    np.testing.assert_array_equal(list(states.values()), rows(whole)[place])
    assert np.count_nonzero(time > 90.0) > 5000
    assert {found.text for found in resumed.findings} == {found.text for found in whole.findings}


@pytest.mark.parametrize("length", [1.0, 10.0])
def test_wheels_with_gnss_begin_anew_under_way(length: float) -> None:
    recording = paused(driven_vehicle.drive(gnss=True), 50.0, 50.0 + length)
    assert recording.gnss is not None
    solution = batch.run(recording, "triple-ins")
    (finding,) = [one for one in solution.findings if one.kind == "restart"]
    assert finding.severity == "note"
    after = solution.time > 50.0 + length
    assert solution.time[after][0] < 50.0 + length + 2.0
    assert solution.time[-1] > 119.0
    over = over_std(solution, recording)[after]
    assert (over < 3.0).mean() > 0.98
    assert over.max() < 5.0


@pytest.fixture
def breaks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs whose state is no number from 60 s on, once."""
    advance = batch.Prepared.advance

    def poisoned(run: batch.Prepared, first: int, last: int) -> None:
        advance(run, first, last)
        after = run.inputs.time[first:last] >= 60.0
        if run.start.time < 60.0:
            run.outputs.states[first:last][after, 3:6] = np.nan

    monkeypatch.setattr(batch.Prepared, "advance", poisoned)


@pytest.mark.usefixtures("breaks")
def test_after_a_state_that_is_no_number_a_run_begins_anew_live_as_well(drive: Recording) -> None:
    one, whole = navigator(drive), batch.run(drive, "enav-fusion")
    assert whole.is_finite.all()
    (finding,) = [found for found in whole.findings if found.kind == "restart"]
    assert (finding.severity, finding.from_s) == ("doubt", pytest.approx(59.98))
    assert np.flatnonzero(np.diff(whole.time) > 0.1).size == 1
    assert 61.0 <= whole.time[np.searchsorted(whole.time, 60.0)] < 63.0
    states = play(one, drive, until(drive, 110.0))
    time = np.array(list(states))
    place = np.searchsorted(whole.time, time)
    np.testing.assert_array_equal(whole.time[place], time)
    np.testing.assert_array_equal(list(states.values()), rows(whole)[place])
    assert np.count_nonzero(time > 61.0) > 1000
    assert set(one.findings) == set(whole.findings)


@pytest.mark.usefixtures("breaks")
def test_wheels_without_gnss_that_begin_anew_so_are_not_to_be_used() -> None:
    whole = batch.run(driven_vehicle.drive(), "triple-ins")
    assert whole.is_finite.all()
    (finding,) = [found for found in whole.findings if found.kind == "restart"]
    assert finding.severity == "serious"
    assert whole.time[-1] > 110.0


@pytest.fixture(scope="module")
def misled(drive: Recording) -> Recording:
    """A drive whose heading is given, wrong by 90 degrees."""
    reference = drive.reference
    assert reference is not None
    assert reference.attitude is not None
    heading = float(reference.attitude[0, 2]) + np.pi / 2.0
    return replace(drive, start=replace(drive.start, heading=heading, heading_from="value"))


def test_where_resets_do_not_help_the_run_begins_anew(misled: Recording) -> None:
    whole = batch.run(misled, "enav-fusion")
    (finding,) = [found for found in whole.findings if found.kind == "restart"]
    assert finding.severity == "doubt"
    assert "resets of the position do not help" in finding.text
    assert finding.to_s is not None
    errors = compare_to_reference(whole, misled.reference)
    assert errors.attitude is not None
    later = errors.time > finding.to_s + 30.0
    assert later.sum() > 1000
    assert errors.horizontal[later].max() < 0.3
    assert np.degrees(np.abs(errors.attitude[later, 2])).max() < 1.5
    assert errors.horizontal[errors.time < finding.to_s - 10.0].max() > 50.0


def test_live_it_begins_anew_as_a_run_does(misled: Recording) -> None:
    one, whole = navigator(misled), batch.run(misled, "enav-fusion")
    (finding,) = [found for found in whole.findings if found.kind == "restart"]
    assert finding.to_s is not None
    end = finding.to_s + 40.0
    states = play(one, misled, until(misled, end))
    time = np.array(list(states))
    place = np.searchsorted(whole.time, time)
    np.testing.assert_array_equal(whole.time[place], time)
    np.testing.assert_array_equal(list(states.values()), rows(whole)[place])
    assert np.count_nonzero(time > finding.to_s) > 1000
    assert finding in one.findings


def test_a_step_that_is_followed_is_no_reason_to_begin_anew(drive: Recording) -> None:
    gnss = drive.gnss
    assert gnss is not None
    position = gnss.position.copy()
    position[gnss.time > 100.0] += np.array([50.0, 0.0, 0.0]) / metres_per_unit(position[0], True)
    solution = batch.run(replace(drive, gnss=replace(gnss, position=position)), "enav-fusion")
    assert solution.innovations.reset.sum() == 1
    assert not [found for found in solution.findings if found.kind == "restart"]
