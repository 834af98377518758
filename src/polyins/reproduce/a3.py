"""Paper A, Table III: four rigid arrays of 16 IMUs through 29 outages; and what keeps the gain from being sqrt(16).

Every source of error has one documented size (`a3.yaml`), the same for all methods. `sources` adds them one after the
other; `candidates` makes one of them larger, to see which could make what was measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polyins.reproduce import rigid_array
from polyins.reproduce.chips import Chips, parts_of
from polyins.reproduce.pictures import bars, write_figure
from polyins.reproduce.progress import Steps
from polyins.simulation.error_scenario import Errors
from polyins.simulation.run import TrueRun

METHODS = ("imu-fusion", "nav-fusion", "enav-fusion")
GROUPS = (1, 2, 3, 4)
QUICK_GROUPS = (1,)
SEED = 0
"""of sources and candidates"""

PAPER = {
    "group1": (5.68, 1.98, 1.97, 2.05),
    "group2": (4.23, 1.66, 1.71, 1.63),
    "group3": (3.94, 1.74, 1.87, 1.72),
    "group4": (5.42, 2.27, 2.31, 2.31),
    "rms": (4.87, 1.93, 1.98, 1.95),
}
"""m: single and the three methods"""
PAPER_RATIO = 2.51
LAB = {"single": 6.98, "uncompensated": 4.25, "compensated": 1.92}
"""m: the same lab's figures for Group 1's 30 s outages, an IMU-level array; see the data set's README"""

SOURCES: Mapping[str, Sequence[str]] = {
    "rate random walk": ("gyro_random_walk_deg_h_sqrt_h", "accel_random_walk_mgal_sqrt_h"),
    "g-sensitivity": ("g_sensitivity_deg_s_g",),
    "vibration rectification": ("vibration_m_s2", "rectification_mg_g2", "rectification_spread_mg_g2"),
    "common noise and drift": ("common_noise_share", "common_drift_share"),
    "quantization and jitter": ("gyro_lsb_deg_s", "accel_lsb_mg", "jitter_s"),
}
"""What is added to white noise, drift, errors of the fixes and the chips' calibrations."""

CANDIDATES: Mapping[str, Mapping[str, float]] = {
    "rate random walk": {"gyro_random_walk_deg_h_sqrt_h": 50.0, "accel_random_walk_mgal_sqrt_h": 300.0},
    "g-sensitivity": {"g_sensitivity_deg_s_g": 0.1},
    "vibration rectification": {"vibration_m_s2": 1.0, "rectification_mg_g2": 3.0, "rectification_spread_mg_g2": 1.0},
    "common noise and drift": {"common_noise_share": 0.1, "common_drift_share": 0.1},
}
"""One source after the other at the upper end of what is plausible."""
UNAWARE = "filter told 250 mGal of offset"

Document = dict[str, Any]


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> Document:
    """Run all groups, uncompensated and compensated, then the sources of error, and return the document.

    `quick` takes the first eleven outages of Group 1 at 20 Hz, and no candidates. `out` is the folder for the picture.
    """
    scenario = rigid_array.base_scenario(quick)
    groups = QUICK_GROUPS if quick else GROUPS
    steps = Steps(progress, 2 * len(groups) + 5 + len(SOURCES) + (0 if quick else len(CANDIDATES) + 1))
    run = rigid_array.drive(scenario)
    errors = scenario.errors
    tables: dict[str, dict[str, dict[str, float]]] = {"uncompensated": {}, "compensated": {}}
    for number in groups:
        chips = rigid_array.group_chips(number, scenario.imus.count)
        recording = rigid_array.recording_of(with_chips(run, errors, chips), seed=number)
        tables["uncompensated"][f"group{number}"] = rigid_array.figures(recording, METHODS, steps.next())
        recording = rigid_array.compensated(recording, chips)
        tables["compensated"][f"group{number}"] = rigid_array.figures(recording, METHODS, steps.next())
    chips = rigid_array.group_chips(1, scenario.imus.count)
    sources = add_sources(run, errors, chips, steps)
    candidates = {} if quick else try_candidates(run, errors, chips, steps)
    if out is not None:
        write_figure(sources_figure(sources, scenario.imus.count), out / "a3-sources.html")
    return {
        "target": "a3",
        "paper": {
            "uncompensated": table(
                {name: dict(zip(("single", *METHODS), row, strict=True)) for name, row in PAPER.items()}
            ),
            "compensated": {"group1": {"single": LAB["single"], "imu-fusion": LAB["compensated"]}},
        },
        "polyins": {
            **{name: table({**rows, "rms": pooled(rows)}) for name, rows in tables.items()},
            "sources": sources,
            "candidates": candidates,
            "largest_difference_of_methods": largest_difference(tables["uncompensated"]),
            "statement": statement(sources, candidates),
        },
        "settings": {
            "track": rigid_array.provenance(),
            "outages": len(run.scenario.outage_intervals()),
            "scenario": scenario.model_dump(mode="json", exclude={"track", "wheels"}),
            "sources": "added one after the other, each with all before it; seed 0, Group 1's chips",
        },
    }


def with_chips(run: TrueRun, errors: Errors, chips: Chips) -> TrueRun:
    """Return the run with errors and the chips of a group."""
    return rigid_array.with_errors(run, errors.model_copy(update={"chips": chips}))


def table(rows: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, Any]]:
    """Return the rows, each with the ratios of single to the methods."""
    return {
        name: {**row, "ratio": {method: row["single"] / row[method] for method in METHODS}}
        for name, row in rows.items()
    }


def pooled(rows: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Return the rms over the groups."""
    names = next(iter(rows.values()))
    return {name: rigid_array.rms(np.array([row[name] for row in rows.values()])) for name in names}


def largest_difference(rows: Mapping[str, Mapping[str, float]]) -> float:
    """Return by how much of the least the three methods differ at most within a group."""
    values = [[row[method] for method in METHODS] for row in rows.values()]
    return max(max(row) / min(row) - 1.0 for row in values)


def add_sources(run: TrueRun, errors: Errors, chips: Chips, steps: Steps) -> dict[str, dict[str, float]]:
    """Return single, eNav-Fusion, their ratio and what of the ratio each source takes, added one after the other."""
    known = Errors(scales=errors.scales)
    exact = run.scenario.gnss.model_copy(update={"position_std_m": (1e-4, 1e-4, 1e-4)}) if run.scenario.gnss else None
    blind = TrueRun(run.scenario.model_copy(update={"gnss": exact, "errors": known}), run.path, run.body, (), ())
    stages = {"white noise and drift": rigid_array.recording_of(blind, SEED, initial_std=None, slow=False)}
    result = {name: _pair(recording, steps) for name, recording in stages.items()}
    plain = rigid_array.recording_of(rigid_array.with_errors(run, known), SEED, initial_std=None)
    result["errors of the fixes"] = _pair(plain, steps)
    settings: dict[str, Any] = {}
    given = errors.model_dump()
    for name, part in parts_of(chips).items():
        settings["chips"] = part
        result[name] = _pair(_recording(run, known, settings), steps)
    for name, keys in SOURCES.items():
        settings |= {key: given[key] for key in keys}
        result[name] = _pair(_recording(run, known, settings), steps)
    ideal = float(np.sqrt(run.scenario.imus.count))
    before = ideal
    for row in result.values():
        row["costs"], before = before - row["ratio"], row["ratio"]
    return result


def try_candidates(run: TrueRun, errors: Errors, chips: Chips, steps: Steps) -> dict[str, dict[str, float]]:
    """Return the same with one source larger, and with a filter that is not told of the chips' offsets."""
    result = {}
    for name, sizes in CANDIDATES.items():
        result[name] = _pair(_recording(run, errors, {"chips": chips, **sizes}), steps)
    unaware = rigid_array.recording_of(with_chips(run, errors, chips), SEED, initial_std=None)
    result[UNAWARE] = _pair(unaware, steps)
    return result


def _recording(run: TrueRun, errors: Errors, settings: Mapping[str, Any]) -> Any:
    changed = rigid_array.with_errors(run, errors.model_copy(update=dict(settings)))
    return rigid_array.recording_of(changed, SEED)


def _pair(recording: Any, steps: Steps) -> dict[str, float]:
    row = rigid_array.figures(recording, ("enav-fusion",), steps.next())
    return {**row, "ratio": row["single"] / row["enav-fusion"]}


def statement(sources: Mapping[str, Mapping[str, float]], candidates: Mapping[str, Mapping[str, float]]) -> str:
    """Say in words which sources take most of the ratio, and which candidate comes nearest to what was measured."""
    largest = sorted(sources, key=lambda name: -sources[name]["costs"])[:2]
    last = list(sources.values())[-1]
    text = (
        f"All sources together: single {last['single']:.2f} m, ratio {last['ratio']:.2f};"
        f" {largest[0]} ({sources[largest[0]]['costs']:.2f}) and {largest[1]} ({sources[largest[1]]['costs']:.2f})"
        " take most of sqrt(N)."
    )
    if not candidates:
        return text
    worst = max(candidates, key=lambda name: candidates[name]["single"])
    lowest = min(candidates, key=lambda name: abs(candidates[name]["ratio"] - PAPER_RATIO))
    return (
        f"{text} Nearest to the paper's ratio of {PAPER_RATIO}: {lowest} ({candidates[lowest]['ratio']:.2f});"
        f" nearest to the lab's single IMU of {LAB['single']} m: {worst} ({candidates[worst]['single']:.2f} m)."
    )


def sources_figure(sources: Mapping[str, Mapping[str, float]], imus: int) -> Any:
    """Return the stacked picture of what each source takes of sqrt(N), and what is left."""
    left = list(sources.values())[-1]["ratio"]
    parts = {"left": left, **{name: row["costs"] for name, row in reversed(list(sources.items()))}}
    return bars({"eNav-Fusion": parts}, f"single / array, of sqrt({imus})", "stack")
