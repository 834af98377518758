"""The gate through outages: chips with errors that the filter does not model, and fixes that lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from polyins.evaluation.errors import compare_to_reference
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording
from polyins.model.solution import Innovations
from polyins.navigate import batch
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario
from polyins.studies.array import SCENARIOS

CHIPS = SCENARIOS["chips"].model_copy(update={"duration_s": 400.0, "rate_hz": 100.0, "imus": Board(count=4)})
"""Outages of 30 s every 90 s; one fix per second."""


def innovations(recording: Recording, method: str = "single", imu: int = 0) -> Innovations:
    return batch.run(recording, method, imu=imu).innovations


def lying(recording: Recording, times: NDArray[np.float64], metres_east: float) -> Recording:
    assert recording.gnss is not None
    position = recording.gnss.position.copy()
    position[np.isin(recording.gnss.time, times), 1] += metres_east / metres_per_unit(position[0], True)[1]
    return replace(recording, gnss=replace(recording.gnss, position=position))


def test_misaligned_chips_reject_no_good_fix() -> None:
    """After outages and in bends, errors beyond the model put good fixes beyond ten of the filter's own sigma."""
    beyond = 0
    for seed in range(6):
        recording = simulate(CHIPS, seed=seed)
        assert recording.options.gate_limit is not None
        runs = [innovations(recording, imu=i) for i in range(4)]
        runs += [innovations(recording, method) for method in ("imu-fusion", "nav-fusion", "enav-fusion")]
        for run in runs:
            assert run.accepted.all()
            assert not run.reset.any()
        beyond += sum(np.count_nonzero(run.nis > recording.options.gate_limit) for run in runs)
    assert beyond > 3


@pytest.mark.parametrize("method", ["single", "imu-fusion", "nav-fusion", "enav-fusion"])
def test_misaligned_chips_still_tell_a_lie(method: str) -> None:
    """A metre and a half while fixes come, hundreds of metres at the end of an outage."""
    recording = simulate(CHIPS, seed=1)
    good = innovations(recording, method)
    ends = good.time[1:][np.diff(good.time) > 30.0]
    assert len(ends) == 3
    between = good.time[np.searchsorted(good.time, ends) + 20]
    for times, metres in ((ends, 300.0), (between, 1.5)):
        run = innovations(lying(recording, times, metres), method)
        np.testing.assert_array_equal(run.time[~run.accepted], times)
        assert not run.reset.any()


@pytest.mark.parametrize("late", [0.3, 1.0])
@pytest.mark.parametrize("method", ["single", "enav-fusion"])
def test_fixes_that_are_late_cost_little_more_than_the_way_in_that_time(method: str, late: float) -> None:
    """They bend the heading; to withhold them then would leave the vehicle to it, for hundreds of metres."""
    recording = simulate(Scenario(duration_s=260.0, rate_hz=50.0, imus=Board(count=2), outages=()), seed=2)
    assert recording.gnss is not None
    assert recording.reference is not None
    told = replace(recording, gnss=replace(recording.gnss, time=recording.gnss.time + late))
    solution = batch.run(told, method)
    errors = compare_to_reference(solution, recording.reference)
    speed = float(np.linalg.norm(solution.velocity, axis=1).max())
    assert 0.5 * late * speed < errors.horizontal.max() < 2.0 * late * speed
    assert not solution.innovations.reset.any()


def test_after_fixes_that_were_late_a_jump_of_a_better_receiver_weighs_little() -> None:
    """What the prediction is worth is judged by the last fixes, not by all."""
    recording = simulate(Scenario(duration_s=260.0, rate_hz=50.0, imus=Board(count=2), outages=()), seed=2)
    gnss = recording.gnss
    assert gnss is not None
    early = gnss.time < 100.0
    told = replace(recording, gnss=replace(gnss, time=np.where(early, gnss.time + 0.3, gnss.time)))
    jump = gnss.time[(gnss.time > 200.0) & (gnss.time < 203.0)]
    run = innovations(lying(told, jump, 10.0))
    np.testing.assert_array_equal(run.time[~run.accepted & (run.time > 150.0)], jump)
