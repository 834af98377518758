"""A car with IMUs on its wheels and its body, by dead reckoning: every method with wheels over the data set WID."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.config.yaml_document import read_yaml
from polyins.errors import InputError
from polyins.evaluation.drift import drift
from polyins.evaluation.errors import Errors, rms
from polyins.evaluation.summary import summarize
from polyins.formats.columns import read_columns
from polyins.formats.documents import plain
from polyins.model.attitude import euler_angles, rotation_matrices, wrap
from polyins.model.methods import find_method
from polyins.model.recording import Recording
from polyins.model.rig import DEG, HOUR, Imu, Rig
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.navigate.choice import choose
from polyins.reading import datasets
from polyins.screen import number, print_table

Array = NDArray[np.float64]
Scores = dict[str, float | None]

METHODS = {
    "wheel-ins/IMU2": "wheel-ins/IMU2",
    "wheel-ins/IMU4": "wheel-ins/IMU4",
    "body-ins": "body-ins/IMU2",
    "dual-wheel-ins": "dual-wheel-ins/IMU2/IMU4",
    "body-wheel-ins/IMU2": "body-wheel-ins/IMU2",
    "body-wheel-ins/IMU4": "body-wheel-ins/IMU4",
    "triple-ins": "triple-ins/IMU2/IMU4",
    "multi-wheel-ins": "multi-wheel-ins",
}
"""What is run, by its name in the document."""
FURTHER = {
    "wheel-ins/IMU2_radial": "wheel-ins/IMU2_radial",
    "wheel-ins/IMU4_radial": "wheel-ins/IMU4_radial",
    "dual-wheel-ins/centralized": "dual-wheel-ins/IMU2/IMU4/centralized",
    "triple-ins/centralized": "triple-ins/IMU2/IMU4/centralized",
}
"""IMUs off the centre of their wheels, and joined covariances."""

STEERED = ("wheel-ins/IMU1", "wheel-ins/IMU3")
"""Controls: a front wheel turns with the steering, so its heading is not the car's."""
WITHOUT_BIAS = ("wheel-ins/IMU2", "body-ins")
"""Controls: a spinning wheel averages its gyro biases out, the body does not (paper B, rotation modulation)."""
NO_BIAS = "no static gyro bias"
CONFIDENT = "taken for calibrated"
CALIBRATED_STD = 100.0 * DEG / HOUR
"""rad/s, `init_gb_deg_h` of the data set: what is left of a gyro bias once a standstill's mean is taken off"""

FIGURES = {
    "rate_percent": "drift\n%",
    "rate_50m_percent": "at 50 m\n%",
    "end_percent": "end\n%",
    "heading_rmse_deg": "heading\ndeg",
}
STEPS_M = (100.0, 50.0)
DRIVING = 1.5
"""m/s: slower than this the reference's heading does not count"""


@dataclass(frozen=True)
class ReferenceAtFixes:
    """The reference of one trial at its fixes."""

    time: Array
    """s, shape (R,)"""
    north_east: Array
    """of the antenna, m, shape (R, 2)"""
    usable: NDArray[np.bool_]
    """shape (R,)"""
    heading: Array
    """rad, shape (R,)"""
    speed: Array
    """m/s, shape (R,)"""
    distance: Array
    """m travelled, shape (R,)"""


@dataclass(frozen=True)
class Trial:
    """One drive."""

    number: str
    recording: Recording
    track: ReferenceAtFixes


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Run every method over every trial that the data folder lists, and return the `wid` document.

    `quick` takes the first trial only; `out`: a folder in which each trial leaves a report. Raises InputError if the
    data set is not there.
    """
    folder = datasets.fetch("wid")
    numbers = list_trials(folder)[: 1 if quick else None]
    trials: dict[str, dict[str, Scores]] = {}
    controls: dict[str, dict[str, Scores]] = {}
    settings: dict[str, Any] = {}
    for done, name in enumerate(numbers, 1):
        trial = load_trial(folder, name)
        solutions = run_all(trial)
        trials[name] = {method: score(solution, trial) for method, solution in solutions.items()}
        controls[name] = {method: score(solution, trial) for method, solution in run_controls(trial).items()}
        settings = _settings(trial.recording)
        if out is not None:
            drawn = {method: solution for method, solution in solutions.items() if method in METHODS}
            _write_report(out / f"wid-trial{name}.html", trial, drawn)
        if progress:
            progress(done / len(numbers))
    return {
        "target": "wid",
        "paper": {},
        "polyins": {
            "trials": plain(trials),
            "mean": plain(mean(trials.values())),
            "controls": plain(mean(controls.values())),
            "controls_by_trial": plain(controls),
        },
        "settings": {**settings, "trials": numbers, "methods": METHODS | FURTHER},
    }


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print the figures of the document: a table of the methods and one of the controls, a row for each."""
    for title, means, trials in (
        ("mean of the trials, and the drift in each", figures["mean"], figures["trials"]),
        ("controls, which have to fail", figures["controls"], figures["controls_by_trial"]),
    ):
        columns = [*FIGURES.values(), *(f"drift\n{name}, %" for name in trials)]
        rows = [
            [name, *(number(scores[key]) for key in FIGURES), *(_drift_in(trial, name) for trial in trials.values())]
            for name, scores in means.items()
        ]
        print_table(f"wid: {title}", ["method", *columns], rows)


def _drift_in(trial: Mapping[str, Scores], name: str) -> str:
    return number(trial[name]["rate_percent"]) if name in trial else "-"


def list_trials(folder: Path) -> list[str]:
    """Return the numbers of the trials in `calibration.yaml` that are more than a smoke test."""
    path = folder / "calibration.yaml"
    if not path.is_file():
        raise InputError(f"{path}: is missing; expected the calibration with its trials")
    trials = read_yaml(path).values.get("trials", {})
    numbers = [str(number) for number, trial in trials.items() if "smoke" not in str(trial.get("role", ""))]
    if not numbers:
        raise InputError(f"{path}: lists no trial to score; expected some under the key trials")
    return numbers


def load_trial(folder: Path, number: str) -> Trial:
    """Read a trial, to be run with paper B's settings: no updates at standstills."""
    recording = datasets.wid(f"trial{number}")
    options = recording.options
    rolling = replace(options.rolling, standstill=False)
    recording = replace(recording, options=replace(options, rolling=rolling))
    return Trial(number, recording, read_track(folder / f"trial{number}" / "reference.csv"))


def read_track(path: Path) -> ReferenceAtFixes:
    """Read a trial's `reference.csv`; raise InputError if a column or any usable fix is missing."""
    wanted = ("time_s", "antenna_north_m", "antenna_east_m", "usable", "heading_deg", "speed_m_s", "distance_m")
    _, (time, north, east, usable, heading_deg, speed, distance) = read_columns(path, wanted)
    return ReferenceAtFixes(time, np.column_stack([north, east]), usable > 0.0, heading_deg * DEG, speed, distance)


def run_all(trial: Trial) -> dict[str, Solution]:
    """Run the methods that the trial has the sensors for."""
    rig = trial.recording.rig
    wanted = METHODS | FURTHER
    return {name: batch.run(trial.recording, label) for name, label in wanted.items() if _possible(label, rig)}


def run_controls(trial: Trial) -> dict[str, Solution]:
    """Run what has to fail: steered wheels, and filters without the static gyro biases.

    The latter know how large these chips' turn-on biases are; as a further row they take them for calibrated.
    """
    recording = trial.recording
    bare = replace(recording, start=replace(recording.start, estimate_gyro_bias=False))
    confident = replace(bare, rig=replace(bare.rig, imus=tuple(_confident(imu) for imu in bare.rig.imus)))
    wanted = {name: (recording, name) for name in STEERED}
    wanted |= {f"{name}, {NO_BIAS}": (bare, METHODS[name]) for name in WITHOUT_BIAS}
    wanted |= {f"{name}, {NO_BIAS}, {CONFIDENT}": (confident, METHODS[name]) for name in WITHOUT_BIAS}
    return {name: batch.run(run, label) for name, (run, label) in wanted.items() if _possible(label, run.rig)}


def _confident(imu: Imu) -> Imu:
    assert imu.initial_std is not None  # the data set's configuration has it
    return replace(imu, initial_std=replace(imu.initial_std, gyro_bias=np.full(3, CALIBRATED_STD)))


def _possible(label: str, rig: Rig) -> bool:
    try:
        choose(find_method(label), rig)
    except InputError:
        return False
    return True


def errors_at_fixes(solution: Solution, trial: Trial) -> tuple[Errors, NDArray[np.bool_]]:
    """Return the errors of the antenna's predicted position, and where the car drives, at the E fixes.

    Errors at fixes that are not usable are interpolated between those that are.
    """
    track = trial.track
    inside = (track.time >= solution.time[0]) & (track.time <= solution.time[-1])
    time, usable = track.time[inside], track.usable[inside]
    if not usable.any():
        raise InputError(f"trial {trial.number}: no usable fix in the reference; expected some to score by")
    reference = trial.recording.reference
    assert reference is not None  # the data set's configuration has one
    antenna = solution.position[:, :2] + (rotation_matrices(solution.attitude) @ reference.lever_arm)[:, :2]
    heading = np.interp(time, solution.time, np.unwrap(euler_angles(solution.attitude)[:, 2]))
    position, attitude = np.zeros((len(time), 3)), np.zeros((len(time), 3))
    for axis in range(2):
        error = np.interp(time, solution.time, antenna[:, axis]) - track.north_east[inside, axis]
        position[:, axis] = np.interp(time, time[usable], error[usable])
    attitude[:, 2] = wrap(heading - track.heading[inside])
    distance = np.maximum.accumulate(track.distance[inside])
    errors = Errors(time, position, None, attitude, distance, np.full(len(time), True))
    return errors, track.speed[inside] > DRIVING


def score(solution: Solution, trial: Trial) -> Scores:
    """Return drift rates, end point error and heading error of one run."""
    errors, driving = errors_at_fixes(solution, trial)
    coarse, fine = (drift(errors, step) for step in STEPS_M)
    assert errors.attitude is not None
    return {
        "rate_percent": coarse["rate_percent"],
        "rate_50m_percent": fine["rate_percent"],
        "end_percent": coarse["end_percent"],
        "heading_rmse_deg": rms(np.degrees(errors.attitude[driving, 2])),
    }


def mean(trials: Iterable[Mapping[str, Scores]]) -> dict[str, Scores]:
    """Return the mean of each figure of each method over the trials that have it."""
    found: dict[str, dict[str, list[float]]] = {}
    for scores in trials:
        for name, figures in scores.items():
            for key, value in figures.items():
                known = found.setdefault(name, {}).setdefault(key, [])
                known += [] if value is None else [value]
    return {
        name: {key: float(np.mean(values)) if values else None for key, values in figures.items()}
        for name, figures in found.items()
    }


def _settings(recording: Recording) -> dict[str, Any]:
    settings: dict[str, Any] = plain(
        {
            "rolling": asdict(recording.options.rolling),
            "noise": {"body" if imu.wheel is None else "wheels": asdict(imu.noise) for imu in recording.rig.imus},
            "start": {
                "heading_from": recording.start.heading_from,
                "position_std_m": recording.start.position_std,
                "velocity_std_m_s": recording.start.velocity_std,
                "attitude_std_rad": recording.start.attitude_std,
            },
            "heading_above_m_s": DRIVING,
        }
    )
    return settings


def _write_report(path: Path, trial: Trial, solutions: Mapping[str, Solution]) -> None:
    """Draw a trial's runs; the table shows the figures of the document."""
    from polyins.report import Scene, write_report

    runs = {}
    for name, solution in solutions.items():
        summary, scores = summarize(solution, trial.recording.reference), score(solution, trial)
        for key in ("rate_percent", "end_percent"):
            summary["drift"][key] = scores[key]
        summary["reference"]["heading_rmse_deg"] = scores["heading_rmse_deg"]
        runs[name] = (solution, summary)
    write_report(path, Scene.of(runs, trial.recording))
