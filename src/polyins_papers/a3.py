"""Paper A, Table III: four rigid arrays of 16 IMUs through 29 outages; and what keeps the gain from being sqrt(16).

Every source of error has one documented size (`a3.yaml`), the same for all methods. `sources` adds them one after the
other; `candidates` makes one of them larger, to see which could make what was measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from polyins.config import Positive, Section
from polyins.model.recording import Recording
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.run import TrueRun, true_run
from polyins.studies import rigid_array
from polyins.studies.chips import Chips, parts_of
from polyins.studies.pictures import bars, write_figure
from polyins.studies.progress import Steps
from polyins.studies.scenario_files import read

METHODS = ("imu-fusion", "nav-fusion", "enav-fusion")
GROUPS = (1, 2, 3, 4)
QUICK_GROUPS = (1,)
SEEDS = (0, 1, 2, 3)
QUICK_SEEDS = (0,)
"""of sources and candidates"""
EXACT_M, NOTHING = (1e-4, 1e-4, 1e-4), (0.0, 0.0, 0.0)
"""m: std of fixes that take nothing from the gain"""

PAPER = {
    "group1": (5.68, 1.98, 1.97, 2.05),
    "group2": (4.23, 1.66, 1.71, 1.63),
    "group3": (3.94, 1.74, 1.87, 1.72),
    "group4": (5.42, 2.27, 2.31, 2.31),
    "rms": (4.87, 1.93, 1.98, 1.95),
}
"""m: single and the three methods"""
PAPER_RATIO = 2.51
SINGLES = (4.87, 6.98)
"""m: the paper's and the lab's single IMU"""
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

CANDIDATES = tuple(SOURCES)[:4]
"""Those whose size is an estimate: each in turn at the upper end of what is plausible, `upper.yaml`."""
UNAWARE = "filter told 250 mGal of offset"
STATED = "fixes as noisy as they state"

Document = dict[str, Any]


class Upper(Section):
    """What `upper.yaml` says."""

    errors: SensorErrors
    """those that are estimates"""
    standstill_late_s: Positive
    """by how much the standstill is taken too long, s"""


UPPER = read(Upper, __package__, "upper")


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> Document:
    """Run all groups, uncompensated and compensated, then the sources of error, and return the document.

    `quick` takes the first eleven outages of Group 1 at 20 Hz, and no candidates. `out` is the folder for the picture.
    """
    scenario = rigid_array.base_scenario(quick)
    groups = QUICK_GROUPS if quick else GROUPS
    steps = Steps(progress, 2 * len(groups) + 5 + len(SOURCES) + (0 if quick else len(CANDIDATES) + 4))
    run = true_run(scenario)
    errors = scenario.errors
    tables: dict[str, dict[str, dict[str, float]]] = {"uncompensated": {}, "compensated": {}}
    for number in groups:
        chips = rigid_array.group_chips(number, scenario.imus.count)
        recording = rigid_array.recording_of(with_chips(run, errors, chips), seed=number)
        tables["uncompensated"][f"group{number}"] = rigid_array.figures(recording, METHODS, steps.next())
        recording = rigid_array.compensated(recording, chips)
        tables["compensated"][f"group{number}"] = rigid_array.figures(recording, METHODS, steps.next())
    chips = rigid_array.group_chips(1, scenario.imus.count)
    seeds = QUICK_SEEDS if quick else SEEDS
    sources = add_sources(run, errors, chips, seeds, steps)
    candidates = {} if quick else try_candidates(run, errors, chips, seeds, steps)
    if out is not None:
        write_figure(sources_figure(sources, scenario.imus.count), out / "a3-sources.html")
    return {
        "target": "a3",
        "paper": {
            "uncompensated": with_spread(
                table({name: dict(zip(("single", *METHODS), row, strict=True)) for name, row in PAPER.items()})
            ),
            "compensated": {"group1": {"single": LAB["single"], "imu-fusion": LAB["compensated"]}},
        },
        "polyins": {
            **{name: with_spread(table({**rows, "rms": pooled(rows)})) for name, rows in tables.items()},
            "sources": sources,
            "candidates": candidates,
            "largest_difference_of_methods": largest_difference(tables["uncompensated"]),
            "statement": statement(sources, candidates),
        },
        "settings": {
            "track": rigid_array.provenance(),
            "outages": len(run.scenario.outage_intervals()),
            "scenario": scenario.model_dump(mode="json", exclude=rigid_array.ELSEWHERE),
            "sources": "added one after the other, each with all before it; Group 1's chips",
            "seeds": seeds,
        },
    }


def with_chips(run: TrueRun, errors: SensorErrors, chips: Chips) -> TrueRun:
    """Return the run with errors and the chips of a group."""
    return rigid_array.with_errors(run, errors.model_copy(update={"chips": chips}))


def table(rows: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, Any]]:
    """Return the rows, each with the ratios of single to the methods."""
    return {
        name: {**row, "ratio": {method: row["single"] / row[method] for method in METHODS}}
        for name, row in rows.items()
    }


def with_spread(rows: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the rows with the standard deviations over the groups."""
    groups = [row for name, row in rows.items() if name != "rms"]
    names = ("single", *METHODS)
    figures = {name: float(np.std([row[name] for row in groups])) for name in names}
    ratios = {name: float(np.std([row["ratio"][name] for row in groups])) for name in METHODS}
    return {**rows, "spread": {**figures, "ratio": ratios}}


def pooled(rows: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Return the rms over the groups."""
    names = next(iter(rows.values()))
    return {name: rigid_array.rms(np.array([row[name] for row in rows.values()])) for name in names}


def largest_difference(rows: Mapping[str, Mapping[str, float]]) -> float:
    """Return by how much of the least the three methods differ at most within a group."""
    values = [[row[method] for method in METHODS] for row in rows.values()]
    return max(max(row) / min(row) - 1.0 for row in values)


def add_sources(
    run: TrueRun, errors: SensorErrors, chips: Chips, seeds: Sequence[int], steps: Steps
) -> dict[str, dict[str, float]]:
    """Return single, eNav-Fusion, their ratio and what of the ratio each source takes, added one after the other."""
    known = rigid_array.with_errors(run, SensorErrors(scales=errors.scales))
    exact = _with_fixes(known, position_std_m=EXACT_M, slow_std_m=NOTHING, stated_std_m=EXACT_M)
    result = {"white noise and drift": _pooled(partial(_recording_of_known_chips, exact), seeds, steps)}
    result["errors of the fixes"] = _pooled(partial(_recording_of_known_chips, known), seeds, steps)
    given = errors.model_dump()
    for name, part in parts_of(chips).items():
        known = with_chips(run, known.scenario.errors, part)
        result[name] = _pooled(partial(rigid_array.recording_of, known), seeds, steps)
    for name, keys in SOURCES.items():
        known = _changed(known, {key: given[key] for key in keys})
        result[name] = _pooled(partial(rigid_array.recording_of, known), seeds, steps)
    before = float(np.sqrt(run.scenario.imus.count))
    for row in result.values():
        row["costs"], before = before - row["ratio"], row["ratio"]
    return result


def try_candidates(
    run: TrueRun, errors: SensorErrors, chips: Chips, seeds: Sequence[int], steps: Steps
) -> dict[str, dict[str, float]]:
    """Return the same with one source larger, with a filter told too little, and with a start a little wrong."""
    own, upper = with_chips(run, errors, chips), UPPER.errors.model_dump()
    makers: dict[str, Callable[[int], Recording]] = {
        name: partial(rigid_array.recording_of, _changed(own, {key: upper[key] for key in SOURCES[name]}))
        for name in CANDIDATES
    }
    plain, sensitive = partial(rigid_array.recording_of, own), makers["g-sensitivity"]
    makers[UNAWARE] = lambda seed: rigid_array.unaware(plain(seed))
    makers[f"g-sensitivity, and {UNAWARE}"] = lambda seed: rigid_array.unaware(sensitive(seed))
    assert run.scenario.gnss is not None
    as_stated = _with_fixes(own, position_std_m=run.scenario.gnss.stated_std_m)
    makers[STATED] = partial(rigid_array.recording_of, as_stated)
    late = UPPER.standstill_late_s
    # the first biases and velocity are then wrong alike for all IMUs
    makers[f"standstill taken {late:g} s too long"] = lambda seed: _late(plain(seed), run.path.static + late)
    return {name: _pooled(make, seeds, steps) for name, make in makers.items()}


def _changed(run: TrueRun, settings: Mapping[str, Any]) -> TrueRun:
    return rigid_array.with_errors(run, run.scenario.errors.model_copy(update=dict(settings)))


def _pooled(make: Callable[[int], Recording], seeds: Sequence[int], steps: Steps) -> dict[str, float]:
    """Return rms over seeds and outages; each seed lets other IMUs be the single one."""
    report, every = steps.next(), len(seeds)
    single, array = [], []
    for k, seed in enumerate(seeds):
        recording = make(seed)
        single += [rigid_array.maxima(recording, "single", imu=i) for i in range(k, len(recording.imus), every)]
        array.append(rigid_array.maxima(recording, "enav-fusion"))
        report((k + 1) / every)
    row = {"single": rigid_array.rms(np.array(single)), "enav-fusion": rigid_array.rms(np.array(array))}
    return {**row, "ratio": row["single"] / row["enav-fusion"]}


def _recording_of_known_chips(run: TrueRun, seed: int) -> Recording:
    return rigid_array.unaware(rigid_array.recording_of(run, seed))


def _with_fixes(run: TrueRun, **keys: Any) -> TrueRun:
    """Return the run with other errors of its fixes."""
    assert run.scenario.gnss is not None
    receiver = run.scenario.gnss.model_copy(update=keys)
    return replace(run, scenario=run.scenario.model_copy(update={"gnss": receiver}))


def _late(recording: Recording, until: float) -> Recording:
    """Return the recording with the first seconds of motion taken for standstill."""
    interval = (float(recording.imus[0].time[0]), until)
    return replace(recording, start=replace(recording.start, static_interval=interval))


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
    nearest = min(candidates, key=lambda name: abs(candidates[name]["ratio"] - PAPER_RATIO))
    worst = max(candidates, key=lambda name: candidates[name]["single"])
    text += (
        f" With one thing changed at a time: nearest to the paper's ratio of {PAPER_RATIO} is"
        f" {nearest} ({candidates[nearest]['ratio']:.2f}); the largest single figure comes from {worst}"
        f" ({candidates[worst]['single']:.2f} m; the lab's is {LAB['single']} m)."
    )
    key = "g_sensitivity_deg_s_g"
    sizes = {figure: size_for(figure, sources, candidates["g-sensitivity"]["single"]) for figure in SINGLES}
    needed = " and ".join(f"{size:.3f} for {figure} m" for figure, size in sizes.items())
    return f"{text} {key} would have to be {needed} (plausible: 0.01 to 0.1)."


def size_for(figure: float, sources: Mapping[str, Mapping[str, float]], at_most: float) -> float:
    """Return the g-sensitivity, deg/s/g, that makes a single IMU's figure, m, whose square is linear in its square.

    `at_most` is the figure at the size of `upper.yaml`; the other point is that of no g-sensitivity.
    """
    names = list(sources)
    without = sources[names[names.index("g-sensitivity") - 1]]["single"] ** 2
    largest = UPPER.errors.g_sensitivity_deg_s_g
    return float(largest * np.sqrt(max(figure**2 - without, 0.0) / (at_most**2 - without)))


def sources_figure(sources: Mapping[str, Mapping[str, float]], imus: int) -> Any:
    """Return the stacked picture of what each source takes of sqrt(N) on top of those before it."""
    ideal = float(np.sqrt(imus))
    columns = {
        name: {"left": row["ratio"], "taken by this source": row["costs"],
               "by those before it": ideal - row["ratio"] - row["costs"]}
        for name, row in sources.items()
    }  # fmt: skip
    return bars(columns, f"single / array, of sqrt({imus}) = {ideal:.2f}", "stack")
