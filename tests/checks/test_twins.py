from dataclasses import replace
from pathlib import Path

from turning_board import board, told_of_samples


def test_the_same_imu_twice_is_left_out_once(tmp_path: Path) -> None:
    bundle = replace(board(2), imus=(board(2).imus[0],) * 2).changed(("checks", "accept"), ["twice"])
    (told,) = told_of_samples(bundle, tmp_path)
    assert told.finding.kind == "twice"
    assert [(one.keys, one.value) for one in told.settings] == [(("imus", 1), None)]
