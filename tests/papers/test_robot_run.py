"""How the robot's runs are chosen, scored and averaged, and what the experiments change."""

from collections import Counter
from dataclasses import fields, replace

import numpy as np
import pytest
from synthetic_solutions import drive, solution

from polyins.evaluation.errors import compare_to_reference
from polyins.model.geodesy import metres_per_unit
from polyins.model.methods import find_method
from polyins.model.recording import Reference
from polyins.navigate.choice import choose
from polyins.simulation.drive_scenario import Drive
from polyins.simulation.run import record, true_run
from polyins.simulation.scenario import Board, Scenario, SensorErrors
from polyins_papers import b6, b7, robot_experiments
from polyins_papers.robot import CONFIGURATIONS, FEW, Score, as_in_the_paper, at_the_reference, by_seed, score, table
from polyins_papers.sites import site
from polyins_papers.vehicles import ROBOT

RUNS = {"wheel-ins": 8, "dual-wheel-ins": 16, "body-wheel-ins": 16, "triple-ins": 16}


@pytest.fixture(scope="module")
def short():
    """The robot's rig on a short drive on the turning Earth."""
    robot = ROBOT.scenario(earth="turning")
    scenario = Scenario(
        duration_s=60.0,
        static_s=10.0,
        drive=Drive(top_speed_m_s=1.9),
        imus=Board(count=4, pitch_m=0.0, position_m=robot.imus.position_m),
        wheels=robot.wheels,
        noise=robot.noise,
        filter_noise=robot.filter_noise,
        errors=SensorErrors(turn_on_share=1.0),
        gnss=None,
    )
    return record(true_run(scenario), seed=0).recording


def chips_of(labels):
    return [tuple(label.split("/")[1:]) for label in labels]


def test_the_runs_are_those_of_the_paper(short):
    assert {name: len(set(labels)) for name, labels in CONFIGURATIONS.items()} == RUNS
    for name, labels in CONFIGURATIONS.items():
        every = Counter(chip for chips in chips_of(labels) for chip in chips)
        assert len(set(every.values())) == 1, name
        assert {choose(find_method(label), short.rig).blocks for label in labels} == {
            tuple((([imu.name for imu in short.rig.imus]).index(chip),) for chip in chips) for chips in chips_of(labels)
        }
    few = Counter(chip for labels in FEW.values() for chips in chips_of(labels) for chip in chips)
    assert few == {f"{name}{c}": 2 if name == "body" else 4 - (name == "right") for name in
                   ("left", "right", "body") for c in (1, 2, 3, 4)}  # fmt: skip
    assert set(Counter(chip for chips in chips_of(b7.LABELS) for chip in chips).values()) == {2}


def test_only_the_wheels_options_change(short):
    changed = as_in_the_paper(short, "end", 0.02)
    rolling = changed.options.rolling
    assert (rolling.standstill, rolling.predict, rolling.speed_window) == (False, "end", 0.02)
    same = replace(changed, options=short.options)
    assert all(getattr(same, field.name) is getattr(short, field.name) for field in fields(short))


def test_a_solution_is_judged_at_the_epochs_of_the_reference():
    truth = drive()
    made = solution(truth)
    wanted = truth.time[4::10]
    reference = Reference(np.append(wanted, wanted[-1] + 100.0), np.zeros((wanted.size + 1, 3)))
    found = at_the_reference(made, reference)
    np.testing.assert_array_equal(found.time, wanted)
    for name in ("position", "velocity", "attitude", "position_variance", "velocity_variance", "phi_covariance"):
        np.testing.assert_array_equal(getattr(found, name), getattr(made, name)[4::10])


def test_means_are_over_all_runs_of_all_seeds():
    runs = [{"wheel-ins": [Score(1.0, 10.0), Score(2.0, 20.0)]}, {"wheel-ins": [Score(6.0, 60.0), Score(7.0, 70.0)]}]
    assert table(runs) == {
        "wheel-ins": {
            "drift_mean_percent": 4.0,
            "drift_std_percent": pytest.approx(np.std([1.0, 2.0, 6.0, 7.0], ddof=1)),
            "heading_mean_deg": 40.0,
            "heading_std_deg": pytest.approx(np.std([10.0, 20.0, 60.0, 70.0], ddof=1)),
        }
    }
    assert by_seed(runs) == {"wheel-ins": {"drift_mean_percent": [1.5, 6.5], "heading_mean_deg": [15.0, 65.0]}}


def test_honesty_is_one_per_degree_of_freedom_where_errors_are_one_sigma():
    truth = drive(roll=0.0)
    reference = Reference(truth.time, truth.geodetic, truth.velocity, truth.euler)
    scale = metres_per_unit(truth.geodetic, geodetic=True)
    half = 0.5 * np.radians(1.0)
    turned = replace(
        solution(truth),
        position=truth.geodetic + np.array([0.3, -0.4, 5.0]) / scale,
        attitude=_turned(truth.attitude, half),
        position_variance=np.tile([0.3**2, 0.4**2, 1.0], (truth.time.size, 1)),
        phi_covariance=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, np.radians(0.5) ** 2], (truth.time.size, 1)),
    )
    errors = compare_to_reference(turned, reference)
    position, heading = b7.honesty(turned, errors)
    np.testing.assert_allclose(position, 2.0, rtol=1e-6)
    np.testing.assert_allclose(heading, 4.0, rtol=1e-6)
    assert score(errors).heading_deg == pytest.approx(1.0)


def _turned(attitude, half):
    w, x, y, z = attitude.T
    c, s = np.cos(half), np.sin(half)
    return np.column_stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])


def test_an_installation_errs_by_just_what_is_said(short):
    wheels = [imu.wheel for imu in short.rig.imus if imu.wheel]
    radius = [imu.wheel for imu in robot_experiments.wrong_radius(short).rig.imus if imu.wheel]
    arm = [imu.wheel for imu in robot_experiments.wrong_lever_arm(short).rig.imus if imu.wheel]
    np.testing.assert_allclose([w.radius for w in radius], [1.005 * w.radius for w in wheels])
    np.testing.assert_allclose([w.lever_arm for w in arm], [np.add(w.lever_arm, [0.0, 0.003, 0.003]) for w in wheels])
    turned = robot_experiments.wrong_heading(short)
    assert np.degrees(turned.start.heading - short.start.heading) == pytest.approx(0.5)
    late = robot_experiments.late_clocks(short)
    shifts = {imu.module: new.time[0] - old.time[0] for imu, new, old in
              zip(short.rig.imus, late.imus, short.imus, strict=True)}  # fmt: skip
    assert shifts == pytest.approx({"body": -0.005, "left": 0.0, "right": 0.005})


def test_the_chips_of_a_tilted_module_are_tilted_alike(short):
    tilted = robot_experiments.tilted_modules(short)
    angles = {}
    for imu, new, old in zip(short.rig.imus, tilted.imus, short.imus, strict=True):
        rotation = np.linalg.lstsq(old.dvel, new.dvel, rcond=None)[0]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
        np.testing.assert_allclose(new.dtheta, old.dtheta @ rotation, atol=1e-12)
        angles.setdefault(imu.module, []).append(np.degrees(np.arccos(rotation[0, 0])))
    assert all(np.ptp(of_module) < 1e-6 and 0.05 < of_module[0] < 2.0 for of_module in angles.values())
    assert len({round(of_module[0], 6) for of_module in angles.values()}) == 3


def test_a_plane_takes_the_place_of_the_earth(short):
    flat = robot_experiments.without_earth_rate(short)
    assert not flat.geodetic
    np.testing.assert_array_equal(flat.start.position, 0.0)
    np.testing.assert_allclose(flat.reference.position[0], 0.0, atol=0.5)
    step = np.diff(short.reference.position, axis=0) * metres_per_unit(short.reference.position[1:], True)
    np.testing.assert_allclose(np.diff(flat.reference.position, axis=0)[:, :2], step[:, :2], atol=2e-5)
    assert flat.options.gravity == pytest.approx(9.7937, abs=2e-4)
    assert all(old is new for old, new in zip(short.imus, flat.imus, strict=True))


@pytest.mark.long
def test_without_errors_the_robot_is_within_5_mm_on_the_turning_earth(monkeypatch):
    # 6 mm where the earth's rate about the axle is taken for rolling
    monkeypatch.setattr(b6, "PREDICTIONS", {"window": b6.PREDICTIONS["window"]})
    monkeypatch.setattr(b6, "ONE_SAMPLE_S", b6.WINDOW)
    run = true_run(site(ROBOT, quick=False).scenario(level=True, earth="turning"))
    (worst,) = b6.error_free_run(run, b6.WHEELS).values()
    assert worst < 0.005


@pytest.mark.long
def test_a_wheel_does_not_know_the_slope_and_the_body_does(monkeypatch):
    monkeypatch.setattr(b6, "PREDICTIONS", {"window": b6.PREDICTIONS["window"]})
    monkeypatch.setattr(b6, "ONE_SAMPLE_S", b6.WINDOW)
    scenario = site(ROBOT, quick=False).scenario()
    way = "track" if scenario.track else "laps"
    halved = getattr(scenario, way).model_copy(update={"slope_deg": 0.5 * ROBOT.laps.slope_deg})
    hilly, flatter = (true_run(each) for each in (scenario, scenario.model_copy(update={way: halved})))
    (wheels,), (body,) = (b6.error_free_run(hilly, labels).values() for labels in (b6.WHEELS, b6.WITH_BODY))
    assert body < 0.005
    # of the second order
    (less,) = b6.error_free_run(flatter, b6.WHEELS).values()
    assert 2.0 * body < 2.0 * less < wheels < 0.02
