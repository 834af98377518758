"""What all figures have in common: fonts, axes, legend, the shading of outages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from polyins.report.figure import Figure, axis_name, panels
from polyins.report.scene import Shade

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
INK = "#1F2430"
TIME_TITLE = "time since start (s)"
AXES = {
    "gridcolor": "#E8EBF0",
    "zerolinecolor": "#C5CBD6",
    "zerolinewidth": 1,
    "linecolor": "#C5CBD6",
    "ticks": "outside",
    "ticklen": 4,
    "tickcolor": "#C5CBD6",
    "automargin": True,
    "title": {"standoff": 15},
}


LOOK = {
    "layout": {
        "font": {"family": FONT, "size": 12.5, "color": INK},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "margin": {"l": 64, "r": 16, "t": 16, "b": 48},
        "legend": {
            "orientation": "h",
            "x": 0.0,
            "y": 1.02,
            "yanchor": "bottom",
            "groupclick": "togglegroup",
            "itemsizing": "constant",
        },
        "hoverlabel": {"font": {"family": FONT}},
        "hovermode": "closest",
        "showlegend": True,
        "xaxis": AXES,
        "yaxis": AXES,
    }
}
"""Plotly's template of all figures"""


def finish(figure: Figure, height: int) -> Figure:
    """Give the figure, which may also be one of Plotly's own, the page's look."""
    figure.update_layout(height=height, template=LOOK)
    return figure


def stacked(rows: Sequence[str], columns: Sequence[str] = ("",)) -> Figure:
    """Return an empty figure of rows that share the time axis, each with its title (with the unit) on the left."""
    figure = panels(len(rows), len(columns), between_rows=0.035, between_columns=0.07)
    x_axes, y_axes = figure.axes("x"), figure.axes("y")
    for axis, title in zip(y_axes[:: len(columns)], rows, strict=True):
        axis["title"] = {"text": title}
    for axis in x_axes[-len(columns) :]:
        axis["title"] = {"text": TIME_TITLE}
    headings = [_heading(title, axis["domain"]) for title, axis in zip(columns, x_axes, strict=False) if title]
    figure.update_layout(annotations=headings)
    return figure


def _heading(title: str, domain: Sequence[float]) -> dict[str, Any]:
    place = {"x": sum(domain) / 2.0, "xref": "paper", "y": 1.0, "yref": "paper", "yanchor": "bottom", "yshift": 2}
    return {"text": title, "showarrow": False, "font": {"size": 16}, **place}


def mark_time(figure: Figure, duration: float, shades: Sequence[Shade], columns: int = 1) -> None:
    """Let the time axes span the run, and shade what is marked behind all rows of each column."""
    for axis in figure.axes("x"):
        axis["range"] = [0.0, duration]
    axes = [axis_name("x", column) for column in range(columns)]
    figure.update_layout(shapes=[_rectangle(shade, axis) for shade in shades for axis in axes])


def _rectangle(shade: Shade, axis: str) -> dict[str, Any]:
    return {
        "type": "rect",
        "x0": shade.begin,
        "x1": shade.end,
        "xref": axis,
        "y0": 0.0,
        "y1": 1.0,
        "yref": "paper",
        "fillcolor": shade.colour,
        "line": {"width": 0},
        "layer": "below",
    }


def choose(figure: Figure, labels: Sequence[str], owners: Sequence[int], first: int = 0) -> None:
    """Add a menu that shows the traces of one choice at a time; `owners` says to which choice each trace belongs.

    The legend moves below the figure: the menu takes its place.
    """
    buttons = [
        {"label": label, "method": "restyle", "args": [{"visible": [owner == choice for owner in owners]}]}
        for choice, label in enumerate(labels)
    ]
    for trace, owner in zip(figure.data, owners, strict=True):
        trace["visible"] = owner == first
    figure.update_layout(
        legend={"y": 0.0, "yref": "container", "yanchor": "bottom"},
        margin={"t": 72 if len(labels) > 1 else 56, "b": 100},
    )
    if len(labels) > 1:
        figure.update_layout(
            updatemenus=[
                {
                    "buttons": buttons,
                    "active": first,
                    "x": 0.0,
                    "xanchor": "left",
                    "y": 1.0,
                    "yanchor": "bottom",
                    "pad": {"b": 28},
                    "bgcolor": "white",
                    "bordercolor": "#C5CBD6",
                }
            ]
        )
