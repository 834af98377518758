"""From the axes of a sensor on a wheel to the module's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polyins.config import WheelEntry
from polyins.config.wheel_mount import wheel_rotation

AXES = ["x", "y", "z", "-x", "-y", "-z"]
TILTS = st.tuples(st.floats(-19, 19), st.floats(-19, 19))


def rotation(axis: str, tilt: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    return wheel_rotation(WheelEntry.model_validate({"radius_m": 0.3, "spin_axis": axis, "tilt_deg": tilt}))


def spin(axis: str, tilt: tuple[float, float]) -> np.ndarray:
    """The true spin axis in sensor axes, as it lies along the positive nominal one."""
    k = "xyz".index(axis[-1])
    vector = np.eye(3)[k] + np.radians(tilt[0]) * np.eye(3)[(k + 1) % 3] + np.radians(tilt[1]) * np.eye(3)[(k + 2) % 3]
    return vector / np.linalg.norm(vector)


def test_a_sensor_with_z_outward_on_both_sides() -> None:
    """As WID's README has it: right (x, y, z) = (zs, xs, ys), left (-zs, ys, xs)."""
    sensor = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(rotation("z") @ sensor, [3.0, 1.0, 2.0])
    np.testing.assert_allclose(rotation("-z") @ sensor, [-3.0, 2.0, 1.0])


@pytest.mark.parametrize("axis", AXES)
@given(tilt=TILTS)
def test_the_true_spin_axis_becomes_the_axle(axis: str, tilt: tuple[float, float]) -> None:
    turned = rotation(axis, tilt)
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turned) == pytest.approx(1.0)
    right = 1.0 if not axis.startswith("-") else -1.0
    np.testing.assert_allclose(turned @ spin(axis, tilt), [right, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("axis", AXES)
@given(tilt=TILTS)
def test_no_turn_is_smaller(axis: str, tilt: tuple[float, float]) -> None:
    """The sensor is turned by the angle between the true and the nominal axis, and not about the axle."""
    turn = rotation(axis).T @ rotation(axis, tilt)
    angle = np.arccos(np.clip(spin(axis, tilt)["xyz".index(axis[-1])], -1.0, 1.0))
    assert np.arccos(np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0)) == pytest.approx(angle, abs=1e-6)
