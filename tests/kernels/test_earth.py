"""Radii, gravity and rates of the Earth against pymap3d and closed forms."""

from __future__ import annotations

import numpy as np
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lanes import Array, block, get, put
from pymap3d import rcurve

from polyins.kernels import bank, earth

LATITUDES = [-1.5, -0.7, 0.0, 0.5328, 1.1, 1.5]


@pytest.mark.parametrize("latitude", LATITUDES)
def test_radii_are_those_of_the_ellipsoid(latitude: float) -> None:
    expected = rcurve.meridian(latitude, deg=False), rcurve.transverse(latitude, deg=False)
    np.testing.assert_allclose(earth.radii(latitude), expected, rtol=1e-13)


@pytest.mark.parametrize("latitude", [-1.5, 0.5328, 1.1])
def test_the_metric_turns_coordinates_into_metres(latitude: float) -> None:
    position, metres, step = np.array([latitude, 2.0, 800.0]), np.empty(3), np.array([1e-5, 1e-5, 10.0])
    earth.metric(position, True, metres)
    for axis, h in enumerate(np.diag(step)):
        ahead = np.array(pymap3d.geodetic2ned(*(position + h), *position, deg=False))
        behind = np.array(pymap3d.geodetic2ned(*(position - h), *position, deg=False))
        moved = (ahead - behind) / (2.0 * step[axis])
        assert moved[axis] == pytest.approx(metres[axis], rel=1e-8)


def test_on_a_plane_metres_are_metres_and_height_points_up() -> None:
    metres = np.empty(3)
    earth.metric(np.array([1e5, -2e5, 30.0]), False, metres)
    np.testing.assert_array_equal(metres, [1.0, 1.0, -1.0])


@pytest.mark.parametrize("latitude", LATITUDES)
def test_gravity_on_the_ellipsoid_is_somiglianas(latitude: float) -> None:
    s2 = np.sin(latitude) ** 2  # GRS 80, of which the formula is the series
    expected = 9.7803267715 * (1.0 + 0.001931851353 * s2) / np.sqrt(1.0 - 0.00669438002290 * s2)
    assert earth.gravity(latitude, 0.0) == pytest.approx(expected, abs=2e-9)


@pytest.mark.parametrize("height", [-400.0, 1000.0, 9000.0])
@pytest.mark.parametrize("latitude", [0.0, 0.5328, 1.5])
def test_gravity_above_the_ellipsoid_falls_off_with_the_square_of_height(latitude: float, height: float) -> None:
    a, f, m = 6378137.0, 1.0 / 298.257222101, 0.00344978600308
    s2, ground = np.sin(latitude) ** 2, earth.gravity(latitude, 0.0)
    expected = ground * (1.0 - 2.0 / a * (1.0 + f + m - 2.0 * f * s2) * height + 3.0 * (height / a) ** 2)
    assert earth.gravity(latitude, height) == pytest.approx(expected, abs=6e-11 * abs(height) + 4e-9)
    assert abs(earth.gravity(latitude, height) - ground) > 1e-3


angles = st.floats(-1.5, 1.5)


@settings(max_examples=50, deadline=None)
@given(
    angles,
    st.lists(st.floats(-1e-3, 1e-3), min_size=8, max_size=8),
    st.floats(-500.0, 2e4),
    st.floats(-300.0, 300.0),
    st.floats(-300.0, 300.0),
)
def test_near_a_latitude_all_lanes_are_evaluated_to_rounding(
    latitude: float, offsets: list[float], height: float, north: float, east: float
) -> None:
    own = latitude + np.array(offsets)
    w = block()
    put(w, bank.AT_POSITION, np.column_stack([own, np.ones(8), np.full(8, height)]))
    put(w, bank.AT_VELOCITY, [north, east, 3.0])
    earth.evaluate(w, latitude, np.sin(latitude), np.cos(latitude))
    r_m, r_n = np.array([earth.radii(x) for x in own]).T + height
    rate = 7.2921151467e-5
    expected: dict[int, Array] = {
        bank.GRAVITY: np.array([[earth.gravity(x, height)] for x in own]),
        bank.EARTH_RATE: rate * np.column_stack([np.cos(own), -np.sin(own)]),
        bank.TRANSPORT_RATE: np.column_stack([east / r_n, -north / r_m, -east / r_n * np.tan(own)]),
        bank.TO_LATITUDE: 1.0 / r_m[:, None],
        bank.TO_LONGITUDE: 1.0 / (r_n * np.cos(own))[:, None],
    }
    for field, values in expected.items():
        # the secant loses a digit near the pole, where the cosine is small
        np.testing.assert_allclose(get(w, field, values.shape[1]), values, rtol=2e-14, atol=1e-19)


def test_a_plane_has_the_given_gravity_and_does_not_turn() -> None:
    w = block(position=(1e4, 2e4, 30.0))
    w[bank.GRAVITY : bank.TO_LATITUDE] = np.nan
    put(w, bank.AT_VELOCITY, [30.0, 20.0, 1.0])
    earth.evaluate_plane(w, 9.81)
    np.testing.assert_array_equal(get(w, bank.GRAVITY, 1), 9.81)
    np.testing.assert_array_equal(get(w, bank.EARTH_RATE, 2), 0.0)
    np.testing.assert_array_equal(get(w, bank.TRANSPORT_RATE, 3), 0.0)
    np.testing.assert_array_equal(get(w, bank.TO_LATITUDE, 2), 1.0)
