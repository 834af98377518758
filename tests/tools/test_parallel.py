"""Jobs in threads: results in order, an error ends the rest, progress that never goes back."""

from __future__ import annotations

import gc
import threading
import weakref

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.evaluation.summary import rms
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario
from polyins.tools.comparison import compare, compare_several
from polyins.tools.parallel import in_order, run_all


def test_results_come_in_the_order_of_the_jobs_whichever_ends_first():
    second_done = threading.Event()

    def first(tell):
        assert second_done.wait(10.0)
        return "first"

    def second(tell):
        second_done.set()
        return "second"

    assert run_all([first, second], threads=2) == ["first", "second"]


def test_items_keep_their_order():
    assert in_order(lambda value: value**2, range(20)) == [value**2 for value in range(20)]


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


SEEDS = {f"seed {k}": k for k in (1, 2, 3)}
METHODS = ["single", "enav-fusion"]


def recording_of(seed):
    drive = Scenario(
        duration_s=60.0, static_s=20.0, imus=Board(count=2), outages=((40.3, 50.3),), reference_rate_hz=10.0
    )
    return simulate(drive, seed=seed)


def test_several_recordings_give_what_each_gives_alone():
    solutions, told = {}, []

    def take(name, recording, result):
        solutions[name] = result.solutions

    readers = {name: lambda seed=seed: recording_of(seed) for name, seed in SEEDS.items()}
    document = compare_several(readers, take, METHODS, threads=2, progress=told.append)
    assert list(document["recordings"]) == list(SEEDS)
    assert told == sorted(told)
    assert told[-1] == 1.0
    for name, seed in SEEDS.items():
        alone = compare(recording_of(seed), METHODS, threads=1)
        assert document["recordings"][name]["ratio_to_single"] == alone.document["ratio_to_single"]
        for method, solution in alone.solutions.items():
            np.testing.assert_array_equal(solution.position, solutions[name][method].position)
    parts = [part["methods"] for part in document["recordings"].values()]
    pooled = document["pooled"]
    for method in METHODS:
        maxima = [part[method]["outages"]["each_m"][0] for part in parts]
        assert pooled["methods"][method]["outages"]["horizontal_max_rms_m"] == pytest.approx(rms(np.array(maxima)))
        errors = np.array([part[method]["reference"]["horizontal_rms_m"] for part in parts])
        assert pooled["methods"][method]["reference"]["horizontal_rms_m"] == pytest.approx(rms(errors))
    single, fused = (pooled["methods"][method]["outages"]["horizontal_max_rms_m"] for method in METHODS)
    assert pooled["ratio_to_single"] == {"enav-fusion": pytest.approx(single / fused)}


def test_a_recording_is_let_go_before_the_one_after_the_next_is_read():
    alive, most = [], []

    def read():
        gc.collect()
        most.append(sum(one() is not None for one in alive))
        recording = recording_of(len(alive))
        alive.append(weakref.ref(recording))
        return recording

    compare_several({str(k): read for k in range(5)}, lambda *_: None, METHODS, threads=1)
    assert len(most) == 5
    assert max(most) <= 1


def test_a_recording_that_cannot_be_read_ends_all_with_its_error():
    read = []

    def fails():
        raise InputError("b.yaml: no such file")

    def good():
        read.append(1)
        return recording_of(1)

    with pytest.raises(InputError, match="no such file"):
        compare_several({"a": good, "b": fails, "c": good, "d": good}, lambda *_: None, METHODS, threads=2)
    assert len(read) <= 2
