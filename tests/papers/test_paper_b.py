"""Paper B's tables and figures by command: what they show, and that laps stand in where the tracks are missing."""

import numpy as np
import pytest

from polyins.config import Noise
from polyins_papers import b4, b5, b7, b8, bfig10, sites, subsystems
from polyins_papers.b6 import PAPER as TABLE_VI
from polyins_papers.robot import CONFIGURATIONS
from polyins_papers.vehicles import CAR, ROBOT

SHORT_S = 115.0


@pytest.fixture
def without_data(monkeypatch):
    monkeypatch.delenv("POLYINS_DATA", raising=False)
    monkeypatch.setattr(sites, "QUICK_S", SHORT_S)


def same_keys(paper, polyins):
    """Whether every figure of the paper has its own of polyins's."""
    return all(
        key in polyins and (not isinstance(value, dict) or same_keys(value, polyins[key]))
        for key, value in paper.items()
    )


def test_laps_stand_in_and_the_output_says_so(without_data, capsys):
    assert sites.site(CAR).folder is None
    assert "car: synthetic laps stand in: the data set whu-car is not at hand" in capsys.readouterr().err
    document = b4.reproduce(quick=True)
    assert document["settings"]["track"].startswith("synthetic laps stand in: the data set whu-robot is not at hand")
    assert same_keys(document["paper"], document["polyins"])
    rates = [document["polyins"][name]["drift_percent"] for name in b4.PAPER]
    assert all(0.0 < rate < 3.0 for rate in rates)
    assert document["polyins"]["mean"]["drift_percent"] == pytest.approx(np.mean(rates))
    assert document["polyins"]["std"]["drift_percent"] == pytest.approx(np.std(rates, ddof=1))
    assert b4.reproduce(quick=True) == document


def test_the_real_track_is_taken_where_it_is(data_folder):
    if not (data_folder / "whu-car").is_dir():
        pytest.skip("no data set: whu-car")
    place = sites.site(CAR, quick=True)
    assert place.folder == (data_folder / "whu-car").resolve()
    assert place.source == "real, data set whu-car; the first 200 s"
    scenario = place.scenario()
    path = scenario.track.path(scenario.static_s, (0.0, 0.0, 0.0), scenario.world())
    time = np.arange(0.0, path.duration, 0.1)
    assert path.speed(time).sum() * 0.1 == pytest.approx(12_200.0, abs=20.0)
    assert np.abs(path.speed(time) * path.heading(time, 1)).max() < 3.0


def test_table_v_is_the_paper_s_table_vi(without_data):
    """The typed-in tables agree with the means that the paper prints of them."""
    for name, rows in {"wheel-ins": list(b4.PAPER.values()), **b5.PAPER}.items():
        drift, heading = np.mean(rows, axis=0)
        assert drift == pytest.approx(TABLE_VI[name]["drift_mean_percent"], abs=0.006), name
        assert heading == pytest.approx(TABLE_VI[name]["heading_mean_deg"], abs=0.06), name
    for name, rows in b7.TESTS.items():
        drift, heading = np.mean(rows, axis=0)
        assert drift == pytest.approx(b7.PAPER[name]["drift_mean_percent"], abs=0.006)
        assert heading == pytest.approx(b7.PAPER[name]["heading_mean_deg"], abs=0.006)
    # "Body/Wheel-INS exhibits the best position accuracy in the majority of cases (10 out of 16)"
    assert b5.least(b5.PAPER, 0)["body-wheel-ins"] == 10


def test_who_is_best_counts_for_both_where_two_are():
    rows = {"a": [(1.0, 5.0), (2.0, 1.0)], "b": [(1.0, 4.0), (3.0, 2.0)]}
    assert b5.least(rows, 0) == {"a": 2, "b": 1}
    assert b5.least(rows, 1) == {"a": 1, "b": 1}


def test_figures_of_a_system_and_its_parts(without_data, tmp_path):
    document = subsystems.bfig8(quick=True, out=tmp_path)
    assert (tmp_path / "bfig8.html").stat().st_size > 10_000
    assert same_keys(document["paper"], document["polyins"])
    # the chips of a figure are those of the tables, in the order that the page says
    curves = subsystems.FIGURES["bfig8"]
    assert curves.paper["Body/Wheel-INS"] == b5.PAPER["body-wheel-ins"][5]
    assert b5.RUNS["body-wheel-ins"][5] == curves.runs["Body/Wheel-INS"]


def test_a_system_lies_between_its_parts_or_not():
    from synthetic_solutions import drive, solution

    from polyins.evaluation.errors import compare_to_reference
    from polyins.model.geodesy import metres_per_unit
    from polyins.model.recording import Reference

    truth = drive(roll=0.0)
    reference = Reference(truth.time, truth.geodetic, truth.velocity, truth.euler)
    scale = metres_per_unit(truth.geodetic, geodetic=True)

    def off(metres):
        from dataclasses import replace

        moved = replace(solution(truth), position=truth.geodetic + np.array([metres, 0.0, 0.0]) / scale)
        return compare_to_reference(moved, reference)

    inside = subsystems.between({"system": off(2.0), "one": off(1.0), "other": off(-3.0)})
    outside = subsystems.between({"system": off(0.5), "one": off(1.0), "other": off(3.0)})
    assert inside["position"] == 1.0
    assert outside["position"] == 0.0


def test_all_runs_are_drawn(without_data, tmp_path):
    document = bfig10.reproduce(quick=True, out=tmp_path)
    assert same_keys(document["paper"], document["polyins"])
    text = (tmp_path / "bfig10.html").read_text(encoding="utf-8")
    for label in ("left1", "14", "431"):
        assert f'"name":"{label}"' in text
    assert sum(len(labels) for labels in CONFIGURATIONS.values()) == text.count('"mode":"lines+markers"')


def test_costs_are_those_of_the_updates(monkeypatch):
    """An update that costs 30 us, every tenth epoch, makes an epoch 3 us dearer."""

    def per_epoch(recording, method, dense):
        rolling = recording.options.rolling
        dt = float(np.median(np.diff(recording.imus[0].time)))
        factor = (4.0 if "centralized" in method else 1.0) * (2.0 if dense else 1.0)
        return factor * (2.0 + 30.0 * dt / rolling.speed_interval + 10.0 * dt / rolling.constraint_interval)

    monkeypatch.setattr(b8, "_per_epoch", per_epoch)
    monkeypatch.setattr(b8, "QUICK_SECONDS", 61.0)
    document = b8.reproduce(quick=True)
    assert same_keys(document["paper"], document["polyins"])
    structured = document["polyins"]["structured"]
    wanted = {"epoch": 2.35, "prediction": 2.0, "velocity update": 30.0, "constraint update": 10.0}
    assert structured["distributed"] == pytest.approx(wanted)
    assert document["polyins"]["ratio"] == pytest.approx(dict.fromkeys(wanted, 4.0))
    assert structured["times_faster"]["centralized"] == pytest.approx(dict.fromkeys(wanted, 2.0))


def test_vehicles_have_the_lab_s_settings():
    for vehicle, radius in ((ROBOT, 0.097), (CAR, 0.3525)):
        scenario = vehicle.scenario()
        assert {wheel.radius_m for wheel in scenario.wheels} == {radius}
        left, right = scenario.wheels
        assert left.position_m[1] == -right.position_m[1] < 0.0
        assert isinstance(scenario.filter_noise, Noise)
        assert scenario.gnss is None
    # the car's chips are the robot's
    for key in ("noise", "filter_noise", "errors", "static_s"):
        assert getattr(ROBOT.base, key) == getattr(CAR.base, key)
