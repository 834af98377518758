"""Paper B's Table VII: Triple INS with a filter for each module against one for all, and whether they are honest.

The separate filters ignore that they are correlated. NEES compares errors with the variances that a filter states.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.errors import Errors
from polyins.formats.documents import plain
from polyins.model.attitude import euler_angles, euler_variance
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.simulation.scenario import SensorErrors
from polyins.studies.progress import Steps
from polyins_papers.robot import WORKERS, Score, body_chip, figures, score, solve
from polyins_papers.robot_experiments import Experiment, grade
from polyins_papers.sites import Site, site
from polyins_papers.vehicles import FILTER_NOISE, GYRO_SCALE_PPM, ROBOT

Array = NDArray[np.float64]

SEEDS = 5
CASE_SEEDS = 2
NO_WEIGHT_M = 1e3
"""std of a reference point that says nothing"""
WHEEL_CHIPS = ((1, 1), (2, 2), (3, 3), (4, 4), (1, 2), (2, 3), (3, 4), (4, 1))
LABELS = tuple(f"triple-ins/left{left}/right{right}/body{body_chip(left, right)}" for left, right in WHEEL_CHIPS)
"""Eight combinations: each chip of each module twice."""
FILTERS = {"distributed": "", "centralized": "/centralized"}


def _wrong_start(recording: Recording, seed: int) -> Recording:
    """Return the recording with a start whose errors are drawn from the deviations that the filter is told."""
    start, rng = recording.start, np.random.default_rng([seed, 1])
    assert start.position is not None
    assert start.heading is not None
    assert start.position_std is not None
    assert start.attitude_std is not None
    off = rng.normal(0.0, start.position_std) / metres_per_unit(start.position, recording.geodetic)
    heading = start.heading + rng.normal(0.0, start.attitude_std[2])
    return replace(recording, start=replace(start, position=start.position + off, heading=float(heading)))


def _without_reference_point(recording: Recording) -> Recording:
    options = recording.options
    return replace(recording, options=replace(options, rolling=replace(options.rolling, constraint_std=NO_WEIGHT_M)))


TABLE = "Table III"
BELIEVED = "as the filter believes"
_BELIEVED = Experiment(
    "chips and start err by just the statistics that the filter is told",
    errors=SensorErrors(),
    noise=FILTER_NOISE,
    predict="window",
)
CASES = {
    TABLE: Experiment("Table III, gyro scale 0.0015, the lab's filter settings", predict="window"),
    f"{TABLE}, predicted at the end": Experiment("as above, predicted at the window's end"),
    f"{TABLE}, filter knows the gyro scale": Experiment(
        "told 1500 ppm instead of 50", filter_noise=grade(gyro_scale_ppm=GYRO_SCALE_PPM), predict="window"
    ),
    BELIEVED: _BELIEVED,
    f"{BELIEVED}, no reference point": replace(
        _BELIEVED, source="as above; the reference point has no weight", change=_without_reference_point
    ),
}

TESTS = {
    "distributed": (
        (0.80, 2.14), (0.76, 1.71), (0.67, 2.96), (0.66, 1.26), (0.56, 1.94), (0.67, 1.25), (0.40, 1.76), (0.46, 0.55)
    ),
    "centralized": (
        (0.63, 1.95), (0.63, 1.51), (0.64, 3.93), (0.55, 1.17), (0.53, 1.03), (0.72, 1.43), (0.53, 2.49), (0.52, 0.76)
    ),
}  # fmt: skip
"""Table VII: drift, percent, and heading RMSE, deg; which chips the tests have the paper does not say"""
PAPER = {
    "distributed": {"drift_mean_percent": 0.62, "heading_mean_deg": 1.70},
    "centralized": {"drift_mean_percent": 0.59, "heading_mean_deg": 1.78},
    "ratio": {"drift": 1.05, "heading": 0.96},
}
"""its means; the ratios are distributed to centralized"""


@dataclass(frozen=True)
class ScoredRun:
    """One run of one filter."""

    score: Score
    position_nees: float
    """of north and east, mean over the epochs; 2 if consistent"""
    heading_nees: float
    """1 if consistent"""


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run both filters over eight combinations, and return the `b7` document.

    `quick` takes the first minutes of the drive, one seed and half of the combinations, and the first case only.
    """
    place = site(ROBOT, quick)
    labels, cases = (LABELS[: len(LABELS) // 2], list(CASES)[:1]) if quick else (LABELS, list(CASES))
    seeds = {name: range(1 if quick else SEEDS if name == TABLE else CASE_SEEDS) for name in cases}
    steps = Steps(progress, sum(map(len, seeds.values())))
    runs = {
        name: [run_both(case_recording(name, place, seed), labels, steps.next()) for seed in seeds[name]]
        for name in cases
    }
    found = {name: _figures(several) for name, several in runs.items()}
    first = {
        name: [(run.score.drift_percent, run.score.heading_deg) for run in some]
        for name, some in runs[TABLE][0].items()
    }
    return {
        "target": "b7",
        "paper": {**PAPER, "tests": _tests(TESTS)},
        "polyins": {
            **found[TABLE],
            "tests": _tests(first),
            "cases": {name: found[name] for name in cases if name != TABLE},
        },
        "settings": plain(
            {
                "track": place.source,
                "seeds": {name: len(several) for name, several in seeds.items()},
                "tests": {f"test {k}": label for k, label in enumerate(labels, 1)},
                "seed of the tests": 0,
                "cases": {name: CASES[name].source for name in cases},
                "nees": "mean over epochs, runs and seeds; position: north and east, 2 if consistent; heading: 1",
            }
        ),
    }


def _tests(rows: Mapping[str, Sequence[tuple[float, float]]]) -> dict[str, dict[str, dict[str, float]]]:
    return {name: figures({f"test {k}": row for k, row in enumerate(several, 1)}) for name, several in rows.items()}


def case_recording(name: str, place: Site, seed: int) -> Recording:
    """Return the recording of a case."""
    recording = CASES[name].recording(place, seed)
    return _wrong_start(recording, seed) if name.startswith(BELIEVED) else recording


def run_both(
    recording: Recording, labels: Sequence[str] = LABELS, progress: Callable[[float], None] = lambda _: None
) -> dict[str, list[ScoredRun]]:
    """Run both filters over combinations, two at a time."""
    runs: list[ScoredRun] = []
    every = [label + ending for ending in FILTERS.values() for label in labels]
    with ThreadPoolExecutor(WORKERS) as pool:
        for run in pool.map(partial(_run, recording), every):
            runs.append(run)
            progress(len(runs) / len(every))
    return {name: runs[k * len(labels) : (k + 1) * len(labels)] for k, name in enumerate(FILTERS)}


def _run(recording: Recording, label: str) -> ScoredRun:
    solution, errors = solve(recording, label)
    position, heading = honesty(solution, errors)
    return ScoredRun(score(errors), float(position.mean()), float(heading.mean()))


def honesty(solution: Solution, errors: Errors) -> tuple[Array, Array]:
    """Return the NEES of north and east, and that of the heading, at the epochs, shape (E,) both, from variances."""
    assert errors.attitude is not None
    variance = solution.position_variance[errors.covered, :2]
    position = np.sum(errors.position[:, :2] ** 2 / variance, axis=1)
    attitude, covariance = solution.attitude[errors.covered], solution.phi_covariance[errors.covered]
    heading_variance = euler_variance(euler_angles(attitude), covariance)[:, 2]
    return position, errors.attitude[:, 2] ** 2 / heading_variance


def _figures(seeds: Sequence[Mapping[str, list[ScoredRun]]]) -> dict[str, Any]:
    means = {name: _means([run for runs in seeds for run in runs[name]]) for name in FILTERS}
    by_seed = [{name: _means(runs[name]) for name in FILTERS} for runs in seeds]
    return {
        **means,
        "ratio": _ratio(means),
        "by seed": {
            **{name: _lists([rows[name] for rows in by_seed]) for name in FILTERS},
            "ratio": _lists([_ratio(rows) for rows in by_seed]),
        },
    }


def _lists(rows: list[dict[str, float]]) -> dict[str, list[float]]:
    return {key: [row[key] for row in rows] for key in rows[0]}


def _means(runs: list[ScoredRun]) -> dict[str, float]:
    return {
        "drift_mean_percent": float(np.mean([run.score.drift_percent for run in runs])),
        "heading_mean_deg": float(np.mean([run.score.heading_deg for run in runs])),
        "position_nees": float(np.mean([run.position_nees for run in runs])),
        "heading_nees": float(np.mean([run.heading_nees for run in runs])),
    }


def _ratio(means: dict[str, dict[str, float]]) -> dict[str, float]:
    one, other = means["distributed"], means["centralized"]
    return {
        "drift": one["drift_mean_percent"] / other["drift_mean_percent"],
        "heading": one["heading_mean_deg"] / other["heading_mean_deg"],
    }
