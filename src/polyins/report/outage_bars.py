"""Each outage's maximum horizontal error, side by side for the methods."""

from __future__ import annotations

from polyins.report.figure import Figure, Trace
from polyins.report.scene import Run, Scene
from polyins.report.style import finish


def outage_figure(scene: Scene) -> Figure | None:
    """Draw the bars; None without outages or without a figure for any of them."""
    if not any(value is not None for run in scene.runs for value in run.summary["outages"]["each_m"]):
        return None
    intervals = [f"{begin:.1f} s to {end:.1f} s" for begin, end in scene.outages]
    bars: list[Trace] = [
        {
            "type": "bar",
            "x": list(range(1, len(intervals) + 1)),
            "y": run.summary["outages"]["each_m"],
            "name": _label(run),
            "marker": {"color": run.colour, "line": {"width": 0}},
            "customdata": intervals,
            "hovertemplate": "%{y:.2f} m<br>outage %{x}, %{customdata}",
        }
        for run in scene.runs
    ]
    figure = finish(Figure(bars), height=380)
    ticks = min(30, len(intervals) + 1)
    figure.update_layout(
        barmode="group",
        bargap=max(0.25, 0.8 - 0.05 * len(intervals) * len(bars)),
        xaxis={"title": {"text": "outage"}, "tickformat": "d", "nticks": ticks, "showgrid": False},
        yaxis={"title": {"text": "max. horizontal error (m)"}, "rangemode": "tozero"},
    )
    return figure


def _label(run: Run) -> str:
    value = run.summary["outages"]["horizontal_max_rms_m"]
    return run.label if value is None else f"{run.label} (rms {value:.2f} m)"
