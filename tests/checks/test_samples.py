"""Checks of single samples: wraps, stuck axes, saturation, stamps, copies, rest."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from turning_board import board, evidence_of

from polyins.checks import clipping, stamps, still, stuck, twins, wraps
from polyins.checks.diagnosis import Diagnosis
from polyins.studies.data_faults.bundle import Bundle


def all_of(bundle: Bundle, folder: Path) -> list[Diagnosis]:
    evidence = evidence_of(bundle, folder)
    finders = (wraps.find, stuck.find, clipping.find, stamps.jitter, stamps.undersampled, twins.find)
    return [one for find in finders for one in find(evidence)]


def test_nothing_is_said_of_good_samples(tmp_path: Path) -> None:
    assert all_of(board(2), tmp_path) == []


def test_a_blow_is_no_wrap(tmp_path: Path) -> None:
    bundle = board()
    accel = bundle.imus[0]["az"].copy()
    accel[3000], accel[3001] = 150.0, -150.0
    assert all_of(bundle.with_imu(0, az=accel), tmp_path) == []


def test_numbers_that_run_over_their_end(tmp_path: Path) -> None:
    bundle = board()
    rates = bundle.imus[0]["gx"]
    half = 0.6 * np.abs(rates).max()
    (told,) = all_of(bundle.with_imu(0, gx=(rates + half) % (2.0 * half) - half), tmp_path)
    assert (told.finding.kind, told.finding.axis) == ("wrap", "gyro x")
    assert told.finding.size == pytest.approx(np.degrees(2.0 * half), rel=0.1)


@pytest.mark.parametrize("axis", ["gy", "ax"])
def test_an_axis_that_stands_still_while_others_go_on(axis: str, tmp_path: Path) -> None:
    bundle = board()
    values = bundle.imus[0][axis].copy()
    values[2000:2400] = values[2000]
    (told,) = all_of(bundle.with_imu(0, **{axis: values}), tmp_path)
    assert told.finding.kind == "stuck"
    assert (told.finding.from_s, told.finding.to_s) == pytest.approx((20.01, 24.0), abs=0.02)


def test_the_end_of_a_range_is_said_where_it_can_be_given(tmp_path: Path) -> None:
    bundle = board()
    most = 0.5 * np.abs(bundle.imus[0]["gx"]).max()
    (told,) = all_of(bundle.with_imu(0, gx=np.clip(bundle.imus[0]["gx"], -most, most)), tmp_path)
    assert told.finding.kind == "saturation"
    assert told.settings[0].value == pytest.approx(np.degrees(most))


def test_stamps_that_jitter_about_an_even_clock_are_counted(tmp_path: Path) -> None:
    bundle = board()
    late = np.random.default_rng(4).uniform(0.0, 0.008, len(bundle.imus[0]["t"]))
    (told,) = all_of(bundle.with_imu(0, t=bundle.imus[0]["t"] + late), tmp_path)
    assert told.finding.kind == "jitter"
    rate, offset = (one.value for one in told.settings)
    assert rate == pytest.approx(100.0, rel=1e-4)
    assert offset == pytest.approx(0.014, abs=0.001)


def test_samples_that_are_uneven_are_not_counted(tmp_path: Path) -> None:
    bundle = board()
    kept = np.sort(np.random.default_rng(5).choice(len(bundle.imus[0]["t"]), 3000, replace=False))
    told = list(stamps.jitter(evidence_of(bundle.with_imu(0, **_rows(bundle, kept)), tmp_path)))
    assert all(one.settings == () for one in told)


def test_too_few_samples_for_the_motion(tmp_path: Path) -> None:
    bundle = board(speed=3.0)
    (told,) = stamps.undersampled(evidence_of(bundle.with_imu(0, **_rows(bundle, slice(None, None, 20))), tmp_path))
    assert told.finding.kind == "undersampled"


def _rows(bundle: Bundle, rows: slice | np.ndarray) -> dict[str, np.ndarray]:
    return {name: values[rows] for name, values in bundle.imus[0].items()}


def test_the_same_imu_twice_is_left_out_once(tmp_path: Path) -> None:
    bundle = replace(board(2), imus=(board(2).imus[0],) * 2).changed(("checks", "accept"), ["twice"])
    (told,) = all_of(bundle, tmp_path)
    assert told.finding.kind == "twice"
    assert [(one.keys, one.value) for one in told.settings] == [(("imus", 1), None)]


def test_where_it_rests_is_noted(tmp_path: Path) -> None:
    (told,) = still.rest(evidence_of(board(), tmp_path))
    assert told.finding.severity == "note"
    assert (told.finding.from_s, told.finding.to_s) == pytest.approx((0.0, 5.0), abs=1.1)
