"""What the mean of several IMUs gains."""

from __future__ import annotations

import numpy as np
import pytest
from resting import ACCEL, GYRO, INTERVAL, shaken, stream

from polyins.calibration.array_gain import array_gain
from polyins.errors import InputError
from polyins.model.recording import ImuStream


def test_independent_ones_gain_the_square_root() -> None:
    found = array_gain(tuple(stream(f"imu{i}", 300.0, 10 + i) for i in range(4)))
    for one in (found.gyro, found.accel):
        row = one.at(1.0)
        assert one.gain[row] == pytest.approx(2.0, abs=0.15)
        assert np.mean((one.low < 2.0) & (one.high > 2.0)) > 0.8
        assert one.common_share[row] < 0.1
    np.testing.assert_allclose(found.gyro.single[0], GYRO / np.sqrt(INTERVAL), rtol=0.02)


def test_what_is_common_is_told_by_its_share() -> None:
    """Half of the variance of each is of all, so that of four the gain is sqrt(1 / (1/2 + 1/8))."""
    count = round(600.0 / INTERVAL)
    white = np.random.default_rng(0).standard_normal((count, 6)) / np.sqrt(INTERVAL)
    common = white * np.repeat([GYRO, ACCEL], 3)
    found = array_gain(tuple(stream(f"imu{i}", 600.0, 20 + i, common=common) for i in range(4)))
    for one in (found.gyro, found.accel):
        row = one.at(0.2)
        assert one.gain[row] == pytest.approx(np.sqrt(1.6), rel=0.03)
        assert one.low[row] < np.sqrt(1.6) < one.high[row]
        assert one.common_share[row] == pytest.approx(0.5, abs=0.05)


def test_clocks_that_do_not_agree_are_resampled() -> None:
    streams = [stream(f"imu{i}", 300.0, 30 + i) for i in range(4)]
    apart = tuple(ImuStream(one.name, one.time * (1.0 + 1e-3 * k) + 0.007 * k, one.dtheta, one.dvel)
                  for k, one in enumerate(streams))  # fmt: skip
    found = array_gain(apart)
    assert found.gyro.tau[0] == pytest.approx(4 * INTERVAL)
    assert found.gyro.gain[found.gyro.at(1.0)] == pytest.approx(2.0, abs=0.2)


def test_ones_that_never_rest_together_are_refused() -> None:
    first, second = shaken(stream("a", 60.0, 1), 0.0, 32.0), shaken(stream("b", 60.0, 2), 28.0, 60.0)
    with pytest.raises(InputError, match="do not rest together for 10 s"):
        array_gain((first, second))
