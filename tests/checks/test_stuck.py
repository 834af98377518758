from pathlib import Path

import pytest
from turning_board import board, told_of_samples


@pytest.mark.parametrize("axis", ["gy", "ax"])
def test_an_axis_that_stands_still_while_others_go_on(axis: str, tmp_path: Path) -> None:
    bundle = board()
    values = bundle.imus[0][axis].copy()
    values[2000:2400] = values[2000]
    (told,) = told_of_samples(bundle.with_imu(0, **{axis: values}), tmp_path)
    assert told.finding.kind == "stuck"
    assert (told.finding.from_s, told.finding.to_s) == pytest.approx((20.01, 24.0), abs=0.02)
