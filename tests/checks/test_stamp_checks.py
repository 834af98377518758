from pathlib import Path

import numpy as np
import pytest
from turning_board import board, evidence_of, some_rows, told_of_samples

from polyins.checks import stamps


def test_stamps_that_jitter_about_an_even_clock_are_counted(tmp_path: Path) -> None:
    bundle = board()
    late = np.random.default_rng(4).uniform(0.0, 0.008, len(bundle.imus[0]["t"]))
    (told,) = told_of_samples(bundle.with_imu(0, t=bundle.imus[0]["t"] + late), tmp_path)
    assert told.finding.kind == "jitter"
    rate, offset = (one.value for one in told.settings)
    assert rate == pytest.approx(100.0, rel=1e-4)
    assert offset == pytest.approx(0.014, abs=0.001)


def test_samples_that_are_uneven_are_not_counted(tmp_path: Path) -> None:
    bundle = board()
    kept = np.sort(np.random.default_rng(5).choice(len(bundle.imus[0]["t"]), 3000, replace=False))
    told = list(stamps.jitter(evidence_of(some_rows(bundle, kept), tmp_path)))
    assert all(one.settings == () for one in told)


def test_too_few_samples_for_the_motion(tmp_path: Path) -> None:
    bundle = board(speed=3.0)
    (told,) = stamps.undersampled(evidence_of(some_rows(bundle, slice(None, None, 20)), tmp_path))
    assert told.finding.kind == "undersampled"
