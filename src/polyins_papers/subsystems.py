"""Paper B's Figs. 7 to 9: errors over time of a system of several IMUs and of each of its IMUs by itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from polyins.evaluation.errors import Errors
from polyins.report.palette import FEW_IMUS
from polyins.report.style import TIME_TITLE, finish
from polyins.studies.pictures import write_figure
from polyins_papers.b4 import EXPERIMENT, SEED, SETTINGS
from polyins_papers.robot import figures, score, solve
from polyins_papers.robot_experiments import EXPERIMENTS
from polyins_papers.sites import site
from polyins_papers.vehicles import ROBOT


@dataclass(frozen=True)
class SubsystemFigure:
    """What a figure draws."""

    runs: Mapping[str, str]
    """labels, by the names of the curves; the system first"""
    paper: Mapping[str, tuple[float, float]]
    """drift, percent, and heading RMSE, deg, of the runs that the tables list"""


FIGURES = {
    "bfig7": SubsystemFigure(
        {
            "Dual Wheel-INS": "dual-wheel-ins/left1/right4",
            "Left Wheel-INS": "wheel-ins/left1",
            "Right Wheel-INS": "wheel-ins/right4",
        },
        {
            "Dual Wheel-INS": (0.56, 0.95),
            "Left Wheel-INS": (0.59, 1.93),
            "Right Wheel-INS": (1.00, 2.28),
        },
    ),
    "bfig8": SubsystemFigure(
        {
            "Body/Wheel-INS": "body-wheel-ins/left2/body2",
            "Left Wheel-INS": "wheel-ins/left2",
            "Body-INS": "body-ins/left2/body2",
        },
        {
            "Body/Wheel-INS": (0.72, 1.20),
            "Left Wheel-INS": (1.34, 3.82),
        },
    ),
    "bfig9": SubsystemFigure(
        {
            "Triple INS": "triple-ins/left1/right2/body4",
            "Left Wheel-INS": "wheel-ins/left1",
            "Right Wheel-INS": "wheel-ins/right2",
            "Body-INS": "body-ins/left1/body4",
        },
        {
            "Triple INS": (0.73, 1.50),
            "Left Wheel-INS": (0.59, 1.93),
            "Right Wheel-INS": (1.19, 2.52),
        },
    ),
}

HEIGHT = 520
EVERY = 5
"""epochs of the reference from one drawn point to the next"""


def reproduce(
    target: str,
    quick: bool = False,
    progress: Callable[[float], None] | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """Run the system of a figure and its parts; draw them into `out`; return the document."""
    curves = FIGURES[target]
    place = site(ROBOT, quick)
    recording = EXPERIMENTS[EXPERIMENT].recording(place, SEED)
    errors: dict[str, Errors] = {}
    for name, label in curves.runs.items():
        errors[name] = solve(recording, label)[1]
        if progress:
            progress(len(errors) / len(curves.runs))
    if out is not None:
        write_figure(picture(errors), out / f"{target}.html")
    scores = {name: score(one) for name, one in errors.items()}
    return {
        "target": target,
        "paper": figures(curves.paper),
        "polyins": {
            **figures({name: (one.drift_percent, one.heading_deg) for name, one in scores.items()}),
            "share of the time between the least and the largest error of the parts": between(errors),
        },
        "settings": {
            "track": place.source,
            **SETTINGS,
            "runs": dict(curves.runs),
            "paper": "Tables IV and V, whose tests are taken to count the left wheel's chip slowest",
        },
    }


bfig7, bfig8, bfig9 = (partial(reproduce, name) for name in FIGURES)


def between(errors: Mapping[str, Errors]) -> dict[str, float]:
    """Return how much of the time the first one's error, without its sign, lies within those of the others."""
    (_, system), *parts = errors.items()
    return {
        "position": _within(system.horizontal, [part.horizontal for _, part in parts]),
        "heading": _within(_heading_deg(system), [_heading_deg(part) for _, part in parts]),
    }


def _within(values: Any, others: list[Any]) -> float:
    return float(np.mean((values >= np.min(others, axis=0)) & (values <= np.max(others, axis=0))))


def _heading_deg(errors: Errors) -> Any:
    assert errors.attitude is not None
    return np.degrees(errors.attitude[:, 2])


def picture(errors: Mapping[str, Errors]) -> Any:
    """Return the picture: horizontal error, m, over heading error, deg."""
    from plotly.graph_objects import Scatter
    from plotly.subplots import make_subplots

    figure = make_subplots(rows=2, cols=1, shared_xaxes="all", vertical_spacing=0.035)
    figure.update_yaxes(title_text="horizontal error (m)", row=1)
    figure.update_yaxes(title_text="heading error (deg)", row=2)
    figure.update_xaxes(title_text=TIME_TITLE, row=2)
    for k, (name, one) in enumerate(errors.items()):
        time = (one.time - one.time[0])[::EVERY]
        line = {"color": FEW_IMUS[k], "width": 2.8 if k == 0 else 1.2}
        for row, values in enumerate((one.horizontal, _heading_deg(one)), 1):
            trace = Scatter(x=time, y=values[::EVERY], name=name, legendgroup=name, mode="lines", line=line)
            figure.add_trace(trace.update(showlegend=row == 1), row=row, col=1)
    return finish(figure, HEIGHT)
