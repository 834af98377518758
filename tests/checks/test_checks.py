"""Checks of data: what they propose and what they let pass (what they refuse is in test_wrong_input)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from written_recordings import as_increments, still_imu

from polyins.checks.stream_checks import check_imu, check_track, off_upright, steady_force, upright_axes
from polyins.errors import InputError
from polyins.formats.rows import ImuRows, RowSource, Track
from polyins.model.axes import axes_matrix, right_handed_axes
from polyins.model.recording import ImuStream

UP = np.array([0.3, -0.5, -9.8])


def test_there_are_24_right_handed_axes() -> None:
    matrices = {tuple(axes_matrix(axes).ravel()) for axes in right_handed_axes()}
    assert len(matrices) == 24
    for matrix in matrices:
        np.testing.assert_allclose(np.linalg.det(np.reshape(matrix, (3, 3))), 1.0)


@given(st.sampled_from(right_handed_axes()), st.sampled_from(right_handed_axes()))
def test_proposed_axes_put_gravity_right(mounted: tuple[str, str, str], configured: tuple[str, str, str]) -> None:
    sensor_force = axes_matrix(mounted).T @ UP
    proposal = upright_axes(configured, axes_matrix(configured) @ sensor_force)
    assert (axes_matrix(proposal) @ sensor_force)[2] == pytest.approx(-9.8)
    assert np.linalg.det(axes_matrix(proposal)) == pytest.approx(1.0)


@given(st.sampled_from(right_handed_axes()))
def test_axes_that_are_right_are_proposed_again(axes: tuple[str, str, str]) -> None:
    assert upright_axes(axes, UP) == axes


@given(st.floats(-55, 55), st.floats(-180, 180))
def test_an_array_that_leans_is_upright(lean_deg: float, toward_deg: float) -> None:
    lean, toward = np.radians([lean_deg, toward_deg])
    force = -9.8 * np.array([np.sin(lean) * np.cos(toward), np.sin(lean) * np.sin(toward), np.cos(lean)])
    time = np.arange(100) * 0.01
    upright, fallen = (ImuStream("a", time, np.zeros((100, 3)), np.tile(f * 0.01, (100, 1))) for f in (force, -force))
    assert off_upright("here", ("x", "y", "z"), upright) == ""
    assert "Try axes" in off_upright("here", ("x", "y", "z"), fallen)


def test_a_mean_over_turns_says_nothing_of_gravity() -> None:
    """An IMU that rests upright, and is then turned over and over: the mean force points sideways."""
    time = np.arange(4000) * 0.01
    angle = np.where(time < 10.0, 0.0, 3.0 * (time - 10.0))
    force = (
        -9.8 * np.column_stack([0.0 * time, np.sin(angle), np.cos(angle)]) + [5.0, 0.0, 0.0] * (time > 10.0)[:, None]
    )
    rate = np.column_stack([np.where(time < 10.0, 0.0, 3.0), 0.0 * time, 0.0 * time])
    turned = ImuStream("a", time, 0.01 * rate, 0.01 * force)
    assert abs(turned.dvel.mean(axis=0)[0]) > abs(turned.dvel.mean(axis=0)[2])
    assert off_upright("here", ("x", "y", "z"), turned) == ""
    assert steady_force(time[1000:], turned.dtheta[1000:], turned.dvel[1000:]) is None


def rows(values: np.ndarray) -> ImuRows:
    return ImuRows(RowSource("imu.txt", 1), values[:, 0], values[:, 1:4], values[:, 4:7])


def test_vibration_and_turning_pass() -> None:
    values = as_increments(still_imu())
    rng = np.random.default_rng(1)
    values[:, 4:7] += 0.02 * 4.0 * rng.normal(size=(len(values), 3))
    values[:, 1:4] += 0.02 * rng.normal(size=(len(values), 3))
    assert check_imu(rows(values)) == ()


def test_an_unusual_turn_rate_is_warned_of() -> None:
    values = as_increments(still_imu())
    values[:, 3] = 0.02 * 5.0
    (warning,) = check_imu(rows(values))
    assert "turns at 5 rad/s (rms)" in warning


def test_a_wheel_may_turn_faster() -> None:
    values = as_increments(still_imu())
    values[:, 3] = 0.02 * 20.0
    with pytest.raises(InputError, match="rms rate 20 rad/s"):
        check_imu(rows(values))
    assert check_imu(rows(values), max_rate_rad_s=100.0) == ()


def test_warnings_of_the_reader_are_passed_on() -> None:
    assert check_imu(replace(rows(as_increments(still_imu())), warnings=("a zero row",))) == ("a zero row",)


def test_one_height_above_the_air_is_for_the_gate_and_all_are_another_unit() -> None:
    time = np.arange(20.0)
    place = np.tile([0.8, 0.2, 500.0], (20, 1))
    place[7, 2] = 1e6
    assert check_track(Track(RowSource("fixes.csv"), time, place, geodetic=True), "gnss") == ()
    place[:, 2] = 5e5
    with pytest.raises(InputError, match="in mm"):
        check_track(Track(RowSource("fixes.csv"), time, place, geodetic=True), "gnss")
