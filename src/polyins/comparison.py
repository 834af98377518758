"""Several methods over one recording, with every single IMU as the yardstick."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from polyins import batch
from polyins.evaluation.summary import comparison, summarize
from polyins.methods import METHODS, find_method
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
    methods: Sequence[str] = tuple(METHODS),
    *,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Run every method, and each IMU on its own.

    `progress` is called with the share of runs done. Raises InputError for an unknown method, before anything runs.
    """
    for name in methods:
        find_method(name)
    arrays = [name for name in methods if name != "single"]
    total = len(recording.imus) + len(arrays)

    def stage(number: int) -> Callable[[float], None] | None:
        return (lambda share: progress((number + share) / total)) if progress else None

    each = {
        imu.name: batch.run(recording, "single", imu=i, progress=stage(i)) for i, imu in enumerate(recording.rig.imus)
    }
    solutions = {"single": next(iter(each.values()))} if "single" in methods else {}
    for number, name in enumerate(arrays, len(each)):
        solutions[name] = batch.run(recording, name, progress=stage(number))
    summaries = {name: summarize(s, recording.reference, recording.outages) for name, s in solutions.items()}
    singles = [summarize(s, recording.reference, recording.outages) for s in each.values()]
    return Comparison(solutions, each, comparison(summaries, singles))
