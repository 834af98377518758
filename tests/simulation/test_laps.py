"""The laps that stand in for a surveyed track."""

import numpy as np
import pytest

from polyins.reproduce.vehicles import CAR, ROBOT
from polyins.simulation.laps import Laps
from polyins.simulation.plane import Plane
from polyins.simulation.run import true_run

LAPS = Laps(length_m=40.0, width_m=20.0, corner_m=4.0, count=3, speed_m_s=1.5, change_m_s=0.5)


@pytest.fixture(scope="module")
def path():
    return LAPS.path(10.0, (0.0, 0.0, 0.0), Plane())


def test_laps_close_and_turn_left(path):
    around = 2.0 * (40.0 + 20.0) - 8.0 * 4.0 + 2.0 * np.pi * 4.0
    assert LAPS.around_m == pytest.approx(around)
    north, east = LAPS.points()
    each = np.round(np.arange(4) * around / 0.5).astype(int)[:3]
    np.testing.assert_allclose(np.hypot(north[each], east[each]), 0.0, atol=0.3)
    assert np.ptp(north) == pytest.approx(40.0, abs=0.3)
    assert np.ptp(east) == pytest.approx(20.0, abs=0.3)
    assert east[np.argmax(north)] < 0.0
    time = np.linspace(0.0, path.duration, 20_000)
    speed = path.speed(time)
    assert np.trapezoid(speed, time) == pytest.approx(3.0 * around, abs=1.0)
    assert np.degrees(np.ptp(path.heading(time))) == pytest.approx(3.0 * 360.0, abs=30.0)


def test_a_corner_has_its_radius(path):
    time = np.linspace(15.0, path.duration - 15.0, 20_000)
    curvature = path.heading(time, 1) / path.speed(time)
    assert curvature.max() < 0.02
    assert curvature.min() == pytest.approx(-1.0 / 4.0, rel=0.1)


def test_laps_begin_and_end_at_rest(path):
    np.testing.assert_array_equal(path.speed(np.linspace(0.0, 10.0, 100)), 0.0)
    assert path.speed(np.array([path.duration]))[0] == 0.0


@pytest.mark.parametrize("vehicle", [ROBOT, CAR], ids=lambda vehicle: vehicle.name)
def test_stand_ins_are_drivable(vehicle):
    scenario = vehicle.scenario()
    path = vehicle.laps(scenario)
    time = np.arange(0.0, path.duration, 0.1)
    speed = path.speed(time)
    assert np.abs(path.speed(time, 1)).max() < 1.0
    assert np.abs(speed * path.heading(time, 1)).max() < 3.0
    # below what an ICM-20602 measures at 2000 deg/s
    assert speed.max() / scenario.wheels[0].radius_m < np.radians(2000.0)


def test_a_run_takes_the_path_that_it_is_given_up_to_its_duration():
    scenario = ROBOT.scenario(duration_s=40.0)
    run = true_run(scenario, ROBOT.laps(scenario))
    assert run.path.duration == run.scenario.duration_s == 40.0
    laps = ROBOT.laps(scenario)
    np.testing.assert_array_equal(run.path.position(np.array([39.0])), laps.position(np.array([39.0])))
