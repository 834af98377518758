"""What the votes over the data and the verdict cost: `python benchmarks/verdict_cost.py`.

CPU time, medians of some rounds, as a share of a run from files to files, as `polyins run` is, and of one in memory.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import TypeVar

from polyins.evaluation.figures import Figures
from polyins.evaluation.verdict import verdict
from polyins.navigate import batch
from polyins.prepare import timesync
from polyins.prepare.data_findings import of_data
from polyins.reading.loading import load
from polyins.screen import number, print_table
from polyins.simulation.files import write
from polyins.tools import bench, navigation

CASES = (("enav-fusion", 4), ("enav-fusion", 16), ("triple-ins", 0))
"""method, and IMUs of the array or 0 for a vehicle with wheels"""

Returned = TypeVar("Returned")


def main() -> None:
    """Time them and print a table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--seconds", type=float, default=300.0)
    given = options.parse_args()
    columns = ["method", "IMUs", "files, ms", "memory, ms", "votes, ms", "verdict, ms", "of files, %", "of memory, %"]
    print_table("votes and verdict", columns, [_row(*case, given.rounds, given.seconds) for case in CASES])


def _row(method: str, count: int, rounds: int, seconds: float) -> list[str]:
    recording = bench.array(count, seconds) if count else bench.vehicle(seconds)
    aligned = timesync.align(recording.imus, bridge=not recording.rig.has_wheels)
    end = float(aligned.time[-1])
    times: list[tuple[float, ...]] = []
    with tempfile.TemporaryDirectory() as folder:
        config, out = write(recording, Path(folder) / "data"), {Path(folder) / "out": None}
        for _ in range(rounds + 1):  # the first one warms up
            files_s, _ = _timed(lambda: navigation.run(load(config), method, folders=out))
            memory_s, solution = _timed(lambda: batch.run(recording, method))
            votes_s, _ = _timed(lambda: of_data(recording, aligned, end))
            figures = Figures(None, recording.outages, recording.geodetic)
            figures.add(solution)
            verdict_s, _ = _timed(partial(verdict, solution, figures))
            said = votes_s + verdict_s
            times.append((files_s, memory_s, votes_s, verdict_s, said / files_s, said / (memory_s + verdict_s)))
    files, memory, votes, judged, of_files, of_memory = (median(column) for column in zip(*times[1:], strict=True))
    milliseconds = [number(1e3 * one, 3) for one in (files, memory, votes, judged)]
    return [method, str(len(recording.imus)), *milliseconds, number(100.0 * of_files, 2), number(100.0 * of_memory, 2)]


def _timed(call: Callable[[], Returned]) -> tuple[float, Returned]:
    begin = time.process_time()
    returned = call()
    return time.process_time() - begin, returned


if __name__ == "__main__":
    main()
