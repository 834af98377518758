"""Several methods over one recording, with every single IMU as the yardstick."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from polyins import batch
from polyins.errors import InputError
from polyins.evaluation.summary import comparison, summarize
from polyins.methods import ARRAY_METHODS, find_method
from polyins.modules import available
from polyins.recording import Recording
from polyins.solution import Solution

Document = dict[str, Any]


@dataclass(frozen=True)
class Comparison:
    """What each method made of a recording."""

    solutions: dict[str, Solution]
    """by method; the first IMU's for `single`"""
    each: dict[str, Solution]
    """every IMU on its own, by its name"""
    document: Document
    """the `compare` document"""


def compare(
    recording: Recording,
    methods: Sequence[str] | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Run every method, or all that the rig allows, and each IMU on its own: on a vehicle each wheel that gives speed.

    `progress` is called with the share of runs done. Raises InputError for an unknown method, before anything runs.
    """
    wheels = recording.rig.rolling
    if methods is None:
        methods = available(recording.rig) if wheels else ARRAY_METHODS
    for name in methods:
        if find_method(name).rolling != wheels:
            raise InputError(f"method: {name!r} is for rigs {'without' if wheels else 'with'} wheels")
    alone = "wheel-ins" if wheels else "single"
    arrays = [name for name in methods if name != alone]
    names = singles_of(recording)
    total = len(names) + len(arrays)

    def stage(number: int) -> Callable[[float], None] | None:
        return (lambda share: progress((number + share) / total)) if progress else None

    each = {
        name: batch.run(recording, f"{alone}/{name}" if wheels else alone, imu=0 if wheels else i, progress=stage(i))
        for i, name in enumerate(names)
    }
    solutions = {alone: next(iter(each.values()))} if alone in methods else {}
    for number, name in enumerate(arrays, len(each)):
        solutions[name] = batch.run(recording, name, progress=stage(number))
    summaries = {name: summarize(s, recording.reference, recording.outages) for name, s in solutions.items()}
    singles = [summarize(s, recording.reference, recording.outages) for s in each.values()]
    return Comparison(solutions, each, comparison(summaries, singles, alone))


def singles_of(recording: Recording) -> list[str]:
    """Return what is run on its own: every IMU, or on a vehicle every module on a wheel that gives speed."""
    rig = recording.rig
    if not rig.rolling:
        return [imu.name for imu in rig.imus]
    wheels = {name: rig.imus[indices[0]].wheel for name, indices in rig.modules().items()}
    return [name for name, wheel in wheels.items() if wheel is not None and not wheel.steering]
