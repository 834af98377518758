"""Several methods over one recording or several, with every single IMU as the yardstick."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from polyins.errors import InputError
from polyins.evaluation.documents import CompareDocument, SeveralDocument
from polyins.evaluation.summary import comparison, over_recordings
from polyins.model.methods import ARRAY_METHODS, find_method
from polyins.model.recording import Recording
from polyins.model.rig import Rig
from polyins.model.solution import Solution
from polyins.navigate.choice import available
from polyins.reading.long_recording import LongRecording
from polyins.tools.navigation import Outcome, head, run
from polyins.tools.parallel import Progress, cores, run_all
from polyins.version import __version__

SINGLE_RATE_HZ = 10.0
"""of the files of single IMUs: they are a yardstick"""
RECORDINGS_AT_ONCE = 2
"""one is read or written while the methods run over the other"""


@dataclass(frozen=True)
class Comparison:
    """What each method made of a recording."""

    outcomes: dict[str, Outcome]
    """by method; the first IMU's for `single`"""
    each: dict[str, Solution]
    """every IMU on its own, by its name"""
    document: CompareDocument
    """the `compare` document"""

    @property
    def solutions(self) -> dict[str, Solution]:
        """The solution of each method; the first IMU's for `single`."""
        return {name: outcome.solution for name, outcome in self.outcomes.items()}


@dataclass(frozen=True)
class Files:
    """Where a comparison writes its solutions: a folder per method, below that of single IMUs one for each."""

    folder: Path
    single_rate_hz: float | None = SINGLE_RATE_HZ
    """rows a second of the folders for each IMU; None: every epoch"""

    def of_singles(self, alone: str, names: Sequence[str]) -> list[dict[Path, float | None]]:
        """Return the folders of each IMU, run by `alone`, whose own has the first one's."""
        found: list[dict[Path, float | None]] = [{self.folder / alone / name: self.single_rate_hz} for name in names]
        if found:
            found[0][self.folder / alone] = None
        return found


def compare(
    recording: Recording | LongRecording,
    methods: Sequence[str] | None = None,
    *,
    files: Files | None = None,
    threads: int | None = None,
    pool: ThreadPoolExecutor | None = None,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Run every method, or all that the rig allows, and each IMU on its own: on a vehicle each wheel that gives speed.

    The runs share the cores, or as many threads as are given, or a `pool` with other comparisons; the solutions are the
    same with any number of them. With `files` each is written where it is made.
    `progress` is called with the share of all runs that is done. Raises InputError for an unknown method, before
    anything runs.
    """
    rig = head(recording).rig
    if methods is None:
        methods = available(rig) if rig.has_wheels else ARRAY_METHODS
    for name in methods:
        if find_method(name).for_wheels != rig.has_wheels:
            raise InputError(f"method: {name!r} is for rigs {'without' if rig.has_wheels else 'with'} wheels")
    alone = "wheel-ins" if rig.has_wheels else "single"
    arrays = [name for name in methods if name != alone]
    names = singles_of(rig)
    alone_runs = [(f"{alone}/{name}", 0) if rig.has_wheels else (alone, i) for i, name in enumerate(names)]

    wanted = files if alone in methods else None
    folders: list[dict[Path, float | None]]
    folders = [{files.folder / name: None} for name in arrays] if files else [{} for _ in arrays]
    folders += wanted.of_singles(alone, names) if wanted else [{} for _ in names]
    # those of the array take longest
    order = [*((name, 0) for name in arrays), *alone_runs]
    jobs = [partial(_run, recording, name, imu, into) for (name, imu), into in zip(order, folders, strict=True)]
    done = run_all(jobs, threads=threads, pool=pool, progress=progress)
    each = dict(zip(names, done[len(arrays) :], strict=True))
    outcomes = {alone: next(iter(each.values()))} if alone in methods else {}
    outcomes |= dict(zip(arrays, done, strict=False))
    summaries = {name: outcome.summary for name, outcome in outcomes.items()}
    return Comparison(
        outcomes,
        {name: outcome.solution for name, outcome in each.items()},
        comparison(summaries, [{**outcome.summary, "imu": name} for name, outcome in each.items()], alone),
    )


def compare_several(
    recordings: Mapping[str, Callable[[], Recording | LongRecording]],
    take: Callable[[str, Recording | LongRecording, Comparison], None],
    methods: Sequence[str] | None = None,
    *,
    files: Files | None = None,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> SeveralDocument:
    """Compare the methods over several recordings, by name what reads each; return the document of all.

    All runs share the threads. A recording is read when its turn comes and let go once `take` has taken what came out,
    so that two of them are in memory at most. Every recording counts the same in `progress`. `files`: each recording
    has a folder of its name there.
    """

    def one(name: str, tell: Progress) -> CompareDocument:
        recording = recordings[name]()
        own = None if files is None else replace(files, folder=files.folder / name)
        result = compare(recording, methods, files=own, pool=pool, progress=tell)
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


def _run(
    recording: Recording | LongRecording, method: str, imu: int, folders: Mapping[Path, float | None], tell: Progress
) -> Outcome:
    return run(recording, method, imu=imu, folders=folders, progress=tell)


def singles_of(rig: Rig) -> list[str]:
    """Return what is run on its own: every IMU, or on a vehicle every module on a wheel that gives speed."""
    if not rig.has_wheels:
        return [imu.name for imu in rig.imus]
    wheels = {name: rig.imus[indices[0]].wheel for name, indices in rig.modules().items()}
    return [name for name, wheel in wheels.items() if wheel is not None and not wheel.steering]
