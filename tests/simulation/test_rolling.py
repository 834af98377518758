import numpy as np
import pytest
from curves import Line
from rolled import CENTRE, LEVER_ARM, RADIUS, WORLDS, drawn, in_body, wheel

from polyins.model.geodesy import metres_per_unit
from polyins.simulation.ground import without_twist
from polyins.simulation.path import Driving, Profile, drive, path
from polyins.simulation.plane import Plane
from polyins.simulation.rolling import roll
from polyins.simulation.slip import slip_periods

TIME = np.sort(np.random.default_rng(0).uniform(0.0, 120.0, 2000))


def rate_to_earth(motion):
    return motion.angular_rate - motion.earth_rate


@pytest.mark.parametrize("world", WORLDS)
def test_the_wheel_s_speed_is_the_forward_speed_of_its_centre(world):
    vehicle, centre = drawn(world).motion(TIME), wheel(world).motion(TIME)
    forward = in_body(vehicle, centre.velocity)[:, 0]
    # on the earth the level at the centre is turned by 3e-8 rad against that in the middle of the axle
    np.testing.assert_allclose(-RADIUS * rate_to_earth(centre)[:, 0], forward, atol=1e-13)
    assert np.ptp(forward) > 1.0
    assert np.abs(drawn(world).pitch(TIME)).max() > 0.01
    assert np.abs(forward - drawn(world).speed(TIME)).max() > 0.01


@pytest.mark.parametrize("world", WORLDS)
def test_a_wheel_on_ground_without_twist_moves_neither_sideways_nor_up(world):
    across = in_body(drawn(world).motion(TIME), wheel(world).motion(TIME).velocity)[:, 1:]
    # the spline of the roll is exact to 1e-10 rad/s; the earth's curvature twists by speed over radius, 3e-7 rad/s
    np.testing.assert_allclose(across, 0.0, atol=1e-10 if world == "plane" else 1e-7)


def test_on_a_twisting_road_the_wheel_goes_up_by_the_roll_rate():
    road = drive(120.0, static=10.0, seed=2, start=(0.0, 0.0, 0.0), driving=Driving(top_speed=1.9), world=Plane())
    vehicle, centre = road.motion(TIME), roll(road, CENTRE, RADIUS).motion(TIME)
    across = in_body(vehicle, centre.velocity)[:, 1:]
    np.testing.assert_allclose(across[:, 1], vehicle.angular_rate[:, 0] * CENTRE[1], atol=1e-14)
    assert np.abs(across).max() > 1e-3


@pytest.mark.parametrize("world", WORLDS)
def test_all_modules_point_at_the_middle_of_the_axle(world):
    truth = drawn(world).truth(TIME)
    for centre in (CENTRE, -CENTRE, np.array([0.4, 0.1, -0.2])):
        rolled = roll(drawn(world), centre, RADIUS, phase=1.0)
        imu = rolled.motion(TIME, LEVER_ARM)
        arm = imu.C_nb @ LEVER_ARM - drawn(world).motion(TIME).C_nb @ centre
        origin = imu.position + rolled.path.world.displacement(imu.position, arm)
        metres = (origin - truth.position) * metres_per_unit(truth.position, world == "earth")
        # longitude as a double is exact to 3e-9 m; the radii of first order to 1e-7 of the arm
        np.testing.assert_allclose(metres, 0.0, atol=1e-13 if world == "plane" else 1e-7)


@pytest.mark.parametrize("world", WORLDS)
def test_velocity_and_rate_of_an_imu_are_the_derivatives_of_its_position_and_attitude(world):
    step, rolled = 1e-4, wheel(world)
    before, at, after = (rolled.motion(TIME[5:-5] + shift, LEVER_ARM) for shift in (-step, 0.0, step))
    moved = (after.position - before.position) * metres_per_unit(at.position, world == "earth") / (2.0 * step)
    np.testing.assert_allclose(moved, at.velocity, atol=1e-4)
    spun = np.swapaxes(at.C_nb, 1, 2) @ (after.C_nb - before.C_nb) / (2.0 * step)
    np.testing.assert_allclose(spun[:, [2, 0, 1], [1, 2, 0]], rate_to_earth(at), atol=2e-5)
    # on a lever arm of 15 mm the velocity differs from that of the centre by 0.3 m/s
    assert np.abs(at.velocity - rolled.motion(TIME[5:-5]).velocity).max() > 0.1


def test_the_module_s_heading_is_the_vehicle_s_plus_a_right_angle_and_its_roll_the_wheel_s_angle():
    level = path(Profile(Line(1.5), Line(), Line(), Line(0.4)), duration=2.0, start=(0.0, 0.0, 0.0), world=Plane())
    rolled = roll(level, CENTRE, 0.5, phase=0.3)
    attitude = rolled.motion(np.array([0.0, 1.0])).attitude
    np.testing.assert_allclose(attitude, [[0.3, 0.0, 0.4 + np.pi / 2], [0.3 - 3.0, 0.0, 0.4 + np.pi / 2]], atol=1e-12)


def test_a_wheel_outside_of_the_turn_turns_more():
    turning = path(
        Profile(Line(1.0), Line(), Line(), Line(0.0, 0.5)), duration=4.0, start=(0.0, 0.0, 0.0), world=Plane()
    )
    left, right = (roll(turning, (0.0, y, 0.0), 0.1) for y in (-0.2, 0.2))
    end = np.array([4.0])
    assert left.angle(end)[0] == pytest.approx(-4.0 * 1.1 / 0.1)
    assert right.angle(end)[0] == pytest.approx(-4.0 * 0.9 / 0.1)


def test_pitching_on_the_spot_turns_the_axle_and_not_the_wheel():
    nodding = path(Profile(Line(), Line(), Line(0.0, 0.2), Line()), duration=1.0, start=(0.0, 0.0, 0.0), world=Plane())
    motion = roll(nodding, CENTRE, RADIUS).motion(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(motion.angular_rate, 0.0, atol=1e-15)
    np.testing.assert_allclose(motion.C_nb - motion.C_nb[:1], 0.0, atol=1e-12)


def test_a_wheel_that_slips_turns_more_than_it_rolls():
    slip = slip_periods(120.0, np.random.default_rng(1), constant=0.02, size=0.3, length=2.0, every=5.0)
    slipping = roll(drawn("plane"), CENTRE, RADIUS, slip=slip)
    forward = slipping.speed(drawn("plane").motion(TIME), TIME)
    shown = -RADIUS * slipping.motion(TIME).angular_rate[:, 0]
    np.testing.assert_allclose(shown, (1.0 + slip(TIME)) * forward, atol=1e-13)
    turned = np.interp(TIME, TIME, slip(TIME))
    assert turned.min() == pytest.approx(0.02)
    assert 0.1 < turned.max() < 0.32


def test_periods_of_slip_have_their_length_and_spacing():
    slip = slip_periods(5000.0, np.random.default_rng(1), constant=0.0, size=0.3, length=2.0, every=8.0)
    time = np.arange(0.0, 5000.0, 0.01)
    slips = slip(time) > 0.0
    periods = np.count_nonzero(np.diff(slips.astype(int)) == 1)
    assert periods == pytest.approx(500, rel=0.1)
    assert slips.mean() == pytest.approx(0.2, rel=0.1)


def test_ground_without_twist_keeps_speed_and_heading_and_has_slopes():
    twisting = drive(300.0, static=20.0, seed=5)
    smooth = without_twist(twisting)
    time = np.arange(0.0, 300.0, 0.37)
    np.testing.assert_array_equal(smooth.heading(time), twisting.heading(time))
    np.testing.assert_array_equal(smooth.speed(time), twisting.speed(time))
    np.testing.assert_array_equal(smooth.position(np.zeros(1)), twisting.position(np.zeros(1)))
    assert smooth.static == 20.0
    assert 0.005 < smooth.pitch(time).std() < 0.05
    assert 0.001 < np.ptp(smooth.roll(time)) < 0.2
    standing = time < 20.0
    assert np.ptp(smooth.pitch(time[standing])) + np.ptp(smooth.roll(time[standing])) < 1e-8
