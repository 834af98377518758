"""The ground under a robot, and what a spring makes of it."""

import numpy as np
import pytest
from scipy.signal import welch

from polyins.simulation.road import FINE, STEP, Bump, Roughness, WheelContact, ground
from polyins.simulation.shuttle import Way, shuttle_path
from polyins.simulation.transmission import transmit

POINT, WHEEL = WheelContact(0.0, 0.0), WheelContact(0.125, 0.08)
FLAT = Roughness(0.0, 0.1, 3.0, 0.5, 4.0, 0.4)


def rough(correlation=0.5, sigma=0.4, seed=0, length=4000.0):
    drawn = ground(length, Roughness(2e-3, 0.1, 3.0, correlation, 4.0, sigma), (), POINT, np.random.default_rng(seed))
    return drawn(STEP * np.arange(int(length / STEP)))


def test_roughness_has_its_size_and_its_correlation():
    heights = rough(sigma=0.0)
    np.testing.assert_allclose(heights.std(axis=0), 2e-3, rtol=0.05)
    assert np.corrcoef(heights.T)[0, 1] == pytest.approx(0.5, abs=0.07)
    assert np.corrcoef(rough(correlation=1.0).T)[0, 1] == pytest.approx(1.0)


def test_power_falls_with_the_square_of_the_wave_number():
    wave, power = welch(rough(sigma=0.0)[:, 0], 1.0 / STEP, nperseg=4096)
    inside = (wave > 0.5) & (wave < 8.0)
    exponent = np.polyfit(np.log(wave[inside]), np.log(power[inside]), 1)[0]
    assert exponent == pytest.approx(-2.0, abs=0.1)
    # nothing beyond the shortest wave
    assert power[wave > 12.0].max() < 1e-6 * power[inside].max()


def test_patches_differ_in_roughness():
    def spread(sigma):
        pieces = rough(sigma=sigma)[:, 0].reshape(-1, 400)
        return np.std(np.log(pieces.std(axis=1)))

    assert spread(0.8) > spread(0.4) > 1.2 * spread(0.0)
    # the same in the median, more as a whole: exp(sigma^2)
    assert rough(sigma=0.4).std() / rough(sigma=0.0).std() == pytest.approx(np.exp(0.16), rel=0.05)


def test_a_book_lifts_the_wheels_of_its_side_only():
    book = Bump(5.0, 0.2, 0.012, left=True, right=False)
    drawn = ground(10.0, FLAT, (book,), WHEEL, np.random.default_rng(0))
    along = np.array([4.85, 5.1, 5.35])
    np.testing.assert_allclose(drawn(along)[:, 0], [0.0, 0.012, 0.0], atol=1e-5)
    np.testing.assert_allclose(drawn(along)[:, 1], 0.0, atol=1e-12)
    # the footprint makes a ramp of its edge
    edge = drawn(np.linspace(4.9, 5.1, 201))[:, 0]
    assert np.diff(edge).max() < 0.012 * 0.0011 / 0.08


def test_a_round_wheel_rolls_over_an_edge_along_an_arc():
    # between two points of the profile, which are its first and its last
    book = Bump(5.001, 0.2, 0.015, left=True, right=True)
    drawn = ground(10.0, FLAT, (book,), WheelContact(0.125, 0.0), np.random.default_rng(0))
    before = FINE * np.arange(4, 40)
    # the disc touches the edge; its axle is on a circle about it
    arc = 0.015 - 0.125 + np.sqrt(np.maximum(0.125**2 - before**2, 0.0))
    np.testing.assert_allclose(drawn(5.0025 - before)[:, 0], np.maximum(arc, 0.0), atol=2e-4)
    np.testing.assert_allclose(drawn(5.2 + before)[:, 1], np.maximum(arc, 0.0), atol=2e-4)


def test_a_spring_passes_slow_motion_and_stops_fast_motion():
    rate, damping, step = 2.0 * np.pi * 12.0, 0.2, 1.0 / 2000.0
    time = step * np.arange(12000)
    for frequency in (1.0, 12.0, 60.0):
        r = frequency / 12.0
        expected = np.sqrt((1 + (2 * damping * r) ** 2) / ((1 - r**2) ** 2 + (2 * damping * r) ** 2))
        y, y_rate = transmit(np.sin(2.0 * np.pi * frequency * time), step, rate, damping)
        settled = slice(6000, -1)
        assert y[settled].std() * np.sqrt(2.0) == pytest.approx(expected, rel=5e-3)
        np.testing.assert_allclose(np.gradient(y, step)[settled], y_rate[settled], atol=0.01 * np.abs(y_rate).max())


def test_a_shuttle_returns_on_parallel_straights():
    there = Way(1.2, 12.0, 1.5)
    path = shuttle_path(120.0, there, static=5.0)
    begins, ways = there.straights(120.0, 5.0)
    heading = path.heading(begins)
    np.testing.assert_allclose(heading, np.pi * np.arange(begins.size), atol=1e-9)
    np.testing.assert_allclose(path.speed(np.linspace(8.0, 119.0, 50)), 1.2)
    assert path.speed(np.array([4.9]))[0] == 0.0
    fine = np.linspace(0.0, begins[2], 100_001)
    assert np.trapezoid(path.speed(fine), fine) == pytest.approx(ways[2], abs=1e-4)
