"""Offsets between clocks, found from simulated motion that is known exactly."""

from dataclasses import replace

import numpy as np
import pytest
from simulated_drive import (
    GRADE,
    Drive,
    body_stream,
    drive,
    fixes,
    later,
    wheel_imu,
    wheel_stream,
)

from polyins.calibration.offsets import gnss_offset, imu_offsets
from polyins.errors import InputError
from polyins.model.recording import ImuStream
from polyins.model.rig import Imu

PLACE = np.array([0.0, 0.004, -0.01])
BIAS = np.radians([2.0, -1.0, 0.5])
RIGHT = 0.7


def wheel(trip: Drive, name: str = "wheel", right: float = RIGHT) -> ImuStream:
    return wheel_stream(trip, name, right, 0.3, PLACE, np.eye(3), BIAS)


def part(stream: ImuStream, begin: float, end: float) -> ImuStream:
    rows = (stream.time >= begin) & (stream.time <= end)
    return ImuStream(stream.name, stream.time[rows], stream.dtheta[rows], stream.dvel[rows])


TRIP = drive()
LEFT, BODY = wheel(TRIP, "left", -RIGHT), body_stream(TRIP, "body", np.eye(3)[[2, 0, 1]])
IMUS = [wheel_imu("right", RIGHT), wheel_imu("left", -RIGHT), Imu("body", GRADE)]


@pytest.mark.parametrize("base", [0, 2])
@pytest.mark.parametrize("offset", [132.711, -0.0234, 5000.25])
def test_offsets_of_wheels_and_body_in_any_mount(base: int, offset: float) -> None:
    streams = [wheel(TRIP), later(LEFT, offset), later(BODY, 7.5 - offset)]
    found = imu_offsets(IMUS, streams, base)
    zero = (0.0, 0.0, 7.5 - offset)[base]
    expected = [zero, zero - offset, zero - (7.5 - offset)]
    assert [one.offset_s for one in found] == pytest.approx(expected, abs=2e-3)
    assert [one.name for one in found] == ["right", "left", "body"]
    assert found[base].std_s == 0.0


def test_streams_that_overlap_in_part() -> None:
    streams = [part(wheel(TRIP), 0.0, 80.0), later(part(LEFT, 30.0, 120.0), -400.0)]
    found = imu_offsets(IMUS[:2], streams, 0)[1]
    assert found.offset_s == pytest.approx(400.0, abs=2e-3)


def test_gnss_clock_by_wheel_speed() -> None:
    gnss = fixes(TRIP, 0.2)
    late = replace(gnss, time=gnss.time + 3600.123)
    found = gnss_offset(IMUS, [wheel(TRIP), LEFT, BODY], late, False)
    assert found.offset_s == pytest.approx(-3600.123, abs=5e-3)


def test_uncertainty_covers_the_error_of_noisy_fixes() -> None:
    draw = np.random.default_rng(3)
    gnss, offs = fixes(TRIP, 0.2), []
    for _ in range(6):
        noisy = replace(gnss, position=gnss.position + draw.normal(0.0, 0.05, gnss.position.shape))
        found = gnss_offset(IMUS[:1], [wheel(TRIP)], noisy, False)
        offs.append(found.offset_s / found.std_s)
    assert 0.3 < np.sqrt(np.mean(np.square(offs))) < 2.2


def test_a_gap_in_one_stream_does_not_move_the_offset() -> None:
    gone = (LEFT.time > 50.0) & (LEFT.time < 51.5)
    holed = ImuStream("left", LEFT.time[~gone], LEFT.dtheta[~gone], LEFT.dvel[~gone])
    found = imu_offsets(IMUS[:2], [wheel(TRIP), later(holed, 10.0)], 0)[1]
    assert found.offset_s == pytest.approx(-10.0, abs=5e-3)


def test_a_steered_wheel_is_compared_by_its_spin() -> None:
    leading = drive()
    early = Drive(leading.time, leading.speed, np.roll(leading.yaw_rate, -5000), leading.slope)
    steered = wheel_stream(early, "steered", 0.0, 0.3, PLACE, np.eye(3), BIAS)
    imus = [wheel_imu("steered", 0.0, steering=True), wheel_imu("left", -RIGHT), Imu("body", GRADE)]
    found = imu_offsets(imus, [later(steered, 20.0), LEFT, BODY], 2)
    assert found[0].offset_s == pytest.approx(-20.0, abs=5e-3)


def test_motion_that_repeats_is_ambiguous() -> None:
    time = drive(seconds=150.0).time
    driving = (time > 10.0) & (time < 140.0)
    again = Drive(time, driving * 2.0 * (1.0 - np.cos(2 * np.pi * (time - 10.0) / 10.0)), 0.0 * time, 0.0 * time)
    streams = [wheel(again), later(part(wheel(again, "left"), 25.0, 125.0), 60.0)]
    with pytest.raises(InputError, match=r"ambiguous offset of left and right: -?\d+\.\d+ s and"):
        imu_offsets(IMUS[:2], streams, 0)


def test_two_drives_share_no_motion() -> None:
    with pytest.raises(InputError, match=r"no common motion|ambiguous offset"):
        imu_offsets(IMUS[:2], [wheel(TRIP), wheel(drive(seed=9), "left")], 0)


def test_a_body_that_stands_shares_no_motion() -> None:
    standing = Drive(TRIP.time, 0.0 * TRIP.speed, 0.0 * TRIP.yaw_rate, 0.0 * TRIP.slope)
    with pytest.raises(InputError, match="body and right share no common motion: one hardly moves"):
        imu_offsets([IMUS[0], IMUS[2]], [wheel(TRIP), body_stream(standing, "body", np.eye(3))], 0)


def test_too_short_a_stream_is_refused() -> None:
    with pytest.raises(InputError, match="less than 20 s"):
        imu_offsets([IMUS[0], IMUS[2]], [wheel(TRIP), part(BODY, 30.0, 45.0)], 0)


def test_gnss_without_a_wheel_is_refused() -> None:
    with pytest.raises(InputError, match="expected an IMU on a wheel"):
        gnss_offset(IMUS[2:], [BODY], fixes(TRIP, 0.0), False)
