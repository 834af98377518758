"""The figures hold the data that they claim to show."""

from dataclasses import replace

import numpy as np
import pytest
from plotted import plotted
from synthetic_solutions import RADIUS_M, drive, of_fixes

from polyins.report.error_curves import attitude_figure, position_figure, velocity_figure
from polyins.report.imu_errors import imu_error_figure
from polyins.report.innovations import innovation_figure
from polyins.report.outage_bars import outage_figure
from polyins.report.palette import METHOD_COLOURS, imu_colours, method_styles
from polyins.report.scene import Scene
from polyins.report.trajectory import trajectory_figure


@pytest.fixture(scope="module")
def scene(made_runs, made_recording, compared) -> Scene:
    return Scene.of(made_runs, made_recording, compared)


@pytest.fixture(scope="module")
def blind(made_runs, made_recording) -> Scene:
    """Neither reference nor fixes nor outages."""
    bare = replace(made_recording, reference=None, gnss=None, outages=())
    made, summary = made_runs["enav-fusion"]
    nothing = {**summary, "outages": {"count": 0, "length_s": None, "horizontal_max_rms_m": None, "each_m": []}}
    quiet = replace(made, measurements={}, imu_error_time=np.zeros(0), imu_errors=np.zeros((0, 6, 12)))
    return Scene.of({"enav-fusion": (quiet, nothing)}, bare, None)


def named(figure, name: str) -> list:
    return [trace for trace in figure.data if trace.name == name]


def test_the_track_is_drawn_in_metres_with_equal_scales(scene):
    figure = plotted(trajectory_figure(scene))
    (reference,) = named(figure, "reference")
    assert np.ptp(reference.x) == pytest.approx(2.0 * RADIUS_M, rel=1e-3)
    assert np.ptp(reference.y) == pytest.approx(2.0 * RADIUS_M, rel=1e-3)
    assert figure.layout.yaxis.scaleanchor == "x"
    assert [trace.name for trace in figure.data[-5:-1]] == [run.name for run in scene.runs]


def test_rejected_fixes_are_drawn_once_where_they_were_measured(scene):
    (rejected,) = named(plotted(trajectory_figure(scene)), "rejected fixes")
    truth = drive(duration=300.0)
    times = scene.runs[0].solution.innovations.time[[5, 40]]
    where = truth.local[np.searchsorted(truth.time, times)]
    np.testing.assert_allclose(np.column_stack([rejected.y, rejected.x]), where[:, :2], atol=0.02)
    assert "rejected by single, imu-fusion, nav-fusion, enav-fusion" in rejected.text[0]


def test_only_the_track_inside_outages_is_marked(scene):
    (marked,) = named(plotted(trajectory_figure(scene)), "GNSS outage")
    assert np.isnan(marked.x).any()
    assert not np.isnan(marked.x).all()


def test_error_curves_reach_the_peaks_of_the_errors(scene):
    figure = plotted(position_figure(scene))
    for run in scene.runs:
        lines = named(figure, run.name)
        assert len(lines) == 3
        for row, line in enumerate(lines):
            assert np.nanmax(np.abs(line.y)) == pytest.approx(np.max(np.abs(run.errors.position[:, row])), rel=1e-6)
            assert line.line.color == METHOD_COLOURS[run.name]


def test_bands_are_three_standard_deviations(scene):
    bands = [
        trace
        for trace in plotted(position_figure(scene)).data
        if trace.legendgroup == "nav-fusion" and trace.name is None
    ]
    assert len(bands) == 6
    widest = 3.0 * np.sqrt(scene.runs[2].solution.position_variance.max())
    assert max(np.max(band.y) for band in bands) == pytest.approx(widest, rel=1e-6)
    assert min(np.min(band.y) for band in bands) == pytest.approx(-widest, rel=1e-6)


def test_attitude_errors_are_in_degrees(scene):
    line = named(plotted(attitude_figure(scene)), "single")[2]
    assert np.max(np.abs(line.y)) == pytest.approx(np.degrees(0.002), rel=1e-3)


def test_time_runs_from_the_start_and_outages_are_shaded(scene):
    figure = plotted(position_figure(scene))
    assert [(shape.x0, shape.x1) for shape in figure.layout.shapes] == [(30.0, 60.0), (120.0, 150.0), (210.0, 240.0)]
    assert figure.layout.xaxis.range == (0.0, 300.0)


def test_bars_are_the_outages_maxima(scene, compared):
    figure = plotted(outage_figure(scene))
    for bar, run in zip(figure.data, scene.runs, strict=True):
        assert list(bar.y) == compared["methods"][run.name]["outages"]["each_m"]
        assert f"rms {run.summary['outages']['horizontal_max_rms_m']:.2f} m" in bar.name


def test_imu_errors_are_drawn_for_each_imu_in_datasheet_units(scene):
    figure = plotted(imu_error_figure(scene))
    shown = [trace for trace in figure.data if trace.visible]
    assert len(shown) == 6 * 12
    assert [trace.name for trace in shown[:6]] == [f"imu{k}" for k in range(1, 7)]
    largest = np.max(scene.runs[2].solution.imu_errors[:, 0, 0]) * 180.0 / np.pi * 3600.0
    assert np.max(shown[0].y) == pytest.approx(largest, rel=1e-6)
    in_ppm = np.max(scene.runs[2].solution.imu_errors[:, 0, 11]) * 1e6
    assert np.max(shown[66].y) == pytest.approx(in_ppm, rel=1e-6)


def test_each_choice_of_the_menu_shows_one_run(scene):
    figure = plotted(innovation_figure(scene))
    (menu,) = figure.layout.updatemenus
    masks = np.array([button.args[0]["visible"] for button in menu.buttons])
    assert masks.shape == (4, len(figure.data))
    np.testing.assert_array_equal(masks.sum(axis=0), 1)


def test_rejected_residuals_stay_in_sight_and_tell_their_value(scene):
    figure = plotted(innovation_figure(scene))
    rejected = named(figure, "rejected")[0]
    assert np.all(np.abs(rejected.y) <= figure.layout.yaxis.range[1])
    assert np.all(rejected.customdata > 2.5)


def test_three_sigma_are_drawn_at_the_fixes_and_not_between(scene):
    bars = [trace for trace in plotted(innovation_figure(scene)).data if trace.name == "3 sigma"]
    innovations = scene.runs[0].solution.innovations
    np.testing.assert_allclose(bars[0].error_y.array, 3.0 * innovations.std[:, 0], rtol=1e-6)
    np.testing.assert_allclose(bars[0].x, innovations.time - 1000.0, atol=1e-3)
    assert not any(30.0 <= x <= 60.0 for x in bars[0].x)


def test_the_fix_after_an_outage_does_not_flatten_the_others(made_runs, made_recording):
    made, summary = made_runs["single"]
    shown = made.innovations
    residual = shown.residual.copy()
    residual[60, 0] = -500.0
    scene = Scene.of(
        {"single": (replace(made, measurements=of_fixes(replace(shown, residual=residual))), summary)},
        made_recording,
        None,
    )
    figure = plotted(innovation_figure(scene))
    assert figure.layout.yaxis.range[1] < 1.0
    drawn = named(figure, "residual")[0]
    assert np.min(drawn.y) >= figure.layout.yaxis.range[0]
    assert np.min(drawn.customdata) == -500.0


def test_a_run_that_rejected_every_fix_is_drawn(made_runs, made_recording):
    made, summary = made_runs["single"]
    none = replace(made.innovations, accepted=np.zeros_like(made.innovations.accepted))
    scene = Scene.of({"single": (replace(made, measurements=of_fixes(none)), summary)}, made_recording, None)
    assert len(named(plotted(innovation_figure(scene)), "rejected")) == 3


def test_without_reference_fixes_or_outages_the_rest_is_drawn(blind):
    assert [trace.name for trace in plotted(trajectory_figure(blind)).data] == ["enav-fusion"]
    assert outage_figure(blind) is None
    assert velocity_figure(blind) is None
    assert imu_error_figure(blind) is None
    assert innovation_figure(blind) is None
    lines = named(plotted(position_figure(blind)), "enav-fusion")
    assert all(np.isnan(line.y).all() for line in lines)


def test_a_solution_that_diverged_is_drawn_as_far_as_it_goes(made_runs, made_recording):
    made, summary = made_runs["enav-fusion"]
    position = made.position.copy()
    position[3000:] = np.nan
    broken = replace(made, position=position, position_variance=np.where(np.isnan(position), np.inf, 1.0))
    scene = Scene.of({"enav-fusion": (broken, summary)}, made_recording, None)
    line = named(plotted(position_figure(scene)), "enav-fusion")[0]
    last = np.max(line.x[~np.isnan(line.y)])
    assert last == pytest.approx(made.time[2999] - made.time[0])
    (track,) = named(plotted(trajectory_figure(scene)), "enav-fusion")
    assert np.isfinite(track.x).sum() > 500


def test_names_are_drawn_as_they_are_written(made_runs, made_recording):
    made, summary = made_runs["nav-fusion"]
    odd = replace(made, imu_names=("<b>bold</b>", *made.imu_names[1:]))
    scene = Scene.of({"a<i>b": (odd, summary)}, made_recording, None)
    assert named(plotted(position_figure(scene)), "a&lt;i&gt;b")
    assert named(plotted(imu_error_figure(scene)), "&lt;b&gt;bold&lt;/b&gt;")


def test_each_method_has_a_colour_of_its_own_and_repeated_ones_a_dash():
    array = ["single", "imu-fusion", "nav-fusion", "enav-fusion", "enav-fusion-shared-mechanization"]
    wheels = ["wheel-ins", "body-ins", "dual-wheel-ins", "body-wheel-ins", "triple-ins", "multi-wheel-ins"]
    for family in (array, wheels):
        assert len({colour for colour, _ in method_styles(family)}) == len(family)
    both = method_styles(["wheel-ins/IMU2", "wheel-ins/IMU4", "unheard-of"])
    assert both[0] == (METHOD_COLOURS["wheel-ins"], "solid")
    assert both[1] == (METHOD_COLOURS["wheel-ins"], "dash")
    assert both[2][0] not in METHOD_COLOURS.values()


@pytest.mark.parametrize("count", [1, 8, 9, 100])
def test_imus_have_different_colours(count):
    assert len(set(imu_colours(count))) == count
