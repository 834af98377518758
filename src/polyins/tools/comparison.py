"""Several methods over one recording or several, with every single IMU as the yardstick."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

from polyins.errors import InputError
from polyins.evaluation.summary import comparison, over_recordings, summarize
from polyins.model.methods import ARRAY_METHODS, find_method
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.navigate.choice import available
from polyins.tools.parallel import Progress, cores, run_all
from polyins.version import __version__

Document = dict[str, Any]

RECORDINGS_AT_ONCE = 2
"""one is read or written while the methods run over the other"""


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
    threads: int | None = None,
    pool: ThreadPoolExecutor | None = None,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Run every method, or all that the rig allows, and each IMU on its own: on a vehicle each wheel that gives speed.

    The runs share the cores, or as many threads as are given, or a `pool` with other comparisons; the solutions are the
    same with any number of them.
    `progress` is called with the share of all runs that is done. Raises InputError for an unknown method, before
    anything runs.
    """
    wheels = recording.rig.has_wheels
    if methods is None:
        methods = available(recording.rig) if wheels else ARRAY_METHODS
    for name in methods:
        if find_method(name).for_wheels != wheels:
            raise InputError(f"method: {name!r} is for rigs {'without' if wheels else 'with'} wheels")
    alone = "wheel-ins" if wheels else "single"
    arrays = [name for name in methods if name != alone]
    names = singles_of(recording)
    alone_runs = [(f"{alone}/{name}", 0) if wheels else (alone, i) for i, name in enumerate(names)]
    # those of the array take longest
    order = [*((name, 0) for name in arrays), *alone_runs]
    jobs = [partial(_run, recording, name, imu) for name, imu in order]
    done = run_all(jobs, threads=threads, pool=pool, progress=progress)
    each = dict(zip(names, done[len(arrays) :], strict=True))
    runs = {alone: next(iter(each.values()))} if alone in methods else {}
    runs |= dict(zip(arrays, done, strict=False))
    return Comparison(
        {name: solution for name, (solution, _) in runs.items()},
        {name: solution for name, (solution, _) in each.items()},
        comparison(
            {name: summary for name, (_, summary) in runs.items()}, [summary for _, summary in each.values()], alone
        ),
    )


def compare_several(
    recordings: Mapping[str, Callable[[], Recording]],
    take: Callable[[str, Recording, Comparison], None],
    methods: Sequence[str] | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Document:
    """Compare the methods over several recordings, by name what reads each; return the document of all.

    All runs share the threads. A recording is read when its turn comes and let go once `take` has taken what came out,
    so that two of them are in memory at most. Every recording counts the same in `progress`.
    """

    def one(name: str, tell: Progress) -> Document:
        recording = recordings[name]()
        result = compare(recording, methods, pool=pool, progress=tell)
        take(name, recording, result)
        return result.document

    with ThreadPoolExecutor(threads or cores()) as pool:
        jobs = [partial(one, name) for name in recordings]
        documents = run_all(jobs, threads=RECORDINGS_AT_ONCE, progress=progress)
    return {
        "polyins": __version__,
        "recordings": dict(zip(recordings, documents, strict=True)),
        "pooled": over_recordings(documents),
    }


def _run(recording: Recording, method: str, imu: int, tell: Progress) -> tuple[Solution, Document]:
    solution = batch.run(recording, method, imu=imu, progress=tell)
    return solution, summarize(solution, recording.reference, recording.outages)


def singles_of(recording: Recording) -> list[str]:
    """Return what is run on its own: every IMU, or on a vehicle every module on a wheel that gives speed."""
    rig = recording.rig
    if not rig.has_wheels:
        return [imu.name for imu in rig.imus]
    wheels = {name: rig.imus[indices[0]].wheel for name, indices in rig.modules().items()}
    return [name for name, wheel in wheels.items() if wheel is not None and not wheel.steering]
