"""What measurements of one kind said against what the filter predicted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.solution import Innovations
from polyins.report.decimation import kept_for_display, points_per_trace
from polyins.report.figure import Figure, Trace, scatter
from polyins.report.palette import REJECTED, transparent
from polyins.report.scene import Run, Scene
from polyins.report.style import choose, finish, mark_time, stacked

Array = NDArray[np.float64]

FIXES = "GNSS position"
USUAL = 0.95
"""share of the accepted measurements that lie well inside the vertical range"""


def other_kinds(scene: Scene) -> list[str]:
    """Return the kinds of measurement beside GNSS positions that some run was shown."""
    return list(dict.fromkeys(kind for run in scene.runs for kind in run.solution.measurements if kind != FIXES))


def innovation_figure(scene: Scene, kind: str = FIXES) -> Figure | None:
    """Draw the residuals with their predicted three sigma, one method at a time; None without measurements.

    Residuals beyond the vertical range are drawn at its edge.
    """
    shown = [(run, one) for run in scene.runs if (one := run.solution.measurements.get(kind)) and one.time.size]
    if not shown:
        return None
    axes, unit = shown[0][1].axes, shown[0][1].unit
    figure = stacked([f"{axis} ({unit})" for axis in axes])
    points = points_per_trace(4 * len(axes) * len(shown))
    limits = np.max([_limits(one) for _, one in shown], axis=0)
    owners = []
    for index, (run, one) in enumerate(shown):
        for row in range(len(axes)):
            traces = [
                _three_sigma(scene, run, one, row, points),
                *_residuals(scene, run, one, row, limits[row], points),
            ]
            figure.add(traces, row)
            owners += [index] * len(traces)
    mark_time(figure, scene.duration, scene.shades)
    finish(figure, height=100 + 180 * len(axes))
    for axis, limit in zip(figure.axes("y"), limits, strict=True):
        axis["range"] = [-1.05 * limit, 1.05 * limit]
    choose(figure, [run.label for run, _ in shown], owners)
    return figure


def _limits(innovations: Innovations) -> Array:
    """Return half the height of each row, shape (A,): the few fixes that end an outage do not decide it."""
    accepted = innovations.accepted
    if not accepted.any():
        return np.asarray(3.0 * innovations.std.max(axis=0), dtype=float)
    reach = np.fmax(3.0 * innovations.std[accepted], np.abs(innovations.residual[accepted]))
    return np.asarray(np.fmin(1.5 * np.quantile(reach, USUAL, axis=0), reach.max(axis=0)), dtype=float)


def _three_sigma(scene: Scene, run: Run, innovations: Innovations, row: int, points: int) -> Trace:
    """Draw a bar for each fix, not a band: between fixes, above all in outages, nothing was predicted."""
    drawn = kept_for_display(innovations.std[:, [row]], points)
    bars = {
        "array": (3.0 * innovations.std[drawn, row]).astype(np.float32),
        "color": transparent(run.colour, 0.17),
        "thickness": float(np.clip(900.0 / drawn.size, 1.0, 5.0)),
        "width": 0,
    }
    return scatter(
        x=scene.since_start(innovations.time[drawn]),
        y=np.zeros(drawn.size, dtype=np.float32),
        error_y=bars,
        name="3 sigma",
        legendgroup="3 sigma",
        showlegend=row == 0,
        mode="markers",
        marker={"color": transparent(run.colour, 0.4), "size": 1},
        hoverinfo="skip",
    )


def _residuals(
    scene: Scene, run: Run, innovations: Innovations, row: int, limit: float, points: int
) -> Iterator[Trace]:
    accepted = innovations.accepted
    circle = {"color": run.colour, "size": 3.5}
    cross = {"color": REJECTED, "size": 9, "symbol": "x-thin", "line": {"color": REJECTED, "width": 2}}
    yield _markers(scene, innovations, row, limit, points, accepted, name="residual", marker=circle)
    if not np.all(accepted):
        yield _markers(scene, innovations, row, limit, points, ~accepted, name="rejected", marker=cross)


def _markers(
    scene: Scene, innovations: Innovations, row: int, limit: float, points: int, chosen: NDArray[np.bool_], **style: Any
) -> Trace:
    residual = innovations.residual[chosen, row]
    drawn = kept_for_display(residual[:, None], points)
    return scatter(
        x=scene.since_start(innovations.time[chosen][drawn]),
        y=np.clip(residual[drawn], -limit, limit).astype(np.float32),
        customdata=residual[drawn].astype(np.float32),
        hovertemplate=f"%{{customdata:.3f}} {innovations.unit} at %{{x:.2f}} s",
        legendgroup=style["name"],
        showlegend=row == 0,
        mode="markers",
        **style,
    )
