import numpy as np
from curves import Line
from pymap3d import geodetic2ned

from polyins.model.attitude import quaternions, rotation_matrices
from polyins.simulation.gnss import GnssReceiver, fixes, with_wrong_fixes
from polyins.simulation.increments import increments
from polyins.simulation.path import Profile, drive, path
from polyins.simulation.plane import Plane

ORIGIN = (0.0, 0.0, 0.0)


def test_a_standing_imu_on_the_plane_feels_gravity_and_no_earth_rate():
    attitude = np.array([0.3, -0.2, 2.0])
    standing = path(Profile(Line(), *map(Line, attitude)), duration=1.0, start=ORIGIN, world=Plane(9.81))
    exact = increments(standing, 100.0)
    C_nb = rotation_matrices(quaternions(attitude[None]))[0]
    np.testing.assert_array_equal(exact.dtheta, 0.0)
    np.testing.assert_allclose(
        exact.at([5.0, 1.0, 2.0])[1], np.tile(C_nb.T @ [0.0, 0.0, -0.0981], (100, 1)), atol=1e-15
    )


def test_a_circle_on_the_plane_closes_and_presses_outwards():
    speed, rate = 3.0, 0.5
    period = 2.0 * np.pi / rate
    circle = path(
        Profile(Line(speed), Line(), Line(), Line(0.0, rate)), duration=period, start=(7.0, 8.0, 9.0), world=Plane()
    )
    truth = circle.truth([0.0, period / 2.0, period])
    np.testing.assert_allclose(truth.position[[0, 2]], [[7.0, 8.0, 9.0]] * 2, atol=1e-9)
    np.testing.assert_allclose(truth.position[1], [7.0, 8.0 + 2.0 * speed / rate, 9.0], atol=1e-9)
    exact = increments(circle, 100.0)
    force = np.tile([0.0, speed * rate, -9.80665], (exact.time.size, 1))
    np.testing.assert_allclose(exact.dvel, force / 100.0, atol=1e-14)


def test_a_point_s_height_falls_where_it_is_lower():
    level = path(Profile(Line(), Line(), Line(), Line()), duration=1.0, start=ORIGIN, world=Plane())
    np.testing.assert_allclose(level.truth([0.5], [1.0, 2.0, 3.0]).position, [[1.0, 2.0, -3.0]], atol=1e-15)


def test_plane_and_earth_agree_on_the_shape_of_a_short_drive():
    start = np.array([0.5, 2.0, 35.0])
    on_plane, on_earth = drive(100.0, seed=4, start=ORIGIN, world=Plane()), drive(100.0, seed=4, start=start)
    time = np.linspace(0.0, 100.0, 50)
    north, east, down = geodetic2ned(*on_earth.truth(time).position.T, *start, deg=False)
    # half a kilometre on a ball of 6,400 km: 2 cm of height, less sideways
    np.testing.assert_allclose(np.column_stack([north, east, -down]), on_plane.truth(time).position, atol=0.1)
    assert np.ptp(north) + np.ptp(east) > 100.0


def test_fixes_and_lies_are_in_metres():
    drawn = drive(100.0, static=10.0, seed=4, start=ORIGIN, world=Plane())
    stream = fixes(drawn, GnssReceiver(np.zeros(3), np.ones(3)), np.random.default_rng(0))
    off = stream.position - drawn.truth(stream.time).position
    assert 0.8 < off.std() < 1.2
    lying, chosen = with_wrong_fixes(stream, np.arange(50, 90), 5, 30.0, np.random.default_rng(1), drawn.world)
    moved = np.linalg.norm(lying.position - stream.position, axis=1)
    np.testing.assert_allclose(moved[chosen], 30.0, rtol=1e-12)
    assert np.count_nonzero(moved) == 5
