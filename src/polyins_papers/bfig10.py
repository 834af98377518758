"""Paper B's Fig. 10: the drift rate of all runs of the four configurations over the way travelled."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from polyins.report.palette import imu_colours
from polyins.report.style import finish
from polyins.studies.pictures import write_figure
from polyins_papers.b4 import EXPERIMENT, SEED, SETTINGS
from polyins_papers.b6 import PAPER
from polyins_papers.robot import CONFIGURATIONS, Scores, score_all
from polyins_papers.robot_experiments import EXPERIMENTS
from polyins_papers.sites import site
from polyins_papers.vehicles import ROBOT

STEP_M = 100.0
TITLES = {
    "wheel-ins": "Wheel-INS",
    "dual-wheel-ins": "Dual Wheel-INS",
    "body-wheel-ins": "Body/Wheel-INS",
    "triple-ins": "Triple INS",
}
HEIGHT = 720


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Run all 56 combinations of one robot, draw them into `out`, and return the `bfig10` document."""
    place = site(ROBOT, quick)
    scores = score_all(EXPERIMENTS[EXPERIMENT].recording(place, SEED), CONFIGURATIONS, progress)
    if out is not None:
        write_figure(picture(scores), out / "bfig10.html")
    return {
        "target": "bfig10",
        "paper": {name: {"drift_mean_percent": row["drift_mean_percent"]} for name, row in PAPER.items()},
        "polyins": {name: _figures(scores, name) for name in CONFIGURATIONS},
        "settings": {
            "track": place.source,
            **SETTINGS,
            "after_m": f"multiples of {STEP_M:g} m; mean over the runs",
        },
    }


def _figures(scores: Scores, name: str) -> dict[str, Any]:
    rates = np.array([one.rates_percent for one in scores[name]])
    return {"drift_mean_percent": float(rates.mean()), "drift_percent_by_100_m": rates.mean(axis=0).tolist()}


def picture(scores: Scores) -> Any:
    """Return the picture: a panel for each configuration, a curve for each run, named as the paper does."""
    from plotly.graph_objects import Scatter
    from plotly.subplots import make_subplots

    figure = make_subplots(
        rows=2,
        cols=2,
        shared_xaxes="all",
        shared_yaxes="all",
        subplot_titles=list(TITLES.values()),
        horizontal_spacing=0.04,
        vertical_spacing=0.08,
    )
    for panel, (name, labels) in enumerate(CONFIGURATIONS.items()):
        row, column = divmod(panel, 2)
        for label, one, colour in zip(labels, scores[name], imu_colours(len(labels)), strict=True):
            way = STEP_M * np.arange(1, len(one.rates_percent) + 1)
            trace = Scatter(x=way, y=one.rates_percent, name=chips_of(label), mode="lines+markers", showlegend=False)
            figure.add_trace(
                trace.update(line={"color": colour, "width": 1.2}, marker={"size": 4}), row + 1, column + 1
            )
    figure.update_xaxes(title_text="distance travelled (m)", row=2)
    figure.update_yaxes(title_text="drift rate (%)", col=1)
    return finish(figure, HEIGHT).update_layout(margin={"t": 40})


def chips_of(label: str) -> str:
    """Return the chips of a run as the paper writes them: `12` for the left wheel's first and the right wheel's second.

    A single wheel keeps its side: `left1`.
    """
    modules = label.split("/")[1:]
    return modules[0] if len(modules) == 1 else "".join(name[-1] for name in modules)
