"""Paper B's robot run, simulated: which chips each configuration takes, how runs are scored and averaged."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from polyins.evaluation.drift import drift_rates
from polyins.evaluation.errors import Errors, compare_to_reference, rms
from polyins.model.recording import Recording, Reference
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins_papers.vehicles import ROBOT

CHIPS = (1, 2, 3, 4)
PAIRS = tuple(product(CHIPS, CHIPS))
WINDOW = ROBOT.base.rolling.speed_window_s
"""s"""
WORKERS = 2
"""Threads: the filter's loop runs without Python's lock."""

Configurations = dict[str, tuple[str, ...]]
"""labels of the runs of each configuration"""
Table = dict[str, dict[str, float]]


def body_chip(left: int, right: int) -> int:
    """Return the body's chip of a combination of wheel chips: each is taken four times, chip c where both are c."""
    return (2 * left - right - 1) % len(CHIPS) + 1


CONFIGURATIONS: Configurations = {
    "wheel-ins": tuple(f"wheel-ins/{side}{chip}" for side in ("left", "right") for chip in CHIPS),
    "dual-wheel-ins": tuple(f"dual-wheel-ins/left{left}/right{right}" for left, right in PAIRS),
    "body-wheel-ins": tuple(f"body-wheel-ins/left{left}/body{body}" for left, body in PAIRS),
    "triple-ins": tuple(f"triple-ins/left{left}/right{right}/body{body_chip(left, right)}" for left, right in PAIRS),
}
"""The 8, 16, 16 and 16 runs of paper B's Tables IV and V."""

FEW: Configurations = {
    name: labels if name == "wheel-ins" else labels[:: len(CHIPS) + 1] for name, labels in CONFIGURATIONS.items()
}
"""Each chip once: 8, 4, 4 and 4 runs, for experiments."""


@dataclass(frozen=True)
class Score:
    """The figures of one run."""

    drift_percent: float
    """mean over the multiples of 100 m"""
    heading_deg: float
    """RMSE"""
    rates_percent: tuple[float, ...] = ()
    """drift after each 100 m"""


Scores = dict[str, list[Score]]
"""of the runs of each configuration"""


def as_in_the_paper(recording: Recording, predict: str = "window", window: float = WINDOW) -> Recording:
    """Return the recording to be run without updates at standstills, which paper B does not have.

    `predict` and `window`, s, are those of the wheel speed, see `RollingOptions`.
    """
    options = recording.options
    rolling = replace(options.rolling, standstill=False, predict=predict, speed_window=window)
    return replace(recording, options=replace(options, rolling=rolling))


def at_the_reference(solution: Solution, reference: Reference) -> Solution:
    """Return the solution at the epochs of the reference, which is what it is judged by."""
    wanted = reference.time
    rows = np.searchsorted(solution.time, wanted[wanted >= solution.time[0]] - 1e-6)
    rows = rows[rows < solution.time.size]
    return replace(
        solution,
        time=solution.time[rows],
        position=solution.position[rows],
        velocity=solution.velocity[rows],
        attitude=solution.attitude[rows],
        position_variance=solution.position_variance[rows],
        velocity_variance=solution.velocity_variance[rows],
        phi_covariance=solution.phi_covariance[rows],
    )


def solve(recording: Recording, label: str) -> tuple[Solution, Errors]:
    """Run a method and return its solution and its errors at the epochs of the reference."""
    reference = recording.reference
    assert reference is not None  # a simulated recording has one
    solution = at_the_reference(batch.run(recording, label), reference)
    return solution, compare_to_reference(solution, reference)


def score(errors: Errors) -> Score:
    """Return drift rate and heading error."""
    rates, attitude = drift_rates(errors)[1], errors.attitude
    assert attitude is not None
    return Score(float(np.mean(rates)), rms(np.degrees(attitude[:, 2])) or 0.0, tuple(rates.tolist()))


def score_all(
    recording: Recording, configurations: Configurations, progress: Callable[[float], None] | None = None
) -> Scores:
    """Run every combination of every configuration, two at a time."""
    labels = [label for several in configurations.values() for label in several]
    scores: list[Score] = []
    with ThreadPoolExecutor(WORKERS) as pool:
        for one in pool.map(lambda label: score(solve(recording, label)[1]), labels):
            scores.append(one)
            if progress:
                progress(len(scores) / len(labels))
    found = iter(scores)
    return {name: [next(found) for _ in several] for name, several in configurations.items()}


def figures(rows: Mapping[str, tuple[float, float]]) -> dict[str, dict[str, float]]:
    """Return rows of drift, percent, and heading error, deg, by name."""
    return {name: {"drift_percent": rate, "heading_deg": heading} for name, (rate, heading) in rows.items()}


def spread(rows: Sequence[tuple[float, float]]) -> dict[str, dict[str, float]]:
    """Return mean and standard deviation of such rows."""
    mean, std = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1)
    return figures({"mean": (float(mean[0]), float(mean[1])), "std": (float(std[0]), float(std[1]))})


def table(runs: Sequence[Scores]) -> Table:
    """Return mean and standard deviation of the figures of each configuration over the runs of all seeds."""
    return {name: _row([one for seed in runs for one in seed[name]]) for name in runs[0]}


def by_seed(runs: Sequence[Scores]) -> dict[str, dict[str, list[float]]]:
    """Return the means of each seed."""
    rows = [table([seed]) for seed in runs]
    return {
        name: {key: [row[name][key] for row in rows] for key in ("drift_mean_percent", "heading_mean_deg")}
        for name in runs[0]
    }


def _row(scores: list[Score]) -> dict[str, float]:
    figures = np.array([(one.drift_percent, one.heading_deg) for one in scores])
    (rate, heading), (rate_std, heading_std) = figures.mean(axis=0), figures.std(axis=0, ddof=1)
    return row(float(rate), float(rate_std), float(heading), float(heading_std))


def row(drift_mean: float, drift_std: float, heading_mean: float, heading_std: float) -> dict[str, float]:
    """Return a row of a table from its four figures, percent and deg."""
    return {
        "drift_mean_percent": drift_mean,
        "drift_std_percent": drift_std,
        "heading_mean_deg": heading_mean,
        "heading_std_deg": heading_std,
    }
