"""Where IMUs rest."""

from __future__ import annotations

import numpy as np
import pytest
from resting import ACCEL, GYRO, INTERVAL, of_rates, shaken, stream

from polyins.calibration.rest import at_rest, rates_of, resting_intervals
from polyins.errors import InputError
from polyins.model.recording import ImuStream
from polyins.prepare.timesync import align


def test_motion_is_left_out_with_what_is_next_to_it() -> None:
    rest = at_rest(shaken(stream("a", 100.0, 1), 40.0, 50.0))
    (first, second) = rest.stretches
    assert 36.0 < first.end < 39.1
    assert 51.0 <= second.begin < 53.1
    assert first.begin < 1.0
    assert second.end > 98.0
    assert rest.used_s == pytest.approx(100.0 - 10.0 - 2.0, abs=3.0)
    assert np.abs(first.values - first.values.mean(axis=0)).max() < 8.0 * ACCEL / np.sqrt(INTERVAL)


def test_a_short_rest_is_none() -> None:
    one = stream("a", 60.0, 2)
    for begin in range(0, 60, 10):
        one = shaken(one, begin, begin + 4.0)
    with pytest.raises(InputError, match=r"IMU a: never rests for 10 s.*for \d s at most.*expected it left alone"):
        at_rest(one)


def test_a_steady_turn_is_no_rest() -> None:
    turning = stream("a", 60.0, 3)
    turned = ImuStream("a", turning.time, turning.dtheta + np.array([0.0, 0.0, 0.5]) * INTERVAL, turning.dvel)
    with pytest.raises(InputError, match="without turning"):
        at_rest(turned)


def test_a_long_pause_ends_a_stretch_and_a_short_one_does_not() -> None:
    one = stream("a", 100.0, 4)
    for pause, count in ((0.5, 1), (20.0, 2)):
        time = one.time + np.where(one.time > 50.0, pause, 0.0)
        rest = at_rest(ImuStream("a", time, one.dtheta, one.dvel))
        assert len(rest.stretches) == count
        assert rest.interval == pytest.approx(INTERVAL, rel=1e-3)
        assert all(part.values[:, 5].max() < -9.0 for part in rest.stretches)


@pytest.mark.parametrize("rates", [True, False])
def test_jitter_of_stamps_is_no_noise(rates: bool) -> None:
    """Whether the file held rates, each multiplied by its own interval, or increments over even ones."""
    one = stream("a", 60.0, 5)
    time = one.time + 1e-3 * np.random.default_rng(0).standard_normal(len(one.time))
    own = np.diff(time, prepend=time[0] - INTERVAL)[:, None] if rates else INTERVAL
    increments = np.hstack([one.dtheta, one.dvel]) / INTERVAL * own
    found = rates_of(time, increments, INTERVAL)
    np.testing.assert_allclose(found.std(axis=0), np.repeat([GYRO, ACCEL], 3) / np.sqrt(INTERVAL), rtol=0.1)


def test_all_have_to_measure() -> None:
    one, other = stream("a", 100.0, 6), stream("b", 100.0, 7)
    kept = (other.time < 30.0) | (other.time > 33.0)
    found = resting_intervals(align((one, other.at(kept)), bridge=False))
    assert len(found) == 2
    assert found[0][1] <= 30.0
    assert found[1][0] >= 33.0


def test_repeated_samples_are_counted() -> None:
    one = stream("a", 40.0, 8)
    rates = np.hstack([one.dtheta, one.dvel]) / INTERVAL
    rates[:, 1] = np.repeat(rates[::4, 1], 4)
    repeated = at_rest(of_rates("a", rates)).repeated()
    assert repeated[1] == pytest.approx(0.75, abs=0.01)
    assert repeated[0] == 0.0


def test_a_few_rows_are_no_rest() -> None:
    with pytest.raises(InputError, match=r"IMU a: has 2 row\(s\); expected 10 s at rest"):
        at_rest(stream("a", 0.04, 9))
    with pytest.raises(InputError, match="measures for less than a second"):
        at_rest(stream("a", 0.5, 9))
