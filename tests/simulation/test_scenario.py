from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from polyins.config import Noise, OutageSchedule
from polyins.errors import InputError
from polyins.model.geodesy import metres_per_unit
from polyins.simulation.increments import increments
from polyins.simulation.run import simulate, simulate_with_truth
from polyins.simulation.scenario import Board, Fixes, Scenario, SensorErrors, WrongFixes, demo, read_scenario

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SHORT = Scenario(duration_s=60.0, static_s=10.0, rate_hz=50.0, imus=Board(count=3), outages=((30.0, 40.0),))
PERFECT = SensorErrors(noise=False, biases=False, scales=False)
MOUNTS = (("x", "y", "z"), ("x", "-y", "-z"), ("y", "z", "x"))


def changed(**fields):
    return SHORT.model_copy(update=fields)


def test_a_recording_has_what_the_scenario_says():
    recording = simulate(SHORT)
    assert [imu.name for imu in recording.rig.imus] == [stream.name for stream in recording.imus]
    assert {stream.time.size for stream in recording.imus} == {3000}
    assert recording.imus[0].rate_hz == pytest.approx(50.0)
    assert recording.geodetic
    assert recording.outages == ((30.0, 40.0),)
    assert recording.start.static_interval == (0.02, 10.0)
    assert recording.gnss.time.size == 60
    assert not np.any(np.isin(recording.gnss.time, recording.imus[0].time))
    assert recording.reference.time[[0, -1]] == pytest.approx([0.1, 60.0])
    np.testing.assert_array_equal(recording.rig.antenna, [-0.3, 0.2, -1.0])


def test_the_reference_is_the_truth_of_the_array_origin():
    simulation = simulate_with_truth(SHORT)
    reference = simulation.recording.reference
    truth = simulation.path.truth(reference.time)
    for name in ("position", "velocity", "attitude"):
        np.testing.assert_array_equal(getattr(reference, name), getattr(truth, name))
    np.testing.assert_array_equal(reference.lever_arm, 0.0)


def test_perfect_imus_read_the_exact_increments_in_array_axes():
    simulation = simulate_with_truth(changed(errors=PERFECT, imus=Board(count=5, pitch_m=0.2, mounts=MOUNTS)))
    exact = increments(simulation.path, 50.0)
    for imu, stream in zip(simulation.recording.rig.imus, simulation.recording.imus, strict=True):
        dtheta, dvel = exact.at(imu.position)
        np.testing.assert_allclose(stream.dtheta, dtheta, atol=1e-17)
        np.testing.assert_allclose(stream.dvel, dvel, atol=1e-15)


def test_drawn_errors_explain_the_streams():
    errors = SensorErrors(noise=False, turn_on_share=0.5)
    simulation = simulate_with_truth(changed(errors=errors, imus=Board(count=3, mounts=MOUNTS)))
    exact = increments(simulation.path, 50.0)
    for imu, stream, drawn in zip(
        simulation.recording.rig.imus, simulation.recording.imus, simulation.errors, strict=True
    ):
        gyro_bias, accel_bias, gyro_scale, accel_scale = np.split(
            drawn.in_array_axes(exact.time - 0.01, imu.rotation), 4, axis=1
        )
        dtheta, dvel = exact.at(imu.position)
        np.testing.assert_allclose(stream.dtheta, (1 + gyro_scale) * dtheta + gyro_bias * 0.02, atol=1e-15)
        np.testing.assert_allclose(stream.dvel, (1 + accel_scale) * dvel + accel_bias * 0.02, atol=1e-14)


def test_one_imu_more_changes_no_other():
    few, more = (simulate(changed(imus=Board(count=count, pitch_m=0.0))) for count in (2, 4))
    for first, second in zip(few.imus, more.imus, strict=False):
        np.testing.assert_array_equal(first.dtheta, second.dtheta)
        np.testing.assert_array_equal(first.dvel, second.dvel)
    np.testing.assert_array_equal(few.gnss.position, more.gnss.position)
    assert np.abs(more.imus[0].dtheta - more.imus[1].dtheta).max() > 1e-6


def test_a_seed_repeats_and_another_differs():
    first, again, other = simulate(SHORT), simulate(SHORT), simulate(SHORT, seed=1)
    np.testing.assert_array_equal(first.imus[1].dvel, again.imus[1].dvel)
    np.testing.assert_array_equal(first.gnss.position, again.gnss.position)
    assert np.abs(first.reference.position - other.reference.position).max() > 1e-7
    assert YAML(typ="safe").load(other.config_text)["seed"] == 1


def test_a_negative_seed_is_refused():
    with pytest.raises(InputError, match="seed is -1; expected"):
        simulate(SHORT, seed=-1)


def test_lies_are_told_where_the_filter_sees_them():
    lying = Fixes(rate_hz=5.0, lies=WrongFixes(count=20, size_m=40.0))
    simulation = simulate_with_truth(changed(gnss=lying))
    fix = simulation.recording.gnss
    truth = simulation.path.truth(fix.time, lying.antenna_position_m)
    wrong = np.abs(fix.position - truth.position)[:, :2].max(axis=1) * 6.4e6 > 10.0
    np.testing.assert_array_equal(np.flatnonzero(wrong), simulation.wrong_fixes)
    told = fix.time[simulation.wrong_fixes]
    assert told.size == 20
    assert told.min() > 10.0
    assert not np.any((told >= 30.0) & (told <= 40.0))


def test_without_a_receiver_there_is_no_gnss():
    recording = simulate(changed(gnss=None))
    assert recording.gnss is None
    assert recording.outages == recording.warnings == ()
    assert YAML(typ="safe").load(recording.config_text)["gnss"] is None


@pytest.mark.parametrize("count", [1, 2, 4, 6, 16])
def test_the_board_is_centred_and_spaced(count):
    positions = Board(count=count, pitch_m=0.1).positions()
    np.testing.assert_allclose(positions.mean(axis=0), 0.0, atol=1e-15)
    apart = np.linalg.norm(positions[:, None] - positions[None], axis=2)[np.triu_indices(count, 1)]
    assert apart.size == 0 or apart.min() == pytest.approx(0.1)
    assert np.unique(np.round(positions, 9), axis=0).shape[0] == count


def test_sixteen_imus_fill_a_square():
    np.testing.assert_allclose(np.ptp(Board().positions(), axis=0), [0.045, 0.045, 0.0])


def test_an_outage_schedule_counts_from_the_standing_start_and_ends_in_time():
    scenario = Scenario(duration_s=400.0, static_s=60.0, outages=OutageSchedule(length_s=30.0, every_s=90.0))
    assert scenario.outage_intervals() == ((120.0, 150.0), (210.0, 240.0), (300.0, 330.0))


def test_a_drive_too_short_for_an_outage_says_so():
    scenario = changed(outages=OutageSchedule(length_s=30.0, every_s=90.0))
    assert simulate(scenario).warnings == ("outages: the drive is too short for one",)
    assert simulate(SHORT).warnings == simulate(changed(outages=())).warnings == ()


def test_the_demonstration_has_four_outages_of_thirty_seconds():
    assert [end - begin for begin, end in demo().outage_intervals()] == [30.0] * 4
    assert demo().imus.count == 16


def test_the_default_grade_is_that_of_the_array_s_chips():
    noise = Scenario().rig().imus[0].noise
    assert noise.angle_random_walk[0] == pytest.approx(np.radians(0.24) / 60.0)
    assert noise.velocity_random_walk[0] == pytest.approx(0.24 / 60.0)
    assert noise.gyro_bias_std[0] == pytest.approx(np.radians(50.0) / 3600.0)
    assert noise.accel_bias_std[0] == pytest.approx(2.5e-3)
    assert noise.gyro_scale_std[0] == noise.accel_scale_std[0] == pytest.approx(1e-3)
    assert noise.correlation_time == 3600.0


def test_the_configuration_in_force_reads_back(tmp_path):
    scenario = changed(gnss=None, imus=Board(count=2, mounts=MOUNTS), noise=Noise.model_validate("tactical"))
    file = tmp_path / "scenario.yaml"
    file.write_text(simulate(scenario).config_text)
    assert read_scenario(file) == scenario


@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("scenario-*.yaml")), ids=lambda path: path.stem)
def test_examples_are_valid(example):
    scenario = read_scenario(example)
    assert scenario.outage_intervals()
    assert len(scenario.rig().imus) == scenario.imus.count


def test_fixes_wander_and_claim_what_the_scenario_says(tmp_path):
    file, errors = tmp_path / "scenario.yaml", []
    for gnss in ("{position_std_m: 0.001}", "{position_std_m: 0.001, slow_std_m: [2, 0, 0], stated_std_m: [3, 2, 1]}"):
        file.write_text(f"duration_s: 400\nrate_hz: 10\nimus: {{count: 1}}\noutages: []\ngnss: {gnss}\n")
        simulation = simulate_with_truth(file)
        stream, antenna = simulation.recording.gnss, simulation.recording.rig.antenna
        truth = simulation.path.truth(stream.time, antenna).position
        errors.append((stream.position - truth) * metres_per_unit(truth, geodetic=True))
    np.testing.assert_array_equal(stream.position_std, np.tile([3.0, 2.0, 1.0], (len(stream.time), 1)))
    plain, slow = errors
    np.testing.assert_allclose(slow[:, 1:], plain[:, 1:], atol=1e-8)
    assert 0.5 < slow[:, 0].std() < 4.0
    # it wanders: within a minute, not from fix to fix
    assert np.diff(slow[:, 0]).std() < 0.5 * slow[:, 0].std()


def test_the_filter_is_told_the_initial_std_of_the_scenario(tmp_path):
    file = tmp_path / "scenario.yaml"
    file.write_text(
        "noise: {gyro_bias_deg_h: 3, accel_scale_ppm: 70}\nerrors: {gyro_turn_on_deg_h: 4, accel_turn_on_mgal: 1000}\n"
        "initial_std: {accel_bias_m_s2: 0.5, gyro_scale_ppm: [1, 2, 3]}\n"
    )
    std = read_scenario(file).rig().imus[-1].initial_std
    np.testing.assert_allclose(np.degrees(std.gyro_bias) * 3600.0, 5.0)
    np.testing.assert_allclose(std.accel_bias, 0.5)
    np.testing.assert_allclose(std.gyro_scale, [1e-6, 2e-6, 3e-6])
    np.testing.assert_allclose(std.accel_scale, 70e-6)


def test_the_example_of_the_demonstration_is_the_demonstration():
    assert read_scenario(EXAMPLES / "scenario-demo.yaml") == demo()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sed: 1", r"line 1: sed: unknown key; did you mean seed\?"),
        ("seed: 1\nimus: {count: 0}", r"line 2: imus.count: is 0; expected"),
        ("imus:\n  mounts: [[x, y, w]]", r"line 2: imus.mounts\[0\]\[2\]: is 'w'; expected 'x'"),
        ("imus:\n  mounts: [[x, y, -z]]", "expected right-handed"),
        ("outages: {length_s: 3}", "outages.every_s: is missing"),
        ("start: {north_m: 1, east_m: 3}", "expected latitude_deg and longitude_deg"),
        ("duration_s: 100\ngnss: {lies: {count: 5000}}", "gnss.lies: 5000 lies among 40 fixes"),
        ("duration_s: 50", "static_s is 60; expected within the 50 s of duration_s"),
        ("rate_hz: 0.001", "rate_hz is 0.001; expected at least two samples within"),
        ("gnss: {phase_s: 2000}", "gnss.phase_s is 2000; expected within"),
        ("outages: [[150, 120]]", r"outages: \[150, 120\]; expected \[from, to\] within"),
        ("outages: [[900, 1001]]", r"outages: \[900, 1001\]; expected"),
        ("errors: {turn_on_share: 1.5}", "errors.turn_on_share: is 1.5; expected"),
    ],
)
def test_mistakes_are_named(tmp_path, text, message):
    file = tmp_path / "scenario.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        simulate(file)
