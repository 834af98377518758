"""What the fixes said against what the filter predicted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polyins.report.decimation import kept_for_display, points_per_trace
from polyins.report.palette import REJECTED, transparent
from polyins.report.scene import Run, Scene
from polyins.report.style import choose, finish, mark_time, stacked
from polyins.solution import Innovations

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

Array = NDArray[np.float64]

AXES = ("north (m)", "east (m)", "down (m)")


def innovation_figure(scene: Scene) -> Figure | None:
    """Draw the residuals with their predicted three sigma, one method at a time; None without fixes.

    The vertical range is that of the accepted residuals; rejected ones beyond it are drawn at the edge.
    """
    runs = [run for run in scene.runs if run.solution.innovations.time.size]
    if not runs:
        return None
    figure = stacked(AXES)
    points = points_per_trace(4 * len(AXES) * len(runs))
    limits = np.max([_limits(run.solution.innovations) for run in runs], axis=0)
    owners = []
    for index, run in enumerate(runs):
        for row in range(len(AXES)):
            traces = [*_band(scene, run, row, points), *_residuals(scene, run, row, limits[row], points)]
            figure.add_traces(traces, rows=row + 1, cols=1)
            owners += [index] * len(traces)
    mark_time(figure, scene.duration, scene.outages)
    finish(figure, height=640)
    for row, limit in enumerate(limits, start=1):
        figure.update_yaxes(range=[-1.05 * limit, 1.05 * limit], row=row)
    choose(figure, [run.label for run in runs], owners)
    return figure


def _limits(innovations: Innovations) -> Array:
    """Return the greatest accepted residual or three sigma, m, shape (3,)."""
    accepted = np.abs(innovations.residual[innovations.accepted])
    limits: Array = np.fmax(3.0 * innovations.std.max(axis=0), accepted.max(axis=0, initial=0.0))
    return limits


def _band(scene: Scene, run: Run, row: int, points: int) -> Iterator[Any]:
    from plotly.graph_objects import Scatter

    innovations = run.solution.innovations
    drawn = kept_for_display(innovations.std[:, [row]], points)
    for sign, fill in ((1.0, None), (-1.0, "tonexty")):
        yield Scatter(
            x=scene.since_start(innovations.time[drawn]),
            y=(sign * 3.0 * innovations.std[drawn, row]).astype(np.float32),
            name="3 sigma",
            legendgroup="3 sigma",
            showlegend=row == 0 and sign > 0.0,
            mode="lines",
            line={"color": transparent(run.colour, 0.5), "width": 0.8},
            fill=fill,
            fillcolor=transparent(run.colour, 0.12),
            hoverinfo="skip",
        )


def _residuals(scene: Scene, run: Run, row: int, limit: float, points: int) -> Iterator[Any]:
    accepted = run.solution.innovations.accepted
    circle = {"color": run.colour, "size": 3.5}
    cross = {"color": REJECTED, "size": 9, "symbol": "x-thin", "line": {"color": REJECTED, "width": 2}}
    yield _markers(scene, run, row, limit, points, accepted, name="residual", marker=circle)
    if not np.all(accepted):
        yield _markers(scene, run, row, limit, points, ~accepted, name="rejected", marker=cross)


def _markers(
    scene: Scene, run: Run, row: int, limit: float, points: int, chosen: NDArray[np.bool_], **style: Any
) -> Any:
    from plotly.graph_objects import Scatter

    innovations = run.solution.innovations
    residual = innovations.residual[chosen, row]
    drawn = kept_for_display(residual[:, None], points)
    return Scatter(
        x=scene.since_start(innovations.time[chosen][drawn]),
        y=np.clip(residual[drawn], -limit, limit).astype(np.float32),
        customdata=residual[drawn].astype(np.float32),
        hovertemplate="%{customdata:.3f} m at %{x:.2f} s",
        legendgroup=style["name"],
        showlegend=row == 0,
        mode="markers",
        **style,
    )
