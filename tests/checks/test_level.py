from pathlib import Path

import pytest
from turning_board import board, evidence_of

from polyins.checks import level
from polyins.studies.data_faults.bundle import GYRO


def test_good_axes_are_not_doubted(tmp_path: Path) -> None:
    evidence = evidence_of(board(2), tmp_path)
    assert [*level.upside(evidence), *level.handedness(evidence)] == []


@pytest.mark.parametrize("axes", [["x", "-y", "-z"], ["-z", "y", "x"], ["y", "z", "x"]])
def test_axes_that_do_not_have_gravity_point_down(axes: list[str], tmp_path: Path) -> None:
    spoiled = board().changed(("imus", 0, "axes"), axes).changed(("checks", "accept"), ["axes"])
    (told,) = level.upside(evidence_of(spoiled, tmp_path))
    assert told.finding.kind == "axes"
    assert told.settings[0].value[2] == "z"


def test_one_gyro_that_turns_against_gravity(tmp_path: Path) -> None:
    spoiled = board().changed(("imus", 0, "columns", "gyro", "names"), ["gy", "gx", "gz"])
    (told,) = level.handedness(evidence_of(spoiled, tmp_path))
    assert (told.finding.kind, told.finding.axis) == ("axes", "gyro")
    assert told.settings[0].value == GYRO
