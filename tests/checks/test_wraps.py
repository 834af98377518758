from pathlib import Path

import numpy as np
import pytest
from turning_board import board, told_of_samples


def test_nothing_is_said_of_good_samples(tmp_path: Path) -> None:
    assert told_of_samples(board(2), tmp_path) == []


def test_a_blow_is_no_wrap(tmp_path: Path) -> None:
    bundle = board()
    accel = bundle.imus[0]["az"].copy()
    accel[3000], accel[3001] = 150.0, -150.0
    assert told_of_samples(bundle.with_imu(0, az=accel), tmp_path) == []


def test_numbers_that_run_over_their_end(tmp_path: Path) -> None:
    bundle = board()
    rates = bundle.imus[0]["gx"]
    half = 0.6 * np.abs(rates).max()
    (told,) = told_of_samples(bundle.with_imu(0, gx=(rates + half) % (2.0 * half) - half), tmp_path)
    assert (told.finding.kind, told.finding.axis) == ("wrap", "gyro x")
    assert told.finding.size == pytest.approx(np.degrees(2.0 * half), rel=0.1)
