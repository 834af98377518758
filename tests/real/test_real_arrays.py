"""Arrays of real chips, of which nothing is known beforehand: a quadrotor's four and the eight of a MIMU4444."""

from pathlib import Path

import numpy as np
import pytest

from polyins.studies.calibration import find_eight, fly


def test_mounts_and_places_of_the_quadrotor(data_folder: Path) -> None:
    if not (data_folder / "quadrotor").is_dir():
        pytest.skip("no data set quadrotor")
    found = fly(every=10)
    assert found["flights"] >= 3
    assert found["mount_deg"]["largest"] < 0.15
    assert found["position_mm"]["largest"] < 5.0
    judged = found["next_flight_deg_s"]
    assert judged["calibrated"] < 0.3 * judged["raw"]


def test_eight_mounts_of_which_four_are_turned_over(data_folder: Path) -> None:
    if not (data_folder / "mimu4444").is_dir():
        pytest.skip("no data set mimu4444")
    found = find_eight()
    assert list(found["axes"].values()) == 4 * [["x", "y", "z"], ["-y", "-x", "-z"]]
    assert max(found["mount_off_deg"]) < 1.1  # what the data set says of residual rotations
    assert max(found["position_off_mm"]) < 1.4
    assert found["poses"] >= 20
    assert found["agreement"]["calibrated"]["accel_m_s2"] < 0.4 * found["agreement"]["configured"]["accel_m_s2"]
    assert np.isfinite(found["mount_off_deg"]).all()
