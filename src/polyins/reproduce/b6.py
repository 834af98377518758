"""Paper B's Tables IV to VI: a robot with four chips in each of three modules, every configuration of them, simulated.

Real track and speeds (data set whu-robot), Table III's errors but a gyro scale of 0.0015. Nothing is tuned; what
differs from the paper is taken apart by experiments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins import batch, datasets
from polyins.evaluation.errors import compare_to_reference
from polyins.evaluation.summary import plain
from polyins.recording import Recording, RollingOptions
from polyins.reproduce.robot import (
    CONFIGURATIONS,
    FEW,
    WINDOW,
    Configurations,
    Scores,
    Table,
    as_in_the_paper,
    by_seed,
    row,
    score_all,
    table,
)
from polyins.reproduce.robot_experiments import EXPERIMENTS, Experiment, World, truth
from polyins.simulation.robot import FILTER_NOISE, chips
from polyins.simulation.run import record
from polyins.simulation.scenario import Errors

SEEDS = 5
PREDICTIONS = ("window", "end")
ERROR_FREE = Errors(noise=False, biases=False, scales=False)
ONE_SAMPLE_S = 0.005

PAPER = {
    "wheel-ins": row(0.95, 0.24, 3.09, 0.99),
    "dual-wheel-ins": row(0.82, 0.19, 2.50, 0.97),
    "body-wheel-ins": row(0.69, 0.17, 2.53, 1.14),
    "triple-ins": row(0.73, 0.16, 2.50, 1.16),
}
"""Table VI"""


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run the tables, the error-free run and the experiments, and return the `b6` document.

    `quick` takes one seed and fewer combinations, and leaves the experiments out. Raises InputError if the data set is
    not there.
    """
    folder = datasets.fetch("whu-robot")
    seeds = range(1 if quick else SEEDS)
    configurations, experiments = (FEW, {}) if quick else (CONFIGURATIONS, EXPERIMENTS)
    steps = iter(np.linspace(0.0, 1.0, 2 + len(seeds) + len(experiments))[1:].tolist())

    def done() -> None:
        if progress:
            progress(next(steps))

    worlds: tuple[World, ...] = ("plane",) if quick else ("plane", "turning")
    error_free = {world: error_free_run(folder, world) for world in worlds}
    done()
    over_window, at_end = _scores(folder, seeds, configurations, done)
    found = {}
    for name, experiment in experiments.items():
        found[name] = run_experiment(experiment, folder)
        done()
    return {
        "target": "b6",
        "paper": PAPER,
        "polyins": {
            **table(over_window),
            "by seed": by_seed(over_window),
            "predicted at the end": {**table(at_end), "by seed": by_seed(at_end)},
            "error-free horizontal_max_m": error_free,
            "experiments": found,
        },
        "settings": _settings(len(seeds), configurations, experiments, quick),
    }


def _scores(
    folder: Path, seeds: Iterable[int], configurations: Configurations, done: Callable[[], None]
) -> list[list[Scores]]:
    """Return the scores of each seed, for each of the two predictions."""
    found: list[list[Scores]] = [[] for _ in PREDICTIONS]
    for seed in seeds:
        recording = record(truth(folder, "plane"), seed=seed).recording
        for prediction, runs in zip(PREDICTIONS, found, strict=True):
            runs.append(score_all(as_in_the_paper(recording, prediction), configurations))
        done()
    return found


def error_free_run(folder: Path, world: World) -> dict[str, float]:
    """Return the greatest horizontal error, m, of Wheel-INS on each wheel without any errors of the chips."""
    run = truth(folder, world)
    scenario = run.scenario.model_copy(update={"errors": ERROR_FREE})
    recording = record(replace(run, scenario=scenario), seed=0).recording
    rows = {
        f"{prediction}, {window:g} s": as_in_the_paper(recording, prediction, window)
        for prediction in PREDICTIONS
        for window in (WINDOW, ONE_SAMPLE_S)
    }
    labels = [f"wheel-ins/{side}1" for side in ("left", "right")]
    return {name: max(_horizontal_max(changed, label) for label in labels) for name, changed in rows.items()}


def _horizontal_max(recording: Recording, label: str) -> float:
    assert recording.reference is not None
    return float(np.max(compare_to_reference(batch.run(recording, label), recording.reference).horizontal))


def run_experiment(experiment: Experiment, folder: Path) -> Table:
    """Return the table of an experiment."""
    return table([score_all(experiment.recording(folder, seed), FEW) for seed in range(experiment.seeds)])


def _settings(
    seeds: int, configurations: Configurations, experiments: dict[str, Experiment], quick: bool
) -> dict[str, Any]:
    settings: dict[str, Any] = plain(
        {
            "seeds": seeds,
            "runs": {name: len(labels) for name, labels in configurations.items()},
            "rolling": {**asdict(RollingOptions()), "standstill": False},
            "chips": chips().model_dump(mode="json"),
            "filter": FILTER_NOISE.model_dump(mode="json"),
            "experiments": {name: experiment.source for name, experiment in experiments.items()},
            "experiment_seeds": {name: experiment.seeds for name, experiment in experiments.items()},
            "experiment_runs": {name: len(labels) for name, labels in FEW.items()},
            "quick": quick,
        }
    )
    return settings
