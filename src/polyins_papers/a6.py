"""Paper A, Table VI: what IMUs may share. Sharing the covariance costs nothing; sharing the mechanization does.

Simplification i is eNav-Fusion. For simplification ii the paper feeds the fused state back into the mechanization of
each IMU; it does not say which part. Here velocity and attitude are fed back by themselves (`feedback`), and both by
the method `enav-fusion-shared-mechanization`, on the flexible array of test A and on the same array if it were rigid.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import Recording
from polyins.studies.progress import Steps
from polyins.studies.rigid_array import maxima
from polyins.tools.parallel import in_order
from polyins_papers import nonrigid
from polyins_papers.feedback import outage_maxima

SEEDS = {"test A": 10, "rigid": 10}
QUICK_SEEDS = 1
PAPER = {"test A": {"nav-fusion": 3.12, "enav-fusion": 2.99, "attitude and velocity shared": 4.64}}
"""m"""

Array = NDArray[np.float64]
Document = dict[str, Any]
Row = Mapping[str, float | None]

VARIANTS: dict[str, Callable[[Recording], Array]] = {
    "imu-fusion": lambda recording: maxima(recording, "imu-fusion"),
    "nav-fusion": lambda recording: maxima(recording, "nav-fusion"),
    "enav-fusion": lambda recording: maxima(recording, "enav-fusion"),
    "velocity shared": lambda recording: outage_maxima(recording, velocity=True, attitude=False),
    "attitude shared": lambda recording: outage_maxima(recording, velocity=False, attitude=True),
    "attitude and velocity shared": lambda recording: maxima(recording, "enav-fusion-shared-mechanization"),
}


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> Document:
    """Run all variants on both arrays and return the document; `quick` takes one seed, the first 330 s."""
    seeds = dict.fromkeys(SEEDS, QUICK_SEEDS) if quick else SEEDS
    steps = Steps(progress, sum(seeds.values()))
    tables = {test: table(test, count, quick, steps) for test, count in seeds.items()}
    return {
        "target": "a6",
        "paper": {name: with_costs(row) for name, row in PAPER.items()},
        "polyins": {name: with_costs(row) for name, row in tables.items()},
        "settings": {
            "seeds": seeds,
            "cost": "relative to enav-fusion",
            "scenarios": {name: nonrigid.scenario_of(name, quick).model_dump(mode="json") for name in seeds},
        },
    }


def table(test: str, seeds: int, quick: bool, steps: Steps) -> Row:
    """Return the rms over outages and seeds, m, by variant; None: it diverged until no number was left."""
    scenario = nonrigid.scenario_of(test, quick)

    def run(number: int) -> dict[str, Array]:
        report = steps.next()
        recording = nonrigid.recording_of(scenario, number)
        found = {name: variant(recording) for name, variant in VARIANTS.items()}
        report(1.0)
        return found

    found = in_order(run, range(seeds))
    pooled = nonrigid.pooled({name: [each[name] for each in found] for name in VARIANTS})
    return {name: error if math.isfinite(error) else None for name, error in pooled.items()}


def with_costs(row: Row) -> Document:
    """Return a row with what each kind of sharing adds to the error of eNav-Fusion, relative."""
    unit = row["enav-fusion"]
    assert unit is not None
    shared = {name: error for name, error in row.items() if name.endswith("shared")}
    return {**row, "cost": {name: None if error is None else error / unit - 1.0 for name, error in shared.items()}}
