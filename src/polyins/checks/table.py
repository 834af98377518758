"""All checks, in the order in which one makes sense only when those before it find nothing that can be put right."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from polyins.checks import (
    array_mounts,
    beginning,
    clipping,
    clocks,
    fix_scatter,
    heights,
    level,
    stamps,
    still,
    stuck,
    trial,
    twins,
    units,
    wraps,
)
from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.model.findings import Finding


@dataclass(frozen=True)
class Check:
    """One of them."""

    find: Callable[[Evidence], Iterable[Diagnosis]]
    before_runs: bool
    """whether `run` and `compare` say the same: what costs little, and is not said elsewhere"""


STAGES: tuple[tuple[Check, ...], ...] = (
    (Check(units.of_time, False), Check(twins.find, False)),
    (Check(units.of_values, True),),
    (
        Check(wraps.find, True),
        Check(stuck.find, True),
        Check(clipping.find, False),
        Check(stamps.jitter, False),
        Check(stamps.undersampled, True),
    ),
    (Check(level.upside, False), Check(level.handedness, True)),
    (Check(array_mounts.find, False),),
    (Check(clocks.find, False), Check(heights.find, True), Check(fix_scatter.find, False)),
    (Check(beginning.find, False),),
    (Check(still.breaks, False), Check(still.rest, False), Check(trial.find, False)),
)
"""all of one stage are asked together"""


def judged(check: Check, evidence: Evidence) -> Iterator[Diagnosis]:
    """Give what a check finds; what the user vouches for is a note that needs no remedy."""
    for one in check.find(evidence):
        if one.finding.kind in evidence.config.checks.accept:
            yield Diagnosis(replace(one.finding, severity="note"))
        else:
            yield one


def in_short(evidence: Evidence) -> tuple[Finding, ...]:
    """Return what the checks before every run find: doubts, for what it costs is known only after the run."""
    found = (one.finding for stage in STAGES for check in stage if check.before_runs for one in judged(check, evidence))
    return tuple(replace(one, severity="doubt") if one.severity == "serious" else one for one in found)
