"""Each fault changes what is recorded, is the same when drawn again, and is judged as a user would see it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from polyins.model.recording import Recording
from polyins.studies.reproduction import leaves
from polyins.studies.robustness.case import Case, cases, good
from polyins.studies.robustness.fault import during, unchanged
from polyins.studies.robustness.lies import LIES, told_lie
from polyins.studies.robustness.table import Row, document, judged, print_tables, summary

SEEDS = (0, 2)
ALL = cases(SEEDS)


def named(name: str) -> Case:
    return next(case for case in ALL if case.name == name)


def streams(recording: Recording) -> list[np.ndarray]:
    fixes = (
        [] if recording.gnss is None else [recording.gnss.time, recording.gnss.position, recording.gnss.position_std]
    )
    imus = [values for one in recording.imus for values in (one.time, one.dtheta, one.dvel)]
    return [*imus, *fixes]


def same(one: Recording, other: Recording) -> bool:
    pairs = zip(streams(one), streams(other), strict=True)
    return all(a.shape == b.shape and np.array_equal(a, b, equal_nan=True) for a, b in pairs)


def test_there_are_enough_of_every_kind() -> None:
    assert len(ALL) >= 150
    assert {case.fault.stream for case in ALL} == {"imu", "clock", "gnss", "gap", "start", "wheel"}
    assert {case.seed for case in ALL} == set(SEEDS)
    assert len({(case.name, case.method) for case in ALL}) == len(ALL)


@pytest.mark.parametrize(
    "case", [case for case in ALL if case.fault.inject is not unchanged], ids=lambda case: case.name
)
def test_a_fault_changes_what_is_recorded_and_is_drawn_alike(case: Case) -> None:
    recording = case.recording()
    start = recording.start != good(case.scenario, case.seed).start
    assert start or not same(recording, good(case.scenario, case.seed))
    assert same(recording, case.recording())


def test_fixes_for_good_are_all_fixes() -> None:
    recording = good("fixes", 0)
    assert during(recording, -np.inf).all()
    assert 0 < during(recording, 100.0, 5.0).sum() <= 5


def test_a_jump_is_named_and_costs_little() -> None:
    row = judged(named("fixes: jump of 50 to 150 m for 5 s"))
    assert row.named
    assert row.verdict == "trust"
    assert row.figures is not None
    assert row.figures[0] < 1.2
    assert row.figures[1] < 5.0


def test_what_is_refused_names_the_fault() -> None:
    row = judged(named("fixes: std negative"))
    assert row.verdict == "refused"
    assert row.named
    assert row.figures is None


def test_the_sums_count_what_is_wrong_in_silence() -> None:
    def row(ratio: float, over: float, verdict: str, named: bool) -> Row:
        return Row("fault", "imu", "single", ratio, over, verdict, named, ())

    rows = [
        row(5.0, 12.0, "trust", False),
        row(5.0, 12.0, "doubt", True),
        row(1.0, 2.0, "trust", True),
        row(1.0, np.nan, "trust", True),
        Row("fault", "imu", "single", None, None, "refused", True, ("why",)),
    ]
    sums = summary(rows, [])
    assert (sums["cases"], sums["refused"], sums["silent_wrong"]) == (5, 1, 2)
    assert sums["named_percent"] == 50.0
    assert sums["trusted_if_harmless_percent"] == 100.0


def test_a_document_lists_cases_by_name_and_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [
        Row("late", "gnss", "single", 5.0, 12.0, "doubt", True, ("delay",)),
        Row("odd", "imu", "single", None, None, "refused", True, ()),
    ]
    said = json.loads(json.dumps(document(rows, [])))
    assert [case["name"] for case in said["cases"]] == ["late", "odd"]
    assert {"stream", "method", "error_ratio", "error_over_std", "verdict", "named"} < set(said["cases"][0])
    assert said["cases"][1]["error_ratio"] is None
    assert {"cases", "silent_wrong", "nan", "named_percent", "trusted_if_harmless_percent", "false_findings"} < set(
        said["summary"]
    )
    print_tables(said)
    assert "late" in capsys.readouterr().out
    page = dict(leaves(said))
    assert page["cases / late / error_ratio"] == "5.000"


@pytest.mark.parametrize(("name", "metres"), [("10 m for 5 s", 0.5), ("1 cm told, 1 m true, always", 3.0)])
def test_a_lie_moves_the_position_little_and_bends_no_heading(name: str, metres: float) -> None:
    row = told_lie(next(lie for lie in LIES if lie.name == name), seed=2)
    assert row["horizontal_max_m"] < metres
    assert row["heading_max_deg"] < 1.0
    assert row["named"]


def test_fixes_of_another_time_are_refused() -> None:
    assert "clock_offset_s: -18.0" in told_lie(next(lie for lie in LIES if lie.name == "18 s late"), seed=2)["refused"]
