"""Paper A, Table V: IMUs on flexible rulers, test A on a lawn, test B over books, and the same array if it were rigid.

One scenario per test serves all methods (`lawn.yaml`, `books.yaml`). Each seed has a ground, rulers and errors of its
own; a figure is the rms over all outages of all seeds.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polyins import bench
from polyins.reproduce import nonrigid
from polyins.reproduce.pictures import lines, write_figure
from polyins.reproduce.progress import Steps
from polyins.reproduce.rigid_array import maxima
from polyins.simulation.scenario import Scenario

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

METHODS = ("imu-fusion", "nav-fusion", "enav-fusion")
SEEDS = {"rigid": 10, "test A": 20, "test B": 20}
QUICK_SEEDS = 1
ROUGHNESS_MM = (1.2, 1.6, 2.0)

PAPER = {
    "rigid": {"single": 4.87},
    "test A": {"single": 8.05, "imu-fusion": 8.04, "nav-fusion": 3.12, "enav-fusion": 2.99},
    "test B": {"single": 8.41, "imu-fusion": 4.21, "nav-fusion": 3.28, "enav-fusion": 3.23},
}
"""m; rigid: of Table III, sixteen IMUs on a car, which Table V divides by"""
PAPER_TIME = {"nav-fusion": 6.05, "enav-fusion": 1.09}

CASES: tuple[bench.Case, ...] = (
    ("single", "single", 1, True),
    ("imu-fusion", "imu-fusion", 6, True),
    ("nav-fusion", "nav-fusion", 6, True),
    ("enav-fusion", "enav-fusion", 6, True),
)
ROUNDS, SECONDS = 5, 100.0
QUICK_ROUNDS, QUICK_SECONDS = 1, 70.0

Document = dict[str, Any]


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> Document:
    """Run the rigid array, test A, test B and the sweep over the lawn's roughness, and time the methods.

    `quick` takes one seed, the first 330 s. `out` is the folder for the picture.
    """
    seeds = dict.fromkeys(SEEDS, QUICK_SEEDS) if quick else SEEDS
    others = [roughness for roughness in ROUGHNESS_MM if roughness != lawn(quick)]
    steps = Steps(progress, sum(seeds.values()) + len(others) * seeds["test A"] + 1)
    tables = {test: table(nonrigid.scenario_of(test, quick), count, steps) for test, count in seeds.items()}
    sweep = {lawn(quick): excess(tables["test A"])}
    for roughness in others:
        scenario = nonrigid.with_roughness(nonrigid.scenario_of("test A", quick), roughness)
        sweep[roughness] = excess(table(scenario, seeds["test A"], steps, ("nav-fusion", "imu-fusion"), singles=False))
    if out is not None:
        write_figure(sweep_figure(sweep), out / "a5-roughness.html")
    return {
        "target": "a5",
        "paper": {
            **{name: {**row, "ratio_to_rigid_single": _ratios(PAPER["rigid"], row)} for name, row in PAPER.items()},
            "time_ratio": PAPER_TIME,
        },
        "polyins": {
            **{name: with_ratios(row, tables["rigid"]) for name, row in tables.items()},
            "roughness_mm": {f"{key:g}": row for key, row in sorted(sweep.items())},
            "time_ratio": time_ratios(quick, steps),
        },
        "settings": {
            "seeds": seeds,
            "outages": {name: len(nonrigid.scenario_of(name, quick).outage_intervals()) for name in seeds},
            "time_ratio": "full matrices as in the paper, six IMUs, the single IMU is the unit",
            "scenarios": {name: nonrigid.scenario_of(name, quick).model_dump(mode="json") for name in seeds},
        },
    }


def lawn(quick: bool) -> float:
    """Return the roughness of test A, mm."""
    road = nonrigid.scenario_of("test A", quick).road
    assert road is not None
    return road.roughness_mm


def table(
    scenario: Scenario, seeds: int, steps: Steps, methods: tuple[str, ...] = METHODS, *, singles: bool = True
) -> dict[str, float]:
    """Return the rms over outages and seeds, m, by method; of `single` over all IMUs."""
    found: dict[str, list[Any]] = {name: [] for name in (*(("single",) if singles else ()), *methods)}
    for number in range(seeds):
        report = steps.next()
        recording = nonrigid.recording_of(scenario, number)
        if singles:
            found["single"] += [maxima(recording, "single", imu=i) for i in range(len(recording.imus))]
        for method in methods:
            found[method].append(maxima(recording, method))
        report(1.0)
    return nonrigid.pooled(found)


def with_ratios(row: dict[str, float], rigid: dict[str, float]) -> Document:
    """Return a row with its ratios, and those of the methods to each other."""
    return {
        **row,
        "ratio": _ratios(row, row),
        "ratio_to_rigid_single": _ratios(rigid, row),
        "imu_fusion_over_single": row["imu-fusion"] / row["single"],
        "imu_fusion_over_nav_fusion": row["imu-fusion"] / row["nav-fusion"],
        "enav_fusion_over_nav_fusion": row["enav-fusion"] / row["nav-fusion"],
    }


def excess(row: dict[str, float]) -> dict[str, float]:
    """Return IMU-Fusion, Nav-Fusion and by how much more the former errs, m."""
    imu, nav = row["imu-fusion"], row["nav-fusion"]
    return {"imu-fusion": imu, "nav-fusion": nav, "excess": imu - nav}


def time_ratios(quick: bool, steps: Steps) -> dict[str, float]:
    """Return the time of each method over that of a single IMU, with full matrices."""
    rounds, seconds = (QUICK_ROUNDS, QUICK_SECONDS) if quick else (ROUNDS, SECONDS)
    cost = bench.measure(CASES, rounds, seconds, steps.next())
    ratio = np.median(cost / cost[:, :1], axis=0)
    return {name: float(value) for (name, *_), value in zip(CASES, ratio, strict=True) if name != "single"}


def sweep_figure(sweep: dict[float, dict[str, float]]) -> Figure:
    """Return the picture of the sweep: errors over roughness."""
    order = sorted(sweep)
    curves = {name: (order, [sweep[key][name] for key in order]) for name in ("imu-fusion", "nav-fusion")}
    return lines(curves, "roughness of the lawn, mm rms", "outage error, m")


def _ratios(unit: dict[str, float], row: dict[str, float]) -> dict[str, float]:
    return {name: unit["single"] / value for name, value in row.items() if name != "single"}
