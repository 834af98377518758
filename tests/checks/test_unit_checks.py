from pathlib import Path

import numpy as np
import pytest
from turning_board import board, evidence_of

from polyins.checks import units
from polyins.studies.data_faults.bundle import ACCEL, GYRO, Bundle

WHOLE = {"gyro": GYRO, "accel": ACCEL}
STEP = 0.01


def in_unit(sensor: str, factor: float, unit: str) -> Bundle:
    """Return the board with values in another unit, and what is said of it."""
    bundle = board()
    spoiled = bundle.with_imu(0, **{name: factor * bundle.imus[0][name] for name in WHOLE[sensor]})
    spoiled = spoiled.changed(("checks", "accept"), ["units"])
    return spoiled.changed(("imus", 0, "columns", sensor, "unit"), unit)


def test_right_units_are_not_doubted(tmp_path: Path) -> None:
    evidence = evidence_of(board(3), tmp_path)
    assert list(units.of_values(evidence)) == []
    assert list(units.of_time(evidence)) == []


@pytest.mark.parametrize(
    ("sensor", "factor", "said", "right"),
    [
        ("gyro", 180.0 / np.pi, "rad/s", "deg/s"),
        ("gyro", 1.0, "deg/s", "rad/s"),
        ("accel", 1.0 / 9.80665, "m/s^2", "g"),
        ("accel", 1.0, "g", "m/s^2"),
    ],
)
def test_a_wrong_unit_is_named_with_the_right_one(
    sensor: str, factor: float, said: str, right: str, tmp_path: Path
) -> None:
    (told,) = units.of_values(evidence_of(in_unit(sensor, factor, said), tmp_path))
    assert (told.finding.kind, told.finding.axis, told.finding.expected) == ("units", sensor, right)
    assert [(one.key, one.value) for one in told.settings] == [(f"imus[0].columns.{sensor}.unit", right)]


def test_increments_of_both_sensors_are_told_from_degrees(tmp_path: Path) -> None:
    """At 57 samples a second both make the same factor of a gyro; the force tells which."""
    bundle = in_unit("accel", STEP, "m/s^2")
    bundle = bundle.with_imu(0, **{name: STEP * bundle.imus[0][name] for name in GYRO})
    told = [one.finding.expected for one in units.of_values(evidence_of(bundle, tmp_path))]
    assert told == ["rad", "m/s"]


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us")])
def test_the_unit_of_stamps(factor: float, unit: str, tmp_path: Path) -> None:
    bundle = board()
    spoiled = bundle.with_imu(0, t=factor * bundle.imus[0]["t"]).changed(("checks", "accept"), ["sampling", "units"])
    (told,) = units.of_time(evidence_of(spoiled, tmp_path))
    assert told.finding.kind == "sampling"
    assert told.settings[0].value == unit
