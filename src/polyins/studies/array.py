"""A simulated rigid array whose IMUs err independently: how near the fusion methods come to sqrt(N)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from polyins.evaluation.summary import figure
from polyins.simulation.run import simulate
from polyins.studies.scenario_files import scenarios
from polyins.tools.comparison import compare

METHODS = ("imu-fusion", "nav-fusion", "enav-fusion")
SEEDS = 10
QUICK_SEEDS = 1
QUICK_RATE_HZ = 50.0

SCENARIOS = scenarios(__package__, "array")


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run 16 IMUs at 200 Hz through 30 s outages of a 1,000 s drive, over ten seeds, and return the document.

    `quick` takes one seed at 50 Hz. The ratio of a seed is the rms of the outage maxima over all single IMUs, divided
    by the method's.
    """
    seeds = QUICK_SEEDS if quick else SEEDS
    total = seeds * len(SCENARIOS)

    def update(share: float) -> None:
        if progress:
            progress((done + share) / total)

    done = 0
    results = {}
    for name, full in SCENARIOS.items():
        scenario = full.model_copy(update={"rate_hz": QUICK_RATE_HZ}) if quick else full
        figures: dict[str, list[float]] = {method: [] for method in ("single", *METHODS)}
        for seed in range(seeds):
            document = compare(
                simulate(scenario, seed=seed).as_published(), ("single", *METHODS), progress=update
            ).document
            for method, values in figures.items():
                value = figure(document["methods"][method])
                assert value is not None  # there are outages and a reference
                values.append(value)
            done += 1
        results[name] = _figures(figures)
    return {
        "target": "array",
        "paper": {},
        "polyins": {**results, "sqrt_n": 4.0},
        "settings": {
            "seeds": seeds,
            "scenarios": {name: scenario.model_dump(mode="json") for name, scenario in SCENARIOS.items()},
        },
    }


def _figures(figures: dict[str, list[float]]) -> dict[str, Any]:
    single = np.array(figures["single"])
    ratios = {name: single / np.array(figures[name]) for name in METHODS}
    return {
        **{name: float(np.sqrt(np.mean(np.square(values)))) for name, values in figures.items()},
        "ratio": {name: float(np.mean(values)) for name, values in ratios.items()},
        "ratio_by_seed": {name: values.tolist() for name, values in ratios.items()},
    }
