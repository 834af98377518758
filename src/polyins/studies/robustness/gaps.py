"""Gaps in the data of all IMUs: what the standard deviations hold, and how soon the error is what it was.

An array with GNSS, and wheels with it and without; GNSS goes on in the gap. Each is run in a batch, live, and live with
a checkpoint that is saved before the gap and resumed after it. Live, the state counts that there is at the time.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.errors import compare_to_reference
from polyins.formats.documents import plain
from polyins.live.replay import Replay
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.navigate.navigator import Navigator, NavigatorState
from polyins.navigate.samples import GnssFix, ImuSample, Sample
from polyins.screen import number, print_table
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Fixes, Scenario
from polyins.studies.robustness.case import SCENARIOS
from polyins.studies.robustness.gap_faults import paused
from polyins.studies.robustness.stated_errors import StatedErrors, stated_errors
from polyins.tools.parallel import run_all

Array = NDArray[np.float64]

SEEDS = (1, 3, 5)
LENGTHS, LIVE_LENGTHS = (2.0, 10.0, 30.0, 60.0, 150.0, 600.0), (10.0, 150.0)
"""s"""
AT, AFTER = 120.0, 110.0
"""s before a gap, of which the first are a standstill, and after it"""
INSIDE = 3.0
"""standard deviations"""
BACK, IN_A_ROW = 2.0, 3
"""times the error without a gap, below which it is for so many fixes once it is back"""
SOON = 0.5
"""s after a fix: a state that is later is not that of the fix"""
EVERY = 0.5
"""s from one look at a live state to the next"""
WAYS = ("batch", "live", "resumed")


@dataclass(frozen=True)
class Carrier:
    """What has the gap."""

    name: str
    scenario: str
    method: str
    gnss: bool


CARRIERS = (
    Carrier("array", "fixes", "enav-fusion", True),
    Carrier("wheels with GNSS", "wheels", "triple-ins", True),
    Carrier("wheels", "wheels", "triple-ins", False),
)


@dataclass(frozen=True)
class Gap:
    """What pauses, for how long, and how it is run."""

    carrier: Carrier
    length: float
    """s"""
    way: str
    seeds: tuple[int, ...]
    """of the drives"""

    @property
    def name(self) -> str:
        """What it is, in words."""
        return f"{self.carrier.name}: {self.length:g} s, {self.way}"


CASES = tuple(
    # live a run takes long, and its states are those of the batch run
    Gap(carrier, length, way, SEEDS if way == "batch" else SEEDS[:1])
    for carrier in CARRIERS
    for length in LENGTHS
    for way in (WAYS if length in LIVE_LENGTHS else WAYS[:1])
)
QUICK_CASES = tuple(
    replace(one, seeds=SEEDS[:1])
    for one in CASES
    if one.length == LIVE_LENGTHS[0] and (one.way == "batch" or not one.carrier.gnss)
)


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run all gaps, or with `quick` those of ten seconds over one drive, and return the document."""
    cases = QUICK_CASES if quick else CASES
    rows = run_all([partial(figures_of, case) for case in cases], progress=progress)
    settings = {"seeds": list(SEEDS), "seeds_live": list(SEEDS[:1]), "begins_s": AT, "inside_std": INSIDE, "back": BACK}
    named = {case.name: row for case, row in zip(cases, rows, strict=True)}
    return {"target": "gaps", "paper": {}, "polyins": plain(named), "settings": settings}


def figures_of(case: Gap, progress: Callable[[float], None]) -> dict[str, Any]:
    """Return the figures of a case, over all seeds."""
    over: list[Array] = []
    back: list[int | None] = []
    end, method = AT + case.length, case.carrier.method
    for seed in case.seeds:
        whole = simulate(scenario(case.carrier, case.length), seed=seed)
        usual = track(batch.run(whole, method), whole)
        error = math.sqrt(float(np.mean(usual.horizontal[usual.time > end] ** 2)))
        recording = paused(whole, AT, case.length)
        solution = batch.run(recording, method)
        if case.way != "batch":
            solution = live(recording, solution, end if case.way == "resumed" else None)
        found = track(solution, whole)
        over.append(found.over)
        back.append(_fixes_until_back(found, whole, end, BACK * error))
        progress(len(over) / len(case.seeds))
    every = np.concatenate(over)
    return {
        "inside_percent": 100.0 * float(np.mean(every < INSIDE)),
        "error_over_std": float(np.max(every)),
        "fixes_until_back": None if None in back else max(one for one in back if one is not None),
    }


def _fixes_until_back(errors: StatedErrors, recording: Recording, end: float, limit: float) -> int | None:
    """Return after how many fixes from the end of a gap on the error is below a limit, m; None without fixes."""
    if recording.gnss is None:
        return None
    fixes = recording.gnss.time[(recording.gnss.time >= end) & (recording.gnss.time < errors.time[-1])]
    rows = np.searchsorted(errors.time, fixes, "right")
    # a state that is not later than the fix does not know it
    off = np.where(errors.time[rows] - fixes < SOON, errors.horizontal[rows], np.inf)
    back = np.all([off[k : len(off) - IN_A_ROW + 1 + k] < limit for k in range(IN_A_ROW)], axis=0)
    return int(np.argmax(back)) + 1 if back.any() else len(fixes)


def scenario(carrier: Carrier, length: float) -> Scenario:
    """Return a drive that is long enough for a gap, s."""
    known, seconds = SCENARIOS[carrier.scenario], AT + length + AFTER
    if known.laps is None:
        return known.model_copy(update={"duration_s": seconds})
    around = 2.0 * (known.laps.length_m + known.laps.width_m) / known.laps.speed_m_s
    laps = known.laps.model_copy(update={"count": math.ceil(seconds / around)})
    return known.model_copy(update={"laps": laps, "gnss": Fixes() if carrier.gnss else None})


def live(recording: Recording, batched: Solution, resumed: float | None) -> Solution:
    """Return the states that a navigator has as the samples come, in the place of those of the batch run.

    `resumed`: s, at which it goes on from a checkpoint that was saved before the gap.
    """
    navigator = Navigator(
        recording.rig,
        recording.start,
        method=batched.method,
        options=recording.options,
        geodetic=recording.geodetic,
        fixes=recording.gnss is not None,
    )
    samples = [one for chunk in Replay(recording).chunks() for one in chunk]
    states = _fed(navigator, [one for one in samples if resumed is None or one.time < AT], recording)
    if resumed is not None:
        with tempfile.TemporaryDirectory() as folder:
            navigator.save(Path(folder) / "checkpoint")
            navigator = Navigator.resume(Path(folder) / "checkpoint")
        states += _fed(navigator, [one for one in samples if one.time >= resumed], recording)
    return replace(
        batched,
        time=np.array([one.time for one in states]),
        position=np.array([one.position for one in states]),
        velocity=np.array([one.velocity for one in states]),
        attitude=np.array([one.attitude for one in states]),
        position_variance=np.array([one.position_std for one in states]) ** 2,
        velocity_variance=np.array([one.velocity_std for one in states]) ** 2,
        phi_covariance=np.array([one.phi_covariance for one in states]),
        status=None,
    )


def _fed(navigator: Navigator, samples: list[Sample], recording: Recording) -> list[NavigatorState]:
    """Feed a navigator and look at its state every now and then."""
    names = [imu.name for imu in recording.rig.imus]
    states: list[NavigatorState] = []
    due = -math.inf
    for one in samples:
        if isinstance(one, ImuSample):
            navigator.imu(one.time, one.dtheta, one.dvel, names.index(one.imu))
        elif isinstance(one, GnssFix) and one.position_std is not None:
            navigator.gnss(one.time, one.position, one.position_std)
        if one.time >= due:
            due, state = one.time + EVERY, navigator.state
            if state is not None and (not states or state.time > states[-1].time):
                states.append(state)
    return states


def track(solution: Solution, recording: Recording) -> StatedErrors:
    """Return the errors of a solution of a recording that has the truth."""
    assert recording.reference is not None
    return stated_errors(solution, compare_to_reference(solution, recording.reference))


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print a row for each case."""
    rows = [
        [name, number(one["inside_percent"], 2), number(one["error_over_std"], 2), number(one["fixes_until_back"])]
        for name, one in figures.items()
    ]
    columns = ["gap in all IMUs", f"inside {INSIDE:g} std, %", "largest error over std", "fixes until back"]
    print_table("gaps", columns, rows)
