"""Paper B's Table IV: Wheel-INS with each chip of each wheel of the robot by itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from polyins_papers.robot import CONFIGURATIONS, figures, score_all, spread
from polyins_papers.robot_experiments import EXPERIMENTS
from polyins_papers.sites import site
from polyins_papers.vehicles import ROBOT

EXPERIMENT = "base, window"
SEED = 0
SETTINGS = {"chips": "Table III, gyro scale 0.0015, one draw", "seed": SEED, "predict": "window"}
"""of the tables and figures that show single runs"""

LABELS = CONFIGURATIONS["wheel-ins"]
PAPER = {
    "left C1": (0.59, 1.93),
    "left C2": (1.34, 3.82),
    "left C3": (0.88, 2.62),
    "left C4": (0.75, 4.44),
    "right C1": (1.00, 2.69),
    "right C2": (1.19, 2.52),
    "right C3": (0.88, 4.41),
    "right C4": (1.00, 2.28),
}
"""drift, percent, and heading RMSE, deg, in the order of the labels"""


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run the eight wheel IMUs of one robot, whose errors a seed draws, and return the `b4` document."""
    place = site(ROBOT, quick)
    recording = EXPERIMENTS[EXPERIMENT].recording(place, SEED)
    scores = score_all(recording, {"wheel-ins": LABELS}, progress)["wheel-ins"]
    found = [(one.drift_percent, one.heading_deg) for one in scores]
    return {
        "target": "b4",
        "paper": {**figures(PAPER), **spread(list(PAPER.values()))},
        "polyins": {**figures(dict(zip(PAPER, found, strict=True))), **spread(found)},
        "settings": {
            "track": place.source,
            **SETTINGS,
            "runs": LABELS,
        },
    }
