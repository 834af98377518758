"""The errors that the filter estimated for each IMU."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np

from polyins.model.rig import DEG, HOUR, MGAL, PPM
from polyins.report.decimation import kept_for_display, points_per_trace
from polyins.report.figure import Figure, Trace, scatter
from polyins.report.palette import imu_colours
from polyins.report.scene import Run, Scene
from polyins.report.style import choose, finish, mark_time, stacked

ROWS = ("gyro bias (deg/h)", "accel. bias (mGal)", "gyro scale (ppm)", "accel. scale (ppm)")
UNITS = np.repeat([DEG / HOUR, MGAL, PPM, PPM], 3)
POINTS = 60_000


def imu_error_figure(scene: Scene) -> Figure | None:
    """Draw bias and scale errors by kind and axis, one method at a time; None if there are none."""
    runs = [run for run in scene.runs if run.solution.imu_error_time.size]
    if not runs:
        return None
    figure = stacked(ROWS, columns=("x", "y", "z"))
    points = points_per_trace(12 * sum(len(run.solution.imu_names) for run in runs), POINTS)
    owners = []
    for index, run in enumerate(runs):
        for state in range(12):
            traces = list(_traces(scene, run, state, points))
            figure.add(traces, state)
            owners += [index] * len(traces)
    mark_time(figure, scene.duration, scene.shades, columns=3)
    finish(figure, height=860)
    most = int(np.argmax([len(run.solution.imu_names) for run in runs]))
    choose(figure, [run.label for run in runs], owners, first=most)
    return figure


def _traces(scene: Scene, run: Run, state: int, points: int) -> Iterator[Trace]:
    names = run.solution.imu_names
    for imu, (name, colour) in enumerate(zip(names, imu_colours(len(names)), strict=True)):
        values = run.solution.imu_errors[:, imu, state] / UNITS[state]
        drawn = kept_for_display(values[:, None], points)
        yield scatter(
            x=scene.since_start(run.solution.imu_error_time[drawn]),
            y=values[drawn].astype(np.float32),
            name=escape(name),
            legendgroup=escape(name),
            showlegend=state == 0,
            mode="lines",
            line={"color": colour, "width": 1.6 if len(names) <= 4 else 1.0},
        )
