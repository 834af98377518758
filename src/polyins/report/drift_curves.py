"""How far vehicles drift per distance travelled, as in paper B's Fig. 10."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polyins.evaluation.drift import STEP, drift_curve, drift_rates
from polyins.report.decimation import kept_for_display, points_per_trace
from polyins.report.figure import Figure, Trace, scatter
from polyins.report.scene import Run, Scene
from polyins.report.style import finish

DRAWN_FROM = 0.05
"""share of the way: before it, any error is a large part of the distance"""


def drift_figure(scene: Scene) -> Figure | None:
    """Draw the curves, percent over m, with marks where the rate is taken; None without wheels or reference."""
    runs = [run for run in scene.runs if run.on_wheels and run.errors is not None and run.errors.time.size]
    if not runs:
        return None
    figure = Figure([trace for run in runs for trace in _traces(run, points_per_trace(len(runs)))])
    finish(figure, height=440)
    figure.update_layout(
        xaxis={"title": {"text": "distance travelled (m)"}, "rangemode": "tozero"},
        yaxis={"title": {"text": "drift rate (%)"}, "rangemode": "tozero"},
    )
    return figure


def _traces(run: Run, points: int) -> Iterator[Trace]:
    assert run.errors is not None
    distance, rate = run.errors.distance, drift_curve(run.errors)
    known = np.flatnonzero((distance > DRAWN_FROM * distance[-1]) & np.isfinite(rate))
    drawn = known[kept_for_display(rate[known, None], points)]
    multiples, rates = drift_rates(run.errors, run.summary["drift"].get("step_m") or STEP)
    yield scatter(
        x=distance[drawn].astype(np.float32),
        y=rate[drawn].astype(np.float32),
        # the summary of a method may be over several runs; this is one
        name=f"{run.label} (mean {rates.mean():.2f} %)" if rates.size else run.label,
        legendgroup=run.label,
        mode="lines",
        line={"color": run.colour, "dash": run.dash, "width": 1.8},
        hovertemplate="%{y:.3f} % after %{x:.0f} m",
    )
    yield scatter(
        x=multiples,
        y=rates,
        name=run.label,
        legendgroup=run.label,
        showlegend=False,
        mode="markers",
        marker={"color": run.colour, "size": 6},
        hovertemplate="%{y:.3f} % after %{x:.0f} m",
    )
