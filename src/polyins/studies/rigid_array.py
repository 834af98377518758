"""A simulated rigid array on the real track of paper A's Group 1, and how far it drifts in the outages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.evaluation.errors import compare_to_reference
from polyins.evaluation.outages import outage_statistic
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.reading import datasets
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.run import TrueRun, record
from polyins.simulation.scenario import Scenario
from polyins.studies.chips import Chips, compensate, draw_chips, read_chips
from polyins.studies.scenario_files import read

Array = NDArray[np.float64]

DATASET = "whu-array"
QUICK_S = 1300.0
QUICK_RATE_HZ = 20.0
ELSEWHERE = {"replay": {"file"}}
"""of the scenario: where the data set is depends on the machine"""


def base_scenario(quick: bool) -> Scenario:
    """Return the scenario of the file, shorter and slower if `quick`.

    It replays the real track; where the data set is not at hand, a drive of its own stands in.
    """
    scenario, folder = read(Scenario, __package__, "a3"), data_folder()
    assert scenario.replay is not None
    track = folder and scenario.replay.model_copy(update={"file": str(folder / scenario.replay.file)})
    shorter = {"duration_s": QUICK_S, "rate_hz": QUICK_RATE_HZ} if quick else {}
    return scenario.model_copy(update={"replay": track, **shorter})


def data_folder() -> Path | None:
    """Return the folder of the data set, or None where it is not at hand."""
    try:
        return datasets.fetch(DATASET)
    except InputError:
        return None


def provenance() -> str:
    """Say what the track and Group 1's chips are."""
    if data_folder() is None:
        return f"a simulated drive and drawn chips stand in: the data set {DATASET} is not at hand"
    return f"real, data set {DATASET}"


def with_errors(run: TrueRun, errors: SensorErrors) -> TrueRun:
    """Return the run with other errors."""
    return replace(run, scenario=run.scenario.model_copy(update={"errors": errors}))


def group_chips(number: int, count: int) -> Chips:
    """Return the chips of a group, counted from 1: the real ones of Group 1 if at hand, else drawn ones."""
    folder = data_folder() if number == 1 else None
    return read_chips(folder) if folder else draw_chips(count, np.random.default_rng([number, 20602]))


def recording_of(run: TrueRun, seed: int) -> Recording:
    """Return a recording with errors that the seed draws."""
    return record(run, seed=seed).recording.as_published().without_gate()


def unaware(recording: Recording) -> Recording:
    """Return the recording for a filter that is told nothing of the chips but their noise."""
    imus = tuple(replace(imu, initial_std=None) for imu in recording.rig.imus)
    return replace(recording, rig=replace(recording.rig, imus=imus))


def compensated(recording: Recording, chips: Chips) -> Recording:
    """Return the recording with every chip's calibration applied."""
    streams = tuple(compensate(stream, chip) for stream, chip in zip(recording.imus, chips, strict=True))
    return replace(unaware(recording), imus=streams)


def maxima(recording: Recording, method: str, *, imu: int = 0) -> Array:
    """Return the maximum horizontal error in each outage, m."""
    return maxima_of(batch.run(recording, method, imu=imu), recording)


def maxima_of(solution: Solution, recording: Recording) -> Array:
    """Return the maximum horizontal error of a solution in each outage, m."""
    assert recording.reference is not None
    errors = compare_to_reference(solution, recording.reference)
    each = outage_statistic(errors, recording.outages)["each_m"]
    return np.array(each, dtype=float)


def figures(
    recording: Recording, methods: Sequence[str], progress: Callable[[float], None] | None = None
) -> dict[str, float]:
    """Return each method's rms of the maxima, m; of `single` over all IMUs."""
    count = len(recording.imus)
    total = count + len(methods)
    every = []
    for i in range(count):
        every.append(maxima(recording, "single", imu=i))
        if progress:
            progress((i + 1) / total)
    result = {"single": rms(np.array(every))}
    for k, method in enumerate(methods, count + 1):
        result[method] = rms(maxima(recording, method))
        if progress:
            progress(k / total)
    return result


def rms(values: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
