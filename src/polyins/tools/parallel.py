"""Several runs at once: the kernels release Python's lock, so that threads use all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from functools import partial
from threading import Lock
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
Progress = Callable[[float], None]
Job = Callable[[Progress], Result]
"""called with what it tells the share of its work done"""


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_all(
    jobs: Sequence[Job[Result]],
    *,
    threads: int | None = None,
    pool: ThreadPoolExecutor | None = None,
    progress: Progress | None = None,
) -> list[Result]:
    """Do all jobs, as many at once as there are cores unless `threads` says how many; return results in their order.

    With a `pool` they share its threads with the jobs of others. `progress` is told the mean share of all. The error of
    the job that fails first is raised; jobs that run then stop at their next report, and those that wait do not begin.
    """
    board = _Board(len(jobs), progress)

    def do(number: int, job: Job[Result]) -> Result:
        with board.failures():
            return job(partial(board.tell, number))

    with nullcontext(pool) if pool else ThreadPoolExecutor(max(1, threads or cores())) as workers:
        futures = [workers.submit(do, number, job) for number, job in enumerate(jobs)]
        try:
            return [future.result() for future in futures]
        except BaseException as error:
            board.failure = board.failure or error
            for future in futures:
                future.cancel()
            raise board.failure from None


def in_order(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return what a function makes of each item, in their order, on all cores.

    The error of what fails first is raised, once what runs has ended.
    """
    return run_all([partial(_apply, function, item) for item in items])


def _apply(function: Callable[[Item], Result], item: Item, _: Progress) -> Result:
    return function(item)


class StoppedError(Exception):
    """Ends a job whose result nobody waits for any more."""


class _Board:
    """The share that each job has done, and the first failure."""

    def __init__(self, jobs: int, progress: Progress | None) -> None:
        self._shares = [0.0] * jobs
        self._progress = progress
        self._lock = Lock()
        self.failure: BaseException | None = None

    @contextmanager
    def failures(self) -> Iterator[None]:
        """Remember the error that ends the block, if it is the first; end it at once if there was one before."""
        self._stop_after_failure()
        try:
            yield
        except StoppedError:
            raise
        except BaseException as error:
            self.failure = self.failure or error
            raise

    def tell(self, number: int, share: float) -> None:
        """Take in the share that a job has done."""
        self._stop_after_failure()
        with self._lock:
            self._shares[number] = share
            if self._progress:
                self._progress(sum(self._shares) / len(self._shares))

    def _stop_after_failure(self) -> None:
        if self.failure is not None:
            raise StoppedError
