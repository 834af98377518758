"""The mechanization of eight IMUs: rotations, rest on the turning Earth, coning."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lanes import NEAR_PLANE, Array, attitudes, block, get, near, put
from scipy.spatial.transform import Rotation

from polyins.kernels import bank, earth, strapdown

EARTH_RATE = 7.2921151467e-5


def angles_between(a: Rotation, b: Rotation) -> Array:
    return np.asarray((a.inv() * b).magnitude())


@pytest.mark.parametrize("length", [0.0, 1e-9, 1e-3, 0.5, 1.9999])
def test_rotations_of_up_to_two_radians_are_exact(length: float) -> None:
    rng = np.random.default_rng(1)
    start, axes = Rotation.random(8, random_state=rng), rng.standard_normal((8, 3))
    rotation = length * axes / np.linalg.norm(axes, axis=1)[:, None]
    w = block(start)
    put(w, bank.ROTATION, rotation)
    strapdown.advance_attitude(w, 0.01)
    expected = (start * Rotation.from_rotvec(rotation)).as_matrix()
    strapdown.update_matrix(w)
    np.testing.assert_allclose(get(w, bank.MATRIX, 9).reshape(8, 3, 3), expected, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(get(w, bank.QUATERNION, 4), axis=1), 1.0, rtol=3e-16)


def test_the_local_level_turns_under_the_body() -> None:
    rng = np.random.default_rng(2)
    start, earth_rate, transport = Rotation.random(8, random_state=rng), [1e-5, -7e-5], [2e-5, -3e-5, 1e-5]
    w = block(start)
    put(w, bank.EARTH_RATE, earth_rate)
    put(w, bank.TRANSPORT_RATE, transport)
    strapdown.advance_attitude(w, 0.02)
    turned = 0.02 * np.array([3e-5, -3e-5, -6e-5])
    assert angles_between(attitudes(w), Rotation.from_rotvec(-turned) * start).max() < 1e-15
    assert angles_between(attitudes(w), start).min() > 1e-6


def test_a_long_flight_keeps_quaternions_normal() -> None:
    w = block()
    put(w, bank.ROTATION, np.random.default_rng(3).uniform(-0.1, 0.1, (8, 3)))
    for _ in range(20_000):
        strapdown.advance_attitude(w, 0.01)
    np.testing.assert_allclose(np.linalg.norm(get(w, bank.QUATERNION, 4), axis=1), 1.0, rtol=1e-15)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 1.0))
def test_increments_are_corrected_for_bias_and_scale(seed: int, fraction: float) -> None:
    rng, dt, w = np.random.default_rng(seed), 0.005, block()
    raw, errors, before = rng.standard_normal((8, 6)), 1e-2 * rng.standard_normal((8, 12)), rng.standard_normal((8, 6))
    put(w, bank.RAW_DTHETA, raw)
    put(w, bank.DTHETA, before)
    put(w, bank.ERRORS, errors)
    strapdown.update_sensitivity(w)
    strapdown.compensate(w, fraction, dt)
    expected = (fraction * raw - dt * errors[:, :6]) / (1.0 + errors[:, 6:])
    np.testing.assert_allclose(get(w, bank.DTHETA, 6), expected, rtol=1e-14, atol=1e-17)
    np.testing.assert_array_equal(get(w, bank.PREVIOUS_DTHETA, 6), before)


@pytest.mark.parametrize("latitude", [-1.2, 0.5328])
def test_an_imu_at_rest_stays_at_rest_on_the_turning_earth(latitude: float) -> None:
    dt, start = 0.02, Rotation.random(8, random_state=np.random.default_rng(4))
    w = block(start, position=(latitude, 1.0, 120.0))
    rate = EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    for turned, accelerated in ((bank.DTHETA, bank.DVEL), (bank.PREVIOUS_DTHETA, bank.PREVIOUS_DVEL)):
        put(w, turned, dt * start.inv().apply(rate))
        put(w, accelerated, -dt * start.inv().apply([0.0, 0.0, earth.gravity(latitude, 120.0)]))
    place = near(latitude)
    strapdown.evaluate_at_own_state(w)
    earth.evaluate(w, *place[1:4])
    for _ in range(round(600.0 / dt)):
        strapdown.mechanize(w, dt, 1.0 / 12.0, place)
    metres = np.empty(3)
    earth.metric(np.array([latitude, 1.0, 120.0]), True, metres)
    drift = (get(w, bank.POSITION, 3) - [latitude, 1.0, 120.0]) * metres
    assert np.abs(drift).max() < 1e-4  # of the 300 km that gravity left uncompensated for 250 s would make
    assert np.abs(get(w, bank.VELOCITY, 3)).max() < 1e-6
    assert angles_between(attitudes(w), start).max() < 1e-11


def test_free_fall_on_a_plane_is_a_parabola() -> None:
    w, dt = block(position=(3.0, 4.0, 100.0)), 0.01
    put(w, bank.VELOCITY, [2.0, -1.0, -5.0])
    earth.evaluate_plane(w, NEAR_PLANE[4])
    for _ in range(200):
        strapdown.mechanize(w, dt, 1.0 / 12.0, NEAR_PLANE)
    g, t = NEAR_PLANE[4], 2.0
    fallen = [3.0 + 2.0 * t, 4.0 - t, 100.0 + 5.0 * t - 0.5 * g * t**2]
    np.testing.assert_allclose(get(w, bank.POSITION, 3), np.tile(fallen, (8, 1)), rtol=1e-13)
    np.testing.assert_allclose(get(w, bank.VELOCITY, 3)[:, 2], -5.0 + g * t, rtol=1e-13)


CONE, FREQUENCY, CONING_DT = 0.02, 2.0 * np.pi * 10.0, 0.01


def coning_attitude(time: float) -> Rotation:
    """The x axis stays within the cone: q = (cos(a/2), 0, sin(a/2) cos(w t), sin(a/2) sin(w t))."""
    c, s = np.cos(0.5 * CONE), np.sin(0.5 * CONE)
    q = [c, 0.0, s * np.cos(FREQUENCY * time), s * np.sin(FREQUENCY * time)]
    return Rotation.from_quat(q, scalar_first=True)


def coning_increment(begin: float, end: float) -> Array:
    """The integral of the body rate (-2 w sin^2(a/2), -w sin a sin(w t), w sin a cos(w t))."""
    a, b = FREQUENCY * begin, FREQUENCY * end
    return np.array([
        -2.0 * np.sin(0.5 * CONE) ** 2 * (b - a),
        np.sin(CONE) * (np.cos(b) - np.cos(a)),
        np.sin(CONE) * (np.sin(b) - np.sin(a)),
    ])  # fmt: skip


def coning_drift(ratio: float, seconds: float) -> float:
    """Run through the motion and return the drift about x, rad/s."""
    w = block(coning_attitude(0.0))
    put(w, bank.PREVIOUS_DTHETA, coning_increment(-CONING_DT, 0.0))
    count = round(seconds / CONING_DT)
    for k in range(count):
        increment = coning_increment(k * CONING_DT, (k + 1) * CONING_DT)
        put(w, bank.DTHETA, increment)
        strapdown.mechanize(w, CONING_DT, ratio, NEAR_PLANE)
        put(w, bank.PREVIOUS_DTHETA, increment)
    away = coning_attitude(count * CONING_DT).inv() * attitudes(w)[0]
    return float(away.as_rotvec()[0] / seconds)


def test_coning_drifts_as_the_theory_of_two_samples_says() -> None:
    """What half the integral of angle x rate gives, less what the product of two neighbouring increments gives."""
    x, square = FREQUENCY * CONING_DT, np.sin(CONE) ** 2
    whole = 0.5 * square * (x - np.sin(x)) / CONING_DT
    left = whole - square * np.sin(0.5 * x) ** 2 * np.sin(x) / 3.0 / CONING_DT
    uncorrected, corrected = coning_drift(0.0, 5.0), coning_drift(1.0 / 12.0, 5.0)
    assert abs(uncorrected) == pytest.approx(whole, rel=2e-3)
    assert abs(corrected) == pytest.approx(left, rel=2e-2)
    assert left < 0.1 * whole
    assert np.sign(uncorrected) == np.sign(corrected)


@pytest.mark.parametrize(("before", "now"), [(0.02, 0.02), (0.005, 0.02), (0.02, 0.005)])
def test_the_coning_ratio_of_unequal_intervals_is_exact_for_linear_rates(before: float, now: float) -> None:
    rate, slope = np.array([0.5, -0.2, 0.3]), np.array([-2.0, 4.0, 1.0])
    w = block()
    put(w, bank.PREVIOUS_DTHETA, rate * before - 0.5 * slope * before**2)
    put(w, bank.DTHETA, rate * now + 0.5 * slope * now**2)
    strapdown.correct_coning_and_sculling(w, now**2 / (6.0 * before * (before + now)))
    strapdown.advance_attitude(w, now)
    pieces, expected = 2000, Rotation.identity()
    for k in range(pieces):
        expected *= Rotation.from_rotvec((rate + slope * (k + 0.5) * now / pieces) * now / pieces)
    assert angles_between(attitudes(w), expected).max() < 2e-9
    commuting = get(w, bank.DTHETA, 3)[0]
    assert (expected.inv() * Rotation.from_rotvec(commuting)).magnitude() > 4e-7 * (now / 0.02) ** 3
