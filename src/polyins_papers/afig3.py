"""Paper A, Fig. 3, and two curves it leaves out: the gain against the number of IMUs and against what they share.

Fig. 3 shows how little the position std of six separate filters differs, which is why they may share one covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import StartOptions
from polyins.model.rig import DEG
from polyins.navigate import batch
from polyins.simulation.path import Path
from polyins.simulation.run import TrueRun, record, true_run
from polyins.simulation.scenario import Board, Scenario
from polyins.studies.pictures import lines, write_figure
from polyins.studies.progress import Steps
from polyins.studies.rigid_array import maxima, rms
from polyins.studies.scenario_files import scenarios
from polyins_papers import nonrigid

Array = NDArray[np.float64]

ARRAYS = {"rigid": "rigid", "on rulers": "test A"}
"""the six IMUs of Table V's test A on the lawn, on rulers that do not bend and on those that do"""
SHOWN = (51.0, 53.0)
"""s after the standing start: the paper's figure; its filters seem to begin there, for all have the same first value"""

SCENARIOS = scenarios(__package__, "afig3")
ARRAY = SCENARIOS["curves"]

COUNTS = (1, 2, 4, 8, 16, 32, 64)
QUICK_COUNTS = (1, 2, 4, 8, 16)
SHARES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
QUICK_SHARES = (0.0, 0.05, 0.2)
COMMON = 0.05
"""share of the second curve against the number of IMUs"""
SEEDS = 4
IMUS = 16

PAPER_FIG3 = {"before_fix_m": [0.155, 0.193], "after_fix_m": [0.018, 0.021]}
"""least and largest east std of six IMUs after one second and after the fix, as the text gives them"""

Document = dict[str, Any]


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: FilePath | None = None
) -> Document:
    """Return the document; `quick` takes fewer IMUs, shares and seeds. `out` is the folder for the pictures."""
    counts, shares, seeds = (QUICK_COUNTS, QUICK_SHARES, 1) if quick else (COUNTS, SHARES, SEEDS)
    steps = Steps(progress, len(ARRAYS) + seeds * (2 + len(shares)))
    std = {}
    for name, test in ARRAYS.items():
        time, std[name] = six_filters(test)
        steps.next()(1.0)
    by_count = {
        "independent": against_count(counts, 0.0, seeds, steps),
        f"common {COMMON:g}": against_count(counts, COMMON, seeds, steps),
    }
    by_share = against_share(shares, seeds, steps)
    if out is not None:
        write_pictures(out, time, std["on rulers"], by_count, by_share)
    return {
        "target": "afig3",
        "paper": {"fig3": dict.fromkeys(ARRAYS, PAPER_FIG3), "ratio_by_imus": {}, "ratio_by_common_share": {}},
        "polyins": {
            "fig3": {name: around_first_fix(time, rows) for name, rows in std.items()},
            "ratio_by_imus": by_count,
            "ratio_by_common_share": by_share,
        },
        "settings": {
            "fig3": "least and largest east std of six separate filters, before and after the first fix",
            "seeds": seeds,
            "sqrt_n": {str(n): float(np.sqrt(n)) for n in counts},
            "expected_by_share": {f"{c:g}": expected(IMUS, c) for c in shares},
            "robot": {name: drive(test).model_dump(mode="json") for name, test in ARRAYS.items()},
            "array": ARRAY.model_dump(mode="json"),
        },
    }


def expected(imus: int, common: float) -> float:
    """Return the gain of a mean of errors that share a part of their variance."""
    return float(1.0 / np.sqrt(common + (1.0 - common) / imus))


def drive(test: str) -> Scenario:
    """Return the scenario of a test with what the figure has otherwise."""
    own = SCENARIOS["six filters"]
    return nonrigid.scenario_of(test, quick=False).model_copy(
        update={key: getattr(own, key) for key in own.model_fields_set}
    )


def six_filters(test: str) -> tuple[Array, Array]:
    """Return times since the start, s, shape (T,), and the position std of six separate filters, m, shape (6, T, 3)."""
    scenario, std = drive(test), []
    truth = true_run(scenario)
    recording = record(truth, seed=scenario.seed).recording.as_published().without_gate()
    for number, imu in enumerate(recording.rig.imus):
        alone = replace(recording.subset([number]), start=_start(truth.path, imu.position, scenario))
        solution = batch.run(alone, "single")
        std.append(np.sqrt(solution.position_variance))
    return solution.time - scenario.static_s, np.array(std)


def _start(path: Path, place: Array, scenario: Scenario) -> StartOptions:
    """Return a start in motion, from the truth of an IMU's place and the same std for all."""
    static, std = scenario.static_s, scenario.start_std
    truth = path.truth([static + SHOWN[0]], place)
    return StartOptions(
        time=float(truth.time[0]),
        end_time=static + SHOWN[1],
        position=truth.position[0],
        velocity=truth.velocity[0],
        roll_pitch=truth.attitude[0, :2],
        heading=float(truth.attitude[0, 2]),
        heading_from="value",
        position_std=np.array(std.position_m),
        velocity_std=np.array(std.velocity_m_s),
        attitude_std=np.array(std.attitude_deg) * DEG,
        estimate_gyro_bias=False,
    )


def around_first_fix(time: Array, std: Array) -> dict[str, list[float]]:
    """Return least and largest east std of the six just before and just after the first fix."""
    at = int(np.argmin(np.diff(std[:, :, 1].mean(axis=0))))
    before, after = std[:, at, 1], std[:, at + 1, 1]
    return {
        "before_fix_m": [float(before.min()), float(before.max())],
        "after_fix_m": [float(after.min()), float(after.max())],
    }


def _with_common(truth: TrueRun, common: float, imus: int) -> TrueRun:
    errors = truth.scenario.errors.model_copy(update={"common_noise_share": common, "common_drift_share": common})
    scenario = truth.scenario.model_copy(update={"errors": errors, "imus": Board(count=imus)})
    return replace(truth, scenario=scenario)


def against_count(counts: Sequence[int], common: float, seeds: int, steps: Steps) -> dict[str, float]:
    """Return single over eNav-Fusion of the first N IMUs, by N; each the ratio of rms over seeds and outages."""
    squares: dict[int, list[float]] = {0: [], **{n: [] for n in counts}}
    for seed in range(seeds):
        report = steps.next()
        truth = true_run(ARRAY.model_copy(update={"seed": seed}))
        recording = record(_with_common(truth, common, max(counts)), seed=seed).recording.as_published().without_gate()
        singles = min(max(counts), IMUS)
        squares[0] += [rms(maxima(recording, "single", imu=i)) ** 2 for i in range(singles)]
        for k, n in enumerate(counts, 1):
            squares[n].append(rms(maxima(recording.subset(range(n)), "enav-fusion")) ** 2)
            report(k / len(counts))
    return {str(n): float(np.sqrt(np.mean(squares[0]) / np.mean(squares[n]))) for n in counts}


def against_share(shares: Sequence[float], seeds: int, steps: Steps) -> dict[str, float]:
    """Return single over eNav-Fusion of 16 IMUs by the share of the variance that they have in common."""
    squares: dict[float, list[tuple[float, float]]] = {common: [] for common in shares}
    for seed in range(seeds):
        truth = true_run(ARRAY.model_copy(update={"seed": seed}))
        for common in shares:
            recording = record(_with_common(truth, common, IMUS), seed=seed).recording.as_published().without_gate()
            single = np.mean([rms(maxima(recording, "single", imu=i)) ** 2 for i in range(IMUS)])
            squares[common].append((float(single), rms(maxima(recording, "enav-fusion")) ** 2))
            steps.next()(1.0)
    return {f"{c:g}": float(np.sqrt(np.divide(*np.mean(values, axis=0)))) for c, values in squares.items()}


def write_pictures(out: FilePath, time: Array, std: Array, by_count: Document, by_share: Document) -> None:
    """Write the three figures."""
    curves = {f"IMU {k}": (time.tolist(), row[:, 1].tolist()) for k, row in enumerate(std, 1)}
    write_figure(lines(curves, "time since start (s)", "east std (m)", markers=False), out / "afig3-std.html")
    counts = [float(n) for n in next(iter(by_count.values()))]
    ratios = {name: (counts, list(row.values())) for name, row in by_count.items()}
    ratios["sqrt(N)"] = (counts, np.sqrt(counts).tolist())
    write_figure(lines(ratios, "IMUs", "single / array", logarithmic=True), out / "afig3-imus.html")
    shares = [float(c) for c in by_share]
    gains = {
        "eNav-Fusion": (shares, list(by_share.values())),
        "expected": (shares, [expected(IMUS, c) for c in shares]),
    }
    write_figure(lines(gains, "share of variance in common", "single / array of 16"), out / "afig3-common.html")
