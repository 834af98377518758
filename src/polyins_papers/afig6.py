"""Paper A, Fig. 6: where the robot drives in the nonrigid tests A and B, as simulated.

The paper's own trajectory is not public: its robot goes round a playground, ours to and fro on straights.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from polyins.model.geodesy import metres_per_unit
from polyins.simulation.scenario import Scenario
from polyins.studies.pictures import lines, write_figure
from polyins.studies.progress import Steps
from polyins.studies.rigid_array import Array
from polyins_papers import nonrigid

TESTS = ("test A", "test B")
INTERVAL = 0.2
"""s between the points of a curve"""


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Return length and extent of both paths; `quick` takes the first 330 s. `out` is the folder for the picture."""
    steps = Steps(progress, len(TESTS))
    tracks = {}
    for test in TESTS:
        tracks[test] = track(nonrigid.scenario_of(test, quick))
        steps.next()(1.0)
    if out is not None:
        curves = {test: (way[:, 1].tolist(), way[:, 0].tolist()) for test, way in tracks.items()}
        figure = lines(curves, "east (m)", "north (m)", markers=False)
        figure.update_yaxes(scaleanchor="x")
        write_figure(figure, out / "afig6-tracks.html")
    return {
        "target": "afig6",
        "paper": {},
        "polyins": {
            test: {
                "length_m": float(np.hypot(*np.diff(way, axis=0).T).sum()),
                "north_m": float(np.ptp(way[:, 0])),
                "east_m": float(np.ptp(way[:, 1])),
            }
            for test, way in tracks.items()
        },
        "settings": {test: nonrigid.scenario_of(test, quick).model_dump(mode="json") for test in TESTS},
    }


def track(scenario: Scenario) -> Array:
    """Return the way of the array origin, m north and east from the start, shape (T, 2)."""
    assert scenario.shuttle is not None
    path = scenario.shuttle.path(scenario.duration_s, scenario.static_s, scenario.start_position(), scenario.world())
    position = path.position(np.arange(0.0, path.duration, INTERVAL))
    return np.asarray(((position - position[0]) * metres_per_unit(position[0], scenario.earth == "turning"))[:, :2])
