"""Wheels that roll as if their radius were another are named, whichever of them a method takes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_vehicle import changed, drive
from slipping_wheels import slipping

from polyins.model.recording import Recording
from polyins.model.rig import DEG
from polyins.navigate import batch
from polyins.prepare.radii import of_radii
from polyins.simulation.scenario import SensorErrors

LEFT, RIGHT = "left1", "right1"


def recorded(seed: int = 0) -> Recording:
    return drive(errors=SensorErrors(), seed=seed)


def longer(recording: Recording, share: float) -> Recording:
    return changed(recording, "left", radius=0.25 * (1.0 + share))


@pytest.mark.parametrize("seed", [0, 2])
def test_wheels_that_are_as_stated_agree_on_curves_too(seed: int) -> None:
    assert of_radii(recorded(seed)) == ()


def test_a_wheel_that_slips_at_times_has_its_radius() -> None:
    assert of_radii(slipping({"left": [(40.0, 8.0, 0.3), (80.0, 3.0, 0.3)]})) == ()


@pytest.mark.parametrize("share", [0.02, 0.06, -0.08])
def test_of_two_that_differ_both_are_named_with_the_share(share: float) -> None:
    (finding,) = of_radii(longer(recorded(), share))
    assert finding.stream == f"{LEFT}, {RIGHT}"
    assert finding.severity == "doubt"
    assert finding.size == pytest.approx(100.0 * share, abs=0.3)


def test_of_three_the_one_that_differs_is_named() -> None:
    recording = recorded()
    (body, left, right), streams = recording.rig.imus, recording.imus
    rig = replace(recording.rig, imus=(body, left, replace(left, name="other", module="other"), right))
    four = replace(recording, rig=rig, imus=(*streams[:2], replace(streams[1], name="other"), streams[2]))
    (finding,) = of_radii(changed(four, RIGHT, radius=0.25 * 1.05))
    assert finding.stream == RIGHT
    assert finding.size == pytest.approx(5.0, abs=0.3)


def test_what_is_stated_of_radii_is_allowed() -> None:
    recording = longer(recorded(), 0.06)
    assert of_radii(changed(recording, "left", radius=0.25 * 1.06, radius_std=0.03)) == ()


def test_biases_of_the_spin_are_taken_from_the_standstill() -> None:
    recording = recorded()
    body, old, right = recording.imus
    biased = replace(old, dtheta=old.dtheta + np.array([3.0 * DEG / old.rate_hz, 0.0, 0.0]))
    assert of_radii(replace(recording, imus=(body, biased, right))) == ()


def test_a_method_of_one_wheel_is_told_of_the_other() -> None:
    solution = batch.run(longer(recorded(), 0.06), "body-wheel-ins")
    assert "wheel" in {one.kind for one in solution.findings if one.severity == "doubt"}
