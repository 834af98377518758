"""A sick IMU does not stop the others live: its samples are left out, and named with when and how many."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from polyins.model.geodesy import displacement
from polyins.model.recording import Recording
from polyins.navigate.navigator import Navigator
from polyins.navigate.refusals import MOST_NAMED, NOT_FINITE, OUT_OF_RANGE, ZEROS, Refusals, unfit
from polyins.prepare.plausible import BODY
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario

Array = NDArray[np.float64]
RATE_HZ = 50.0
SICK = 1

Fault = Callable[[float, Array], tuple[float, Array]]


@pytest.fixture(scope="module")
def array() -> Recording:
    return simulate(Scenario(duration_s=40.0, static_s=10.0, rate_hz=RATE_HZ, imus=Board(count=3)), seed=1)


def navigated(recording: Recording, fault: Fault, *, together: bool = False, silent: bool = False) -> Navigator:
    """Navigate with the samples of one IMU changed, from nothing to the end."""
    gnss = recording.gnss
    assert gnss is not None
    navigator = Navigator(recording.rig, recording.start)
    fixes = iter(zip(gnss.time, gnss.position, gnss.position_std, strict=True))
    fix = next(fixes)
    for k, time in enumerate(recording.imus[0].time):
        samples = [(time, np.concatenate([one.dtheta[k], one.dvel[k]])) for one in recording.imus]
        samples[SICK] = fault(time, samples[SICK][1])
        if together:
            values = np.array([of for _, of in samples])
            navigator.imu(time, values[:, :3], values[:, 3:])
        else:
            for i, (stamp, of) in enumerate(samples):
                if not (silent and i == SICK):
                    navigator.imu(stamp, of[:3], of[3:], i)
        while fix is not None and fix[0] <= time:
            navigator.gnss(*fix)
            fix = next(fixes, None)
    navigator.flush()
    return navigator


def during(begin: float, end: float, change: Callable[[Array], Array]) -> Fault:
    return lambda time, values: (time, change(values) if begin < time <= end else values)


def with_first(value: float) -> Callable[[Array], Array]:
    return lambda values: np.concatenate([[value], values[1:]])


FAULTS: dict[str, tuple[Fault, str, int]] = {
    "NaN": (during(20.0, 21.0, with_first(np.nan)), NOT_FINITE, 50),
    "inf": (during(20.0, 21.0, with_first(-np.inf)), NOT_FINITE, 50),
    "1e30": (during(20.0, 30.0, with_first(1e30)), OUT_OF_RANGE, 500),
    "1e300": (during(20.0, 20.021, with_first(1e300)), OUT_OF_RANGE, 1),
    "5 rad": (during(20.0, 20.021, with_first(5.0)), OUT_OF_RANGE, 1),
    "200 m/s": (during(20.0, 20.021, lambda values: values + 200.0 * np.eye(6)[4]), OUT_OF_RANGE, 1),
    "zeros": (during(20.0, 50.0, np.zeros_like), ZEROS, 1000),
    "NaN at the beginning": (during(0.0, 6.0, with_first(np.nan)), NOT_FINITE, 300),
    "a stamp that stays": (lambda time, values: (min(time, 20.0) if time < 20.1 else time, values), "duplicated", 4),
    "stamps that go back": (lambda time, values: (time - 2.003 * (20.0 < time < 21.0), values), "late", 50),
}


@pytest.mark.parametrize("together", [False, True])
@pytest.mark.parametrize("case", FAULTS)
def test_the_others_go_on_and_it_is_named(case: str, together: bool, array: Recording) -> None:
    fault, why, count = FAULTS[case]
    if together and "stamp" in case:
        pytest.skip("samples with one stamp have no stamps of their own")
    navigator = navigated(array, fault, together=together)
    assert navigator.counts == {why: pytest.approx(count, abs=1)}
    assert {one.kind for one in navigator.findings} <= {"left out", "gap"}
    (finding,) = (one for one in navigator.findings if one.kind == "left out")
    assert (finding.stream, finding.severity) == ("imu2", "note")
    assert finding.size == navigator.counts[why]
    state, reference = navigator.state, array.reference
    assert state is not None
    assert reference is not None
    assert state.time == array.imus[0].time[-1]
    error = displacement(state.position, reference.position[-1], array.geodetic)
    assert np.linalg.norm(error[:2]) < 5.0 * np.linalg.norm(state.position_std[:2])


def test_good_data_are_all_taken(array: Recording) -> None:
    for together in (False, True):
        navigator = navigated(array, lambda time, values: (time, values), together=together)
        assert navigator.counts == {}
        assert navigator.findings == ()


def test_an_imu_that_never_sends_does_not_keep_the_others_from_starting(array: Recording) -> None:
    navigator = navigated(array, lambda time, values: (time, values), silent=True)
    assert navigator.waits_for == ""
    (finding,) = navigator.findings
    assert (finding.kind, finding.stream, finding.severity) == ("gap", "imu2", "note")
    assert finding.to_s == array.imus[0].time[-1]
    assert [one.silent for one in navigator.health] == [False, True, False]
    assert navigator.state is not None
    assert navigator.state.time == array.imus[0].time[-1]


def test_a_sample_of_unknown_length_is_not_judged_by_its_size() -> None:
    assert unfit(0.0, np.full(6, 100.0), BODY, np.nan) == ""
    assert unfit(0.0, np.full(6, 100.0), BODY, 1.0) == OUT_OF_RANGE
    assert unfit(np.nan, np.full(6, 0.1), BODY, 1.0) == NOT_FINITE


def test_many_stretches_are_one_finding() -> None:
    refusals = Refusals()
    for k in range(3 * MOST_NAMED):
        refusals.add("left", ZEROS, 10.0 * k)
        refusals.add("left", ZEROS, 10.0 * k + 0.5)
        if k == 2:
            assert [(one.from_s, one.to_s, one.size) for one in refusals.findings()] == [
                (0.0, 0.5, 2),
                (10.0, 10.5, 2),
                (20.0, 20.5, 2),
            ]
    (finding,) = refusals.findings()
    assert (finding.from_s, finding.to_s, finding.size) == (0.0, 30.0 * MOST_NAMED - 9.5, 6 * MOST_NAMED)
