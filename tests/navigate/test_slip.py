from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from driven_vehicle import changed, off
from playing import events, navigator_for, play, rows
from slipping_wheels import rolling, slipping

from polyins.evaluation.verdict import of_live, of_measurements
from polyins.model.findings import Finding
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.navigate.navigator import Navigator

METHOD = "triple-ins"
SHORT = {
    "left": [(40.0, 0.5, 0.05), (79.0, 0.7, 0.05), (115.0, 0.6, -0.05)],
    "right": [(34.3, 0.5, -0.05), (82.2, 0.5, 0.05)],
}


def found(solution: Solution, kind: str = "slip") -> list[Finding]:
    return [one for one in of_measurements(solution.measurements) if one.kind == kind]


def has(findings: list[Finding], begin: float, length: float) -> bool:
    """Whether a finding covers a slip and little more."""
    return any(
        one.from_s is not None
        and one.to_s is not None
        and begin - 0.51 <= one.from_s <= begin + length
        and begin <= one.to_s <= begin + length + 0.51
        for one in findings
    )


def test_nothing_slips() -> None:
    recording = slipping({})
    judged, unjudged = batch.run(recording, METHOD), batch.run(recording.without_gate(), METHOD)
    assert not found(judged)
    assert not found(judged, "wheel")
    np.testing.assert_array_equal(judged.position, unjudged.position)


def test_short_slips_of_one_wheel() -> None:
    recording = slipping(SHORT)
    findings = found(batch.run(recording, METHOD))
    for name, slips in SHORT.items():
        for begin, length, _ in slips:
            assert rolling().path.speed(np.array([begin]))[0] > 2.0
            assert has(findings, begin, length), (name, begin)
    assert len(findings) == 5


def test_wheel_that_spins_and_wheel_that_locks() -> None:
    recording = slipping({"left": [(40.0, 2.0, 0.5)], "right": [(80.0, 2.0, -1.0)]})
    spins, locks = found(batch.run(recording, METHOD))
    assert (spins.stream, locks.stream) == ("left1", "right1")
    assert spins.size == pytest.approx(0.5 * 2.86, rel=0.1)
    assert locks.size == pytest.approx(-3.3, rel=0.1)
    assert locks.expected == pytest.approx(3.3, rel=0.1)
    assert has([spins], 40.0, 2.0)
    assert has([locks], 80.0, 2.0)


def test_all_wheels_slip_and_lock() -> None:
    both = [(40.0, 1.0, 0.2), (80.0, 1.5, -1.0)]
    solution = batch.run(slipping({"left": both, "right": both}), METHOD)
    findings = found(solution)
    assert [one.stream for one in findings] == ["wheel speed"] * 2
    assert all(has(findings, begin, length) for begin, length, _ in both)
    assert not solution.measurements["wheel speed"].accepted[
        np.searchsorted(solution.measurements["wheel speed"].time, 80.9)
    ]


def test_drift_is_that_without_slip() -> None:
    both = [(40.0, 1.0, 0.2), (83.0, 1.5, -1.0)]
    slips = {"left": [*both[:1], (70.0, 2.0, 0.3), *both[1:]], "right": both}
    rolls, recording = slipping({}), slipping(slips)
    error = [float(off(batch.run(one, METHOD), one)[-1]) for one in (rolls, recording, recording.without_gate())]
    assert error[1] < error[0] + 0.2
    assert error[2] > error[0] + 1.0


def test_radius_that_is_wrong_throughout() -> None:
    recording = changed(slipping({}), "left", radius=0.25 * 1.06)
    (wrong,) = found(batch.run(recording, METHOD), "wheel")
    assert wrong.text.startswith("left1, right1: differ")
    assert wrong.severity == "doubt"
    assert wrong.from_s is not None
    assert wrong.from_s < 30.0
    assert wrong.to_s is not None
    assert wrong.to_s > 85.0


def test_a_replay_is_the_batch_run_to_the_last_bit_and_finds_the_same(tmp_path: Path) -> None:
    prepared = batch.prepare(until(slipping(SHORT), 45.0), METHOD)
    played = events(prepared.recording)
    middle = next(n for n, event in enumerate(played) if event.arrives > 40.7)
    navigator = navigator_for(prepared, delay=0.1)
    states = play(navigator, prepared.recording, played[:middle])
    navigator.save(tmp_path / "checkpoint")
    resumed = Navigator.resume(tmp_path / "checkpoint")
    states |= play(resumed, prepared.recording, played[middle:])
    solution = batch.navigate(prepared)
    assert len(found(solution)) == 2
    assert of_measurements(resumed.measurements) == of_measurements(solution.measurements)
    assert set(found(solution)) <= set(of_live(resumed).findings)
    shown = np.isin(solution.time, list(states))
    assert shown.sum() > 5000
    np.testing.assert_array_equal([states[time] for time in solution.time[shown]], rows(solution)[shown])


def test_a_slip_that_is_believed_after_a_while_ends_without_harm() -> None:
    both = [(60.0, 8.0, 0.3)]
    recording = slipping({"left": both, "right": both})
    judged, unjudged = batch.run(recording, METHOD), batch.run(recording.without_gate(), METHOD)
    assert {one.severity for one in found(judged)} == {"doubt"}
    wheels = judged.measurements["wheel speed"]
    assert wheels.accepted[(wheels.time > 68.0) & (wheels.time < 75.0)].all()
    assert off(judged, recording)[-1] < off(unjudged, recording)[-1]


def until(recording: Recording, end: float) -> Recording:
    streams = []
    for stream in recording.imus:
        kept = stream.time <= end
        streams.append(replace(stream, time=stream.time[kept], dtheta=stream.dtheta[kept], dvel=stream.dvel[kept]))
    return replace(recording, imus=tuple(streams))
