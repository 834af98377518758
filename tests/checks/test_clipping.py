from pathlib import Path

import numpy as np
import pytest
from turning_board import board, told_of_samples


def test_the_end_of_a_range_is_said_where_it_can_be_given(tmp_path: Path) -> None:
    bundle = board()
    most = 0.9 * np.abs(bundle.imus[0]["gx"]).max()
    (told,) = told_of_samples(bundle.with_imu(0, gx=np.clip(bundle.imus[0]["gx"], -most, most)), tmp_path)
    assert told.finding.kind == "saturation"
    assert told.settings[0].value == pytest.approx(np.degrees(most))


def test_a_range_that_would_leave_out_most_rows_is_not_given(tmp_path: Path) -> None:
    bundle = board()
    most = 0.3 * np.abs(bundle.imus[0]["gx"]).max()
    (told,) = told_of_samples(bundle.with_imu(0, gx=np.clip(bundle.imus[0]["gx"], -most, most)), tmp_path)
    assert (told.finding.kind, told.settings) == ("saturation", ())
