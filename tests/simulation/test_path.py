import numpy as np
import pytest
from curves import Line
from hypothesis import given, settings
from hypothesis import strategies as st
from pymap3d import ecef2ned, geodetic2ecef

from polyins.model.attitude import rotation_matrices
from polyins.simulation import earth
from polyins.simulation.path import Driving, Profile, drive, path, smooth_steps

SEEDS = st.integers(0, 2**32 - 1)


@settings(max_examples=8, deadline=None)
@given(SEEDS)
def test_any_seed_gives_a_drivable_path(seed):
    driving = Driving()
    drawn = drive(400.0, static=30.0, seed=seed, driving=driving)
    time = np.arange(0.0, 400.0, 0.1)
    speed, yaw_rate = drawn.speed(time), drawn.heading(time, 1)
    assert speed.min() >= -1e-12
    assert 8.0 < speed.max() <= 16.0 + 1e-9
    assert np.abs(drawn.speed(time, 1)).max() <= 2.5
    assert np.all(np.abs(yaw_rate) * driving.turn_radius <= speed + 1e-9)
    assert np.abs(speed * yaw_rate).max() <= 1.6 * driving.lateral_acceleration
    assert np.abs(drawn.pitch(time)).max() <= driving.steepest + 1e-12
    assert np.abs(drawn.roll(time)).max() < np.radians(6.0)
    assert np.ptp(drawn.heading(time)) > np.radians(90.0)


@settings(max_examples=8, deadline=None)
@given(SEEDS)
def test_a_standing_vehicle_holds_attitude_and_place(seed):
    drawn = drive(300.0, static=30.0, seed=seed)
    time = np.arange(0.0, 300.0, 0.05)
    standing = drawn.speed(time) == 0.0
    assert standing[time <= 30.0].all()
    assert standing[time > 31.0].any()
    for curve in (drawn.roll, drawn.pitch, drawn.heading):
        assert np.abs(curve(time[standing], 1)).max() < 1e-9
    start = drawn.truth([0.0, 15.0, 30.0])
    np.testing.assert_array_equal(start.velocity, 0.0)
    assert np.ptp(start.position, axis=0) == pytest.approx(0.0, abs=1e-12)


def test_seeds_differ_and_repeat():
    time = np.linspace(0.0, 200.0, 50)
    first, again, other = (drive(200.0, seed=seed).truth(time).position for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-5


def test_curves_are_smooth_across_knots():
    drawn = drive(300.0, seed=3)
    knots = drawn.speed.x[(drawn.speed.x > 1.0) & (drawn.speed.x < 299.0)]
    before, after = np.nextafter(knots, 0.0), np.nextafter(knots, 1e9)
    for curve, order in ((drawn.speed, 3), (drawn.pitch, 3), (drawn.roll, 3), (drawn.heading, 4)):
        for nu in range(order + 1):
            np.testing.assert_allclose(curve(before, nu), curve(after, nu), atol=1e-9)


def test_smooth_steps_pass_through_their_values_without_overshoot():
    time, value = np.array([0.0, 2.0, 5.0, 6.0]), np.array([1.0, 3.0, -2.0, -2.0])
    curve = smooth_steps(time, value)
    np.testing.assert_allclose(curve(time), value, atol=1e-12)
    fine = curve(np.linspace(0.0, 6.0, 601))
    assert fine.max() == pytest.approx(3.0)
    assert fine.min() == pytest.approx(-2.0)


def test_velocity_points_along_the_body_and_heading_is_course():
    truth = drive(200.0, static=10.0, seed=4).truth(np.arange(20.0, 200.0, 0.5))
    moving = np.linalg.norm(truth.velocity, axis=1) > 0.5
    along = np.einsum("tij,ti->tj", rotation_matrices(truth.quaternion), truth.velocity)
    np.testing.assert_allclose(along[:, 1:], 0.0, atol=1e-12)
    course = np.arctan2(truth.velocity[moving, 1], truth.velocity[moving, 0])
    np.testing.assert_allclose(course, truth.attitude[moving, 2], atol=1e-12)


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (0.4, -0.3, 0.2)])
def test_velocity_is_the_derivative_of_position(point):
    drawn, time, half = drive(200.0, static=10.0, seed=5), np.arange(20.0, 199.0, 0.37), 0.002
    truth = drawn.truth(time, point)
    rate = (drawn.truth(time + half, point).position - drawn.truth(time - half, point).position) / (2 * half)
    meridian, transverse = earth.radii(truth.position)
    metric = np.column_stack([meridian, transverse * np.cos(truth.position[:, 0]), -np.ones_like(time)])
    np.testing.assert_allclose(rate * metric, truth.velocity, atol=2e-6)


def test_a_point_is_off_the_origin_by_its_lever_arm():
    drawn, time, point = drive(200.0, seed=6), np.arange(0.0, 200.0, 7.0), np.array([1.0, -2.0, 0.5])
    origin, there = drawn.truth(time), drawn.truth(time, point)
    for row in range(time.size):
        apart = ecef2ned(*geodetic2ecef(*there.position[row], deg=False), *origin.position[row], deg=False)
        expected = rotation_matrices(origin.quaternion)[row] @ point
        np.testing.assert_allclose(apart, expected, atol=1e-6)


def test_a_meridian_drive_covers_the_meridian_arc():
    # from the equator, at constant speed and height, to the latitude whose arc length is speed x time
    straight = path(Profile(Line(200.0), Line(), Line(), Line()), duration=4000.0, start=(0.0, 0.3, 0.0))
    latitude, longitude, height = straight.truth([4000.0]).position[0]
    e2, phi = earth.ECCENTRICITY_SQUARED, np.linspace(0.0, latitude, 20001)
    arc = np.trapezoid(earth.SEMI_MAJOR_AXIS * (1 - e2) / (1 - e2 * np.sin(phi) ** 2) ** 1.5, phi)
    assert arc == pytest.approx(800_000.0, abs=1e-3)
    assert (longitude, height) == pytest.approx((0.3, 0.0), abs=1e-12)
