"""Figures of the reproductions, in the look of the report, as HTML pages of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from polyins.files import whole
from polyins.report.palette import FEW_IMUS
from polyins.report.style import finish

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

HEIGHT = 420


def bars(groups: Mapping[str, Mapping[str, float]], title: str, mode: Literal["group", "stack"]) -> Figure:
    """Return bars, one trace for each name within the groups, beside each other or on top of each other."""
    from plotly.graph_objects import Bar, Figure

    figure = Figure()
    names = list(dict.fromkeys(name for parts in groups.values() for name in parts))
    for k, name in enumerate(names):
        values = [parts.get(name) for parts in groups.values()]
        figure.add_trace(Bar(name=name, x=list(groups), y=values, marker_color=FEW_IMUS[k % len(FEW_IMUS)]))
    figure.update_layout(barmode="relative" if mode == "stack" else "group")
    figure.update_yaxes(title_text=title)
    return finish(figure, HEIGHT)


def lines(
    curves: Mapping[str, tuple[Sequence[float], Sequence[float]]],
    x_title: str,
    y_title: str,
    *,
    logarithmic: bool = False,
    markers: bool = True,
) -> Figure:
    """Return curves by name, each as x and y."""
    from plotly.graph_objects import Figure, Scatter

    figure = Figure()
    for k, (name, (x, y)) in enumerate(curves.items()):
        colour = FEW_IMUS[k % len(FEW_IMUS)]
        mode = "lines+markers" if markers else "lines"
        figure.add_trace(Scatter(name=name, x=list(x), y=list(y), mode=mode, line={"color": colour}))
    figure.update_xaxes(title_text=x_title, type="log" if logarithmic else "linear")
    figure.update_yaxes(title_text=y_title, type="log" if logarithmic else "linear")
    return finish(figure, HEIGHT)


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure as a page that needs no network."""
    with whole(path) as beside:
        figure.write_html(beside, include_plotlyjs=True, config={"displayModeBar": False})
