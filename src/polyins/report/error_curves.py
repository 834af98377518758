"""Errors against the reference over time, inside the three-sigma bands that the filter states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.model.attitude import euler_angles, euler_variance
from polyins.report.decimation import kept_for_display, points_per_trace
from polyins.report.figure import Figure, Trace, scatter
from polyins.report.palette import transparent
from polyins.report.scene import Run, Scene
from polyins.report.style import finish, mark_time, stacked

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Curves:
    """Errors of one run and their stated standard deviation, shape (T, 3) each, NaN where unknown."""

    run: Run
    errors: Array
    std: Array


def position_figure(scene: Scene) -> Figure:
    """Draw the position errors, m."""
    curves = [
        Curves(run, run.at_epochs(lambda errors: errors.position), np.sqrt(run.solution.position_variance))
        for run in scene.runs
    ]
    return _figure(scene, curves, ("north (m)", "east (m)", "down (m)"))


def velocity_figure(scene: Scene) -> Figure | None:
    """Draw the velocity errors, m/s; None if the reference has no velocity."""
    if scene.recording.reference is None or scene.recording.reference.velocity is None:
        return None
    curves = [
        Curves(run, run.at_epochs(lambda errors: errors.velocity), np.sqrt(run.solution.velocity_variance))
        for run in scene.runs
    ]
    return _figure(scene, curves, ("north (m/s)", "east (m/s)", "down (m/s)"))


def attitude_figure(scene: Scene) -> Figure:
    """Draw the attitude errors, deg."""
    curves = [
        Curves(run, np.degrees(run.at_epochs(lambda errors: errors.attitude)), _attitude_std_deg(run))
        for run in scene.runs
    ]
    return _figure(scene, curves, ("roll (deg)", "pitch (deg)", "heading (deg)"))


def _attitude_std_deg(run: Run) -> Array:
    euler = euler_angles(run.solution.attitude)
    return np.degrees(np.sqrt(euler_variance(euler, run.solution.phi_covariance)))


def _figure(scene: Scene, curves: Sequence[Curves], titles: Sequence[str]) -> Figure:
    axes = _axes_to_draw(curves)
    figure = stacked([titles[axis] for axis in axes])
    points = points_per_trace(3 * len(axes) * len(curves))
    opacity = 0.14 / np.sqrt(len(curves))
    for row, axis in enumerate(axes):
        bands = [trace for one in curves for trace in _band(scene, one, axis, points, opacity)]
        lines = [_line(scene, one, axis, points, legend=row == 0) for one in curves]
        figure.add([*bands, *lines], row)
    mark_time(figure, scene.duration, scene.shades)
    return finish(figure, height=120 + 175 * len(axes))


def _axes_to_draw(curves: Sequence[Curves]) -> list[int]:
    """Return the axes whose errors are known; all where none is, for the bands' sake."""
    known = [axis for axis in range(3) if any(np.isfinite(one.errors[:, axis]).any() for one in curves)]
    return known or [0, 1, 2]


def _line(scene: Scene, curves: Curves, axis: int, points: int, legend: bool) -> Trace:
    run = curves.run
    drawn = kept_for_display(curves.errors[:, [axis]], points)
    return scatter(
        x=scene.since_start(run.solution.time[drawn]),
        y=curves.errors[drawn, axis].astype(np.float32),
        name=run.label,
        legendgroup=run.label,
        showlegend=legend,
        mode="lines",
        line={"color": run.colour, "dash": run.dash, "width": 1.4},
    )


def _band(scene: Scene, curves: Curves, axis: int, points: int, opacity: float) -> Iterator[Trace]:
    run = curves.run
    drawn = kept_for_display(curves.std[:, [axis]], points)
    for sign, fill in ((1.0, "none"), (-1.0, "tonexty")):
        yield scatter(
            x=scene.since_start(run.solution.time[drawn]),
            y=(sign * 3.0 * curves.std[drawn, axis]).astype(np.float32),
            legendgroup=run.label,
            showlegend=False,
            mode="lines",
            line={"color": transparent(run.colour, 0.35), "width": 0.6},
            fill=fill,
            fillcolor=transparent(run.colour, opacity),
            hoverinfo="skip",
        )
