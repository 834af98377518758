"""What real arrays of eight IMUs gain at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.calibration.array_gain import AT_S, array_gain
from polyins.calibration.imu_noise import imu_noise
from polyins.config import KNOWN_IMUS
from polyins.studies.allan import BOARD, MIMU, array_binary, mimu4444


@pytest.mark.parametrize(("name", "read"), [(MIMU, mimu4444), (f"logs/{BOARD}", array_binary)])
def test_eight_gain_nearly_the_square_root(data_folder: Path, name: str, read) -> None:
    if not (data_folder / name).is_dir():
        pytest.skip(f"no {name}")
    found = array_gain(read())
    assert found.imus == 8
    for sensor in (found.gyro, found.accel):
        row = sensor.at(AT_S)
        assert 2.4 < sensor.gain[row] < 2.9
        assert sensor.low[row] < np.sqrt(8.0) < sensor.high[row]


def test_accelerometers_are_about_as_a_datasheet_says(data_folder: Path) -> None:
    """That of the MPU-6050, which is alike, though these are MPU-9150."""
    if not (data_folder / MIMU).is_dir():
        pytest.skip(f"no {MIMU}")
    found = imu_noise(mimu4444()[0])
    assert len(found.rest.stretches) == 20
    stated = KNOWN_IMUS["mpu-6050"].figures["velocity_random_walk_m_s_sqrt_h"].value / 60.0
    for axis in found.axes["accel"]:
        assert axis.noise.random_walk.value == pytest.approx(stated, rel=0.6)
        assert axis.noise.excess < 1.3
