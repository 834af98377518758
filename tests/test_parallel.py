"""Jobs in threads: results in order, an error ends the rest, progress that never goes back."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from polyins.comparison import compare
from polyins.parallel import run_all
from polyins.simulation.scenario import Board, Scenario, simulate


def test_results_come_in_the_order_of_the_jobs_whichever_ends_first():
    second_done = threading.Event()

    def first(tell):
        assert second_done.wait(10.0)
        return "first"

    def second(tell):
        second_done.set()
        return "second"

    assert run_all([first, second], threads=2) == ["first", "second"]


def test_progress_is_the_mean_share_of_all_jobs_and_ends_at_one():
    told: list[float] = []

    def job(tell):
        for share in (0.25, 0.5, 1.0):
            tell(share)

    run_all([job] * 4, threads=2, progress=told.append)
    assert told == sorted(told)
    assert len(told) == 12
    assert told[-1] == 1.0


def test_an_error_is_raised_and_ends_the_jobs_that_run_or_wait():
    running, stopped, began = threading.Event(), threading.Event(), []

    def fails(tell):
        assert running.wait(10.0)
        raise ValueError("no start")

    def goes_on(tell):
        running.set()
        try:
            for _ in range(10_000):
                tell(0.0)
                threading.Event().wait(0.001)
        except BaseException:
            stopped.set()
            raise

    with pytest.raises(ValueError, match="no start"):
        run_all([fails, goes_on, *(lambda tell: began.append(1) for _ in range(50))], threads=2)
    assert stopped.is_set()
    assert not began


def test_a_comparison_in_threads_is_that_on_one_core():
    recording = simulate(Scenario(duration_s=90.0, imus=Board(count=2)))
    one, two = (compare(recording, ["single", "nav-fusion", "enav-fusion"], threads=n) for n in (1, 2))
    assert list(one.solutions) == list(two.solutions) == ["single", "nav-fusion", "enav-fusion"]
    assert list(one.each) == list(two.each)
    assert list(one.document["methods"]) == list(two.document["methods"])
    for name, solution in (one.solutions | one.each).items():
        np.testing.assert_array_equal(solution.position, (two.solutions | two.each)[name].position)
    assert one.document["ratio_to_single"] == two.document["ratio_to_single"]
