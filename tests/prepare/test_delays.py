"""IMUs and fixes that are late are named with how late they are; good ones are not, nor motion that shows no course."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, Recording
from polyins.prepare.blocks import Blocks
from polyins.prepare.delays import delays
from polyins.prepare.timesync import align
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Fixes, Scenario


@cache
def drive(velocity: bool = False) -> Recording:
    fixes = Fixes(velocity_std_m_s=(0.05, 0.05, 0.05) if velocity else None)
    scenario = Scenario(duration_s=240.0, static_s=20.0, rate_hz=50.0, imus=Board(count=4), gnss=fixes)
    return simulate(scenario, seed=4)


def late_imu(recording: Recording, by: float) -> Recording:
    streams = list(recording.imus)
    streams[1] = ImuStream(streams[1].name, streams[1].time + by, streams[1].dtheta, streams[1].dvel)
    return replace(recording, imus=tuple(streams))


def late_fixes(recording: Recording, by: float, after: float = 0.0) -> Recording:
    gnss = recording.gnss
    assert gnss is not None
    return replace(recording, gnss=replace(gnss, time=np.where(gnss.time >= after, gnss.time + by, gnss.time)))


def of(recording: Recording) -> tuple[Finding, ...]:
    return delays(recording, Blocks.of(align(recording.imus)))


@pytest.mark.parametrize("velocity", [False, True])
def test_clocks_that_agree_are_not_named(velocity: bool) -> None:
    assert of(drive(velocity)) == ()


@pytest.mark.parametrize(("by", "severity"), [(0.02, "note"), (0.1, "doubt"), (-0.3, "doubt"), (1.0, "doubt")])
def test_a_late_imu_is_named(by: float, severity: str) -> None:
    (finding,) = of(late_imu(drive(), by))
    assert (finding.kind, finding.stream, finding.severity) == ("delay", "imu2", severity)
    assert isinstance(finding.size, float)
    assert finding.size == pytest.approx(by, rel=0.1, abs=0.01)


@pytest.mark.parametrize("velocity", [False, True])
@pytest.mark.parametrize("by", [1.0, -0.5])
def test_late_fixes_are_named(velocity: bool, by: float) -> None:
    (finding,) = of(late_fixes(drive(velocity), by))
    assert (finding.kind, finding.stream, finding.severity) == ("delay", "GNSS position", "serious")
    assert isinstance(finding.size, float)
    assert finding.size == pytest.approx(by, rel=0.2)
    assert f"clock_offset_s: {-finding.size:.3g}" in finding.remedy


@pytest.mark.parametrize("velocity", [False, True])
def test_fixes_that_are_later_and_later_are_named_with_the_drift(velocity: bool) -> None:
    recording = drive(velocity)
    gnss = recording.gnss
    assert gnss is not None
    middle, drift = float(np.mean(gnss.time)), 2000e-6
    (finding,) = of(replace(recording, gnss=replace(gnss, time=gnss.time + drift * (gnss.time - middle))))
    told = re.search(r"(growing|shrinking) by (\d+) ppm \(std (\d+) ppm\)", finding.text)
    assert told
    assert float(told[2]) == pytest.approx(2000.0, abs=3.0 * float(told[3]))
    assert "time_offset: estimate" in finding.remedy
    assert re.search(r"clock_drift_ppm: -\d+ and clock_reference_s", finding.remedy)


@pytest.mark.parametrize("seed", [1, 3, 5])
@pytest.mark.parametrize("by", [0.2, 0.3])
def test_fixes_a_little_late_are_named_in_every_drive(seed: int, by: float) -> None:
    scenario = Scenario(duration_s=260.0, static_s=30.0, rate_hz=50.0, imus=Board(count=1))
    good = simulate(scenario, seed=seed)
    assert of(good) == ()
    (finding,) = of(late_fixes(good, by))
    assert isinstance(finding.size, float)
    assert finding.size == pytest.approx(by, abs=0.06)


def test_an_antenna_ahead_of_the_axle_is_not_a_delay() -> None:
    """Its course turns earlier than the vehicle does, by its place over the speed."""
    scenario = Scenario(duration_s=240.0, static_s=20.0, rate_hz=50.0, imus=Board(count=1))
    gnss = scenario.gnss
    assert gnss is not None
    ahead = scenario.model_copy(update={"gnss": gnss.model_copy(update={"antenna_position_m": (1.0, 0.0, -1.0)})})
    assert of(simulate(ahead, seed=4)) == ()


def test_a_delay_that_begins_is_dated() -> None:
    (finding,) = of(late_fixes(drive(True), 1.0, after=90.0))
    assert finding.from_s is not None
    assert finding.from_s > 30.0


@pytest.mark.parametrize("by", [18.0, -17.0])
def test_fixes_of_another_time_are_refused(by: float) -> None:
    with pytest.raises(InputError, match=rf"gnss\.clock_offset_s: {-by:.1f} corrects"):
        of(late_fixes(drive(True), by))


def test_two_imus_do_not_tell_which_is_late() -> None:
    recording = late_imu(drive().subset([0, 1]), 0.3)
    assert all(finding.stream == "GNSS position" for finding in of(recording))


def test_a_vehicle_that_hardly_moves_tells_nothing() -> None:
    recording = late_fixes(drive(), 1.0)
    aligned = align(recording.imus).between(0.0, 19.0)
    assert delays(recording, Blocks.of(aligned)) == ()
