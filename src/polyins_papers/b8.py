"""Paper B's Table VIII: what Triple INS costs per epoch and per update, with a filter for each module or one for all.

An update cannot be timed by itself inside the compiled loop: the more often it comes the dearer are the epochs, and the
difference over how often it came is its cost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.studies.progress import Steps
from polyins.tools import bench

Array = NDArray[np.float64]

ROUNDS, SECONDS = 7, 120.0
QUICK_ROUNDS, QUICK_SECONDS = 3, 70.0
"""the first minute at rest is not navigated"""
EVERY = 10
"""epochs between two updates that are timed"""
NEVER_S = 1e9
FILTERS = {"distributed": "triple-ins", "centralized": "triple-ins/centralized"}
DENSE, STRUCTURED = "dense", "structured"

PAPER_US = {
    "distributed": {"epoch": 120.0, "velocity update": 98.0, "constraint update": 91.0},
    "centralized": {"epoch": 1027.0, "velocity update": 694.0, "constraint update": 690.0},
}
"""on an i7-7700HQ at 2.8 GHz"""
FIGURES = ("epoch", "prediction", "velocity update", "constraint update")


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Time both filters in both forms, in turns, and return the `b8` document."""
    rounds, seconds = (QUICK_ROUNDS, QUICK_SECONDS) if quick else (ROUNDS, SECONDS)
    recording = bench.vehicle(seconds)
    cases = [(method, form == DENSE) for form in (DENSE, STRUCTURED) for method in FILTERS.values()]
    steps = Steps(progress, (rounds + 1) * len(cases))
    cost = np.array([[figures(recording, *case, steps.next()) for case in cases] for _ in range(rounds + 1)])[1:]
    dense, structured = cost[:, :2], cost[:, 2:]
    return {
        "target": "b8",
        "paper": _with_ratio(PAPER_US),
        "polyins": {
            **_table(dense),
            STRUCTURED: {**_table(structured), "times_faster": _times_faster(dense, structured)},
        },
        "settings": {
            "us": "CPU time, of three IMUs together; of how many the paper's updates are it does not say",
            "epoch": "at 200 Hz with wheel speed at 2 Hz and the reference point at 1 Hz",
            "updates": f"by how much dearer epochs are where it comes every {EVERY} of them; medians of {rounds}",
            "seconds": seconds,
            "machine": bench.machine(),
        },
    }


def figures(
    recording: Recording, method: str, dense: bool, progress: Callable[[float], None] = lambda _: None
) -> list[float]:
    """Return the CPU time, us, of what `FIGURES` names."""
    often = EVERY * float(np.median(np.diff(recording.imus[0].time)))
    rolling = recording.options.rolling
    paper = (rolling.speed_interval, rolling.constraint_interval)
    cost = []
    for speed, constraint in (paper, (NEVER_S, NEVER_S), (often, NEVER_S), (NEVER_S, often)):
        cost.append(_per_epoch(_with_intervals(recording, speed, constraint), method, dense))
        progress(len(cost) / len(FIGURES))
    epoch, prediction, with_speed, with_constraint = cost
    return [epoch, prediction, EVERY * (with_speed - prediction), EVERY * (with_constraint - prediction)]


def _with_intervals(recording: Recording, speed: float, constraint: float) -> Recording:
    """Return the recording with times from one update to the next, s, of wheel speed and reference point."""
    options = recording.options
    rolling = replace(options.rolling, standstill=False, speed_interval=speed, constraint_interval=constraint)
    return replace(recording, options=replace(options, rolling=rolling))


def _per_epoch(recording: Recording, method: str, dense: bool) -> float:
    solution = batch.navigate(batch.prepare(recording, method, dense_covariance=dense))
    return 1e6 * solution.filter_s / len(solution.time)


def _table(cost: Array) -> dict[str, dict[str, float]]:
    """Return the medians over the rounds of costs, us, shape (R, 2, 4), and those of the ratios within a round."""
    median, ratio = np.median(cost, axis=0), np.median(cost[:, 1] / cost[:, 0], axis=0)
    return {**{name: _row(row) for name, row in zip(FILTERS, median, strict=True)}, "ratio": _row(ratio)}


def _times_faster(dense: Array, structured: Array) -> dict[str, dict[str, float]]:
    faster = np.median(dense / structured, axis=0)
    return {name: _row(row) for name, row in zip(FILTERS, faster, strict=True)}


def _row(values: Array) -> dict[str, float]:
    return dict(zip(FIGURES, map(float, values), strict=True))


def _with_ratio(us: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    one, other = us["distributed"], us["centralized"]
    return {**us, "ratio": {name: other[name] / one[name] for name in one}}
