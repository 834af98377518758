"""Wheels that slip, one or all at once: how many of the slips are found, and what they cost.

A robot with a chip in each wheel and one on its body drives laps by dead reckoning. Its wheels turn more or less than
they roll by 5 % and more for half a second and more, always at 2 m/s and more, one slip every few seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.errors import compare_to_reference
from polyins.evaluation.verdict import of_measurements
from polyins.formats.documents import plain
from polyins.model.findings import Finding
from polyins.model.methods import find_method
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.navigate.choice import choose
from polyins.screen import number, print_table
from polyins.simulation.path import smooth_steps
from polyins.simulation.rolling import roll
from polyins.simulation.run import TrueRun, record, true_run
from polyins.simulation.wheels import wheel_increments
from polyins.studies.robustness.case import SCENARIOS
from polyins.tools.parallel import run_all

Array = NDArray[np.float64]

SEEDS = (1, 3, 5)
METHODS, QUICK_METHODS = ("triple-ins", "dual-wheel-ins", "body-wheel-ins", "triple-ins/centralized"), ("triple-ins",)
SHARES, LENGTHS = (0.05, 0.1, 0.2, 0.5), (0.5, 1.0, 2.0, 4.0)
"""by which a wheel turns more, or less, than it rolls; s"""
RISE = 0.02
"""s from rolling to slipping"""
LEAST_SPEED, APART = 2.0, 8.0
"""m/s; s from one slip to the next at least"""
NEAR = 0.6
"""s from a slip to a finding: speeds are judged every half second"""
WHO = ("one wheel", "all wheels")


@dataclass(frozen=True)
class OneSlip:
    """One slip."""

    begin: float
    """s"""
    length: float
    """s"""
    share: float
    """by which the wheel turns more than it rolls"""
    wheel: int
    """of one wheel: which"""


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Let one wheel slip, and all, under every method, or with `quick` under one over one drive."""
    seeds, methods = (SEEDS[:1], QUICK_METHODS) if quick else (SEEDS, METHODS)
    cases = [(who, method) for who in WHO for method in methods]
    rows = run_all([partial(_row, *case, seeds) for case in cases], progress=progress)
    names = [f"{who}: {method}" for who, method in cases]
    settings = {
        "seeds": list(seeds),
        "shares": list(SHARES),
        "lengths_s": list(LENGTHS),
        "least_speed_m_s": LEAST_SPEED,
    }
    return {"target": "slips", "paper": {}, "polyins": plain(dict(zip(names, rows, strict=True))), "settings": settings}


def _row(who: str, method: str, seeds: tuple[int, ...], progress: Callable[[float], None]) -> dict[str, Any]:
    count = found = false = 0
    errors = np.zeros((4, 0))
    for seed in seeds:
        run = true_run(SCENARIOS["wheels"].model_copy(update={"seed": seed}))
        slips = drawn(run, np.random.default_rng(seed))
        recording = slipping(run, slips, who, seed)
        solution = batch.run(recording, method)
        findings = [one for one in of_measurements(solution.measurements) if one.kind in ("slip", "wheel")]
        if method.startswith("body-wheel") and who == WHO[0]:
            # it has but the first wheel
            slips = [slip for slip in slips if slip.wheel == 0]
        count, found = count + len(slips), found + sum(is_found(slip, findings) for slip in slips)
        false += sum(not any(_near(slip, one) for slip in slips) for one in findings)
        rolls = slipping(run, [], who, seed)
        runs = ((rolls, rolls), (recording, recording), (recording, recording.without_gate()))
        rms = [_rms_error(known, batch.run(taken, method)) for known, taken in runs]
        blind = np.hypot(rms[0], _least_error(recording, method, slips)) if _nothing_rolls(who, method) else rms[0]
        errors = np.column_stack([errors, [*rms, blind]])
        progress(1.0 / len(seeds))
    rolled, judged, unjudged, least = np.sqrt(np.mean(errors**2, axis=1))
    return {
        "slips": count,
        "found": found,
        "false": false,
        "error_ratio": judged / rolled,
        "error_ratio_unjudged": unjudged / rolled,
        "error_ratio_least": least / rolled,
    }


def drawn(run: TrueRun, rng: np.random.Generator) -> list[OneSlip]:
    """Return slips of a drive."""
    slips: list[OneSlip] = []
    time = run.scenario.static_s + 2.0 * APART
    while time < run.path.duration - 2.0 * APART:
        length = float(rng.choice(LENGTHS))
        slip = OneSlip(time, length, float(rng.choice(SHARES) * rng.choice([-1.0, 1.0])), int(rng.integers(2)))
        if run.path.speed(np.linspace(time, time + length, 20)).min() < LEAST_SPEED:
            time += 1.0
            continue
        slips.append(slip)
        time += length + float(rng.uniform(APART, 2.0 * APART))
    return slips


def slipping(run: TrueRun, slips: list[OneSlip], who: str, seed: int) -> Recording:
    """Return the recording of a drive with those slips, of the wheel that each says or of all at once."""
    wheels = []
    for i, module in enumerate(run.scenario.wheels):
        knots = [(0.0, 0.0)]
        for slip in slips:
            if who != WHO[0] or slip.wheel == i:
                begin, end = slip.begin, slip.begin + slip.length
                knots += [(begin - RISE, 0.0), (begin, slip.share), (end, slip.share), (end + RISE, 0.0)]
        knots.append((run.path.duration, 0.0))
        curve = smooth_steps(*np.array(knots).T)
        wheels.append(roll(run.path, module.position_m, module.radius_m, phase=1.0 + i, slip=curve))
    spinning = tuple(wheel_increments(wheel, run.scenario.rate_hz) for wheel in wheels)
    return record(replace(run, wheels=tuple(wheels), spinning=spinning), seed=seed).recording


def is_found(slip: OneSlip, findings: list[Finding]) -> bool:
    """Whether a finding is of the time of a slip."""
    return any(_near(slip, one) for one in findings)


def _near(slip: OneSlip, finding: Finding) -> bool:
    if finding.from_s is None or finding.to_s is None:
        return False
    return finding.from_s < slip.begin + slip.length + NEAR and finding.to_s > slip.begin - NEAR


def _nothing_rolls(who: str, method: str) -> bool:
    """Whether no wheel of a method rolls while one slips."""
    return who == WHO[1] or method.startswith("body-wheel")


def _least_error(recording: Recording, method: str, slips: list[OneSlip]) -> float:
    """Return the rms that the noise of the accelerometers makes of a drive, if each slip is known and none is used.

    In a slip of length L the way is off by sqrt(q L^3 / 3), with q the density of the noise of their mean, m^2/s^3.
    """
    imus = [recording.rig.imus[i] for i in choose(find_method(method), recording.rig).all]
    density = float(np.mean([np.mean(imu.noise.velocity_random_walk**2) for imu in imus])) / len(imus)
    time = recording.imus[0].time
    ended = [density * slip.length**3 / 3.0 * float(np.mean(time > slip.begin + slip.length)) for slip in slips]
    return float(np.sqrt(np.sum(ended)))


def _rms_error(recording: Recording, solution: Solution) -> float:
    assert recording.reference is not None
    return float(np.sqrt(np.mean(compare_to_reference(solution, recording.reference).horizontal ** 2)))


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print a row for each method."""
    counts, ratios = ("slips", "found", "false"), ("error_ratio", "error_ratio_least", "error_ratio_unjudged")
    rows = [
        [name, *(str(one[key]) for key in counts), *(number(one[key], 3) for key in ratios)]
        for name, one in figures.items()
    ]
    last = ["error over that\nwithout slip", "at least,\nif all are known", "if none is\njudged"]
    print_table("slips of wheels", ["who slips", "slips", "found", "found falsely", *last], rows)
