"""The lines of an IMU: rates, ranges and noise, as they are proposed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from written_recordings import as_increments, still_imu, write_rows

from polyins.formats.rows import ImuRows, RowSource
from polyins.reading.loading import load
from polyins.tools.propose.imus import shaking
from polyins.tools.propose.proposal import propose


def save(folder: Path, text: str) -> Path:
    path = folder / "proposed.yaml"
    path.write_text(text)
    return path


def test_repeated_stamps_are_counted_instead(tmp_path: Path) -> None:
    rows = as_increments(still_imu())
    rows[7, 0] = rows[6, 0]
    text = propose([write_rows(tmp_path / "imu.txt", rows)]).text
    assert "rate_hz: 50  # CHECK: 1 stamp(s) repeat" in text
    assert load(save(tmp_path, text)).imus[0].rate_hz == pytest.approx(50.0)


def test_what_shakes_is_the_random_walk() -> None:
    rng = np.random.default_rng(6)
    time, walks = np.arange(4000) / 100.0, (2e-3, 0.05)
    swing = 0.05 * np.sin(time)[:, None] * [1.0, 0.5, 0.2]  # of a vehicle that turns and accelerates
    angle, velocity = (swing * 0.01 + walk * 0.1 * rng.normal(size=(4000, 3)) for walk in walks)
    rows = ImuRows(RowSource("a"), time, angle, velocity)
    assert shaking(rows) == pytest.approx(walks, rel=0.1)
    still = ImuRows(RowSource("a"), time, swing * 0.01, swing * 0.01)
    assert max(shaking(still)) < 1e-6


def turned_fast(scale_deg_s: float) -> np.ndarray:
    """Rest, then turns beyond the end of the range: t, gyro deg/s, force g."""
    time = np.arange(1, 1001) / 50.0
    rate = np.where(time[:, None] > 8.0, 1.3 * scale_deg_s * np.sin(np.outer(time, [3.0, 2.1, 1.7])), 0.3)
    noise = np.random.default_rng(2).normal(0.0, 0.1, rate.shape)
    force = np.tile([0.0, 0.0, -1.0], (len(time), 1))
    force[time > 8.0] += [1.5, 0.0, 0.2]
    return np.column_stack([time, np.clip(rate + noise, -scale_deg_s, scale_deg_s), force + 1e-3 * noise])


@pytest.mark.parametrize("scale", [500.0, 1997.99])
def test_the_end_of_the_gyros_range_and_what_is_down_at_rest(scale: float, tmp_path: Path) -> None:
    path = write_rows(tmp_path / "imu.csv", turned_fast(scale), "t,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g", ",")
    text = propose([path]).text
    assert f"gyro_range_deg_s: {scale:g}" in text
    assert "axes: [x, y, z]" in text
