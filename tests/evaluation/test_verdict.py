"""A verdict without a reference: what innovations say of the std, of jumps, noise and delays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import polyins as pi
from polyins.evaluation.errors import compare_to_reference
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario


@pytest.fixture(scope="module")
def drive() -> Recording:
    return simulate(Scenario(duration_s=240.0, static_s=20.0, rate_hz=50.0, imus=Board(count=2), outages=()), seed=1)


def judged(recording: Recording) -> tuple[str, dict[str, dict]]:
    document = pi.evaluate(pi.run(recording), None)["verdict"]
    return document["level"], {finding["kind"]: dict(finding) for finding in document["findings"]}


def moved(recording: Recording, begin: float, end: float, metres: list[float]) -> Recording:
    gnss = recording.gnss
    assert gnss is not None
    position = gnss.position.copy()
    position[(gnss.time >= begin) & (gnss.time < end)] += np.array(metres) / metres_per_unit(position[0], True)
    return replace(recording, gnss=replace(gnss, position=position))


def test_a_good_run_is_trusted(drive: Recording) -> None:
    level, findings = judged(drive)
    assert level == "trust"
    assert set(findings) <= {"coverage"}


def test_a_jump_is_named_with_its_size_and_time(drive: Recording) -> None:
    level, findings = judged(moved(drive, 100.0, 105.0, [0.0, 10.0, 0.0]))
    assert level == "trust"
    jump = findings["jump"]
    assert jump["size"] == pytest.approx(10.0, abs=0.5)
    assert jump["axis"] == "east"
    assert (jump["from_s"], jump["to_s"]) == (pytest.approx(100.5, abs=0.6), pytest.approx(104.5, abs=0.6))


def test_a_step_is_followed_and_doubted(drive: Recording) -> None:
    level, findings = judged(moved(drive, 100.0, 1e9, [5.0, 0.0, 0.0]))
    assert level == "doubt"
    assert findings["reset"]["size"] == 1


def noisy(recording: Recording, metres: float, after: float) -> Recording:
    gnss = recording.gnss
    assert gnss is not None
    noise = np.random.default_rng(2).normal(0.0, metres, gnss.position.shape) / metres_per_unit(gnss.position[0], True)
    return replace(recording, gnss=replace(gnss, position=gnss.position + noise * (gnss.time > after)[:, None]))


def heading_over_std(recording: Recording) -> float:
    """The largest error of the heading over its std."""
    solution = pi.run(recording)
    errors = compare_to_reference(solution, recording.reference)
    assert errors.attitude is not None
    return float(np.max(np.abs(errors.attitude[:, 2]) / np.sqrt(solution.phi_covariance[errors.covered, 5])))


@pytest.mark.parametrize(("after", "expected"), [(0.0, "trust"), (100.0, "doubt")])
def test_noise_that_is_not_stated_is_named_with_its_size(drive: Recording, after: float, expected: str) -> None:
    """A standstill shows it before anything is built on it; later the first fixes with it are believed."""
    level, findings = judged(noisy(drive, 0.5, after))
    assert level == expected
    assert drive.gnss is not None
    stated = float(drive.gnss.position_std[0, 0])
    assert findings["noise"]["size"] == pytest.approx(0.5 / stated, rel=0.4)


def test_noise_that_a_standstill_shows_does_not_bend_the_heading(drive: Recording) -> None:
    assert heading_over_std(noisy(drive, 1.0, 0.0)) < 4.0


def test_a_std_that_no_receiver_has_is_no_promise(drive: Recording) -> None:
    gnss = drive.gnss
    assert gnss is not None
    sure = replace(drive, gnss=replace(gnss, position_std=np.full_like(gnss.position_std, 1e-12)))
    assert heading_over_std(sure) < 4.0
    assert "noise" in judged(sure)[1]


def test_positions_that_are_late_are_doubted(drive: Recording) -> None:
    gnss = drive.gnss
    assert gnss is not None
    level, findings = judged(replace(drive, gnss=replace(gnss, time=gnss.time + 1.0)))
    assert level != "trust"
    assert set(findings) & {"delay", "innovations", "rejected", "noise"}


def test_a_delay_is_told_once_with_what_the_course_tells(drive: Recording) -> None:
    gnss = drive.gnss
    assert gnss is not None
    document = pi.evaluate(pi.run(replace(drive, gnss=replace(gnss, time=gnss.time + 0.3))), None)["verdict"]
    (finding,) = [one for one in document["findings"] if one["kind"] == "delay"]
    assert finding["size"] == pytest.approx(0.3, abs=0.05)


def test_a_std_that_is_too_large_is_noted(drive: Recording) -> None:
    gnss = drive.gnss
    assert gnss is not None
    level, findings = judged(replace(drive, gnss=replace(gnss, position_std=100.0 * gnss.position_std)))
    assert level == "trust"
    assert findings["too modest"]["size"] < 0.1


def test_velocities_that_are_wrong_by_far_are_not_to_be_used_in_silence(drive: Recording) -> None:
    gnss = drive.gnss
    assert gnss is not None
    velocity = np.tile([30.0, -20.0, 0.0], (len(gnss.time), 1))
    wrong = replace(gnss, velocity=velocity, velocity_std=np.full_like(velocity, 0.05))
    level, _ = judged(replace(drive, gnss=wrong, start=replace(drive.start, heading=0.0, heading_from="value")))
    assert level == "do-not-use"
