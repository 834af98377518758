"""The start of a run: levelling, gyro biases, heading, velocity and position."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from array_recordings import NOISE, Swing
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polyins.errors import InputError
from polyins.kernels import earth
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import GnssStream, ImuStream, Recording, Reference, StartOptions
from polyins.model.rig import DEG, Imu, ImuErrors, Rig
from polyins.prepare import alignment
from polyins.prepare.alignment import Start, find_standstill, find_start, level, rotation_matrix
from polyins.prepare.timesync import Aligned, align
from polyins.simulation.increments import increments
from polyins.simulation.path import START, Path, Profile, path, smooth_steps

Array = NDArray[np.float64]

PLACE = np.array(START)
RATE_HZ = 100.0
AT_ORIGIN, NO_BIAS = np.zeros(3), np.zeros(6)
EARTH_RATE = earth.EARTH_RATE_RAD_S * np.array([np.cos(PLACE[0]), 0.0, -np.sin(PLACE[0])])


def rig(count: int = 1, antenna: Array = AT_ORIGIN) -> Rig:
    return Rig(tuple(Imu(f"imu{i}", NOISE) for i in range(count)), antenna)


def standing(
    attitude: Rotation, seconds: float, *, noise: float = 0.0, bias: Array = NO_BIAS, name: str = "imu0"
) -> ImuStream:
    """An IMU at rest on the turning Earth; noise is a factor on that of its grade."""
    count, dt = round(seconds * RATE_HZ), 1.0 / RATE_HZ
    rng = np.random.default_rng([7, len(name), ord(name[-1])])
    gravity = earth.gravity(PLACE[0], PLACE[2])
    still = np.concatenate([attitude.inv().apply(EARTH_RATE), attitude.inv().apply([0.0, 0.0, -gravity])]) + bias
    walk = np.concatenate([NOISE.angle_random_walk, NOISE.velocity_random_walk])
    values = still * dt + noise * walk * np.sqrt(dt) * rng.standard_normal((count, 6))
    return ImuStream(name, dt * np.arange(1, count + 1), values[:, :3], values[:, 3:])


def fixes(truth: Path, times: Array, antenna: Array = AT_ORIGIN, std: float = 0.02) -> GnssStream:
    at = truth.truth(times, antenna)
    return GnssStream(times, at.position, np.full((len(times), 3), std))


def fixes_at_rest(times: Array, noise: float = 0.02) -> GnssStream:
    metres = metres_per_unit(PLACE, True)
    scatter = noise * np.random.default_rng(3).standard_normal((len(times), 3)) / metres
    return GnssStream(times, PLACE + scatter, np.full((len(times), 3), noise))


def found(recording: Recording) -> Start:
    return find_start(recording, align(recording.imus))


def off_by(angle: float, expected: float) -> float:
    """The difference of two angles, deg."""
    return float(np.degrees(abs((angle - expected + np.pi) % (2.0 * np.pi) - np.pi)))


# --- levelling --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pitch", [-70.0, 0.0, 12.0, 85.0])
@pytest.mark.parametrize("roll", [-179.0, -30.0, 0.0, 60.0, 120.0])
def test_gravity_alone_levels(roll: float, pitch: float) -> None:
    force = Rotation.from_euler("ZYX", [77.0, pitch, roll], degrees=True).inv().apply([0.0, 0.0, -9.8])
    np.testing.assert_allclose(np.degrees(level(force)), [roll, pitch], atol=1e-10)


@pytest.mark.parametrize("heading", [0.0, 70.0, -160.0])
@pytest.mark.parametrize("acceleration", [(1.5, 0.0), (0.0, 2.0), (-1.0, 1.0)])
def test_a_known_acceleration_is_taken_out(acceleration: tuple[float, float], heading: float) -> None:
    a = np.array([*acceleration, 0.0])
    attitude = Rotation.from_euler("ZYX", [heading, 4.0, -3.0], degrees=True)
    force = attitude.inv().apply(a - [0.0, 0.0, 9.8])
    np.testing.assert_allclose(np.degrees(level(force, a, np.radians(heading))), [-3.0, 4.0], atol=0.15)
    assert np.abs(np.degrees(level(force)) - [-3.0, 4.0]).max() > 4.0


def test_a_standstill_levels_with_the_mean_of_all_imus() -> None:
    attitude = Rotation.from_euler("ZYX", [40.0, -4.0, 7.0], degrees=True)
    tilts = np.array([[0.0] * 3 + [0.05, 0.0, 0.0], [0.0] * 3 + [-0.05, 0.0, 0.0]])
    imus = tuple(standing(attitude, 20.0, noise=1.0, bias=b, name=f"imu{i}") for i, b in enumerate(tilts))
    start = found(Recording(rig(2), imus, gnss=fixes_at_rest(np.arange(1.0, 20.0)),
                            start=StartOptions(heading=40.0 * DEG, static_interval=(0.0, 15.0))))  # fmt: skip
    np.testing.assert_allclose(np.degrees(start.attitude), [7.0, -4.0, 40.0], atol=0.02)
    assert start.sources["roll_pitch"] == "levelled at standstill"
    assert start.time == pytest.approx(15.0)
    np.testing.assert_array_equal(start.velocity, 0.0)
    np.testing.assert_allclose(start.attitude_std[:2], 0.1 * DEG)


def test_levelling_is_as_sure_as_the_accelerometers_biases_allow() -> None:
    noise = replace(NOISE, accel_bias_std=np.full(3, 0.05))
    unsure = Rig((Imu("imu0", noise),))
    options = StartOptions(heading=0.0, position=PLACE, static_interval=(0.0, 5.0))
    start = found(Recording(unsure, (standing(Rotation.identity(), 8.0),), start=options))
    np.testing.assert_allclose(start.attitude_std[:2], 0.05 / 9.8)


def test_a_known_accelerometer_bias_does_not_tilt() -> None:
    attitude = Rotation.from_euler("ZYX", [40.0, -4.0, 7.0], degrees=True)
    bias = np.array([0.001, -0.002, 0.003, 0.3, -0.2, 0.1])
    known = replace(
        rig().imus[0], initial_errors=ImuErrors(gyro_bias=np.array([0.001, -0.001, 0.0]), accel_bias=bias[3:])
    )
    imu = standing(attitude, 10.0, bias=bias)
    start = found(Recording(Rig((known,)), (imu,), gnss=fixes_at_rest(np.arange(1.0, 10.0)),
                            start=StartOptions(heading=40.0 * DEG, static_interval=(0.0, 8.0))))  # fmt: skip
    np.testing.assert_allclose(np.degrees(start.attitude), [7.0, -4.0, 40.0], atol=1e-4)
    np.testing.assert_allclose(start.imu_errors[0, :3], bias[:3], atol=1e-8)
    np.testing.assert_allclose(start.imu_errors[0, 3:6], bias[3:], atol=1e-15)


# --- gyro biases ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("geodetic", [True, False])
def test_gyro_biases_are_what_is_left_without_the_earth_rate(geodetic: bool) -> None:
    attitude = Rotation.from_euler("ZYX", [130.0, -4.0, 7.0], degrees=True)
    biases = np.zeros((2, 6))
    biases[:, :3] = [[3e-4, -2e-4, 1e-4], [-5e-4, 0.0, 4e-4]]
    imus = tuple(standing(attitude, 12.0, bias=bias, name=f"imu{i}") for i, bias in enumerate(biases))
    position = PLACE if geodetic else np.zeros(3)
    options = StartOptions(heading=130.0 * DEG, position=position, static_interval=(0.0, 10.0))
    start = found(Recording(rig(2), imus, geodetic=geodetic, start=options))
    shown = biases[:, :3] if geodetic else biases[:, :3] + attitude.inv().apply(EARTH_RATE)
    np.testing.assert_allclose(start.imu_errors[:, :3], shown, atol=1e-9)
    assert start.sources["gyro_bias"].startswith("mean of 1")


def test_the_std_of_a_gyro_bias_shrinks_with_the_length_of_the_standstill() -> None:
    def std(seconds: float) -> Array:
        imu = standing(Rotation.identity(), seconds + 2.0, noise=1.0)
        options = StartOptions(heading=0.0, position=PLACE, static_interval=(0.0, seconds))
        start = found(Recording(rig(), (imu,), start=options))
        error = np.abs(start.imu_errors[0, :3])
        assert np.all(error < 4.0 * start.imu_error_std[0, :3])
        np.testing.assert_array_equal(start.imu_error_std[0, 3:], rig().imus[0].start_std()[3:])
        return start.imu_error_std[0, :3]

    short, long = std(5.0), std(45.0)
    assert np.all(short < NOISE.gyro_bias_std)
    assert np.all(long < short)
    assert np.all(long > 0.1 * NOISE.gyro_bias_std)


def test_gyro_biases_are_left_alone_on_request() -> None:
    imu = standing(Rotation.identity(), 12.0, bias=np.full(6, 1e-3))
    options = StartOptions(heading=0.0, position=PLACE, static_interval=(0.0, 10.0), estimate_gyro_bias=False)
    start = found(Recording(rig(), (imu,), start=options))
    np.testing.assert_array_equal(start.imu_errors, 0.0)
    np.testing.assert_array_equal(start.imu_error_std[0], rig().imus[0].start_std())
    assert start.sources["gyro_bias"].startswith("configuration, std up to ")


def test_without_a_standstill_the_filter_believes_the_turn_on_bias() -> None:
    imu = standing(Rotation.identity(), 12.0)
    known = replace(rig().imus[0], initial_std=ImuErrors(gyro_bias=np.full(3, 3.0 * DEG)))
    options = StartOptions(heading=0.0, position=PLACE, static_interval=(0.0, 10.0))
    measured, not_measured = (
        found(Recording(Rig((known,)), (imu,), start=replace(options, estimate_gyro_bias=estimated)))
        for estimated in (True, False)
    )
    np.testing.assert_allclose(not_measured.imu_error_std[0, :3], 3.0 * DEG)
    assert not_measured.sources["gyro_bias"] == "configuration, std up to 3 deg/s"
    assert np.all(measured.imu_error_std[0, :3] < 0.1 * DEG)


# --- standstill -------------------------------------------------------------------------------------------------------


def step(before: float, after: float, begin: float, end: float, last: float = 1e4) -> Any:
    """A smooth change from one value to another."""
    return smooth_steps(np.array([-1.0, begin, end, last]), np.array([before, before, after, after]))


def leaving(at: float, *, turn: float = 0.0, duration: float = 25.0, start: Array = PLACE) -> Path:
    """Stands at 30 deg of heading, turns on the spot in the two seconds before `at`, then leaves."""
    return path(
        Profile(
            step(0.0, 6.0, at, at + 3.0),
            step(0.02, 0.02, 1.0, 2.0),
            step(0.03, 0.03, 1.0, 2.0),
            step(30.0 * DEG, 30.0 * DEG + turn, at - 2.0, at),
        ),
        duration=duration,
        start=start,
    )


def drive_of(truth: Path, *, count: int = 1, antenna: Array = AT_ORIGIN, noise: float = 0.3) -> Recording:
    exact, streams = increments(truth, RATE_HZ), []
    for i in range(count):
        rng = np.random.default_rng([9, i])
        white = noise * np.sqrt(exact.interval) * rng.standard_normal((len(exact.time), 6))
        streams.append(
            ImuStream(
                f"imu{i}",
                exact.time,
                exact.dtheta + NOISE.angle_random_walk * white[:, :3],
                exact.dvel + NOISE.velocity_random_walk * white[:, 3:],
            )
        )
    times = np.arange(0.5, truth.duration - 0.01, 0.5)
    return Recording(rig(count, antenna), tuple(streams), gnss=fixes(truth, times, antenna))


def standstill_of(recording: Recording, *, with_gnss: bool = True) -> tuple[float, float] | None:
    stream = None
    if with_gnss:
        assert recording.gnss is not None
        stream = alignment.velocities_from_positions(recording.gnss, recording.geodetic)
    return find_standstill(align(recording.imus), stream)


def test_a_standstill_before_the_drive_is_found() -> None:
    begin, end = standstill_of(drive_of(leaving(12.0))) or (np.nan, np.nan)
    assert begin < 1.1
    assert 9.0 <= end <= 12.3
    start = found(drive_of(leaving(12.0)))
    assert start.sources["standstill"].startswith("found: ")
    assert start.time == pytest.approx(end, abs=0.011)


def test_at_most_a_minute_of_a_standstill_is_used() -> None:
    begin, end = standstill_of(drive_of(leaving(80.0, duration=90.0))) or (np.nan, np.nan)
    assert end - begin == pytest.approx(60.0, abs=0.02)


def test_less_than_three_seconds_are_no_standstill() -> None:
    assert standstill_of(drive_of(leaving(2.0))) is None


def test_a_steady_straight_drive_is_no_standstill_when_gnss_says_that_it_moves() -> None:
    """To the IMUs it is one: without GNSS nothing tells them apart."""
    steady = path(Profile(Swing(10.0), Swing(0.0), Swing(0.0), Swing(1.0)), duration=20.0)
    recording = drive_of(steady)
    assert standstill_of(recording, with_gnss=False) is not None
    assert standstill_of(recording) is None
    start = found(recording)
    assert start.sources["time"] == "first fix in motion"
    np.testing.assert_allclose(start.velocity, steady.truth(np.array([start.time])).velocity[0], atol=0.02)


def test_a_standstill_later_in_the_recording_is_used() -> None:
    """Driving first: the run starts where the array stops."""
    arriving = path(Profile(step(6.0, 0.0, 5.0, 9.0), Swing(0.0), Swing(0.0), Swing(1.0)), duration=25.0)
    begin, end = standstill_of(drive_of(arriving)) or (np.nan, np.nan)
    assert begin >= 8.0
    assert end > 20.0


def test_shaking_on_the_spot_is_no_standstill() -> None:
    shaken = path(Profile(Swing(0.0), Swing(0.0, 0.0, 0.05, 9.0), Swing(0.0), Swing(1.0)), duration=10.0)
    assert standstill_of(drive_of(shaken)) is None


def test_a_recording_that_stands_all_the_while_starts_in_its_standstill() -> None:
    imu = standing(Rotation.identity(), 15.0, noise=0.3)
    start = found(Recording(rig(), (imu,), start=StartOptions(heading=1.0, position=PLACE)))
    assert 3.0 <= start.time <= 14.0
    np.testing.assert_array_equal(start.velocity, 0.0)


def test_a_given_standstill_needs_data() -> None:
    recording = drive_of(leaving(12.0))
    for interval in ((30.0, 40.0), (2.0, 2.5)):
        with pytest.raises(InputError, match="static interval"):
            found(replace(recording, start=StartOptions(static_interval=interval)))


# --- heading ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [0.0, 70.0, -160.0])
@pytest.mark.parametrize("count", [1, 3])
def test_the_heading_is_that_under_way_less_what_the_array_turned_since(turn: float, count: int) -> None:
    start = found(drive_of(leaving(12.0, turn=turn * DEG), count=count))
    assert start.time < 12.2
    np.testing.assert_allclose(np.degrees(start.attitude), [np.degrees(0.02), np.degrees(0.03), 30.0], atol=0.3)
    assert start.sources["heading"].startswith("GNSS accelerations from ")
    assert 0.3 * DEG < start.attitude_std[2] < 8.0 * DEG


def test_a_gyro_bias_does_not_turn_the_heading() -> None:
    recording = drive_of(leaving(12.0, turn=70.0 * DEG))
    imu = recording.imus[0]
    biased = replace(imu, dtheta=imu.dtheta + np.array([0.01, -0.02, 0.03]) / RATE_HZ)
    start = found(replace(recording, imus=(biased,)))
    assert off_by(start.attitude[2], 30.0 * DEG) < 0.3
    np.testing.assert_allclose(start.imu_errors[0, :3], [0.01, -0.02, 0.03], atol=2e-4)


@pytest.mark.parametrize("time", [None, 5.25], ids=["first-fix", "later"])
def test_a_start_in_motion_levels_and_heads_by_gnss(time: float | None) -> None:
    """A steady turn: without the acceleration that GNSS sees, the roll would be wrong by six degrees."""
    turning = path(Profile(Swing(10.0), Swing(0.02), Swing(-0.03), Swing(-2.0, 0.1)), duration=20.0)
    start = found(replace(drive_of(turning), start=StartOptions(time=time)))
    truth = turning.truth(np.array([start.time]))
    assert start.sources["roll_pitch"].startswith("levelled in motion")
    assert off_by(start.attitude[0], truth.attitude[0, 0]) < 0.6
    assert off_by(start.attitude[1], truth.attitude[0, 1]) < 0.6
    assert off_by(start.attitude[2], truth.attitude[0, 2]) < 1.0
    np.testing.assert_allclose(start.velocity, truth.velocity[0], atol=0.1)


def test_a_course_due_south_is_no_obstacle() -> None:
    steady = path(Profile(Swing(10.0), Swing(0.0), Swing(0.0), Swing(np.pi, 0.0, 0.02, 1.0)), duration=20.0)
    start = found(drive_of(steady))
    assert off_by(start.attitude[2], steady.truth(np.array([start.time])).attitude[0, 2]) < 1.0


def shifted(recording: Recording, metres_east: float) -> Recording:
    """The recording moved along its parallel, longitudes within +-180 degrees."""
    assert recording.gnss is not None
    position = recording.gnss.position.copy()
    position[:, 1] += metres_east
    position[:, 1] = (position[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
    return replace(recording, gnss=replace(recording.gnss, position=position))


def test_the_antimeridian_between_two_fixes_is_no_obstacle() -> None:
    """The drive crosses it eastwards where the course is taken."""
    recording = drive_of(leaving(12.0, turn=30.0 * DEG))
    assert recording.gnss is not None
    east = recording.gnss.position[:, 1]
    here = found(recording)
    at = float(here.sources["heading"].split()[3])
    crossing = np.interp(at + 0.2, recording.gnss.time, east)
    there = found(shifted(recording, np.pi - crossing))
    np.testing.assert_allclose(there.attitude, here.attitude, atol=1e-6)
    np.testing.assert_allclose(there.velocity, here.velocity, atol=1e-6)
    assert there.time == here.time


def test_a_start_on_the_antimeridian_is_between_its_fixes() -> None:
    steady = path(Profile(Swing(10.0), Swing(0.0), Swing(0.0), Swing(1.5)), duration=20.0)
    recording = drive_of(steady)
    assert recording.gnss is not None
    time = 5.25
    recording = replace(recording, start=StartOptions(time=time))
    crossing = np.interp(time + 0.01, recording.gnss.time, recording.gnss.position[:, 1])
    here, there = found(recording), found(shifted(recording, np.pi - crossing))
    moved = there.position[1] - here.position[1] - (np.pi - crossing)
    assert abs((moved + np.pi) % (2.0 * np.pi) - np.pi) < 1e-9
    np.testing.assert_allclose(there.velocity, here.velocity, atol=1e-6)


# --- given, from the reference, from GNSS -----------------------------------------------------------------------------


def test_given_values_are_taken_as_they_are() -> None:
    options = StartOptions(
        time=3.0,
        position=PLACE,
        velocity=np.array([1.0, 2.0, 3.0]),
        roll_pitch=np.array([0.1, -0.2]),
        heading=2.0,
        position_std=np.array([1.0, 2.0, 3.0]),
        velocity_std=np.array([0.4, 0.5, 0.6]),
        attitude_std=np.array([0.01, 0.02, 0.03]),
        estimate_gyro_bias=False,
    )
    start = found(replace(drive_of(leaving(12.0)), start=options))
    assert start.time == pytest.approx(3.0)
    np.testing.assert_array_equal(start.position, PLACE)
    np.testing.assert_array_equal(start.velocity, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(start.attitude, [0.1, -0.2, 2.0])
    np.testing.assert_array_equal(start.position_std, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(start.velocity_std, [0.4, 0.5, 0.6])
    np.testing.assert_array_equal(start.attitude_std, [0.01, 0.02, 0.03])
    for name in ("time", "position", "velocity", "roll_pitch", "heading"):
        assert start.sources[name] == "given"


def test_the_reference_gives_attitude_and_velocity() -> None:
    truth = leaving(12.0, turn=30.0 * DEG)
    recording = drive_of(truth)
    times = np.arange(0.0, 24.0, 0.1)
    at = truth.truth(times)
    for velocity in (at.velocity, None):
        reference = Reference(times, at.position, velocity, at.attitude)
        options = StartOptions(time=16.03, heading_from="reference")
        start = found(replace(recording, reference=reference, start=options))
        expected = truth.truth(np.array([start.time]))
        np.testing.assert_allclose(start.velocity, expected.velocity[0], atol=0.02)
        assert max(off_by(*pair) for pair in zip(start.attitude, expected.attitude[0], strict=True)) < 0.01
        for name in ("velocity", "roll_pitch", "heading"):
            assert start.sources[name] == "reference"


def test_without_gnss_the_reference_gives_the_heading_across_south() -> None:
    times = np.arange(0.0, 20.0)
    heading = np.where(times < 10.5, 179.0, -179.0) * DEG  # at 10.5 s half way: due south, not north
    attitude = np.column_stack([np.zeros(20), np.zeros(20), heading])
    reference = Reference(times, np.tile(PLACE, (20, 1)), None, attitude)
    imu = standing(Rotation.identity(), 15.0)
    options = StartOptions(time=10.5, position=PLACE, velocity=np.zeros(3))
    start = found(Recording(rig(), (imu,), reference=reference, start=options))
    assert off_by(start.attitude[2], np.pi) < 1e-6
    assert start.sources["heading"] == "reference"


def test_the_position_is_that_of_the_antenna_less_its_lever_arm() -> None:
    antenna = np.array([-0.5, 0.8, -1.2])
    recording = drive_of(leaving(12.0), antenna=antenna)
    start = found(recording)
    metres = metres_per_unit(PLACE, True)
    assert np.abs((start.position - PLACE) * metres).max() < 0.02
    assert start.sources["position"] == "GNSS"
    # of the fix, and of where the antenna is seen from the origin
    assert ((start.position_std > 0.02) & (start.position_std < 0.05)).all()


def lying_at(which: list[int], recording: Recording, metres_north: float = 50.0) -> Recording:
    assert recording.gnss is not None
    position = recording.gnss.position.copy()
    position[which, 0] += metres_north / metres_per_unit(PLACE, True)[0]
    return replace(recording, gnss=replace(recording.gnss, position=position))


@pytest.mark.parametrize("given", [{"heading": 1.5}, {}], ids=["first-fix", "fix-in-motion"])
@pytest.mark.parametrize("lie", [0, 1, 2, 3])
def test_a_start_in_motion_is_not_where_a_lie_is(lie: int, given: dict[str, Any]) -> None:
    steady = path(Profile(Swing(10.0), Swing(0.0), Swing(0.0), Swing(1.5)), duration=20.0)
    recording = replace(drive_of(steady), start=StartOptions(**given))
    start = found(lying_at([lie], recording))
    truth = steady.truth(np.array([start.time]))
    off = np.abs((start.position - truth.position[0]) * metres_per_unit(PLACE, True))
    assert np.all(off < np.maximum(3.0 * start.position_std, 0.1))
    assert off.max() < 1.5
    assert np.all(np.abs(start.velocity - truth.velocity[0]) < 1.0)


@pytest.mark.parametrize("lie", [9, 10, 11])
def test_a_start_at_rest_is_not_where_a_lie_is(lie: int) -> None:
    imu, seconds = standing(Rotation.identity(), 20.0), np.arange(1.0, 20.0)
    options = StartOptions(heading=0.0, static_interval=(0.0, 11.0))
    start = found(lying_at([lie], Recording(rig(), (imu,), gnss=fixes_at_rest(seconds), start=options)))
    off = np.abs((start.position - PLACE) * metres_per_unit(PLACE, True))
    assert off.max() < 0.1
    assert (start.sources["position"] == "GNSS") == (lie != 10)  # the fix at 11 s


def test_fixes_that_tell_the_truth_are_taken_as_they_are() -> None:
    """Full braking, a fix each second: the median of five is far from the fix, and the fix is right."""
    braking = path(Profile(smooth_steps(np.array([-1.0, 1.0, 7.0, 1e3]), np.array([30.0, 30.0, 2.0, 2.0])), Swing(0.0),
                   Swing(0.0), Swing(1.5)), duration=20.0)  # fmt: skip
    recording = drive_of(braking)
    assert recording.gnss is not None
    every = slice(None, None, 2)
    gnss = fixes(braking, recording.gnss.time[every])
    for time in (0.5, 2.0, 3.5, 5.5):
        start = found(replace(recording, gnss=gnss, start=StartOptions(time=time, heading=1.5)))
        assert start.sources["position"] == "GNSS"
        assert start.sources["velocity"] == "GNSS, fixes in motion"
        np.testing.assert_array_equal(start.position_std, 0.02)


def test_a_start_waits_for_the_first_fix_within_the_imus() -> None:
    """Between two fixes the position is off by what the vehicle accelerates there."""
    speeding = path(Profile(Swing(5.0, 3.0), Swing(0.0), Swing(0.0), Swing(1.5)), duration=20.0)
    recording = drive_of(speeding)
    imu = recording.imus[0]
    late = ImuStream(imu.name, imu.time[120:], imu.dtheta[120:], imu.dvel[120:])
    start = found(
        replace(recording, imus=(late,), gnss=fixes(speeding, np.arange(0.5, 20.0)), start=StartOptions(heading=1.5))
    )
    assert start.sources["time"] == "first fix"
    assert start.time == pytest.approx(1.5)
    truth = speeding.truth(np.array([start.time]))
    assert np.abs((start.position - truth.position[0]) * metres_per_unit(PLACE, True)).max() < 0.01


@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
def test_positions_of_a_reference_in_coarse_steps_give_a_velocity(rate_hz: float) -> None:
    """Steps of a decimetre at 10 Hz make half a metre per second of the difference of neighbours."""
    steady = path(Profile(Swing(10.0), Swing(0.0), Swing(0.0), Swing(1.5)), duration=20.0)
    recording = drive_of(steady)
    time = np.arange(0.3, 20.0, 1.0 / rate_hz)
    at = steady.truth(time)
    metres = metres_per_unit(PLACE, True)
    coarse = np.round((at.position - PLACE) * metres, 1) / metres + PLACE
    for begin in (0.5, 5.05, 18.0):
        options = StartOptions(time=begin, heading_from="reference")
        start = found(replace(recording, reference=Reference(time, coarse, None, at.attitude), start=options))
        truth = steady.truth(np.array([start.time]))
        assert np.abs(start.velocity - truth.velocity[0]).max() < 0.25


def test_a_plane_without_positions_starts_at_zero() -> None:
    imu = standing(Rotation.identity(), 15.0)
    start = found(Recording(rig(), (imu,), geodetic=False,
                            start=StartOptions(heading=1.0, static_interval=(0.0, 10.0))))  # fmt: skip
    np.testing.assert_array_equal(start.position, 0.0)
    np.testing.assert_array_equal(start.velocity, 0.0)
    assert start.sources["position"].startswith("zero")


def test_differences_of_positions_serve_as_velocities() -> None:
    truth = leaving(5.0)
    stream = fixes(truth, np.arange(0.5, 20.0, 0.5))
    velocities = alignment.velocities_from_positions(stream, True).velocity
    assert velocities is not None
    np.testing.assert_allclose(velocities[20:-1], truth.truth(stream.time).velocity[20:-1], atol=1e-4)
    given = replace(stream, velocity=np.ones_like(stream.position))
    assert alignment.velocities_from_positions(given, True) is given


def test_euler_angles_make_the_rotation_from_body_to_level() -> None:
    expected = Rotation.from_euler("ZYX", [2.0, -0.5, 0.3]).as_matrix()
    np.testing.assert_allclose(rotation_matrix(np.array([0.3, -0.5, 2.0])), expected, atol=1e-15)


# --- where nothing gives a start --------------------------------------------------------------------------------------


def test_a_standstill_alone_has_no_heading() -> None:
    imu = standing(Rotation.identity(), 15.0)
    options = StartOptions(position=PLACE, static_interval=(0.0, 10.0))
    with pytest.raises(InputError, match=r"no heading; expected start\.heading_deg, GNSS, or a reference"):
        found(Recording(rig(), (imu,), start=options))


def test_gnss_that_never_moves_gives_no_heading() -> None:
    still, options = standing(Rotation.identity(), 15.0), StartOptions(static_interval=(0.0, 10.0))
    recording = Recording(rig(), (still,), gnss=fixes_at_rest(np.arange(1.0, 15.0)), start=options)
    with pytest.raises(InputError, match=r"no heading.*nothing moves far enough"):
        found(recording)


def test_a_single_fix_gives_no_heading() -> None:
    still, options = standing(Rotation.identity(), 15.0), StartOptions(static_interval=(0.0, 10.0))
    recording = Recording(rig(), (still,), gnss=fixes_at_rest(np.array([4.0])), start=options)
    with pytest.raises(InputError, match="heading"):
        found(recording)


@pytest.mark.parametrize("wanted", ["value", "gnss-course", "reference"])
def test_a_heading_from_what_is_missing_is_refused(wanted: str) -> None:
    imu = standing(Rotation.identity(), 15.0)
    options = StartOptions(
        heading_from=wanted, position=PLACE, velocity=np.zeros(3), roll_pitch=np.zeros(2), static_interval=(0.0, 10.0)
    )
    with pytest.raises(InputError, match="heading"):
        found(Recording(rig(), (imu,), start=options))


def test_motion_without_gnss_has_no_velocity() -> None:
    rolling = Profile(Swing(5.0), Swing(0.0, 0.0, 0.2, 3.0), Swing(0.0), Swing(1.0))
    recording = replace(drive_of(path(rolling, duration=9.0)), gnss=None,
                        start=StartOptions(heading=1.0, position=PLACE))  # fmt: skip
    with pytest.raises(InputError, match=r"no velocity; expected GNSS, a standstill, or start\.velocity_m_s"):
        found(recording)


@pytest.mark.parametrize("time", [-3.0, 24.8, 300.0])
def test_a_start_outside_the_data_is_refused(time: float) -> None:
    with pytest.raises(InputError, match=rf"start: time {time:.3f} s; expected within the IMU data, 0\.010 to 2"):
        found(replace(drive_of(leaving(12.0)), start=StartOptions(time=time)))


def under_way(speed: float, noise: float, seed: int, duration: float = 90.0) -> tuple[Recording, Path]:
    """A drive from the first row on with positions once a second, that noisy, m."""
    driven = path(Profile(Swing(speed), Swing(0.0), Swing(0.0), Swing(-2.0, 0.02)), duration=duration)
    recording = drive_of(driven)
    assert recording.gnss is not None
    time = np.arange(0.5, duration - 1.0)
    truth = driven.truth(time)
    off = np.random.default_rng(seed).normal(0.0, noise, (len(time), 3))
    position = truth.position + off / metres_per_unit(PLACE, True)
    return replace(recording, gnss=GnssStream(time, position, np.full((len(time), 3), noise))), driven


@pytest.mark.long
@pytest.mark.parametrize(("speed", "noise"), [(15.0, 5.0), (4.0, 2.0), (2.0, 0.5), (1.0, 0.02)])
def test_a_course_is_as_sure_as_the_way_is_long_against_the_noise(speed: float, noise: float) -> None:
    """Of forty starts all within four of their std, and their mean square is that of one."""
    ratios = []
    for seed in range(40):
        recording, driven = under_way(speed, noise, seed)
        start = found(recording)
        truth = driven.truth(np.array([start.time]))
        assert start.time < 2.0
        ratios.append(off_by(start.attitude[2], truth.attitude[0, 2]) * DEG / start.attitude_std[2])
    assert max(ratios) < 4.0
    assert 0.05 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def test_who_hovers_has_no_course() -> None:
    recording, _ = under_way(0.05, 0.02, 0, 40.0)
    imu = recording.imus[0]
    shaken = replace(imu, dtheta=imu.dtheta + 0.02 * np.sin(np.arange(len(imu.time)))[:, None] / RATE_HZ)
    noisy = np.random.default_rng(1).normal(0.0, 0.5, shaken.dvel.shape) / RATE_HZ
    shaken = replace(shaken, dvel=shaken.dvel + noisy)
    with pytest.raises(InputError, match="no heading"):
        found(replace(recording, imus=(shaken,)))


def test_steady_acceleration_is_no_standstill() -> None:
    """The IMU is as quiet as at rest, and feels a constant force that is not the vertical."""
    time = np.arange(1, 3000) / RATE_HZ
    quiet_rows = np.zeros((len(time), 6, 1))
    quiet_rows[:, 3] = 4.0 / RATE_HZ
    quiet_rows[:, 5] = -9.81 / RATE_HZ
    quiet = Aligned(time, quiet_rows, (), np.zeros((len(time), 1), dtype=bool))
    assert find_standstill(quiet, None, True, 0.1) is None
    quiet_rows[:, 3] = 0.0
    assert find_standstill(quiet, None, True, 0.1) is not None


def quiet_for(duration: float, rate: float) -> Aligned:
    """An IMU that shows nothing but gravity and one rate about the vertical, rad/s."""
    time = np.arange(1, round(duration * RATE_HZ)) / RATE_HZ
    rows = np.zeros((len(time), 6, 1))
    rows[:, 2], rows[:, 5] = rate / RATE_HZ, -9.81 / RATE_HZ
    return Aligned(time, rows, (), np.zeros((len(time), 1), dtype=bool))


def around_a_circle(speed: float, rate: float, interval: float, std: float, *, velocity: bool) -> GnssStream:
    """Fixes of 60 s on a plane, with noise."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 60.0, interval)
    angle, radius = rate * time, speed / rate
    place = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    moves = speed * np.column_stack([-np.sin(angle), np.cos(angle), np.zeros_like(angle)])
    return GnssStream(
        time,
        place + rng.normal(0.0, std, place.shape),
        np.full(place.shape, std),
        moves + rng.normal(0.0, 0.1, place.shape) if velocity else None,
        np.full(place.shape, 0.1) if velocity else None,
    )


@pytest.mark.parametrize("interval", [0.1, 1.0])
@pytest.mark.parametrize("velocity", [False, True])
def test_a_steady_circle_is_no_standstill(interval: float, velocity: bool) -> None:
    """What comes back does not drift, and a gyro alone could take the turn for its bias."""
    rate = 6.0 * DEG
    assert find_standstill(quiet_for(60.0, rate), None, False, 0.1) is not None
    moving = around_a_circle(1.5, rate, interval, 0.02, velocity=velocity)
    assert find_standstill(quiet_for(60.0, rate), moving, False, 0.1) is None
    resting = around_a_circle(1e-9, rate, interval, 0.02, velocity=velocity)
    assert find_standstill(quiet_for(60.0, rate), resting, False, 0.1) is not None


def test_fixes_that_are_worse_than_they_state_are_still_at_rest() -> None:
    for seed in range(20):
        stream = around_a_circle(1e-9, 0.1, 0.2, 0.02, velocity=False)
        noisy = np.random.default_rng(seed).normal(0.0, 0.06, stream.position.shape)
        assert (
            find_standstill(quiet_for(60.0, 0.0), replace(stream, position=stream.position + noisy), False) is not None
        )


def test_a_steady_turn_is_no_bias() -> None:
    assert find_standstill(quiet_for(60.0, 17.0 * DEG), None, False, 0.1) is None


@pytest.mark.parametrize("at", [0.01, 8.0])
def test_a_heading_of_one_instant_is_carried_to_the_start(at: float) -> None:
    turning = path(Profile(Swing(10.0), Swing(0.02), Swing(-0.03), Swing(-2.0, 0.1)), duration=20.0)
    heading = float(turning.truth(np.array([at])).attitude[0, 2])
    options = StartOptions(time=4.0, heading=heading, heading_time=at)
    start = found(replace(drive_of(turning), start=options))
    assert off_by(start.attitude[2], turning.truth(np.array([start.time])).attitude[0, 2]) < 0.5
    assert start.attitude_std[2] >= 1.0 * DEG


def test_a_heading_of_an_instant_without_data_is_refused() -> None:
    with pytest.raises(InputError, match="the heading is that at 99"):
        found(replace(drive_of(leaving(12.0)), start=StartOptions(heading=1.0, heading_time=99.0)))
