from pathlib import Path

import numpy as np
import pytest

from polyins.config import Rolling
from polyins.errors import InputError
from polyins.reading.loading import load
from polyins.simulation.drive_scenario import Drive
from polyins.simulation.files import write
from polyins.simulation.run import record, simulate, simulate_with_truth, true_run
from polyins.simulation.scenario import Board, Scenario, SensorErrors, read_scenario
from polyins.simulation.wheel_scenario import Slip, SurveyedTrack, WheelModule
from polyins_papers.vehicles import ROBOT

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "robot.yaml"
PERFECT = SensorErrors(noise=False, biases=False, scales=False)
WHEELS = (
    WheelModule(name="left", position_m=(0.0, -0.165, 0.0), radius_m=0.097, chips=2),
    WheelModule(name="right", position_m=(0.0, 0.165, 0.0), radius_m=0.097, chips=1, lever_arm_m=(0.0, 0.0, -0.02)),
)
SHORT = Scenario(
    duration_s=40.0,
    static_s=10.0,
    rate_hz=100.0,
    earth="plane",
    drive=Drive(top_speed_m_s=1.9),
    gnss=None,
    imus=Board(count=2, pitch_m=0.0, position_m=(0.1, 0.0, -0.2)),
    wheels=WHEELS,
)


def changed(**fields):
    return SHORT.model_copy(update=fields)


def test_the_rig_has_the_body_s_chips_and_then_those_of_each_wheel():
    recording = simulate(SHORT)
    assert [imu.name for imu in recording.rig.imus] == ["body1", "body2", "left1", "left2", "right1"]
    assert recording.rig.modules() == {"body": [0, 1], "left": [2, 3], "right": [4]}
    assert [stream.name for stream in recording.imus] == [imu.name for imu in recording.rig.imus]
    assert {stream.time.size for stream in recording.imus} == {4000}
    np.testing.assert_array_equal(recording.rig.imus[1].position, [0.1, 0.0, -0.2])
    np.testing.assert_array_equal(recording.rig.imus[4].wheel.lever_arm, [0.0, 0.0, -0.02])
    assert not recording.geodetic


def test_the_start_is_given_where_there_is_no_receiver():
    simulation = simulate_with_truth(SHORT)
    start, truth = simulation.recording.start, simulation.path.truth([10.0])
    np.testing.assert_array_equal(start.position, truth.position[0])
    assert (start.heading, start.heading_from) == (truth.attitude[0, 2], "value")
    assert start.static_interval == (0.01, 10.0)
    np.testing.assert_allclose(np.degrees(start.attitude_std), [1.0, 1.0, 0.1])
    np.testing.assert_array_equal(start.position_std, 0.05)
    assert simulate(Scenario(duration_s=40.0, static_s=10.0, wheels=WHEELS)).start.position is None


@pytest.mark.parametrize("earth", ["plane", "turning"])
def test_perfect_chips_show_their_wheel_s_speed_and_the_earth_s_rate(earth):
    simulation = simulate_with_truth(changed(errors=PERFECT, earth=earth))
    left, right = (simulation.recording.imus[index] for index in (2, 4))
    np.testing.assert_array_equal(left.dtheta, simulation.recording.imus[3].dtheta)
    for stream, wheel in ((left, simulation.wheels[0]), (right, simulation.wheels[1])):
        motion = simulation.path.motion(stream.time - 0.005)
        speed = -0.097 * (stream.dtheta[:, 0] * 100.0 - motion.earth_rate[:, 1])
        # the mean over an interval of 10 ms and the value in its middle
        np.testing.assert_allclose(speed, wheel.speed(motion, stream.time - 0.005), atol=2e-5)
        assert np.ptp(speed) > 0.5
    rate = np.linalg.norm(left.dtheta[:900], axis=1) * 100.0
    np.testing.assert_allclose(rate, 7.292115e-5 if earth == "turning" else 0.0, rtol=1e-4, atol=1e-9)
    assert np.abs(left.dvel - right.dvel).max() > 0.01


def test_the_calibrated_radius_fits_the_scaled_gyro():
    errors = SensorErrors(noise=False, biases=False, turn_on_share=1.0)
    simulation, bare = simulate_with_truth(changed(errors=errors)), simulate(changed(errors=PERFECT))
    for index in (2, 3, 4):
        known, true = simulation.recording.rig.imus[index].wheel.radius, bare.rig.imus[index].wheel.radius
        assert true == 0.097
        assert abs(known / true - 1.0) > 1e-5
        shown, want = simulation.recording.imus[index].dtheta[:, 0], bare.imus[index].dtheta[:, 0]
        np.testing.assert_allclose(known * shown, true * want, atol=1e-15)
    uncalibrated = tuple(wheel.model_copy(update={"calibrated": False}) for wheel in WHEELS)
    assert simulate(changed(errors=errors, wheels=uncalibrated)).rig.imus[2].wheel.radius == 0.097


def test_chips_of_one_module_err_on_their_own_and_a_wheel_more_changes_nothing():
    full, less = simulate(SHORT), simulate(changed(wheels=WHEELS[:1]))
    assert np.abs(full.imus[2].dtheta - full.imus[3].dtheta).max() > 1e-6
    for first, second in zip(full.imus, less.imus, strict=False):
        np.testing.assert_array_equal(first.dtheta, second.dtheta)
        np.testing.assert_array_equal(first.dvel, second.dvel)


def test_a_seed_draws_other_errors_on_the_same_run():
    run = true_run(SHORT)
    first, second = (record(run, seed=seed).recording for seed in (0, 5))
    np.testing.assert_array_equal(first.reference.position, second.reference.position)
    np.testing.assert_array_equal(first.imus[2].dvel, simulate(SHORT).imus[2].dvel)
    difference = first.imus[2].dtheta - second.imus[2].dtheta
    assert 1e-6 < np.abs(difference).max() < 1e-2
    assert np.abs(first.reference.position - simulate(SHORT, seed=5).reference.position).max() > 1.0


def test_the_configuration_in_force_repeats_a_recording(tmp_path):
    recording = record(true_run(SHORT), seed=5).recording
    (tmp_path / "scenario.yaml").write_text(recording.config_text)
    again = simulate(tmp_path / "scenario.yaml")
    np.testing.assert_array_equal(again.imus[3].dvel, recording.imus[3].dvel)
    np.testing.assert_array_equal(again.reference.position, recording.reference.position)


def test_slip_shows_in_the_wheel_and_not_in_the_truth():
    slipping = tuple(wheel.model_copy(update={"slip": Slip(constant=0.05)}) for wheel in WHEELS)
    dry, wet = simulate(changed(errors=PERFECT)), simulate(changed(errors=PERFECT, wheels=slipping))
    np.testing.assert_array_equal(dry.reference.position, wet.reference.position)
    np.testing.assert_array_equal(dry.imus[0].dvel, wet.imus[0].dvel)
    for index in (2, 4):
        turned, rolled = wet.imus[index].dtheta[:, 0], dry.imus[index].dtheta[:, 0]
        np.testing.assert_allclose(turned, 1.05 * rolled, atol=2e-4 * np.abs(rolled).max())
    drawn = tuple(wheel.model_copy(update={"slip": Slip(size=0.3, every_s=5.0)}) for wheel in WHEELS)
    shown = simulate(changed(errors=PERFECT, wheels=drawn))
    apart = [np.abs(shown.imus[index].dtheta - dry.imus[index].dtheta)[:, 0] for index in (2, 4)]
    assert min(values.max() for values in apart) > 0.001
    assert np.any((apart[0] > 1e-6) & (apart[1] < 1e-9))


def test_the_filter_is_told_its_own_noise():
    recording = simulate(Scenario.model_validate({**SHORT.model_dump(), "filter_noise": "tactical"}))
    grades = {imu.noise.gyro_bias_std[0] for imu in recording.rig.imus}
    assert grades == {np.radians(1.0) / 3600.0}
    np.testing.assert_array_equal(recording.imus[2].dtheta, simulate(SHORT).imus[2].dtheta)


def test_wheels_read_back_as_they_were(tmp_path):
    recording = simulate(SHORT)
    back = load(write(recording, tmp_path))
    for before, after in zip(recording.rig.imus, back.rig.imus, strict=True):
        assert (before.name, before.module) == (after.name, after.module)
        assert (before.wheel is None) == (after.wheel is None)
        np.testing.assert_allclose(after.rotation, np.eye(3), atol=1e-15)
        np.testing.assert_array_equal(after.position, before.position)
        if before.wheel and after.wheel:
            assert (before.wheel.radius, before.wheel.steering) == (after.wheel.radius, after.wheel.steering)
            np.testing.assert_array_equal(before.wheel.lever_arm, after.wheel.lever_arm)
    for before, after in zip(recording.imus, back.imus, strict=True):
        np.testing.assert_array_equal(before.dtheta, after.dtheta)
        np.testing.assert_array_equal(before.dvel, after.dvel)
    assert not back.geodetic
    assert back.options.rolling.predict == recording.options.rolling.predict
    assert back.start.heading == pytest.approx(recording.start.heading, abs=1e-15)


def test_the_plane_s_gravity_and_start_are_those_given():
    scenario = Scenario.model_validate(
        {**SHORT.model_dump(), "gravity_m_s2": 9.79, "start": {"north_m": 3.0, "east_m": 4.0, "height_m": 5.0}}
    )
    recording = simulate(scenario.model_copy(update={"errors": PERFECT}))
    np.testing.assert_allclose(recording.start.position, [3.0, 4.0, 5.0], atol=1e-9)
    assert recording.options.gravity == 9.79
    assert np.linalg.norm(recording.imus[0].dvel[10]) * 100.0 == pytest.approx(9.79)


def test_the_example_is_valid_and_its_modules_have_four_chips():
    assert [len(chips) for chips in read_scenario(EXAMPLE).rig().modules().values()] == [4, 4, 4]


def track_files(folder, names="north_m,east_m"):
    angle = np.linspace(0.0, 4.0, 60)
    points = np.column_stack([10.0 * np.sin(angle), 10.0 - 10.0 * np.cos(angle)])
    if names != "north_m,east_m":
        points = points / [110_852.4, 96_486.3] + [30.0, 114.0]
    np.savetxt(folder / "track.csv", points, delimiter=",", header=names, comments="", fmt="%.12f")
    speeds = np.column_stack([np.arange(0.0, 40.0, 0.5), np.full(80, 1.0)])
    np.savetxt(folder / "odometer.csv", speeds, delimiter=",", header="time_s,speed_m_s", comments="")
    text = "static_s: 10\nrate_hz: 50\nearth: plane\ngnss: null\ntrack: {file: track.csv, odometer: odometer.csv}\n"
    (folder / "scenario.yaml").write_text(text)
    return folder / "scenario.yaml"


@pytest.mark.parametrize("names", ["north_m,east_m", "latitude_deg,longitude_deg"])
def test_a_track_s_files_count_from_the_scenario_s(tmp_path, names):
    recording = simulate(track_files(tmp_path, names))
    end = [10.0 * np.sin(4.0), 10.0 - 10.0 * np.cos(4.0)]
    np.testing.assert_allclose(recording.reference.position[-1, :2], end, atol=0.1)
    assert recording.imus[0].time[-1] == pytest.approx(10.0 + 39.5 + 3.0 + 5.0, abs=1.0)


def test_ground_goes_up_and_down_where_it_is_asked_to_and_does_not_twist(tmp_path):
    scenario = track_files(tmp_path)
    level = simulate(scenario).reference
    text = scenario.read_text().replace("odometer.csv}", "odometer.csv, slope_deg: 2, slope_length_m: 25}")
    scenario.write_text(text + "wheels: [{name: left, position_m: [0, -0.2, 0], chips: 1}]\n")
    run = true_run(read_scenario(scenario))
    time = np.arange(0.0, run.path.duration, 0.1)
    motion = run.path.motion(time)
    assert not level.attitude[:, :2].any()
    assert 0.5 < np.degrees(np.abs(motion.attitude[:, 1]).max()) < 2.0
    assert np.degrees(np.ptp(motion.attitude[:, 0])) > 0.5
    np.testing.assert_allclose((motion.angular_rate - motion.earth_rate)[:, 0], 0.0, atol=1e-6)
    np.testing.assert_allclose(run.path.heading(time), simulate_heading(tmp_path, time), atol=1e-9)


def simulate_heading(folder, time):
    return true_run(read_scenario(track_files(folder))).path.heading(time)


def test_a_track_without_its_columns_is_refused(tmp_path):
    scenario = track_files(tmp_path)
    (tmp_path / "odometer.csv").write_text("time_s,velocity\n0,1\n")
    with pytest.raises(InputError, match=r"odometer\.csv: .*speed_m_s"):
        simulate(scenario)
    with pytest.raises(InputError, match=r"nowhere\.csv"):
        simulate(changed(track=SurveyedTrack(file="nowhere.csv", odometer="nowhere.csv")))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("earth: flat", "line 1: earth: is 'flat'; expected 'turning' or 'plane'"),
        ("earth: plane\nstart: {latitude_deg: 1, longitude_deg: 2}", "line 2: start: expected north_m and east_m"),
        ("wheels: [{name: left}]", r"wheels\[0\].position_m: is missing"),
        ("wheels: [{name: a/b, position_m: [0, 1, 0]}]", r"wheels\[0\].name: is 'a/b'; expected"),
        ("wheels: [{name: body, position_m: [0, 1, 0]}]", "wheels: two modules are named 'body'"),
        ("wheels: [{name: l, position_m: [0, 1, 0], radius_m: 0}]", r"wheels\[0\].radius_m: is 0; expected"),
        ("wheels: [{name: l, position_m: [0, 1, 0], slip: {constant: -1}}]", r"slip.constant: is -1; expected"),
        ("track: {file: a.csv}", "track.odometer: is missing"),
    ],
)
def test_mistakes_are_named(tmp_path, text, message):
    (tmp_path / "scenario.yaml").write_text(text)
    with pytest.raises(InputError, match=message):
        read_scenario(tmp_path / "scenario.yaml")


@pytest.fixture(scope="module")
def robot_data(data_folder):
    folder = data_folder / "whu-robot"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    return folder


def test_the_robot_s_path_is_drivable(robot_data):
    scenario = ROBOT.scenario(robot_data, errors=PERFECT)
    path = scenario.track.path(scenario.static_s, (0.0, 0.0, 0.0), scenario.world())
    time = np.arange(0.0, path.duration, 0.02)
    assert np.abs(path.heading(time, 1)).max() < 1.5
    assert np.abs(path.speed(time, 1)).max() < 1.0
    assert 1.8 < path.speed(time).max() < 1.9
    assert 1270.0 < path.speed(time).sum() * 0.02 < 1285.0
    np.testing.assert_array_equal(path.speed(time[time <= 30.0]), 0.0)
    turned = np.degrees(path.heading(time[[-1]]) - path.heading(time[[0]]))[0]
    assert turned == pytest.approx(-1783.0, abs=20.0)


def test_the_robot_has_three_modules_of_four_chips(robot_data):
    scenario = ROBOT.scenario(robot_data, duration_s=40.0)
    recording = record(true_run(scenario), seed=3).recording
    assert [len(chips) for chips in recording.rig.modules().values()] == [4, 4, 4]
    radii = np.array([imu.wheel.radius for imu in recording.rig.imus if imu.wheel])
    assert 1e-4 < np.abs(radii / 0.097 - 1.0).max() < 6e-3
    still = recording.imus[4].time < 30.0
    bias = np.array([stream.dtheta[still].mean(axis=0) * 200.0 for stream in recording.imus])
    assert np.degrees(bias).std() * 3600.0 == pytest.approx(200.0, rel=0.4)


def test_the_filter_is_told_how_wheels_aid_it():
    recording = simulate(changed(rolling=Rolling(constraint_std_m=0.5, standstill=False)))
    assert recording.options.rolling.constraint_std == 0.5
    assert not recording.options.rolling.standstill
    assert simulate(SHORT).options.rolling.standstill
