"""What all figures have in common: fonts, axes, legend, the shading of outages."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from polyins.report.scene import Shade

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

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


def finish(figure: Figure, height: int) -> Figure:
    """Give the figure the page's look."""
    figure.update_layout(height=height, template=_look())
    return figure


@cache
def _look() -> Any:
    """Return the template of all figures, which is validated once and not figure by figure."""
    from plotly.graph_objects import layout

    return layout.Template(
        layout={
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
    )


def stacked(rows: Sequence[str], columns: int = 1, column_titles: Sequence[str] | None = None) -> Figure:
    """Return an empty figure of rows that share the time axis, each with its title (with the unit) on the left."""
    from plotly.subplots import make_subplots

    figure = make_subplots(
        rows=len(rows),
        cols=columns,
        shared_xaxes="all",
        vertical_spacing=0.035,
        horizontal_spacing=0.07,
        column_titles=column_titles,
    )
    for row, title in enumerate(rows, start=1):
        figure.update_yaxes(title_text=title, row=row, col=1)
    figure.update_xaxes(title_text=TIME_TITLE, row=len(rows))
    return figure


def mark_time(figure: Figure, duration: float, shades: Sequence[Shade], columns: int = 1) -> None:
    """Let the time axes span the run, and shade what is marked behind all rows of each column."""
    figure.update_xaxes(range=[0.0, duration])
    axes = ["x", *(f"x{column}" for column in range(2, columns + 1))]
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
        trace.visible = owner == first
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
