"""Arrays that are turned by hand: what is found is inside its std, and what the motion does not tell is said."""

from dataclasses import replace

import numpy as np
import pytest

from polyins.calibration import array
from polyins.calibration.estimates import Calibration, Estimate
from polyins.calibration.relative import differences
from polyins.config import ImuEntry
from polyins.errors import InputError
from polyins.model.recording import ImuStream, Recording
from polyins.model.rig import Imu, NoiseGrade, Rig
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.run import Simulation
from polyins.studies.calibration import by_hand, deviations, without_knowledge
from polyins.studies.chips import draw_chips

GRADE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=0.2,
    velocity_random_walk_m_s_sqrt_h=0.2,
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=250.0,
    gyro_scale_ppm=1000.0,
    accel_scale_ppm=1000.0,
    correlation_time_h=1.0,
)
GRAVITY = 9.80665
RATE_HZ = 100.0
PLACES = np.array([[0.1, 0.0, 0.0], [-0.1, 0.05, 0.02], [0.0, -0.05, -0.02]])


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    """Four chips drawn like real ones, held in 26 attitudes and shaken."""
    chips = draw_chips(4, np.random.default_rng(20602))
    return by_hand(1, SensorErrors(scales=False, chips=chips), count=4)


@pytest.fixture(scope="module")
def calibration(simulation: Simulation) -> Calibration:
    return array.calibrate(*without_knowledge(simulation.recording))


def settings(calibration: Calibration, name: str) -> dict[str, Estimate]:
    return {one.key: one for one in calibration.imus[name]}


def test_everything_is_inside_its_std(simulation: Simulation) -> None:
    off = deviations(simulation)
    assert set(off) == {
        "mount_deg", "gyro_matrix", "accel_matrix", "position_m", "clock_offset_s",
        "initial_errors.gyro_bias_deg_s", "initial_errors.accel_bias_m_s2",
    }  # fmt: skip
    whole = np.abs(np.concatenate(list(off.values())))
    assert np.mean(whole < 3.0) >= 0.99
    assert 0.5 < np.sqrt(np.mean(whole**2)) < 1.3


def test_stds_are_those_of_a_good_calibration(calibration: Calibration) -> None:
    found = settings(calibration, "imu1")
    assert max(found["gyro_matrix"].std or ()) < 3e-4
    assert max(found["accel_matrix"].std or ()) < 3e-4
    assert max(found["position_m"].std or ()) < 3e-4
    assert calibration.poses == 26
    assert calibration.warnings == ()
    before, after = calibration.agreement["configured"], calibration.agreement["calibrated"]
    assert after.gyro < 0.2 * before.gyro
    assert after.accel < 0.3 * before.accel


def test_the_next_start_is_as_sure_as_the_drift_allows(calibration: Calibration) -> None:
    found = settings(calibration, "imu2")
    bias = np.array(found["initial_std.gyro_bias_deg_s"].value)
    assert np.all(bias >= 50.0 / 3600.0)
    assert np.all(bias < 60.0 / 3600.0)
    assert max(found["initial_std.gyro_scale_ppm"].value) < 300.0


def test_a_late_clock_is_found(simulation: Simulation) -> None:
    known, entries = without_knowledge(simulation.recording)
    late = replace(known.imus[2], time=known.imus[2].time + 4e-3)
    found = array.calibrate(replace(known, imus=(*known.imus[:2], late, known.imus[3])), entries)
    offsets = [settings(found, imu.name)["clock_offset_s"].value[0] for imu in known.rig.imus]
    np.testing.assert_allclose(np.array(offsets) - np.mean(offsets), [1e-3, 1e-3, -3e-3, 1e-3], atol=2e-5)


def test_imus_in_axes_of_their_own_are_found(simulation: Simulation, calibration: Calibration) -> None:
    known, entries = without_knowledge(simulation.recording)
    turn = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    stream = known.imus[1]
    other = replace(stream, dtheta=stream.dtheta @ turn, dvel=stream.dvel @ turn)
    found = array.calibrate(replace(known, imus=(known.imus[0], other, *known.imus[2:])), entries)
    assert settings(found, "imu2")["axes"].value == "-y, -x, -z"
    plain = settings(calibration, "imu2")
    turned = settings(found, "imu2")
    # the frame is then that of the other three
    offset = np.subtract(turned["mount_deg"].value, plain["mount_deg"].value)
    assert np.abs(offset).max() < 0.3
    assert "axes" not in settings(found, "imu1")


def test_lost_rows_are_left_out(simulation: Simulation, calibration: Calibration) -> None:
    known, entries = without_knowledge(simulation.recording)
    keep = np.ones(len(known.imus[0].time), dtype=bool)
    keep[5000:5003] = keep[9000:9200] = False
    found = array.calibrate(replace(known, imus=(known.imus[0].at(keep), *known.imus[1:])), entries)
    for name in calibration.imus:
        one, other = (settings(each, name)["gyro_matrix"] for each in (calibration, found))
        assert np.abs(np.subtract(one.value, other.value)).max() < 3.0 * max(one.std or ())


def test_one_imu_alone_is_calibrated_by_attitudes(simulation: Simulation) -> None:
    known, entries = without_knowledge(simulation.recording)
    found = settings(array.calibrate(known.subset([0]), entries[:1]), "imu1")
    errors = simulation.errors[0]
    measured = np.reshape(found["accel_matrix"].value, (3, 3)) @ errors.accel_response
    std = np.max(found["accel_matrix"].std or ())
    # up to a rotation: nothing but its own axes says where they point
    np.testing.assert_allclose(np.linalg.svd(measured)[1], 1.0, atol=4.0 * std)
    turned = np.reshape(found["gyro_matrix"].value, (3, 3)) @ errors.gyro_response
    np.testing.assert_allclose(np.linalg.svd(turned)[1], 1.0, atol=4.0 * np.max(found["gyro_matrix"].std or ()))
    assert "position_m" not in found


def moving(rates: np.ndarray) -> Recording:
    """Three error-free IMUs on a body that turns as told, its middle at rest; level when its rates are about z."""
    rng = np.random.default_rng(2)
    change = np.gradient(rates, 1.0 / RATE_HZ, axis=0)
    up = np.array([0.0, 0.0, -GRAVITY])
    time = np.arange(1, len(rates) + 1) / RATE_HZ
    streams = []
    for k, place in enumerate(PLACES):
        lever = np.cross(change, place) + np.cross(rates, np.cross(rates, place))
        noise = rng.normal(0.0, 1e-3, (2, len(rates), 3))
        streams.append(
            ImuStream(f"imu{k}", time, (rates + 0.1 * noise[0]) / RATE_HZ, (up + lever + noise[1]) / RATE_HZ)
        )
    imus = tuple(Imu(stream.name, GRADE, position=PLACES[k] + 0.01) for k, stream in enumerate(streams))
    return Recording(Rig(imus), tuple(streams), geodetic=False)


def entries_of(recording: Recording) -> list[ImuEntry]:
    return [ImuEntry(name=imu.name, file="none") for imu in recording.rig.imus]


def test_what_turns_about_one_axis_does_not_tell_is_said_and_stays_as_configured() -> None:
    time = np.arange(0.0, 60.0, 1.0 / RATE_HZ)
    yaw = np.column_stack([0.0 * time, 0.0 * time, 2.0 * np.sin(1.7 * time) + np.sin(4.1 * time)])
    recording = moving(yaw)
    moved = np.array([0.003, -0.004, 0.02])
    rig = replace(
        recording.rig,
        imus=(replace(recording.rig.imus[0], position=recording.rig.imus[0].position + moved), *recording.rig.imus[1:]),
    )
    recording = replace(recording, rig=rig)
    found = array.calibrate(recording, entries_of(recording))
    said = " ".join(found.warnings)
    assert "places along (0.00, 0.00, 1.00) stay as configured" in said
    assert "gyros: matrices and mounts along" in said
    assert "what the IMUs have in common stays as configured" in said
    places = np.array([settings(found, imu.name)["position_m"].value for imu in recording.rig.imus])
    configured = np.array([imu.position for imu in recording.rig.imus])
    np.testing.assert_allclose(places[:, 2], configured[:, 2], atol=1e-9)
    true = PLACES - PLACES.mean(axis=0) + configured.mean(axis=0)
    np.testing.assert_allclose(places[:, :2], true[:, :2], atol=2e-4)
    assert "initial_std.gyro_bias_deg_s" not in settings(found, "imu0")


def test_what_hardly_turns_is_refused() -> None:
    recording = moving(np.zeros((3000, 3)))
    with pytest.raises(InputError, match="hardly turns"):
        array.calibrate(recording, entries_of(recording))


def test_what_is_too_short_is_refused() -> None:
    recording = moving(np.ones((500, 3)))
    with pytest.raises(InputError, match="in common"):
        differences(recording.imus, PLACES)


def test_one_imu_that_was_not_held_is_refused() -> None:
    time = np.arange(0.0, 30.0, 1.0 / RATE_HZ)
    recording = moving(np.column_stack([np.sin(time), np.cos(2.0 * time), np.sin(3.0 * time)])).subset([0])
    with pytest.raises(InputError, match="attitudes"):
        array.calibrate(recording, entries_of(recording))


def test_gravity_that_is_not_known_is_said(simulation: Simulation) -> None:
    known, entries = without_knowledge(simulation.recording)
    standard = replace(known, options=replace(known.options, gravity=GRAVITY))
    assert any("gravity is taken as" in text for text in array.calibrate(standard, entries).warnings)
