"""Slips are drawn where the vehicle is fast, and found where one wheel of several slips."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from polyins.evaluation.verdict import of_measurements
from polyins.navigate import batch
from polyins.simulation.run import TrueRun, true_run
from polyins.studies.robustness.case import SCENARIOS
from polyins.studies.robustness.slips import APART, LEAST_SPEED, WHO, OneSlip, drawn, is_found, slipping

SEED = 2


@pytest.fixture(scope="module")
def run() -> TrueRun:
    return true_run(SCENARIOS["wheels"].model_copy(update={"seed": SEED}))


def test_slips_are_apart_and_fast(run: TrueRun) -> None:
    slips = drawn(run, np.random.default_rng(SEED))
    assert len(slips) > 8
    for one, other in pairwise(slips):
        assert other.begin - one.begin >= one.length + APART
    assert all(run.path.speed(np.array([one.begin, one.begin + one.length])).min() > LEAST_SPEED for one in slips)


def test_one_slip_of_one_wheel_is_found_and_nothing_else(run: TrueRun) -> None:
    begin = next(one.begin for one in drawn(run, np.random.default_rng(SEED)))
    slip = OneSlip(begin, 0.5, 0.1, 0)
    solution = batch.run(slipping(run, [slip], WHO[0], SEED), "triple-ins")
    findings = [one for one in of_measurements(solution.measurements) if one.kind == "slip"]
    assert len(findings) == 1
    assert is_found(slip, findings)
    assert not is_found(OneSlip(begin + 30.0, 0.5, 0.1, 0), findings)
