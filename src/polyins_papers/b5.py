"""Paper B's Table V: sixteen combinations of chips each for Dual Wheel-INS, Body/Wheel-INS and Triple INS."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from polyins_papers.b4 import EXPERIMENT, SEED, SETTINGS
from polyins_papers.robot import CONFIGURATIONS, figures, score_all, spread
from polyins_papers.robot_experiments import EXPERIMENTS
from polyins_papers.sites import site
from polyins_papers.vehicles import ROBOT

Rows = Mapping[str, Sequence[tuple[float, float]]]
"""drift, percent, and heading RMSE, deg, of each test of each configuration"""

RUNS = {name: labels for name, labels in CONFIGURATIONS.items() if name != "wheel-ins"}
_DRIFT = {
    "dual-wheel-ins": "0.60 0.80 0.68 0.56 0.97 1.11 0.75 0.85 1.08 1.09 0.93 0.88 0.71 0.71 0.85 0.53",
    "body-wheel-ins": "0.46 0.56 0.54 0.52 0.96 0.72 0.92 0.96 0.82 0.65 0.79 0.84 0.57 0.56 0.53 0.57",
    "triple-ins": "0.57 0.73 0.56 0.51 0.87 0.93 0.71 0.70 1.01 0.95 0.81 0.78 0.72 0.61 0.72 0.45",
}
_HEADING = {
    "dual-wheel-ins": "2.12 1.62 2.86 0.95 2.02 2.33 3.55 2.13 2.81 2.46 4.37 1.46 3.22 2.19 4.27 1.66",
    "body-wheel-ins": "1.42 1.58 1.62 1.49 2.13 1.20 1.19 2.07 3.44 2.39 2.22 3.99 4.04 3.74 3.56 4.41",
    "triple-ins": "2.11 1.50 2.77 0.91 2.24 1.97 4.02 1.76 2.76 2.12 4.79 1.25 3.54 2.08 4.51 1.60",
}
PAPER: Rows = {
    name: list(zip(map(float, _DRIFT[name].split()), map(float, _HEADING[name].split()), strict=True)) for name in RUNS
}
"""in the order of the tests; which chips they are the paper does not say"""


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run the combinations of one robot, whose errors a seed draws, and return the `b5` document."""
    place = site(ROBOT, quick)
    scores = score_all(EXPERIMENTS[EXPERIMENT].recording(place, SEED), RUNS, progress)
    found = {name: [(one.drift_percent, one.heading_deg) for one in several] for name, several in scores.items()}
    return {
        "target": "b5",
        "paper": _table(PAPER),
        "polyins": _table(found),
        "settings": {
            "track": place.source,
            **SETTINGS,
            "tests": {name: [label.partition("/")[2] for label in labels] for name, labels in RUNS.items()},
            "order": "the paper does not say which chips a test has; ours count the left wheel's slowest",
        },
    }


def _table(rows: Rows) -> dict[str, Any]:
    tests = {
        name: {**figures({f"test {k}": row for k, row in enumerate(several, 1)}), **spread(several)}
        for name, several in rows.items()
    }
    return {**tests, "tests with the least drift": least(rows, 0), "tests with the least heading error": least(rows, 1)}


def least(rows: Rows, figure: int) -> dict[str, int]:
    """Return in how many tests each configuration has the least of a figure; where two share it, both count."""
    columns = {name: [row[figure] for row in several] for name, several in rows.items()}
    lowest = [min(values) for values in zip(*columns.values(), strict=True)]
    return {
        name: sum(value == low for value, low in zip(values, lowest, strict=True)) for name, values in columns.items()
    }
