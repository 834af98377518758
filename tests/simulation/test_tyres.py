"""Tyres, whether they pull or only push."""

from dataclasses import replace

import numpy as np
import pytest

from polyins.simulation.transmission import transmit
from polyins.simulation.tyres import Suspension, bounce

STEP, GRAVITY = 1.0 / 2000.0, 9.79
RATES = 2.0 * np.pi * np.array([12.0, 13.0, 12.5])
ROBOT = Suspension(0.45, 0.40, np.zeros(3), RATES, 0.2)
JUMPING = replace(ROBOT, only_push=True)


@pytest.mark.parametrize("only_push", [False, True], ids=["pulling", "pushing"])
@pytest.mark.parametrize("mode", [0, 1, 2], ids=["heave", "pitch", "roll"])
def test_on_the_ground_the_body_is_three_oscillators_whose_foot_is_the_plane_through_the_wheels(
    mode: int, only_push: bool
) -> None:
    time = STEP * np.arange(4000)
    foot = 1e-4 * np.sin(2.0 * np.pi * 9.0 * time) / (1.0, 0.225, 0.2)[mode]
    motion, change = bounce(np.outer(foot, ROBOT.arms()[mode]), STEP, replace(ROBOT, only_push=only_push), GRAVITY)
    # equal tyres: what damps the heave damps a faster mode more
    damping = ROBOT.damping * RATES[mode] / RATES[0]
    expected, rate = transmit(foot, STEP, RATES[mode], damping)
    np.testing.assert_allclose(motion[:, mode], expected, atol=1e-5 * np.abs(expected).max())
    np.testing.assert_allclose(change[:, mode], rate, atol=1e-5 * np.abs(rate).max())
    others = [other for other in range(3) if other != mode]
    np.testing.assert_allclose(motion[:, others], 0.0, atol=1e-15)


def test_where_the_ground_is_gone_the_body_falls_as_gravity_has_it() -> None:
    ground = np.zeros((400, 4))
    ground[100:] = -0.5
    motion, change = bounce(ground, STEP, JUMPING, GRAVITY)
    np.testing.assert_allclose(motion[:100], 0.0, atol=1e-15)
    fallen = STEP * np.arange(299)
    # the ground takes one step to go: speed and place when it has gone are what the rest follows from
    expected = motion[101, 0] + change[101, 0] * fallen - GRAVITY * fallen**2 / 2.0
    np.testing.assert_allclose(motion[101:, 0], expected, atol=1e-12)
    assert abs(change[101, 0]) < 3.0 * GRAVITY * STEP


def test_a_body_comes_to_rest_on_three_wheels_where_a_hole_is_deeper_than_its_tyres_are_pressed_in() -> None:
    sink = GRAVITY / RATES[0] ** 2
    ground = np.zeros((8000, 4))
    ground[:, 3] = -10.0 * sink
    motion, change = bounce(ground, STEP, JUMPING, GRAVITY)
    corners = ROBOT.arms().T @ motion[-1]
    pressed = sink + ground[-1] - corners
    np.testing.assert_allclose(change[-1], 0.0, atol=1e-6)
    # opposite wheels of a body on three carry all of it: the one across the hole nothing
    assert pressed[3] < 0.0
    np.testing.assert_allclose(np.maximum(pressed, 0.0), [0.0, 2.0 * sink, 2.0 * sink, 0.0], atol=1e-4 * sink)


def test_tyres_that_pull_make_twice_of_twice_the_ground() -> None:
    ground = np.zeros((2000, 4))
    ground[100:500, 0] = 0.02
    once, _ = bounce(ground, STEP, ROBOT, GRAVITY)
    twice, _ = bounce(2.0 * ground, STEP, ROBOT, GRAVITY)
    np.testing.assert_allclose(twice, 2.0 * once, atol=1e-12)
    # deeper than the tyres are pressed in: those that only push let go
    jumped, _ = bounce(ground, STEP, JUMPING, GRAVITY)
    assert np.abs(jumped - once)[500:].max() > 1e-3
