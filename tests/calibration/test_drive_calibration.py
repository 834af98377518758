"""Calibration from a drive whose mounting is known exactly."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulated_drive import (
    GRADE,
    body_stream,
    drive,
    fixes,
    recording,
    wheel_imu,
    wheel_stream,
)

from polyins.calibration.drive import calibrate
from polyins.calibration.estimates import Calibration, Estimate
from polyins.errors import InputError
from polyins.model.rig import Imu

RADIUS = 0.29
PLACE = np.array([0.0, 0.006, -0.15])
BIAS = np.radians([1.0, -2.0, 3.0])
TILT_DEG = (0.0, 1.5, -3.0)
"""of the module against the stream's axes, about x, y and z"""


def setting(calibration: Calibration, imu: str, key: str) -> Estimate:
    return next(one for one in calibration.imus[imu] if one.key.endswith(key))


def tilted() -> np.ndarray:
    return Rotation.from_euler("XYZ", TILT_DEG, degrees=True).as_matrix()


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    """Of a right wheel with a tilt, a left wheel off its centre, and a body IMU, antenna 0.2 m right."""
    trip = drive()
    mount = Rotation.from_euler("ZYX", [3.0, -2.5, 1.5], degrees=True).as_matrix()
    streams = [
        wheel_stream(trip, "right", 0.7, RADIUS, PLACE, tilted(), BIAS),
        wheel_stream(trip, "left", -0.7, 1.01 * RADIUS, -0.2 * PLACE, np.eye(3), -BIAS),
        body_stream(trip, "body", mount.T),
    ]
    imus = [wheel_imu("right", 0.7), wheel_imu("left", -0.7), Imu("body", GRADE)]
    return calibrate(recording(imus, streams, fixes(trip, 0.2), 0.2))


def test_radius_of_each_wheel(calibration: Calibration) -> None:
    right, left = (setting(calibration, name, "radius_m") for name in ("right", "left"))
    assert right.value[0] == pytest.approx(RADIUS, rel=3e-4)
    assert left.value[0] == pytest.approx(1.01 * RADIUS, rel=3e-4)
    assert right.configured == (0.3,)


def test_wheels_stand_beside_the_antenna_where_they_are(calibration: Calibration) -> None:
    assert setting(calibration, "right", "right_of_antenna_m").value[0] == pytest.approx(0.5, abs=0.02)
    assert setting(calibration, "left", "right_of_antenna_m").value[0] == pytest.approx(-0.9, abs=0.02)


def test_spin_axis_and_its_tilt(calibration: Calibration) -> None:
    axis = tilted()[:, 0]
    expected = np.degrees([axis[1] / axis[0], axis[2] / axis[0]])
    found = setting(calibration, "right", "tilt_deg")
    assert found.value == pytest.approx(expected, abs=0.02)
    assert max(found.std) < 0.05
    assert setting(calibration, "right", "spin_axis").value == "x"


def test_lever_arm_points_from_the_imu_to_the_centre(calibration: Calibration) -> None:
    # the smallest rotation onto the axle leaves the module turned about it by what the mount turns besides
    found = np.array(setting(calibration, "right", "lever_arm_m").value)
    assert np.linalg.norm(found[1:]) == pytest.approx(np.linalg.norm(PLACE), abs=2e-4)
    assert found[1:] == pytest.approx(-PLACE[1:], abs=1e-3)
    assert setting(calibration, "left", "lever_arm_m").value == pytest.approx(0.2 * PLACE, abs=1e-4)


def test_body_mounting_on_hills(calibration: Calibration) -> None:
    found = setting(calibration, "body", "mount_deg")
    assert found.value == pytest.approx((1.5, -2.5, 3.0), abs=0.15)
    assert found.std[0] >= 1.0  # crossfall looks like roll
    assert found.std[1] < 0.2
    assert setting(calibration, "body", "axes").value == "x, y, z"


def test_forward_comes_from_the_body_and_nothing_is_odd(calibration: Calibration) -> None:
    assert "body" in calibration.forward_from
    assert calibration.warnings == ()


@pytest.mark.parametrize("with_body", [True, False])
def test_axis_declared_to_the_left_is_found_to_be_the_right_one_reversed(with_body: bool) -> None:
    trip = drive()
    about_z = np.diag([-1.0, -1.0, 1.0])
    streams = [wheel_stream(trip, "wheel", 0.0, RADIUS, PLACE, about_z, BIAS)]
    imus = [wheel_imu("wheel", 0.0)]
    if with_body:
        streams, imus = [*streams, body_stream(trip, "body", np.eye(3))], [*imus, Imu("body", GRADE)]
    found = calibrate(recording(imus, streams, None))
    assert setting(found, "wheel", "spin_axis").value == "-x"
    assert any("spin_axis" in text for text in found.warnings)


def test_driving_backwards_is_seen_with_a_body_imu_only() -> None:
    trip = drive()
    backwards = type(trip)(trip.time, -trip.speed, trip.yaw_rate, -trip.slope)
    streams = [
        wheel_stream(backwards, "wheel", 0.0, RADIUS, PLACE, np.eye(3), BIAS),
        body_stream(backwards, "body", np.eye(3)),
    ]
    imus = [wheel_imu("wheel", 0.0), Imu("body", GRADE)]
    assert setting(calibrate(recording(imus, streams, None)), "wheel", "spin_axis").value == "x"
    alone = calibrate(recording(imus[:1], streams[:1], None))
    assert setting(alone, "wheel", "spin_axis").value == "-x"
    assert "taken" in alone.forward_from


def test_without_gnss_there_is_no_radius_and_the_pitch_is_unsure() -> None:
    trip = drive(slope=0.0)
    streams = [wheel_stream(trip, "wheel", 0.0, RADIUS, PLACE, np.eye(3), BIAS), body_stream(trip, "body", np.eye(3))]
    found = calibrate(recording([wheel_imu("wheel", 0.0), Imu("body", GRADE)], streams, None))
    assert all("radius" not in one.key for one in found.imus["wheel"])
    assert setting(found, "body", "mount_deg").std[1] >= 2.0
    assert "no GNSS" in found.warnings[0]


def test_mount_is_counted_from_the_configured_rotation() -> None:
    trip = drive()
    sensor = Rotation.from_euler("ZYX", [10.0, 4.0, -6.0], degrees=True).as_matrix()
    # a reader has turned the stream by the configured rotation, which is right
    streams = [wheel_stream(trip, "wheel", 0.0, RADIUS, PLACE, np.eye(3), BIAS), body_stream(trip, "body", np.eye(3))]
    imus = [wheel_imu("wheel", 0.0), Imu("body", GRADE, sensor)]
    mount = setting(calibrate(recording(imus, streams, fixes(trip, 0.0))), "body", "mount_deg")
    assert mount.configured == pytest.approx((-6.0, 4.0, 10.0))
    assert mount.value == pytest.approx((-6.0, 4.0, 10.0), abs=0.1)


def test_no_standstill_is_an_error() -> None:
    trip = drive()
    part = slice(2000 * 10, 9000 * 10)
    moving = type(trip)(*(values[part] for values in (trip.time, trip.speed + 2.0, trip.yaw_rate, trip.slope)))
    stream = wheel_stream(moving, "wheel", 0.0, RADIUS, PLACE, np.eye(3), BIAS)
    with pytest.raises(InputError, match="IMU wheel: no standstill"):
        calibrate(recording([wheel_imu("wheel", 0.0)], [stream], None))


def test_standing_all_the_time_is_an_error() -> None:
    trip = drive()
    standing = type(trip)(trip.time, 0.0 * trip.speed, 0.0 * trip.yaw_rate, trip.slope)
    stream = wheel_stream(standing, "wheel", 0.0, RADIUS, PLACE, np.eye(3), BIAS)
    with pytest.raises(InputError, match=r"turns 0\.0 times"):
        calibrate(recording([wheel_imu("wheel", 0.0)], [stream], None))


def test_no_wheel_is_an_error() -> None:
    stream = body_stream(drive(), "body", np.eye(3))
    with pytest.raises(InputError, match="no IMU on a wheel"):
        calibrate(recording([Imu("body", GRADE)], [stream], None))
