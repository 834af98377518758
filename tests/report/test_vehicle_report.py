"""The report of runs with wheels: drift over distance, what is known of attitude, gaps in an IMU's data."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plotted import plotted
from synthetic_solutions import drifting, drive, recording, reference

from polyins.evaluation.summary import comparison, on_wheels, summarize
from polyins.model.attitude import rotation_matrices
from polyins.model.geodesy import displacement
from polyins.model.recording import Recording
from polyins.report import write_report
from polyins.report.drift_curves import drift_figure
from polyins.report.error_curves import attitude_figure, position_figure
from polyins.report.imu_errors import imu_error_figure
from polyins.report.palette import SILENCE
from polyins.report.scene import Scene
from polyins.report.tables import figures_table
from polyins.report.trajectory import trajectory_figure

ANTENNA = np.array([0.3, 0.2, -1.0])
METHODS = {"wheel-ins": 1, "triple-ins/imu1/imu2": 3}
TRUTH = drive(duration=100.0)


@pytest.fixture(scope="module")
def driven() -> Recording:
    """800 m by dead reckoning, with a reference of position and heading; imu2 is silent for two seconds."""
    heading_only = TRUTH.euler * [np.nan, np.nan, 1.0]
    of_antenna = replace(reference(TRUTH), velocity=None, attitude=heading_only, lever_arm=ANTENNA)
    made = recording(TRUTH, 3, (), gnss=None, reference=of_antenna)
    silent = (TRUTH.time > 1040.0) & (TRUTH.time < 1042.0)
    quiet = replace(made.imus[1], time=TRUTH.time[~silent])
    return replace(made, imus=(made.imus[0], quiet, made.imus[2]))


@pytest.fixture(scope="module")
def runs(driven: Recording) -> dict:
    solutions = {}
    for seed, (name, imus) in enumerate(METHODS.items()):
        made = drifting(TRUTH, name, imus, 0.05, ((1050.0, 1090.0),), seed)
        solutions[name] = replace(made, measurements={})
    return {name: (made, summarize(made, driven.reference)) for name, made in solutions.items()}


@pytest.fixture(scope="module")
def scene(runs: dict, driven: Recording) -> Scene:
    return Scene.of(runs, driven, None)


def test_methods_with_wheels_are_known_by_their_name():
    assert on_wheels({"method": "body-wheel-ins/IMU4"})
    assert not on_wheels({"method": "enav-fusion"})
    assert not on_wheels({"method": "from-elsewhere"})


def test_the_dots_of_the_drift_figure_are_what_the_rate_is_the_mean_of(scene):
    figure = plotted(drift_figure(scene))
    assert len(figure.data) == 2 * len(scene.runs)
    for run, curve, dots in zip(scene.runs, figure.data[::2], figure.data[1::2], strict=True):
        rate = run.summary["drift"]["rate_percent"]
        assert rate > 0.1
        np.testing.assert_array_equal(dots.x, 100.0 * np.arange(1, 8))
        assert np.mean(dots.y) == pytest.approx(rate)
        assert f"{run.name} (mean {rate:.2f} %)" == curve.name
        np.testing.assert_allclose(np.interp(dots.x, curve.x, curve.y), dots.y, rtol=0.01)


def test_without_wheels_or_reference_there_is_no_drift_figure(scene, made_runs, made_recording):
    assert drift_figure(Scene.of(made_runs, made_recording, None)) is None
    blind = tuple(replace(run, errors=None) for run in scene.runs)
    assert drift_figure(replace(scene, runs=blind)) is None


def test_only_known_attitude_errors_have_a_row(scene):
    figure = plotted(attitude_figure(scene))
    titles = [axis.title.text for axis in figure.select_yaxes()]
    assert titles == ["heading (deg)"]
    assert {trace.name for trace in figure.data if trace.name} == set(METHODS)
    assert len(list(plotted(position_figure(scene)).select_yaxes())) == 3


def test_tracks_are_drawn_at_the_point_that_the_reference_follows(scene):
    run = scene.runs[0]
    at_own_point = displacement(run.solution.position, scene.origin, True)
    moved = at_own_point + rotation_matrices(run.solution.attitude) @ ANTENNA
    (track,) = [trace for trace in plotted(trajectory_figure(scene)).data if trace.name == run.name]
    np.testing.assert_allclose([track.y[0], track.x[0]], moved[0, :2], atol=1e-3)
    np.testing.assert_allclose([track.y[-1], track.x[-1]], moved[-1, :2], atol=1e-3)


def test_gaps_in_the_data_of_an_imu_that_navigates_are_shaded(scene):
    (shape,) = plotted(position_figure(scene)).layout.shapes
    assert (shape.x0, shape.x1) == (pytest.approx(40.0, abs=0.06), pytest.approx(42.0, abs=0.06))
    assert shape.fillcolor == SILENCE
    assert len(plotted(imu_error_figure(scene)).layout.shapes) == 3
    alone = replace(scene, runs=scene.runs[:1])
    assert plotted(position_figure(alone)).layout.shapes == ()


def test_the_table_shows_drift_with_wheels_only(scene, made_runs, made_recording):
    table = figures_table(scene, None)
    column = table.headings.index("drift rate (%)")
    figures = [f"{run.summary['drift']['rate_percent']:.2f}" for run in scene.runs]
    assert [cells[column] for _, _, cells in table.rows] == figures
    assert not {"roll rmse (deg)", "NIS GNSS", "fixes rejected"} & set(table.headings)
    assert "drift rate (%)" not in figures_table(Scene.of(made_runs, made_recording, None), None).headings


def test_the_page_has_no_section_without_content(runs: dict, driven: Recording, tmp_path: Path):
    summaries = {name: summary for name, (_, summary) in runs.items()}
    compared = comparison(summaries, [summaries["wheel-ins"]] * 2, "wheel-ins")
    write_report(tmp_path / "report.html", Scene.of(runs, driven, compared), compared)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    sections = re.findall(r'<div class="plot[^"]*"><div>.*?id="plot-(\w+)"', text, re.DOTALL)
    assert sections == ["trajectory", "drift", "position", "attitude", "imus"]
    assert "no data from imu2" in text
    assert "figures of <em>wheel-ins</em> are over all IMUs" in text
    assert "error, wheel-ins / method" in text


def test_a_curve_is_labelled_with_its_own_rate_where_the_summary_is_over_several(runs: dict, driven: Recording):
    single, triple = (summary for _, summary in runs.values())
    other = {**single, "drift": {**single["drift"], "rate_percent": 9.0}}
    compared = comparison({"triple-ins": triple}, [single, other], "wheel-ins")
    scene = Scene.of({"wheel-ins": runs["wheel-ins"]}, driven, compared)
    assert scene.runs[0].summary["drift"]["rate_percent"] > 4.5
    assert plotted(drift_figure(scene)).data[0].name == f"wheel-ins (mean {single['drift']['rate_percent']:.2f} %)"
