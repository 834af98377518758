"""Paper B's Table VI: what Wheel-INS gains from a second wheel and from the body, on the robot's and the car's tracks.

Table III's errors but a gyro scale of 0.0015. Nothing is tuned; what differs from the paper is taken apart by
experiments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from polyins.evaluation.errors import compare_to_reference
from polyins.formats.documents import plain
from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.simulation.run import TrueRun, record
from polyins.simulation.scenario import SensorErrors
from polyins.studies.progress import Steps
from polyins_papers.robot import (
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
from polyins_papers.robot_experiments import EXPERIMENTS, Experiment, World, truth
from polyins_papers.sites import Site, site
from polyins_papers.vehicles import CAR, ROBOT

SEEDS = 5
CAR_SEEDS = 3
PREDICTIONS = {"window": "base, window", "end": "base"}
"""experiments, by what the wheel speed is compared with"""
ERROR_FREE = SensorErrors(noise=False, biases=False, scales=False)
ONE_SAMPLE_S = 0.005
WHEELS, WITH_BODY = ("wheel-ins/left1", "wheel-ins/right1"), ("triple-ins/left1/right1/body1",)

PAPER = {
    "wheel-ins": row(0.95, 0.24, 3.09, 0.99),
    "dual-wheel-ins": row(0.82, 0.19, 2.50, 0.97),
    "body-wheel-ins": row(0.69, 0.17, 2.53, 1.14),
    "triple-ins": row(0.73, 0.16, 2.50, 1.16),
}
"""Table VI"""


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run table, car, error-free runs and experiments, and return the `b6` document.

    `quick` takes the first minutes of the drives, one seed and fewer combinations, and leaves the experiments out.
    """
    robot, car = site(ROBOT, quick), site(CAR, quick)
    seeds, car_seeds = (range(1), range(1)) if quick else (range(SEEDS), range(CAR_SEEDS))
    configurations, experiments = (FEW, {}) if quick else (CONFIGURATIONS, EXPERIMENTS)
    exact = error_free_runs(robot, car, quick)
    steps = Steps(progress, len(PREDICTIONS) * (len(seeds) + len(car_seeds)) + len(exact) + len(experiments))
    error_free = {
        name: error_free_run(truth(place, world), labels, steps.next())
        for name, (place, world, labels) in exact.items()
    }
    tables = {key: _scores(name, robot, seeds, configurations, steps) for key, name in PREDICTIONS.items()}
    on_car = {key: table(_scores(name, car, car_seeds, FEW, steps)) for key, name in PREDICTIONS.items()}
    found = {name: run_experiment(experiment, robot, steps.next()) for name, experiment in experiments.items()}
    window, end = tables["window"], tables["end"]
    return {
        "target": "b6",
        "paper": PAPER,
        "polyins": {
            **table(window),
            "by seed": by_seed(window),
            "predicted at the end": {**table(end), "by seed": by_seed(end)},
            "car": {**on_car["window"], "predicted at the end": on_car["end"]},
            "error-free horizontal_max_m": error_free,
            "steepest_deg": {place.vehicle.name: steepest(truth(place)) for place in (robot, car)},
            "experiments": found,
        },
        "settings": {
            "tracks": {"robot": robot.source, "car": car.source},
            "scenarios": {place.vehicle.name: _described(place) for place in (robot, car)},
            **_settings(configurations, experiments),
            "seeds": {"robot": len(seeds), "car": len(car_seeds)},
        },
    }


def _scores(
    experiment: str, place: Site, seeds: Iterable[int], configurations: Configurations, steps: Steps
) -> list[Scores]:
    """Return the scores of each seed."""
    return [score_all(EXPERIMENTS[experiment].recording(place, seed), configurations, steps.next()) for seed in seeds]


def error_free_runs(robot: Site, car: Site, quick: bool) -> dict[str, tuple[Site, World, Sequence[str]]]:
    """Return where the runs without errors are, and of which systems; `quick` has fewer."""
    few: dict[str, tuple[Site, World, Sequence[str]]] = {
        "robot, plane": (robot, "plane", WHEELS),
        "car, plane": (car, "plane", WHEELS),
    }
    if quick:
        return few
    return {
        **few,
        "robot, level": (robot, "level", WHEELS),
        "car, level": (car, "level", WHEELS),
        "robot, turning": (robot, "turning", WHEELS),
        "robot, plane, with the body": (robot, "plane", WITH_BODY),
    }


def error_free_run(
    run: TrueRun, labels: Sequence[str], progress: Callable[[float], None] = lambda _: None
) -> dict[str, float]:
    """Return the greatest horizontal error, m, of the worst of several systems without any errors of the chips."""
    scenario = run.scenario.model_copy(update={"errors": ERROR_FREE})
    recording = record(replace(run, scenario=scenario), seed=0).recording.as_published().without_gate()
    rows = {
        f"{prediction}, {window:g} s": as_in_the_paper(recording, prediction, window)
        for prediction in PREDICTIONS
        for window in (WINDOW, ONE_SAMPLE_S)
    }
    found = {name: max(_horizontal_max(changed, label) for label in labels) for name, changed in rows.items()}
    progress(1.0)
    return found


def steepest(run: TrueRun) -> dict[str, float]:
    """Return the largest roll and pitch of the vehicle, deg."""
    time = np.arange(0.0, run.path.duration, 0.1)
    tilts = {"roll": run.path.roll(time), "pitch": run.path.pitch(time)}
    return {name: float(np.degrees(np.abs(tilt)).max()) for name, tilt in tilts.items()}


def _described(place: Site) -> dict[str, Any]:
    """Return the scenario of a site without where its files are."""
    files = {"track": {"file", "odometer"}}
    described: dict[str, Any] = place.scenario().model_dump(mode="json", exclude=files if place.folder else None)
    return described


def _horizontal_max(recording: Recording, label: str) -> float:
    assert recording.reference is not None
    return float(np.max(compare_to_reference(batch.run(recording, label), recording.reference).horizontal))


def run_experiment(experiment: Experiment, place: Site, progress: Callable[[float], None] = lambda _: None) -> Table:
    """Return the table of an experiment."""
    scores = []
    for seed in range(experiment.seeds):
        scores.append(score_all(experiment.recording(place, seed), FEW))
        progress((seed + 1) / experiment.seeds)
    return table(scores)


def _settings(configurations: Configurations, experiments: dict[str, Experiment]) -> dict[str, Any]:
    settings: dict[str, Any] = plain(
        {
            "runs": {name: len(labels) for name, labels in configurations.items()},
            "runs of the car and the experiments": {name: len(labels) for name, labels in FEW.items()},
            "rolling": ROBOT.base.rolling.model_dump(mode="json"),
            "experiments": {name: experiment.source for name, experiment in experiments.items()},
            "experiment_seeds": {name: experiment.seeds for name, experiment in experiments.items()},
        }
    )
    return settings
