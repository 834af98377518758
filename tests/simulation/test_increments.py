import numba
import numpy as np
import pytest
from curves import Line, Sine
from mechanization import mechanize
from scipy.spatial.transform import Rotation
from scipy.special import jv

from polyins.model.attitude import quaternions, rotation_matrices
from polyins.simulation import earth
from polyins.simulation.increments import increments
from polyins.simulation.path import Profile, drive, path

# interpreted, a mechanization of 1,000 s takes minutes
DURATION = 100.0 if numba.config.DISABLE_JIT else 1000.0
ALIGNED = np.eye(3)
NORTH_POLE = (np.pi / 2, 0.0, 0.0)
ATTITUDE = np.array([0.3, -0.2, 2.0])
C_NB = rotation_matrices(quaternions(ATTITUDE[None]))[0]


def mechanized(drawn, rate_hz, point, C_ab=ALIGNED):
    """Return the largest errors, m, m/s and deg, of an IMU that starts from the truth and runs free."""
    exact = increments(drawn, rate_hz)
    start, truth = drawn.truth([0.0], point), drawn.truth(exact.time, point)
    C_start = rotation_matrices(start.quaternion)[0] @ C_ab
    position, velocity, C = mechanize(
        start.position[0], start.velocity[0], C_start, *exact.at(point, C_ab), exact.interval
    )
    meridian, transverse = earth.radii(truth.position)
    metric = np.column_stack([meridian, transverse * np.cos(truth.position[:, 0]), np.ones_like(meridian)])
    turned = np.swapaxes(rotation_matrices(truth.quaternion) @ C_ab, 1, 2) @ C
    angle = np.linalg.norm(Rotation.from_matrix(turned).as_rotvec(degrees=True), axis=1)
    miss = np.linalg.norm((position - truth.position) * metric, axis=1)
    return miss.max(), np.abs(velocity - truth.velocity).max(), angle.max()


@pytest.mark.parametrize(
    ("point", "mount_deg"),
    [((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((0.3, -0.3, 0.26), (130.0, -35.0, 170.0))],
    ids=["at the origin", "on a lever arm, turned"],
)
def test_mechanized_increments_return_to_the_path(point, mount_deg):
    C_ab = Rotation.from_euler("ZYX", mount_deg, degrees=True).as_matrix()
    miss, velocity, angle = mechanized(drive(DURATION, seed=0), 200.0, point, C_ab)
    assert miss < 5e-4
    assert velocity < 1e-6
    assert angle < 1e-7


def test_a_body_that_slips_sideways_returns_to_its_path_too():
    slipping = path(
        Profile(Line(8.0), Sine(0.1, 0.5), Sine(0.05, 0.3, 1.0), Line(0.3, 0.1), Sine(1.5, 0.4)), duration=60.0
    )
    miss, velocity, angle = mechanized(slipping, 200.0, (0.3, -0.3, 0.26))
    assert miss < 5e-4
    assert velocity < 1e-5
    assert angle < 1e-6
    time = np.arange(0.0, 60.0, 0.1)
    motion = slipping.motion(time)
    sideways = np.einsum("ti,ti->t", motion.velocity, motion.C_nb[:, :, 1])
    np.testing.assert_allclose(sideways, Sine(1.5, 0.4)(time), atol=1e-12)


def test_what_is_left_is_the_mechanization_s_own_error():
    # the integrals do not depend on the rate, so the error falls with the third power of the interval
    drawn = drive(200.0, static=20.0, seed=1)
    coarse, fine = (mechanized(drawn, rate, (0.2, 0.1, -0.3))[2] for rate in (50.0, 100.0))
    assert 6.0 < coarse / fine < 10.0


@pytest.mark.parametrize("latitude", [-0.9, 0.0, 0.5, 1.2])
def test_a_standing_imu_feels_gravity_and_the_earth_s_rate(latitude):
    position = np.array([[latitude, 1.0, 300.0]])
    standing = path(Profile(Line(), *map(Line, ATTITUDE)), duration=1.0, start=position[0])
    exact = increments(standing, 100.0)
    rate = earth.ROTATION_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    np.testing.assert_allclose(exact.dtheta, np.tile(C_NB.T @ rate * 0.01, (100, 1)), rtol=1e-12, atol=1e-18)
    force = C_NB.T @ [0.0, 0.0, -earth.gravity(position)[0]]
    np.testing.assert_allclose(exact.dvel, np.tile(force * 0.01, (100, 1)), rtol=1e-12, atol=1e-15)


def test_a_turntable_at_the_pole_turns_at_a_constant_rate():
    # table and earth turn about the same vertical, so the rate in b and the centripetal force are constant
    roll, pitch, rate, point = 0.3, -0.2, 4.0, np.array([0.5, -0.2, 0.1])
    table = path(Profile(Line(), Line(roll), Line(pitch), Line(0.0, rate)), duration=2.0, start=NORTH_POLE)
    exact = increments(table, 200.0)
    down = rotation_matrices(quaternions(np.array([[roll, pitch, 0.0]])))[0, 2]
    turning = (rate - earth.ROTATION_RATE) * down
    np.testing.assert_allclose(exact.dtheta, np.tile(turning / 200.0, (400, 1)), rtol=1e-12, atol=1e-17)
    centripetal = np.cross(turning, np.cross(turning, point)) / 200.0
    gained = exact.at(point)[1] - exact.dvel
    # gravity's change over half a metre is 2e-6 m/s^2
    np.testing.assert_allclose(gained, np.tile(centripetal, (400, 1)), atol=2e-6 / 200.0)
    assert np.abs(gained - centripetal).max() > 1e-7 / 200.0


def test_changing_rate_pushes_along_the_tangent():
    swinging = path(Profile(Line(), Line(), Line(), Sine(0.5, 3.0)), duration=2.0)
    exact = increments(swinging, 200.0)
    gained = exact.at([1.0, 0.0, 0.0])[1] - exact.dvel
    ends = np.arange(401) / 200.0
    np.testing.assert_allclose(gained[:, 1], np.diff(1.5 * np.cos(3.0 * ends)), atol=2e-6)


def test_coning_drifts_as_bessel_s_function_says():
    # roll = a sin, pitch = a cos: the z axis turns on average by a w J1(a), and sees the earth by J0(sqrt(2) a)
    amplitude, rate, latitude = 0.05, 2.0 * np.pi * 8.0, 0.5
    roll, pitch = Sine(amplitude, rate), Sine(amplitude, rate, np.pi / 2)
    coning = path(Profile(Line(), roll, pitch, Line()), duration=1.0, start=(latitude, 0.0, 0.0))
    drift = increments(coning, 400.0).dtheta.sum(axis=0)
    earth_down = -earth.ROTATION_RATE * np.sin(latitude)
    expected = amplitude * rate * jv(1, amplitude) + earth_down * jv(0, np.sqrt(2.0) * amplitude)
    assert drift[2] == pytest.approx(expected, abs=1e-12)


def test_a_straight_drive_adds_coriolis_and_the_acceleration():
    # along the equator eastwards at constant speed: f = -(g - 2 w v - v^2 / R) down, no rate but about north
    speed = 100.0
    straight = path(Profile(Line(speed), Line(), Line(), Line(np.pi / 2)), duration=1.0, start=(0.0, 0.0, 0.0))
    exact = increments(straight, 100.0)
    up = earth.EQUATOR_GRAVITY - 2.0 * earth.ROTATION_RATE * speed - speed**2 / earth.SEMI_MAJOR_AXIS
    np.testing.assert_allclose(exact.dvel, np.tile([0.0, 0.0, -up / 100.0], (100, 1)), atol=1e-13)
    turn = earth.ROTATION_RATE + speed / earth.SEMI_MAJOR_AXIS
    np.testing.assert_allclose(exact.dtheta, np.tile([0.0, -turn / 100.0, 0.0], (100, 1)), atol=1e-16)
    speeding = path(Profile(Line(0.0, 2.0), Line(), Line(), Line(np.pi / 2)), duration=1.0, start=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(increments(speeding, 100.0).dvel[:, 0], 0.02, rtol=1e-9)


def test_gravity_gradient_is_the_derivative_of_gravity():
    position, step = np.array([[0.6, 0.2, 500.0]]), 100.0
    gradient = earth.gravity_gradient(position)[0]
    for axis, offset in ((0, [step, 0.0, 0.0]), (2, [0.0, 0.0, step])):
        ahead = position + earth.displacement(position, np.array([offset]))
        change = (earth.gravity(ahead) - earth.gravity(position))[0] / step
        assert gradient[2, axis] == pytest.approx(change, rel=1e-3, abs=1e-12)


def test_intervals_tile_the_path():
    drawn = drive(100.0, static=10.0, seed=2)
    fine, coarse = increments(drawn, 200.0), increments(drawn, 50.0)
    np.testing.assert_allclose(coarse.time, np.arange(1, 5001) / 50.0, rtol=1e-15)
    np.testing.assert_allclose(fine.dtheta.reshape(-1, 4, 3).sum(axis=1), coarse.dtheta, atol=1e-12)
    np.testing.assert_allclose(fine.lever.reshape(-1, 4, 3, 3).sum(axis=1), coarse.lever, atol=1e-12)
