"""The simulated drives of the array, with other fixes, and how far methods drift in their outages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.simulation.run import Simulation, simulate_with_truth
from polyins.simulation.scenario import Scenario
from polyins.studies.array import QUICK_RATE_HZ, SCENARIOS
from polyins.studies.rigid_array import maxima, rms

METHOD = "enav-fusion"


def scenario(name: str, quick: bool, fix_std: float | None = None) -> Scenario:
    """Return a drive of the study `array`; `fix_std`: of the fixes, m, if it is another one."""
    found = SCENARIOS[name]
    if quick:
        found = found.model_copy(update={"rate_hz": QUICK_RATE_HZ})
    if fix_std is None:
        return found
    assert found.gnss is not None
    return found.model_copy(update={"gnss": found.gnss.model_copy(update={"position_std_m": (fix_std,) * 3})})


def of_some(simulation: Simulation, count: int) -> Recording:
    """Return the recording of the first IMUs."""
    recording = simulation.recording
    return recording if count == len(recording.imus) else recording.subset(list(range(count)))


def compared_every(recording: Recording, interval: float) -> Recording:
    """Return the recording with IMUs that are compared with their mean at an interval, s."""
    return replace(recording, options=replace(recording.options, relative_interval=interval))


def gains(name: str, fix_std: float | None, seeds: range, quick: bool) -> dict[str, float]:
    """Return the rms of outage maxima, m, of one IMU, of paper A's array and of ours, and the ratio of ours to one."""
    single, paper, ours, ratios = [], [], [], []
    for seed in seeds:
        recording = simulate_with_truth(scenario(name, quick, fix_std), seed=seed).recording
        imus = range(0, len(recording.imus), 4) if quick else range(len(recording.imus))
        single.append(rms(np.array([maxima(recording, "single", imu=i) for i in imus])))
        paper.append(rms(maxima(recording.as_published(), METHOD)))
        ours.append(rms(maxima(recording, METHOD)))
        ratios.append(single[-1] / ours[-1])
    return {
        "single": rms(np.array(single)),
        "paper": rms(np.array(paper)),
        METHOD: rms(np.array(ours)),
        "ratio": float(np.mean(ratios)),
        "paper_ratio": float(np.mean(np.array(single) / np.array(paper))),
        "over_paper": rms(np.array(ours)) / rms(np.array(paper)),
    }


def left_out(name: str, count: int, seeds: range, quick: bool) -> tuple[int, float]:
    """Return how many healthy IMUs of drives are left out, and in how many hours."""
    number, hours = 0, 0.0
    for seed in seeds:
        recording = of_some(simulate_with_truth(scenario(name, quick), seed=seed), count)
        solution = batch.run(recording, METHOD)
        number += len(solution.exclusions)
        hours += float(solution.time[-1] - solution.time[0]) / 3600.0
    return number, hours
