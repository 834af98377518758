"""One faulty IMU of an array: how soon it is left out, and what is left of the array's accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import ImuStream, Recording, usual_interval
from polyins.model.rig import DEG
from polyins.navigate import batch
from polyins.simulation.run import simulate_with_truth
from polyins.studies.beyond.drives import METHOD, compared_every, of_some, scenario
from polyins.studies.rigid_array import maxima, maxima_of, rms

Array = NDArray[np.float64]

BEGINS = 300.0
"""s: just where an outage begins"""
FAULTY = 1
COMPARED_EVERY = 0.1
NOISE_FACTOR = 10.0
CLOCK_S = 0.1


def _add(column: int, size: float) -> Callable[[Array, slice, float], None]:
    def change(rates: Array, after: slice, _: float) -> None:
        rates[after, column] += size

    return change


def _keep(column: int) -> Callable[[Array, slice, float], None]:
    def change(rates: Array, after: slice, _: float) -> None:
        rates[after, column] = rates[after.start, column]

    return change


def _dead(rates: Array, after: slice, _: float) -> None:
    rates[after] = 0.0


def _noisy(rates: Array, after: slice, _: float) -> None:
    own = np.median(np.abs(np.diff(rates[: after.start // 10], axis=0)), axis=0) / 0.954
    rates[after] += np.random.default_rng(7).normal(0.0, NOISE_FACTOR * own, rates[after].shape)


def _scaled(rates: Array, after: slice, _: float) -> None:
    rates[after, 2] *= 1.02


def _spikes(rates: Array, after: slice, interval: float) -> None:
    rates[after.start :: round(1.0 / interval), 1] += 2000.0 * DEG


def _late(rates: Array, after: slice, interval: float) -> None:
    rows = round(CLOCK_S / interval)
    rates[after] = rates[after.start - rows : len(rates) - rows].copy()


FAULTS: dict[str, Callable[[Array, slice, float], None]] = {
    "gyro_0.2_deg_s": _add(2, 0.2 * DEG),
    "gyro_0.05_deg_s": _add(2, 0.05 * DEG),
    "accelerometer_0.1_m_s2": _add(3, 0.1),
    "gyro_stuck": _keep(2),
    "accelerometer_stuck": _keep(3),
    "dead": _dead,
    "noise_x10": _noisy,
    "scale_2_percent": _scaled,
    "spikes": _spikes,
    "clock_100_ms": _late,
}


def faults(count: int, seed: int, quick: bool) -> dict[str, dict[str, float | None]]:
    """Return for each fault after how many seconds the IMU is left out, and the drift over that of the healthy rest.

    The drift is the rms of outage maxima. A scale shows from the first turn on.
    """
    healthy = compared_every(
        of_some(simulate_with_truth(scenario("as modelled", quick), seed=seed), count), COMPARED_EVERY
    )
    rest = healthy.subset([i for i in range(count) if i != FAULTY])
    best = rms(maxima(rest, METHOD))
    return {name: _outcome(_with_fault(healthy, change), best) for name, change in FAULTS.items()}


def _with_fault(recording: Recording, change: Callable[[Array, slice, float], None]) -> Recording:
    stream = recording.imus[FAULTY]
    interval = usual_interval(stream.time)
    rates = np.hstack([stream.dtheta, stream.dvel]) / interval
    change(rates, slice(int(np.searchsorted(stream.time, BEGINS)), None), interval)
    spoiled = ImuStream(stream.name, stream.time, rates[:, :3] * interval, rates[:, 3:] * interval)
    imus = tuple(spoiled if i == FAULTY else one for i, one in enumerate(recording.imus))
    return replace(recording, imus=imus)


def _outcome(recording: Recording, best: float) -> dict[str, float | None]:
    own = recording.rig.imus[FAULTY].name
    solution = batch.run(recording, METHOD)
    found = [one for one in solution.exclusions if one.imu == own]
    return {
        "found_s": found[0].from_s - BEGINS if found else None,
        "error_over_rest": rms(maxima_of(solution, recording)) / best,
    }
