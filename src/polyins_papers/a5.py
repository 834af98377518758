"""Paper A, Table V: IMUs on flexible rulers, test A on a lawn, test B over books, and the same array if it were rigid.

One scenario per test serves all methods (`lawn.yaml`, `books.yaml`). Each seed has a ground, rulers and errors of its
own; a figure is the rms over all outages of all seeds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polyins.model.recording import Recording
from polyins.simulation.scenario import Scenario
from polyins.studies.pictures import lines, write_figure
from polyins.studies.progress import Steps
from polyins.studies.rigid_array import Array, maxima
from polyins.tools.parallel import in_order
from polyins_papers import nonrigid

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

OWN_RATES = "imu-fusion, own rates"
"""as the paper's (13) has it: each force is moved to the origin by that IMU's own rate, not by the mean of all"""
METHODS = ("imu-fusion", OWN_RATES, "nav-fusion", "enav-fusion")
SEEDS = {"rigid": 10, "test A": 120, "test B": 60}
"""test A scatters more, and lies nearer to one IMU"""
QUICK_SEEDS = 1
BLOCK, DRAWS = 20, 2000
"""seeds of a block; how often seeds are drawn again"""
RATIOS = {
    "imu_fusion_over_single": ("imu-fusion", "single"),
    "imu_fusion_over_nav_fusion": ("imu-fusion", "nav-fusion"),
    "own_rates_over_single": (OWN_RATES, "single"),
}
SWEPT = ("imu-fusion", "nav-fusion")
"""one IMU errs much the same whatever is varied"""

PAPER = {
    "rigid": {"single": 4.87},
    "test A": {"single": 8.05, "imu-fusion": 8.04, "nav-fusion": 3.12, "enav-fusion": 2.99},
    "test B": {"single": 8.41, "imu-fusion": 4.21, "nav-fusion": 3.28, "enav-fusion": 3.23},
}
"""m; rigid: of Table III, sixteen IMUs on a car, which Table V divides by"""


@dataclass(frozen=True)
class Sweep:
    """A figure of a test that is varied about its scenario's."""

    test: str
    change: Callable[[Scenario, float], Scenario]
    values: tuple[float, ...]
    own: float
    """the scenario's"""
    seeds: int
    title: str


SWEEPS = {
    "roughness_mm": Sweep("test A", nonrigid.with_roughness, (1.2, 1.6, 2.0), 1.6, 20, "roughness of the lawn, mm rms"),
    "book_mm": Sweep("test B", nonrigid.with_books, (7.5, 11.25, 15.0), 15.0, 20, "thickest of the books, mm"),
    # A5 across the way; 16K, China's size of textbooks, across; A4 across or A5 along; 16K along; A4 along
    "length_mm": Sweep(
        "test B", nonrigid.with_lengths, (148.0, 185.0, 210.0, 260.0, 297.0), 210.0, 20, "length of the books, mm"
    ),
    "thickness_mm": Sweep(
        "test A", nonrigid.with_thickness, (0.8, 1.0, 1.2, 1.5, 2.0), 1.0, 20, "thickness of the rulers, mm"
    ),
}

BOTH = ("test A", "test B")


@dataclass(frozen=True)
class Variant:
    """Something that no source decides, assumed otherwise than in the scenario."""

    change: Callable[[Scenario], Scenario]
    tests: tuple[str, ...] = BOTH
    seeds: int = 20


VARIANTS = {
    "tyres only push": Variant(lambda scenario: nonrigid.with_road(scenario, tyres_only_push=True)),
    # wheels of 0.2 to 0.3 m across are usual for such robots
    "round wheels": Variant(lambda scenario: nonrigid.with_road(scenario, wheel_radius_m=0.125)),
    "ends of a ruler alike": Variant(lambda scenario: nonrigid.with_rulers(scenario, tuning_spread=0.0)),
    "roughness of the whole ground": Variant(nonrigid.with_roughness_of_the_whole),
    "ground without patches": Variant(lambda scenario: nonrigid.with_road(scenario, patch_sigma=0.0)),
    "waves down to 0.05 m": Variant(lambda scenario: nonrigid.with_road(scenario, wavelengths_m=(0.05, 3.0))),
    "thickest book first": Variant(nonrigid.with_books_reversed, ("test B",)),
    "books in drawn order": Variant(lambda scenario: nonrigid.with_road(scenario, books_shuffled=True), ("test B",)),
    "all books under the left wheels": Variant(nonrigid.with_books_on_the_left, ("test B",)),
}

Runs = list[dict[str, Array]]
"""by seed and method: the largest horizontal error in each outage, m; of `single` for every IMU"""

Document = dict[str, Any]


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> Document:
    """Run the rigid array, test A, test B, the sweeps over the lawn, the books and the rulers, and the variants.

    `quick` takes one seed, the first 330 s. `out` is the folder for the pictures.
    """
    seeds = dict.fromkeys(SEEDS, QUICK_SEEDS) if quick else SEEDS
    others = sum((QUICK_SEEDS if quick else sweep.seeds) * (len(sweep.values) - 1) for sweep in SWEEPS.values())
    others += sum((QUICK_SEEDS if quick else each.seeds) * len(each.tests) for each in VARIANTS.values())
    steps = Steps(progress, sum(seeds.values()) + others)
    runs = {test: run(nonrigid.scenario_of(test, quick), count, steps) for test, count in seeds.items()}
    tables = {test: row(found) for test, found in runs.items()}
    sweeps = {name: run_sweep(sweep, runs[sweep.test], quick, steps) for name, sweep in SWEEPS.items()}
    variants = {test: run_variants(test, runs[test], quick, steps) for test in BOTH}
    if out is not None:
        for name, sweep in SWEEPS.items():
            write_figure(sweep_figure(sweeps[name], sweep.title), out / f"a5-{name.partition('_')[0]}.html")
    return {
        "target": "a5",
        "paper": {test: {**own, "ratio_to_rigid_single": _ratios(PAPER["rigid"], own)} for test, own in PAPER.items()},
        "polyins": {
            **{
                test: {
                    **with_ratios(own, tables["rigid"]),
                    "by_block": by_block(runs[test]),
                    "90_percent_interval": interval(runs[test]),
                }
                for test, own in tables.items()
            },
            **sweeps,
            "variants": variants,
        },
        "settings": {
            "seeds": {
                **seeds,
                **{name: QUICK_SEEDS if quick else sweep.seeds for name, sweep in SWEEPS.items()},
                "variants": {name: QUICK_SEEDS if quick else each.seeds for name, each in VARIANTS.items()},
            },
            "outages": {name: len(nonrigid.scenario_of(name, quick).outage_intervals()) for name in seeds},
            "scenarios": {name: nonrigid.scenario_of(name, quick).model_dump(mode="json") for name in seeds},
        },
    }


def run_sweep(sweep: Sweep, own: Runs, quick: bool, steps: Steps) -> Document:
    """Return the figures by value of what is varied; `own` are the runs of the test as it is."""
    scenario = nonrigid.scenario_of(sweep.test, quick)
    seeds = QUICK_SEEDS if quick else sweep.seeds
    return {
        f"{value:g}": excess(
            own[:seeds] if value == sweep.own else run(sweep.change(scenario, value), seeds, steps, SWEPT), own[:seeds]
        )
        for value in sweep.values
    }


def run_variants(test: str, own: Runs, quick: bool, steps: Steps) -> dict[str, Document]:
    """Return the figures of a test by what is assumed; `own` are its runs as it is."""
    scenario = nonrigid.scenario_of(test, quick)
    found = {}
    for name, variant in VARIANTS.items():
        if test in variant.tests:
            seeds = QUICK_SEEDS if quick else variant.seeds
            runs = run(variant.change(scenario), seeds, steps, SWEPT)
            found[name] = excess(runs, own[:seeds])
    return found


def run(scenario: Scenario, seeds: int, steps: Steps, names: Sequence[str] = ("single", *METHODS)) -> Runs:
    """Return the errors in outages by seed."""

    def one(number: int) -> dict[str, Array]:
        report = steps.next()
        recording = nonrigid.recording_of(scenario, number)
        found = {name: errors(recording, name) for name in names}
        report(1.0)
        return found

    return in_order(one, range(seeds))


def row(runs: Runs) -> dict[str, float]:
    """Return the rms over outages and seeds, m, by method; of `single` over all IMUs."""
    return nonrigid.pooled({name: [each[name] for each in runs] for name in runs[0]})


def by_block(runs: Runs) -> dict[str, list[float]]:
    """Return the ratios of IMU-Fusion for each block of seeds by itself: how far they scatter."""
    rows = [row(runs[first : first + BLOCK]) for first in range(0, len(runs), BLOCK)]
    return {name: [each[above] / each[below] for each in rows] for name, (above, below) in RATIOS.items()}


def interval(runs: Runs) -> dict[str, list[float]]:
    """Return where 90 % of the ratios of IMU-Fusion lie if as many seeds are drawn from these, some twice."""
    squares = {name: np.array([np.mean(np.square(each[name])) for each in runs]) for name in runs[0]}
    drawn = np.random.default_rng(0).integers(len(runs), size=(DRAWS, len(runs)))
    return {
        name: np.percentile(
            np.sqrt(squares[above][drawn].mean(axis=1) / squares[below][drawn].mean(axis=1)), (5.0, 95.0)
        ).tolist()
        for name, (above, below) in RATIOS.items()
    }


def errors(recording: Recording, name: str) -> Array:
    """Return the largest horizontal error in each outage, m; of `single` for every IMU."""
    if name == "single":
        return np.array([maxima(recording, name, imu=i) for i in range(len(recording.imus))])
    if name == OWN_RATES:
        return maxima(nonrigid.with_forces_at_origin(recording), "imu-fusion")
    return maxima(recording, name)


def with_ratios(metres: dict[str, float], rigid: dict[str, float]) -> Document:
    """Return the errors by method with their ratios, and those of the methods to each other."""
    return {
        **metres,
        "ratio": _ratios(metres, metres),
        "ratio_to_rigid_single": _ratios(rigid, metres),
        "imu_fusion_over_single": metres["imu-fusion"] / metres["single"],
        "imu_fusion_over_nav_fusion": metres["imu-fusion"] / metres["nav-fusion"],
        "enav_fusion_over_nav_fusion": metres["enav-fusion"] / metres["nav-fusion"],
    }


def excess(runs: Runs, own: Runs) -> Document:
    """Return the methods of a sweep, m, how much more IMU-Fusion errs than Nav-Fusion, and the ratios.

    The single IMU is that of the test as it is, over the same seeds.
    """
    found, single = row(runs), row(own)["single"]
    return {
        **{name: found[name] for name in SWEPT},
        "ratio": {name: single / found[name] for name in SWEPT},
        "excess": found["imu-fusion"] - found["nav-fusion"],
        "imu_fusion_over_single": found["imu-fusion"] / single,
        "imu_fusion_over_nav_fusion": found["imu-fusion"] / found["nav-fusion"],
    }


def sweep_figure(sweep: Mapping[str, Mapping[str, float]], title: str) -> Figure:
    """Return the picture of a sweep: errors over what is varied."""
    values = [float(value) for value in sweep]
    return lines({name: (values, [row[name] for row in sweep.values()]) for name in SWEPT}, title, "outage error, m")


def _ratios(unit: dict[str, float], metres: dict[str, float]) -> dict[str, float]:
    return {name: unit["single"] / value for name, value in metres.items() if name != "single"}
