"""Which axes of an IMU point forward, right, down, as they are proposed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from written_recordings import as_increments, still_imu, write_rows

from polyins.formats.rows import ImuRows, RowSource, SensorRows
from polyins.reading.loading import load
from polyins.tools.propose.axes import forward_axes
from polyins.tools.propose.proposal import propose


def save(folder: Path, text: str) -> Path:
    path = folder / "proposed.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("order", [[1, 2, 3], [2, -1, 3], [3, 1, 2], [-3, 2, 1], [1, -2, -3]])
def test_gravity_tells_what_is_down(order: list[int], tmp_path: Path) -> None:
    rows = as_increments(still_imu())
    turned = rows.copy()
    for group in (1, 4):
        for axis, source in enumerate(order):
            turned[:, group + axis] = np.sign(source) * rows[:, group + abs(source) - 1]
    text = propose([write_rows(tmp_path / "imu.txt", turned)]).text
    mean = load(save(tmp_path, text)).imus[0].dvel.mean(axis=0)
    assert mean[2] == pytest.approx(-9.80665 / 50)


def logged(time: np.ndarray, force: np.ndarray) -> ImuRows:
    return ImuRows(RowSource("log"), time, np.zeros_like(force), np.diff(time, prepend=-0.02)[:, None] * force)


def test_the_axis_that_goes_with_the_speed_is_forward() -> None:
    time = np.arange(3000) / 50.0
    speed = SensorRows(RowSource("log"), "odometer", time[::5], 3.0 * np.sin(0.3 * time[::5]))
    ahead = 0.9 * np.cos(0.3 * time)
    force = np.column_stack([0.3 * np.sin(time), np.full(3000, 9.8), -ahead])
    axes, agreement, sigmas = forward_axes(("x", "z", "-y"), logged(time, force), speed)
    assert axes == ("-z", "x", "-y")
    assert agreement > 0.9
    assert sigmas > 4.0
