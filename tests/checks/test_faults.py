"""Rows that a chip did not measure are left out and named; whatever is constant for a reason stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from polyins.checks.faults import LONGEST_REPEAT, alive, clipped, without_faults
from polyins.errors import InputError
from polyins.formats.rows import ImuRows, RowSource
from polyins.model.recording import ImuStream

RATE_HZ = 100.0
Array = NDArray[np.float64]


def noisy(seed: int = 1, count: int = 1000, noise: float = 1e-3) -> ImuRows:
    """An IMU at rest, in increments."""
    values = np.random.default_rng(seed).normal([0.0, 0.0, 0.0, 0.0, 0.0, -9.8], noise, (count, 6)) / RATE_HZ
    return rows(values)


def rows(values: Array) -> ImuRows:
    return ImuRows(RowSource("a.csv", 2), 100.0 + np.arange(len(values)) / RATE_HZ, values[:, :3], values[:, 3:])


def held(of: ImuRows, begin: int, end: int) -> ImuRows:
    """The rows with those from begin to end - 1 all equal to the one before."""
    dtheta, dvel = of.dtheta.copy(), of.dvel.copy()
    dtheta[begin:end], dvel[begin:end] = dtheta[begin - 1], dvel[begin - 1]
    return replace(of, dtheta=dtheta, dvel=dvel)


@settings(max_examples=25, deadline=None)
@given(begin=st.integers(1, 500), length=st.integers(LONGEST_REPEAT, 400))
def test_a_frozen_chip_is_left_out_exactly_while_it_is_frozen(begin: int, length: int) -> None:
    given_rows = noisy()
    kept, (finding,) = without_faults(held(given_rows, begin, begin + length), "left", 7.0)
    np.testing.assert_array_equal(kept.time, np.delete(given_rows.time, slice(begin, begin + length)))
    first, last = given_rows.time[begin - 1] + 7.0, given_rows.time[begin + length - 1] + 7.0
    text = f"a.csv: IMU left repeats the same values from {first:.3f} to {last:.3f} s; {length} row(s) left out"
    assert finding.text == text
    assert (finding.kind, finding.stream, finding.severity) == ("left out", "left", "note")
    assert (finding.from_s, finding.to_s, finding.size) == (pytest.approx(first), pytest.approx(last), length)


def test_a_chip_that_freezes_again_and_again_is_named_each_time() -> None:
    kept, found = without_faults(held(held(noisy(), 100, 130), 400, 450), "left", 0.0)
    assert len(kept.time) == 1000 - 30 - 50
    assert [finding.from_s for finding in found] == pytest.approx([100.99, 103.99])


def test_a_few_equal_samples_are_no_fault() -> None:
    given_rows = held(noisy(), 100, 100 + LONGEST_REPEAT - 1)
    assert without_faults(given_rows, "left", 0.0) == (given_rows, ())


@pytest.mark.parametrize("length", [1, 2, 50])
def test_rows_of_zeros_are_left_out(length: int) -> None:
    given_rows = noisy()
    given_rows.dtheta[200 : 200 + length] = 0.0
    given_rows.dvel[200 : 200 + length] = 0.0
    kept, (finding,) = without_faults(given_rows, "left", 0.0)
    assert len(kept.time) == 1000 - length
    assert "IMU left shows zeros only from 101.990" in finding.text
    assert (finding.kind, finding.size) == ("left out", length)


def test_a_gyro_at_exactly_zero_is_no_fault() -> None:
    given_rows = replace(noisy(), dtheta=np.zeros((1000, 3)))
    assert without_faults(given_rows, "left", 0.0) == (given_rows, ())


def test_data_without_noise_may_be_constant() -> None:
    """An IMU on a body that drives straight on, turns, and drives straight on again."""
    time = np.arange(3000) / RATE_HZ
    turn = np.where((time > 10.0) & (time < 20.0), np.sin(0.1 * np.pi * time) ** 2, 0.0)
    values = (
        np.column_stack([0.0 * turn, 0.0 * turn, 0.5 * turn, 0.0 * turn, 3.0 * turn, np.full(3000, -9.8)]) / RATE_HZ
    )
    assert without_faults(rows(values), "body", 0.0)[1] == ()
    assert without_faults(rows(values + 1e-17 * noisy(count=3000, noise=1.0).dvel[:, :1]), "body", 0.0)[1] == ()
    assert without_faults(rows(np.tile(values[0], (3000, 1))), "body", 0.0)[1] == ()
    assert clipped(rows(values), "body", 0.0) == ()


def test_samples_written_several_times_are_no_freezing() -> None:
    """A chip of 5 Hz in a file of 100."""
    slow = noisy(count=50)
    values = np.repeat(np.hstack([slow.dtheta, slow.dvel]), 20, axis=0)
    assert without_faults(rows(values), "left", 0.0)[1] == ()
    values[500:] = values[500]
    assert len(without_faults(rows(values), "left", 0.0)[0].time) == 501


def test_rates_at_uneven_stamps_are_compared_as_rates() -> None:
    generator = np.random.default_rng(3)
    given_rows = noisy()
    stamps = np.cumsum(generator.uniform(0.008, 0.012, 1000))
    per_second = np.hstack([given_rows.dtheta, given_rows.dvel]) * RATE_HZ
    per_second[300:400] = per_second[299]
    steps = np.diff(stamps, prepend=0.0)[:, None]
    kept, _ = without_faults(ImuRows(RowSource("a.csv"), stamps, *np.hsplit(per_second * steps, 2)), "left", 0.0)
    assert len(kept.time) == 900


def stream(name: str, of: ImuRows) -> ImuStream:
    return ImuStream(name, of.time, of.dtheta, of.dvel)


def test_one_dead_chip_among_others_is_left_out_and_a_constant_recording_is_not() -> None:
    living, constant = stream("a", noisy()), stream("b", held(noisy(), 1, 1000))
    zeros = stream("c", replace(noisy(), dtheta=np.zeros((1000, 3)), dvel=np.zeros((1000, 3))))
    empty, single = (stream(name, rows(np.ones((count, 6)))) for name, count in (("d", 0), ("e", 1)))
    kept, found = alive((constant, living, zeros, empty, single))
    assert kept == [1]
    assert [(one.kind, one.stream, one.severity) for one in found] == [
        ("left out", name, "note") for name in ("b", "c", "d", "e")
    ]
    assert found[0].text == "IMU b shows the same values throughout; the run goes on without it"
    assert found[2].text == "IMU d has no data; the run goes on without it"
    assert alive((constant, constant)) == ([0, 1], ())
    assert alive((living, living)) == ([0, 1], ())
    with pytest.raises(InputError, match="IMU c, d: no data, or the same values throughout"):
        alive((zeros, empty))


@pytest.mark.parametrize(("channel", "unit", "name"), [(1, np.pi / 180.0, "gyro y"), (3, 1.0, "accelerometer x")])
def test_values_that_stay_at_the_largest_one_are_a_warning(channel: int, unit: float, name: str) -> None:
    values = noisy(noise=0.2).dtheta[:, 0] * RATE_HZ + 300.0 * np.sin(np.arange(1000) / 30.0)
    whole = np.hstack([noisy().dtheta, noisy().dvel])
    whole[:, channel] = unit * values / RATE_HZ
    assert clipped(rows(whole), "left", 0.0) == ()
    whole[:, channel] = unit * np.clip(values, -250.0, 250.0) / RATE_HZ
    (finding,) = clipped(rows(whole), "left", 0.0)
    assert f"{name} of IMU left stays at exactly 250" in finding.text
    assert finding.size == pytest.approx(250.0)
    assert clipped(rows(whole), "left", 0.0, gyro=False) == (() if channel < 3 else (finding,))


def test_a_coarse_gyro_at_rest_is_not_clipped() -> None:
    whole = np.hstack([noisy().dtheta, noisy().dvel])
    whole[:, 0] = np.round(noisy(4).dtheta[:, 0] / 3e-5) * 3e-5
    assert clipped(rows(whole), "left", 0.0) == ()
