"""What IMUs of an array have in common, in simulation and on real flights: rms^2(N) = common^2 + independent^2 / N."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polyins.errors import InputError
from polyins.model.recording import Recording
from polyins.simulation.run import true_run
from polyins.studies import flights, rigid_array
from polyins.studies.pictures import lines, write_figure
from polyins.studies.progress import Steps
from polyins.studies.rigid_array import maxima, rms

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

COUNTS = (1, 2, 3, 4)
NAME = "split-imus.html"
SEED = 0

Document = dict[str, Any]


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> Document:
    """Run eNav-Fusion of one to four IMUs in the scenario of a3 and over the real flights, and return the document.

    `quick` takes the first eleven outages and every fourth flight. The flights are null without the data set
    `quadrotor`. `out` is the folder for the picture.
    """
    steps = Steps(progress, 2)
    scenario = rigid_array.base_scenario(quick)
    chips = rigid_array.group_chips(1, scenario.imus.count)
    errors = scenario.errors.model_copy(update={"chips": chips})
    run = rigid_array.with_errors(true_run(scenario), errors)
    simulated = by_imus(rigid_array.recording_of(run, SEED), steps.next())
    flown = fly(quick, steps.next())
    if out is not None:
        write_figure(split_figure({"simulation": simulated, **({"real flights": flown} if flown else {})}), out / NAME)
    return {
        "target": "split",
        "paper": {},
        "polyins": {"simulation": split(simulated), "flights": split(flown) if flown else None},
        "settings": {
            "by_imus_m": "rms of the largest horizontal error of an outage, over all subsets taken, eNav-Fusion",
            "simulation": f"scenario of a3, Group 1, outages of 30 s; track: {rigid_array.provenance()}",
            "flights": "data set quadrotor, outages of 10 s" if flown else "data set quadrotor is not at hand",
        },
    }


def split_figure(figures: Mapping[str, Mapping[int, float]]) -> Figure:
    """Return the picture of the outage error over the number of IMUs, over that of one, with the fitted curves."""
    counts = list(map(float, COUNTS))
    curves = {}
    for name, by_count in figures.items():
        fit = split(by_count)
        fitted = np.hypot(fit["common_m"], fit["independent_m"] / np.sqrt(counts))
        curves[name] = (counts, [by_count[count] / by_count[1] for count in COUNTS])
        curves[f"{name}: fit"] = (counts, (fitted / by_count[1]).tolist())
    curves["nothing in common"] = (counts, (1.0 / np.sqrt(counts)).tolist())
    return lines(curves, "IMUs", "outage error over that of one")


def by_imus(recording: Recording, progress: Callable[[float], None]) -> dict[int, float]:
    """Return the rms over subsets that have no IMU in common, by how many IMUs they have, m."""
    result = {}
    for k, count in enumerate(COUNTS, 1):
        firsts = range(0, len(recording.imus) - count + 1, count)
        subsets = [recording.subset(range(first, first + count)) for first in firsts]
        result[count] = rms(np.array([maxima(subset, "enav-fusion") for subset in subsets]))
        progress(k / len(COUNTS))
    return result


def fly(quick: bool, progress: Callable[[float], None]) -> dict[int, float] | None:
    """Return the same of the real flights, or None where they are not at hand."""
    try:
        document = flights.reproduce(quick, progress)
    except InputError:
        return None
    return {int(count): value for count, value in document["polyins"]["by_imus"].items()}


def split(figures: Mapping[int, float]) -> Document:
    """Return the figures with the least-squares split of their squares, neither part negative, and the ratios."""
    from scipy.optimize import nnls

    counts = np.array(list(figures))
    squares = np.array(list(figures.values())) ** 2
    (common, independent), _ = nnls(np.column_stack([np.ones(len(counts)), 1.0 / counts]), squares)
    return {
        "by_imus_m": {str(count): value for count, value in figures.items()},
        "ratio": {str(count): figures[1] / value for count, value in figures.items()},
        "common_m": float(np.sqrt(common)),
        "independent_m": float(np.sqrt(independent)),
        "common_share": float(common / (common + independent)),
    }
