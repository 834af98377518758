import numba
import numpy as np
import pytest
from curves import Line
from mechanization import mechanize
from rolled import CENTRE, LEVER_ARM, RADIUS, WORLDS, drawn, in_body, wheel
from scipy.spatial.transform import Rotation

from polyins.simulation.ground import without_twist
from polyins.simulation.path import Driving, Profile, drive, path
from polyins.simulation.plane import Plane
from polyins.simulation.rolling import roll
from polyins.simulation.wheels import wheel_increments

ORIGIN = (0.0, 0.0, 0.0)
# interpreted, a mechanization of 40 s takes a minute
DURATION = 15.0 if numba.config.DISABLE_JIT else 40.0


def integrals(rolled, lever_arm, edges):
    """Return (dtheta, dvel) from the true velocities: d/dt v_b = f_b - (w_ib + w_ie) x v_b + gravity in b."""
    ends = rolled.motion(edges, lever_arm)
    dtheta, dvel = np.zeros((edges.size - 1, 3)), np.diff(in_body(ends, ends.velocity), axis=0)
    for node, weight in zip(*np.polynomial.legendre.leggauss(12), strict=True):
        length = np.diff(edges)
        motion = rolled.motion(edges[:-1] + length * (1.0 + node) / 2.0, lever_arm)
        share = (length * weight / 2.0)[:, None]
        gravity = motion.C_nb[:, 2, :] * rolled.path.world.gravity(motion.position)[:, None]
        dtheta += share * motion.angular_rate
        turning = np.cross(motion.angular_rate + motion.earth_rate, in_body(motion, motion.velocity))
        dvel += share * (turning - gravity)
    return dtheta, dvel


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("radius", [RADIUS, 0.025], ids=["0.1 rad per sample", "0.4 rad per sample"])
def test_increments_are_the_integrals_of_the_true_motion(world, radius):
    rolled = roll(drawn(world), CENTRE + np.array([0.1, 0.0, 0.05]), radius, phase=0.3)
    exact = wheel_increments(rolled, 200.0)
    dtheta, dvel = exact.at(-LEVER_ARM)
    np.testing.assert_array_equal(exact.time, np.arange(1, 24_001) / 200.0)
    want_dtheta, want_dvel = integrals(rolled, LEVER_ARM, np.arange(24_001) / 200.0)
    assert np.abs(dtheta[:, 0]).max() > 0.005 * 1.5 / radius
    np.testing.assert_allclose(dtheta, want_dtheta, atol=1e-14)
    # the angle's spline is exact to 1e-8 rad/s, which times a velocity or an arm is what is left
    np.testing.assert_allclose(dvel, want_dvel, atol=1e-9)


@pytest.mark.parametrize("world", WORLDS)
def test_the_sum_of_the_increments_about_the_axle_is_the_way_over_the_radius(world):
    exact, rolled = wheel_increments(wheel(world), 200.0), wheel(world)
    motion = drawn(world).motion(exact.time - 0.0025)
    way = rolled.speed(motion, exact.time - 0.0025).sum() / 200.0
    # the axle takes part in the earth's rotation
    turned = exact.dtheta[:, 0].sum() - motion.earth_rate[:, 1].sum() / 200.0
    assert -RADIUS * turned == pytest.approx(way, abs=1e-5)


def test_a_standing_wheel_shows_earth_rate_and_gravity_whatever_its_angle():
    exact = wheel_increments(wheel("earth"), 200.0)
    motion, still = wheel("earth").motion(exact.time[:1000]), slice(0, 1000)
    np.testing.assert_allclose(exact.dtheta[still], motion.earth_rate / 200.0, atol=1e-11)
    gravity = wheel("earth").path.world.gravity(motion.position)[:, None]
    np.testing.assert_allclose(exact.dvel[still], -gravity * motion.C_nb[:, 2, :] / 200.0, atol=1e-9)
    assert np.linalg.norm(exact.dtheta[0]) * 200.0 == pytest.approx(7.292115e-5)


def test_a_wheel_at_constant_speed_shows_centripetal_force_and_turning_gravity():
    rate = 15.0
    straight = path(Profile(Line(rate * 0.1), Line(), Line(), Line(0.7)), duration=1.0, start=ORIGIN, world=Plane())
    exact = wheel_increments(roll(straight, CENTRE, 0.1), 200.0)
    dtheta, dvel = exact.at(-np.array([0.0, 0.015, 0.0]))
    np.testing.assert_allclose(dtheta, np.tile([-rate / 200.0, 0.0, 0.0], (200, 1)), atol=1e-15)
    ends = -rate * np.arange(201) / 200.0
    gravity = -9.80665 / -rate * np.column_stack([np.zeros(200), np.diff(-np.cos(ends)), np.diff(np.sin(ends))])
    np.testing.assert_allclose(dvel - gravity, np.tile([0.0, 0.015 * rate**2 / 200.0, 0.0], (200, 1)), atol=1e-12)


def test_mechanized_increments_return_to_the_path_as_fast_as_the_mechanization_allows():
    rolled = roll(without_twist(drive(DURATION, static=5.0, seed=1, driving=Driving(top_speed=1.9))), CENTRE, RADIUS)
    misses = [mechanized(rolled, rate_hz) for rate_hz in (200.0, 400.0, 800.0)]
    # two-sample coning and sculling terms: the error falls with the third power of the interval, not to a floor
    for what in range(3):
        assert 6.5 < misses[0][what] / misses[1][what] < 9.5
        assert 6.5 < misses[1][what] / misses[2][what] < 9.5
    assert misses[2][0] < 5e-3


def mechanized(rolled, rate_hz):
    """Return the largest errors, m, m/s and rad, of an IMU that starts from the truth and runs free."""
    exact = wheel_increments(rolled, rate_hz)
    start, truth = rolled.motion([0.0], LEVER_ARM), rolled.motion(exact.time, LEVER_ARM)
    increments = exact.at(-LEVER_ARM)
    position, velocity, C = mechanize(start.position[0], start.velocity[0], start.C_nb[0], *increments, exact.interval)
    turned = Rotation.from_matrix(np.swapaxes(truth.C_nb, 1, 2) @ C).as_rotvec()
    miss = np.abs(position - truth.position) * [6.4e6, 5.5e6, 1.0]
    return miss.max(), np.abs(velocity - truth.velocity).max(), np.abs(turned).max()
