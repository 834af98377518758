"""Fixes that repeat, leap by a week or end are named with how much; those of a vehicle that stands or moves are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from polyins.model.recording import GnssStream
from polyins.prepare.fixes import WEEK_S, of_fixes

END = 100.0


def drive(speed: float = 5.0, std: float = 0.02) -> GnssStream:
    """Positions on a plane, north, east and height, m, at 1 Hz."""
    time = np.arange(0.5, END, 1.0)
    position = np.column_stack([speed * time, np.zeros_like(time), np.full_like(time, 30.0)])
    return GnssStream(time, position, np.full((len(time), 3), std))


def repeated(gnss: GnssStream, first: int, count: int) -> GnssStream:
    position = gnss.position.copy()
    position[first : first + count] = position[first - 1]
    return replace(gnss, position=position)


@pytest.mark.parametrize(("unit", "factor"), [("feet", 3.2808), ("cm", 100.0), ("mm", 1000.0)])
@pytest.mark.parametrize("last", [49, 99])
def test_heights_in_another_unit_are_named_with_its_factor(unit: str, factor: float, last: int) -> None:
    gnss = drive()
    position = gnss.position + np.random.default_rng(1).normal(0.0, 0.02, gnss.position.shape)
    position[40 : last + 1, 2] *= factor
    (finding,) = of_fixes(replace(gnss, position=position), False, END)
    assert finding.kind == "units"
    assert unit in finding.text
    assert finding.size == pytest.approx(factor, rel=0.01)
    assert (finding.from_s, finding.to_s) == (40.5, last + 0.5)


def test_noise_and_a_step_of_heights_are_no_units() -> None:
    gnss = drive(std=10.0)
    position = gnss.position + np.random.default_rng(1).normal(0.0, 10.0, gnss.position.shape)
    assert of_fixes(replace(gnss, position=position), False, END) == ()
    position = drive().position.copy()
    position[40:, 2] += 50.0
    assert of_fixes(replace(drive(), position=position), False, END) == ()


def test_fixes_at_latitude_and_longitude_zero_are_named() -> None:
    gnss = drive()
    position = np.column_stack([0.8 + gnss.position[:, 0] * 1e-7, np.full(len(gnss.time), 0.1), gnss.position[:, 2]])
    assert of_fixes(replace(gnss, position=position), True, END) == ()
    position[40:43, :2] = np.radians(1e-7)
    kinds = {finding.kind: finding for finding in of_fixes(replace(gnss, position=position), True, END)}
    assert (kinds["place"].from_s, kinds["place"].to_s) == (40.5, 42.5)
    near = np.column_stack([1e-6 + gnss.position[:, :2] * 1e-7, gnss.position[:, 2]])
    assert of_fixes(replace(gnss, position=near), True, END) == ()


def test_good_fixes_say_nothing() -> None:
    assert of_fixes(drive(), False, END) == ()


def test_a_vehicle_that_stands_may_repeat_itself() -> None:
    assert of_fixes(drive(speed=0.0), False, END) == ()


def test_two_at_one_place_are_chance() -> None:
    assert of_fixes(repeated(drive(), 40, 1), False, END) == ()


def test_a_receiver_that_repeats_itself_is_named() -> None:
    (finding,) = of_fixes(repeated(repeated(drive(), 20, 2), 40, 6), False, END)
    assert finding.kind == "frozen"
    assert (finding.from_s, finding.to_s) == (39.5, 45.5)
    assert finding.size == pytest.approx(35.0)
    assert "the longest of 2 times" in finding.text


def test_a_week_that_rolls_over_is_named() -> None:
    gnss = drive()
    kinds = {one.kind: one for one in of_fixes(
        replace(gnss, time=np.where(gnss.time > 60.0, gnss.time + WEEK_S, gnss.time)), False, END
    )}  # fmt: skip
    assert kinds["clock"].from_s == 59.5
    assert kinds["clock"].size == pytest.approx(WEEK_S + 1.0)
    assert kinds["outage"].size == pytest.approx(40.5)


@pytest.mark.parametrize(("begin", "end", "size"), [(30.0, 45.0, 16.0), (70.0, 200.0, 30.5)])
def test_where_there_is_no_fix_for_long_is_named(begin: float, end: float, size: float) -> None:
    gnss = drive()
    kept = (gnss.time < begin) | (gnss.time > end)
    (finding,) = of_fixes(GnssStream(gnss.time[kept], gnss.position[kept], gnss.position_std[kept]), False, END)
    assert finding.kind == "outage"
    assert finding.size == pytest.approx(size)
