"""The live front gives what a batch run gives, bit for bit, in whatever order and however late the data come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from array_recordings import START, Array, shaken_path, shaken_recording, start_at
from driven_vehicle import drive, without
from hypothesis import given, settings
from hypothesis import strategies as st
from playing import Event, events, feed, navigator_for, play, row, rows

from polyins.errors import InputError
from polyins.model.recording import USUAL_OF, ImuStream, Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.navigate.navigator import Navigator
from polyins.prepare.alignment import Start
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario

ARRAYS = ("single", "imu-fusion", "nav-fusion", "enav-fusion", "enav-fusion-shared-mechanization")
WHEELS = ("wheel-ins", "body-ins", "triple-ins", "triple-ins/centralized")


def of_own_clocks(recording: Recording) -> Recording:
    """Each IMU but the first somewhat before the one before it, at a rate of its own."""
    streams = [
        replace(stream, time=stream.time * (1.0 - 0.004 * i) - 0.0013 * i) for i, stream in enumerate(recording.imus)
    ]
    # not at the first sample, of which only the usual interval tells where it begins
    start = start_at(shaken_path(float(streams[0].time[-1]), start=START), 0.1)
    return replace(recording, imus=tuple(streams), start=start)


def with_gap(recording: Recording, imu: int, begin: float, end: float) -> Recording:
    streams = list(recording.imus)
    kept = (streams[imu].time <= begin) | (streams[imu].time >= end)
    old = streams[imu]
    streams[imu] = ImuStream(old.name, old.time[kept], old.dtheta[kept], old.dvel[kept])
    return replace(recording, imus=tuple(streams))


def with_velocities(recording: Recording) -> Recording:
    """Every other fix has a velocity that is hardly believed: the recording's own are left out."""
    gnss = recording.gnss
    assert gnss is not None
    velocity = np.tile([-9.0, 7.0, 0.0], (len(gnss.time), 1))
    return replace(recording, gnss=replace(gnss, velocity=velocity, velocity_std=np.full_like(velocity, 5.0)))


def replayed(recording: Recording, method: str, lateness: float = -0.001, **options: float) -> dict[float, Array]:
    prepared = batch.prepare(recording, method)
    return play(navigator_for(prepared, **options), prepared.recording, events(prepared.recording, lateness))


def assert_same(states: dict[float, Array], solution: Solution) -> None:
    """Every epoch of the solution, with the same bits."""
    np.testing.assert_array_equal(list(states), solution.time)
    np.testing.assert_array_equal(list(states.values()), rows(solution))


@pytest.mark.parametrize("method", ARRAYS)
def test_a_replay_is_the_batch_run_to_the_last_bit(method: str) -> None:
    recording = shaken_recording(3, 4.0)
    assert_same(replayed(recording, method, delay=0.1), batch.run(recording, method))


@pytest.mark.parametrize("method", WHEELS)
def test_so_it_is_with_wheels(method: str) -> None:
    recording = drive(gnss=True)
    assert_same(replayed(recording, method, delay=0.1), batch.run(recording, method))


def test_so_it_is_with_a_silent_wheel() -> None:
    recording = without(drive(), "left1", 6.0, 7.0)
    assert_same(replayed(recording, "triple-ins"), batch.run(recording, "triple-ins"))


def test_so_it_is_with_velocities_and_outages() -> None:
    recording = replace(with_velocities(shaken_recording(2, 4.0)), outages=((1.5, 2.5),))
    assert_same(replayed(recording, "enav-fusion"), batch.run(recording, "enav-fusion"))


@pytest.mark.parametrize("method", ["imu-fusion", "enav-fusion"])
def test_so_it_is_with_imus_of_own_clocks(method: str) -> None:
    recording = of_own_clocks(shaken_recording(3, 4.0))
    assert_same(replayed(recording, method), batch.run(recording, method))


def test_so_it_is_over_more_samples_than_tell_the_usual_interval() -> None:
    """Batch takes the median of the first 10,000 intervals, live of the latest ones; here stamps jitter by a tenth."""
    recording = of_own_clocks(shaken_recording(2, 105.0, rate_hz=100.0))
    jitter = np.random.default_rng(4).uniform(-1e-3, 1e-3, (2, len(recording.imus[0].time)))
    streams = [replace(imu, time=imu.time + moved) for imu, moved in zip(recording.imus, jitter, strict=True)]
    # a batch run ends where the first of them does
    recording = with_gap(replace(recording, imus=tuple(streams)), 0, streams[1].time[-1] - 0.02, np.inf)
    assert len(recording.imus[0].time) > USUAL_OF
    assert_same(replayed(recording, "enav-fusion", delay=0.1), batch.run(recording, "enav-fusion"))


@pytest.mark.parametrize(("imus", "length"), [((1,), 0.1), ((1,), 0.6), ((0, 1, 2), 0.1)])
def test_so_it_is_with_gaps(imus: tuple[int, ...], length: float) -> None:
    recording = of_own_clocks(shaken_recording(3, 4.0))
    for imu in imus:
        recording = with_gap(recording, imu, 2.0, 2.0 + length)
    assert_same(replayed(recording, "enav-fusion"), batch.run(recording, "enav-fusion"))


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=8, deadline=None)
def test_the_order_of_arrival_does_not_matter(seed: int) -> None:
    recording = of_own_clocks(shaken_recording(2, 2.5, rate_hz=100.0))
    prepared = batch.prepare(recording, "enav-fusion")
    rng = np.random.default_rng(seed)
    mixed = sorted(events(recording), key=lambda event: event.arrives + rng.uniform(0.0, 0.06))
    navigator = navigator_for(prepared, wait=0.1, delay=10.0)
    play(navigator, recording, mixed)
    np.testing.assert_array_equal(window(navigator), rows(batch.run(recording, "enav-fusion")))
    assert not navigator.counts


def window(navigator: Navigator) -> Array:
    return np.array([row(state) for state in navigator.history()])


@pytest.mark.parametrize("lateness", [0.003, 0.3, 0.9])
@pytest.mark.parametrize("method", ["single", "enav-fusion", "nav-fusion"])
def test_fixes_that_come_late_are_applied_at_their_own_time(method: str, lateness: float) -> None:
    recording = shaken_recording(2, 4.0)
    prepared = batch.prepare(recording, method)
    recording, on_time, late = prepared.recording, navigator_for(prepared), navigator_for(prepared)
    play(on_time, recording, events(recording))
    play(late, recording, events(recording, lateness))
    np.testing.assert_array_equal(window(late), window(on_time))
    assert not late.counts


def test_with_wheels_too() -> None:
    prepared = batch.prepare(drive(gnss=True), "triple-ins/centralized")
    recording, on_time, late = prepared.recording, navigator_for(prepared), navigator_for(prepared)
    play(on_time, recording, events(recording))
    play(late, recording, events(recording, 0.5))
    np.testing.assert_array_equal(window(late), window(on_time))


def test_a_fix_that_is_later_than_agreed_is_counted() -> None:
    recording = shaken_recording(1, 4.0)
    navigator = navigator_for(batch.prepare(recording, "single"), delay=0.2)
    play(navigator, recording, events(recording, 1.5))
    assert recording.gnss is not None
    assert navigator.counts == {"late": len(recording.gnss.time)}


@pytest.mark.parametrize("method", ["single", "enav-fusion", "triple-ins/centralized"])
def test_killed_anywhere_it_resumes_bit_for_bit(method: str, tmp_path: Path) -> None:
    recording = drive(gnss=True) if "triple" in method else of_own_clocks(shaken_recording(2, 4.0))
    prepared = batch.prepare(recording, method)
    recording, played = prepared.recording, events(prepared.recording, 0.21)
    whole = navigator_for(prepared)
    hand_over(whole, recording, played)
    for place in np.random.default_rng(5).integers(0, len(played), 5):
        navigator = navigator_for(prepared)
        hand_over(navigator, recording, played[:place])
        navigator.save(tmp_path / "checkpoint")
        resumed = Navigator.resume(tmp_path / "checkpoint")
        hand_over(resumed, recording, played[place:])
        np.testing.assert_array_equal(window(resumed), window(whole))
        assert resumed.counts == whole.counts


def hand_over(navigator: Navigator, recording: Recording, played: list[Event]) -> None:
    for event in played:
        feed(navigator, recording, event)


def test_another_file_is_no_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "some"
    path.write_text("some text")
    with pytest.raises(InputError, match="expected a file that a navigator saved"):
        Navigator.resume(path)
    with pytest.raises(InputError, match="is no checkpoint"):
        Navigator.resume(tmp_path / "nothing")


def test_samples_of_another_number_of_imus_are_refused() -> None:
    recording = shaken_recording(3, 4.0)
    navigator = Navigator(recording.rig, batch.prepare(recording, "enav-fusion").start)
    with pytest.raises(InputError, match="of 2 IMUs; expected those of 3"):
        navigator.imu(0.01, np.zeros((2, 3)), np.zeros((2, 3)))


def test_a_vehicle_begins_at_a_start_that_is_known() -> None:
    """Whose wheels stand at any angle: they are levelled."""
    recording = drive()
    rig = recording.rig
    position = recording.start.position if recording.start.position is not None else np.zeros(3)
    found = batch.prepare(recording, "triple-ins").start
    known = Start.known(rig, 8.0, position, attitude=found.attitude)
    navigator = Navigator(rig, known, method="triple-ins", geodetic=recording.geodetic, options=recording.options)
    for event in events(recording):
        feed(navigator, recording, event)
    navigator.flush()
    state, solution = navigator.state, batch.run(recording, "triple-ins")
    assert state is not None
    assert np.abs(state.position - solution.position[-1]).max() < 1.0


def simulated() -> Recording:
    """An array that stands for ten seconds and then drives, with fixes."""
    return simulate(Scenario(duration_s=40.0, static_s=10.0, rate_hz=50.0, imus=Board(count=3), outages=(), seed=2))


@pytest.mark.parametrize(
    ("made", "method"),
    [(simulated, "enav-fusion"), (simulated, "single"), (drive, "triple-ins"), (lambda: drive(gnss=True), "body-ins")],
)
def test_a_navigator_finds_the_start_of_a_batch_run(made: Callable[[], Recording], method: str) -> None:
    recording = made()
    taken = recording.start if method != "single" else replace(recording.start, heading=0.3, heading_from="value")
    recording = replace(recording, start=taken)
    navigator = Navigator(
        recording.rig,
        recording.start,
        method=method,
        options=recording.options,
        geodetic=recording.geodetic,
        fixes=recording.gnss is not None and recording.start.position is None,
    )
    assert navigator.state is None
    for event in events(recording, lateness=-0.02):
        feed(navigator, recording, event)
    navigator.flush()
    solution, state = batch.run(recording, method), navigator.state
    assert navigator.start is not None
    assert navigator.start.time == solution.start["time_s"]
    assert state is not None
    assert state.time == solution.time[-1]
    np.testing.assert_array_equal(row(state), rows(solution)[-1])


def test_a_navigator_without_a_start_says_what_it_waits_for_and_has_no_checkpoint(tmp_path: Path) -> None:
    recording = simulated()
    navigator = Navigator(recording.rig)
    for k in range(200):
        navigator.imu(
            recording.imus[0].time[k],
            np.array([one.dtheta[k] for one in recording.imus]),
            np.array([one.dvel[k] for one in recording.imus]),
        )
    assert "until" in navigator.waits_for
    for event in [e for e in events(recording) if e.imu >= 0 and recording.imus[0].time[199] < e.arrives < 12.0]:
        feed(navigator, recording, event)
    assert "GNSS" in navigator.waits_for
    with pytest.raises(InputError, match=r"there is no start yet .*GNSS"):
        navigator.save(tmp_path / "navigator.npz")
    navigator.gnss(5.0, np.full(3, np.nan), np.ones(3))
    assert navigator.counts["not finite"] == 1
