"""Fixes that lie, one lie at a time: how far off position and heading are, in metres and degrees.

A drive of seven minutes without outages, one IMU; three seeds. Of lies that end, errors are those up to `LATER` seconds
after they began, and `later_m` the largest after that; of a step for good, errors are against where the step leads.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.evaluation.errors import compare_to_reference
from polyins.evaluation.verdict import of_measurements
from polyins.formats.documents import plain
from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.screen import number, print_table
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario
from polyins.studies.robustness.fault import during, fixes, moved, with_gnss
from polyins.tools.parallel import run_all

SEEDS = (1, 3, 5)
AT, LATER = 150.0, 160.0
FOLLOWED = 15.0
"""s after which a true step has to be followed"""
SCENARIO = Scenario(duration_s=420.0, rate_hz=50.0, imus=Board(count=1), outages=())
METHOD = "single"


@dataclass(frozen=True)
class Lie:
    """What fixes say instead of the truth."""

    name: str
    tell: Callable[[Recording], Recording]
    step: float = 0.0
    """m north, by which the truth of a step for good is off"""


def _jump(recording: Recording, *, metres: float, axis: int, length: float) -> Recording:
    off = np.zeros(3)
    off[axis] = metres
    return moved(recording, during(recording, AT, length), off)


def _repeated(recording: Recording, *, length: float) -> Recording:
    where, position = during(recording, AT, length), fixes(recording).position.copy()
    position[where] = position[int(np.argmax(where))]
    return with_gnss(recording, position=position)


def _near_zero(recording: Recording, *, length: float) -> Recording:
    position = fixes(recording).position.copy()
    position[during(recording, AT, length), :2] = np.radians(1e-7)
    return with_gnss(recording, position=position)


def _noise(recording: Recording, *, begin: float, length: float) -> Recording:
    """Tell 1 cm, and be off by 1 m."""
    where = during(recording, begin, length)
    off = np.random.default_rng(5).normal(0.0, 1.0, (int(where.sum()), 3))
    std = fixes(recording).position_std.copy()
    std[where] = 0.01
    return with_gnss(moved(recording, where, off), position_std=std)


def _drift(recording: Recording, *, rate: float, length: float) -> Recording:
    where = during(recording, AT, length)
    return moved(recording, where, np.outer(rate * (fixes(recording).time[where] - AT), [1.0, 0.0, 0.0]))


def _late(recording: Recording, *, by: float) -> Recording:
    return with_gnss(recording, time=fixes(recording).time + by)


def _truth(recording: Recording) -> Recording:
    return recording


LIES = (
    Lie("none", _truth),
    Lie("2 m for 5 s", partial(_jump, metres=2.0, axis=1, length=5.0)),
    Lie("10 m for 2 s", partial(_jump, metres=10.0, axis=0, length=2.0)),
    Lie("10 m for 5 s", partial(_jump, metres=10.0, axis=0, length=5.0)),
    Lie("50 m for 15 s", partial(_jump, metres=50.0, axis=0, length=15.0)),
    Lie("position repeated for 5 s", partial(_repeated, length=5.0)),
    Lie("(1e-7, 1e-7) deg for 5 s", partial(_near_zero, length=5.0)),
    Lie("1 cm told, 1 m true, always", partial(_noise, begin=0.0, length=np.inf)),
    Lie("1 cm told, 1 m true, for 60 s", partial(_noise, begin=AT, length=60.0)),
    Lie("drift of 0.2 m/s for 60 s", partial(_drift, rate=0.2, length=60.0)),
    Lie("0.3 s late", partial(_late, by=0.3)),
    Lie("1 s late", partial(_late, by=1.0)),
    Lie("18 s late", partial(_late, by=18.0)),
    Lie("a true step of 2 m", partial(_jump, metres=2.0, axis=0, length=np.inf), step=2.0),
    Lie("a true step of 10 m", partial(_jump, metres=10.0, axis=0, length=np.inf), step=10.0),
    Lie("a true step of 50 m", partial(_jump, metres=50.0, axis=0, length=np.inf), step=50.0),
)


@cache
def _drive(seed: int) -> Recording:
    return simulate(SCENARIO, seed=seed)


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Tell every lie over three drives, or with `quick` over one, and return the document."""
    seeds = SEEDS[: 1 if quick else None]
    rows = run_all([partial(_row, lie, seeds) for lie in LIES], progress=progress)
    settings = {"seeds": list(seeds), "method": METHOD, "begins_s": AT, "later_s": LATER, "followed_s": FOLLOWED}
    return {
        "target": "lies",
        "paper": {},
        "polyins": plain(dict(zip([lie.name for lie in LIES], rows, strict=True))),
        "settings": settings,
    }


def _row(lie: Lie, seeds: tuple[int, ...], progress: Callable[[float], None]) -> dict[str, Any]:
    """Return the worst of all seeds."""
    told = [told_lie(lie, seed) for seed in seeds]
    progress(1.0)
    known = [one for one in told if "refused" not in one]
    row: dict[str, Any] = {"refused": len(told) - len(known)}
    for key in ("horizontal_max_m", "heading_max_deg", "later_max_m"):
        row[key] = max((one[key] for one in known), default=None)
    row["named"] = sorted({kind for one in told for kind in one["named"]})
    return row


def told_lie(lie: Lie, seed: int) -> dict[str, Any]:
    """Return the largest errors, and the kinds of what was said; or that the run was refused."""
    recording = lie.tell(_drive(seed))
    try:
        solution = batch.run(recording, METHOD)
    except InputError as refusal:
        return {"refused": str(refusal), "named": ["refused"]}
    assert recording.reference is not None
    errors = compare_to_reference(solution, recording.reference)
    assert errors.attitude is not None
    off = np.hypot(errors.position[:, 0] - lie.step * (errors.time >= AT), errors.position[:, 1])
    # the first fix that lies is told from then on
    since = errors.time - float(fixes(recording).time[int(np.argmax(fixes(recording).time >= AT))])
    shown = (since > (FOLLOWED if lie.step else 0.0)) & (since < LATER)
    findings = (*solution.findings, *of_measurements(solution.measurements, solution.findings))
    return {
        "horizontal_max_m": float(off[shown].max()),
        "heading_max_deg": float(np.degrees(np.abs(errors.attitude[(since > 0.0) & (since < LATER), 2]).max())),
        "later_max_m": float(off[since >= LATER].max()),
        "named": [one.kind for one in findings if one.kind != "coverage"],
    }


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print a row for each lie."""
    rows = [
        [
            name,
            "refused" if one["horizontal_max_m"] is None else number(one["horizontal_max_m"], 2),
            number(one["heading_max_deg"], 2),
            number(one["later_max_m"], 2),
            ", ".join(one["named"]),
        ]
        for name, one in figures.items()
    ]
    print_table("lies of GNSS", ["lie", "largest error, m", "of heading, deg", "later, m", "named"], rows)
