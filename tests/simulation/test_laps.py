"""The laps that stand in for a surveyed track."""

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.simulation.laps import lap_length, lap_points
from polyins.simulation.plane import Plane
from polyins.simulation.run import true_run
from polyins.simulation.scenario import read_scenario
from polyins.simulation.wheel_scenario import Laps
from polyins_papers.vehicles import CAR, ROBOT

LAPS = Laps(length_m=40.0, width_m=20.0, corner_m=4.0, count=3, speed_m_s=1.5, change_m_s=0.5)


@pytest.fixture(scope="module")
def path():
    return LAPS.path(10.0, (0.0, 0.0, 0.0), Plane())


def test_laps_close_and_turn_left(path):
    around = 2.0 * (40.0 + 20.0) - 8.0 * 4.0 + 2.0 * np.pi * 4.0
    assert lap_length(40.0, 20.0, 4.0) == pytest.approx(around)
    north, east = lap_points(40.0, 20.0, 4.0, 3)
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


@pytest.mark.parametrize("vehicle", [ROBOT, pytest.param(CAR, marks=pytest.mark.long)], ids=lambda one: one.name)
def test_stand_ins_are_drivable(vehicle):
    scenario = vehicle.scenario()
    path = true_run(scenario).path
    time = np.arange(0.0, path.duration, 0.1)
    speed = path.speed(time)
    assert np.abs(path.speed(time, 1)).max() < 1.0
    assert np.abs(speed * path.heading(time, 1)).max() < 3.0
    # below what an ICM-20602 measures at 2000 deg/s
    assert speed.max() / scenario.wheels[0].radius_m < np.radians(2000.0)


@pytest.mark.long
@pytest.mark.parametrize("vehicle", [ROBOT, CAR], ids=lambda vehicle: vehicle.name)
def test_vehicles_go_up_and_down_and_lean_as_the_ground_does(vehicle):
    hilly, level = (true_run(vehicle.scenario(level=level)).path for level in (False, True))
    time = np.arange(40.0, hilly.duration, 0.1)
    for tilt in (hilly.roll(time), hilly.pitch(time)):
        # the ground does not twist: it is bent, so slopes are not those of the file, but of their size
        assert np.degrees(tilt).min() < -0.2
        assert np.degrees(tilt).max() > 0.2
        assert np.abs(np.degrees(tilt)).max() < 1.5 * vehicle.laps.slope_deg
    assert not level.roll(time).any()
    assert not level.pitch(time).any()
    np.testing.assert_array_equal(hilly.heading(time), level.heading(time))


def test_laps_are_driven_to_their_end_unless_a_duration_is_given():
    whole, part = (true_run(ROBOT.scenario(duration_s=duration)) for duration in (None, 40.0))
    assert part.path.duration == part.scenario.duration_s == 40.0
    assert whole.scenario.duration_s == whole.path.duration > 900.0
    at = np.array([39.0])
    np.testing.assert_array_equal(part.path.position(at), whole.path.position(at))


@pytest.mark.parametrize(
    ("laps", "problem"),
    [
        ("{corner_m: 20, width_m: 30, length_m: 90}", "laps.corner_m: is 20; expected at most half of"),
        ("{speed_m_s: 1, change_m_s: 1}", "laps.change_m_s: is 1; expected less than the 1 of speed_m_s"),
        ("{count: 0}", "laps.count"),
        ("{length_m: 5, width_m: 5, corner_m: 1}", "laps.count: is 1; expected laps of at least 20 s"),
        ("{}\nshuttle: {}", "shuttle: is given with laps; expected one of them"),
    ],
)
def test_laps_that_nothing_can_drive_are_refused(tmp_path, laps, problem):
    file = tmp_path / "scenario.yaml"
    file.write_text(f"laps: {laps}\n")
    with pytest.raises(InputError, match=problem):
        read_scenario(file)
