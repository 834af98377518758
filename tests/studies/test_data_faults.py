"""The study of injected faults: that it judges what it says, on a made recording that needs no data set."""

from typing import Any

import numpy as np
import pytest
from turning_board import board

from polyins.studies.data_faults import faults, table
from polyins.studies.data_faults.faults import FAULTS, Fault
from polyins.studies.data_faults.table import Case, Row, cases, summary


def test_there_are_enough_cases_and_seeds_draw_others() -> None:
    drawn = cases(table.SEEDS)
    assert len(drawn) >= 40
    assert {case.fault.name for case in drawn} == {fault.name for fault in FAULTS}
    assert [case.recording for case in cases((1,))] == [case.recording for case in cases((1,))]
    assert [case.recording for case in cases((1,))] != [case.recording for case in cases((3,))]
    assert all(seed % 2 for seed in table.SEEDS)


@pytest.mark.parametrize("inject", [faults.degrees_as_radians, faults.turned, faults.gyro_axes, faults.jitter])
def test_what_is_injected_is_not_right_until_it_is_put_right(inject: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    good = board(3)
    monkeypatch.setattr(table, "good", lambda name: good)
    kinds = ("units", "mount", "axes", "jitter")
    case = Case(Fault("made", kinds, inject, ("made",)), "made", 1, 0)
    injected = case.injected()
    assert injected.right is not None
    assert not injected.right(injected.bundle.values)
    row = table.judged(case)
    assert (row.named, row.fixed) == (True, True), row


def test_a_fault_that_is_not_named_is_told_from_one_that_is() -> None:
    rows = [
        Row("a", "r", "", named=True, repairable=True, fixed=True, said=()),
        Row("b", "r", "", named=True, repairable=True, fixed=False, said=()),
        Row("c", "r", "", named=False, repairable=False, fixed=False, said=()),
        Row("d", "r", "", named=True, repairable=False, fixed=False, said=()),
    ]
    told = summary(rows, {"r": ("units imu1",)}, 3)
    assert (told["named_percent"], told["fixed_percent"]) == (75.0, 50.0)
    assert told["false_alarms"] == {"r": ["units imu1"]}


def test_nothing_is_said_of_the_made_recording() -> None:
    assert table.false_alarms(board(3)) == ()
    assert np.isfinite(board(3).vectors(0, ["gx", "gy", "gz"])).all()
