"""An IMU that is noisier than its figures and the others explain is named; vibration that shakes all of them is not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, Recording
from polyins.prepare.blocks import Blocks
from polyins.prepare.noise import noisy
from polyins.prepare.timesync import align
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario


@cache
def drive(count: int = 4) -> Recording:
    return simulate(Scenario(duration_s=140.0, static_s=20.0, rate_hz=50.0, imus=Board(count=count)), seed=2)


def with_noise(recording: Recording, imus: tuple[int, ...], factor: float, after: float) -> Recording:
    """Make the gyros of some IMUs so many times as noisy as they are."""
    rng, streams = np.random.default_rng(4), list(recording.imus)
    for i in imus:
        one, interval = streams[i], 0.02
        own = np.mean(recording.rig.imus[i].noise.angle_random_walk) * np.sqrt(interval)
        more = rng.normal(0.0, np.sqrt(factor**2 - 1.0) * own, one.dtheta.shape) * (one.time > after)[:, None]
        streams[i] = ImuStream(one.name, one.time, one.dtheta + more, one.dvel)
    return replace(recording, imus=tuple(streams))


def of(recording: Recording) -> tuple[Finding, ...]:
    return noisy(recording.rig, Blocks.of(align(recording.imus)))


def test_imus_as_modelled_are_not_named() -> None:
    assert of(drive()) == ()


def test_the_noisy_one_is_named() -> None:
    (finding,) = of(with_noise(drive(), (2,), 10.0, after=60.0))
    assert (finding.kind, finding.stream, finding.axis, finding.severity) == ("noise", "imu3", "gyro", "note")
    assert finding.size == pytest.approx(10.0, rel=0.2)
    assert finding.from_s == pytest.approx(60.0, abs=21.0)


def test_half_of_them_are_named_and_doubted() -> None:
    findings = of(with_noise(drive(), (0, 3), 30.0, after=0.0))
    assert [one.stream for one in findings] == ["imu1", "imu4"]
    assert {one.severity for one in findings} == {"doubt"}


def test_what_shakes_all_of_them_is_vibration() -> None:
    assert of(with_noise(drive(), (0, 1, 2, 3), 10.0, after=0.0)) == ()


def test_its_own_figures_explain_it() -> None:
    shaken = with_noise(drive(), (2,), 10.0, after=0.0)
    imus = list(shaken.rig.imus)
    grade = imus[2].noise
    imus[2] = replace(imus[2], noise=replace(grade, angle_random_walk=10.0 * np.asarray(grade.angle_random_walk)))
    assert of(replace(shaken, rig=replace(shaken.rig, imus=tuple(imus)))) == ()


def test_of_two_it_is_not_told_which() -> None:
    assert of(with_noise(drive(), (0,), 10.0, after=0.0).subset([0, 1])) == ()
