"""What an epoch costs: every method against the dense, paper-shaped single filter, in one run."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import Recording
from polyins.navigate import batch

ROUNDS = 9
SECONDS = 120.0

Case = tuple[str, str, int, bool]

CASES: tuple[Case, ...] = (
    ("dense/single", "single", 1, True),
    ("single", "single", 1, False),
    ("imu-fusion/16", "imu-fusion", 16, False),
    ("enav-fusion/16", "enav-fusion", 16, False),
    ("enav-fusion/100", "enav-fusion", 100, False),
    ("nav-fusion/16", "nav-fusion", 16, False),
    ("dense/enav-fusion/16", "enav-fusion", 16, True),
    ("dense/nav-fusion/16", "nav-fusion", 16, True),
    ("wheel-ins", "wheel-ins", 0, False),
    ("triple-ins", "triple-ins", 0, False),
    ("triple-ins/centralized", "triple-ins/centralized", 0, False),
    ("dense/triple-ins", "triple-ins", 0, True),
    ("dense/triple-ins/centralized", "triple-ins/centralized", 0, True),
)
"""name, method, IMUs of the array or 0 for a vehicle with wheels, dense covariance"""

IMUS = {name: count for name, _, count, _ in CASES}
FEW, MANY = "enav-fusion/16", "enav-fusion/100"
FURTHER = "enav-fusion/further"
"""What each IMU beyond sixteen costs. It grows several times over where the loops over lanes do not vectorize."""


def bench(progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Return the `bench` document: CPU time per epoch, compilation left out.

    IMUs at 200 Hz; arrays with GNSS at 1 Hz; vehicles with wheel speed at 2 Hz and the reference point at 1 Hz.

    The cases take turns, and each ratio is the median of those within a round, so that a change in the machine's
    speed does not enter.
    """
    cost = measure(CASES, ROUNDS, SECONDS, progress)
    names = [name for name, *_ in CASES]
    columns = dict(zip(names, cost.T, strict=True))
    if FEW in columns and MANY in columns:
        columns[FURTHER] = (columns[MANY] - columns[FEW]) / (IMUS[MANY] - IMUS[FEW])
    return {
        "machine": machine(),
        "results": [
            {
                "name": name,
                "us_per_epoch": float(np.median(column)),
                "ratio_to_dense": float(np.median(column / cost[:, 0])),
                "runs": ROUNDS,
                "min": float(column.min()),
                "median": float(np.median(column)),
            }
            for name, column in columns.items()
        ],
    }


def measure(
    cases: Sequence[Case], rounds: int, seconds: float, progress: Callable[[float], None] | None = None
) -> NDArray[np.float64]:
    """Return the CPU time per epoch of each case in each round, us, (rounds, cases).

    `seconds` is how long the recordings last.

    The cases take turns, so that a change in the machine's speed is the same for all of a round.
    """
    counts = sorted({case[2] for case in cases})
    recordings = {count: array(count, seconds) if count else vehicle(seconds) for count in counts}
    cost = np.empty((rounds, len(cases)))
    for k in range(-1, rounds):  # a first round warms up
        for j, (_, method, count, dense) in enumerate(cases):
            solution = batch.navigate(batch.prepare(recordings[count], method, dense_covariance=dense))
            cost[k, j] = 1e6 * solution.filter_s / len(solution.time)
        if progress:
            progress((k + 2) / (rounds + 1))
    return cost


def machine() -> dict[str, Any]:
    """Return what the program runs on."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }


def array(count: int, seconds: float = SECONDS) -> Recording:
    """Return a simulated recording of an array of `count` IMUs; those beyond sixteen repeat the first ones."""
    from polyins.simulation.run import simulate
    from polyins.simulation.scenario import Scenario

    recording = simulate(Scenario(duration_s=seconds))
    order = [i % len(recording.imus) for i in range(count)]
    imus = tuple(replace(recording.rig.imus[i], name=f"imu{k}") for k, i in enumerate(order, 1))
    return replace(recording, rig=replace(recording.rig, imus=imus), imus=tuple(recording.imus[i] for i in order))


def vehicle(seconds: float = SECONDS) -> Recording:
    """Return a simulated recording of a robot: an IMU in each of two wheels and one on the body, no GNSS."""
    from polyins.simulation.drive_scenario import Drive
    from polyins.simulation.run import simulate
    from polyins.simulation.scenario import Board, Scenario
    from polyins.simulation.wheel_scenario import WheelModule

    half = 0.2
    wheels = tuple(
        WheelModule(name=name, position_m=(0.0, right, 0.0), radius_m=0.1, chips=1)
        for name, right in (("left", -half), ("right", half))
    )
    slow = Drive(top_speed_m_s=2.0)
    return simulate(Scenario(duration_s=seconds, imus=Board(count=1), wheels=wheels, gnss=None, drive=slow))


def _processor() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()
