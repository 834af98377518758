"""A gyro and an accelerometer with stamps of their own as one IMU."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.formats.joined import joined_rates
from polyins.formats.rows import intervals


def force_at(time: np.ndarray) -> np.ndarray:
    return np.column_stack([0.1 * time, -0.2 * time, 9.8 + 0.0 * time])


def samples(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([time, values])


@pytest.mark.parametrize("rate_hz", [25.0, 100.0, 400.0])
def test_forces_are_taken_between_those_around_the_stamps(rate_hz: float) -> None:
    gyro = np.arange(1, 201) / 100.0
    force = 0.0037 + np.arange(-1, 2.1 * rate_hz) / rate_hz
    rows = joined_rates(
        Path("a"), "imu", samples(gyro, np.tile([1.0, 2.0, 3.0], (200, 1))), samples(force, force_at(force))
    )
    np.testing.assert_array_equal(rows.time, gyro)
    steps = intervals(rows.time)[:, None]
    np.testing.assert_allclose(rows.dtheta / steps, np.tile([1.0, 2.0, 3.0], (200, 1)))
    np.testing.assert_allclose(rows.dvel / steps, force_at(gyro), atol=1e-9)


def test_rows_in_a_gap_and_beyond_the_ends_are_left_out() -> None:
    gyro = np.arange(0, 300) / 100.0
    force = gyro[(gyro >= 0.5) & (gyro <= 2.5) & ~((gyro > 1.0) & (gyro < 1.2))]
    rows = joined_rates(Path("a"), "imu", samples(gyro, np.zeros((300, 3))), samples(force, force_at(force)))
    assert (rows.time[0], rows.time[-1]) == pytest.approx((0.49, 2.51))  # an interval before and after
    assert not ((rows.time > 1.001) & (rows.time < 1.199)).any()
    assert len(rows.time) == 203 - 19


def test_one_sample_is_no_accelerometer() -> None:
    gyro = np.arange(0, 300) / 100.0
    rows = joined_rates(Path("a"), "imu", samples(gyro, np.zeros((300, 3))), np.array([[1.0, 0.0, 0.0, 9.8]]))
    assert len(rows.time) == 0
