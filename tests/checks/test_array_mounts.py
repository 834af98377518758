from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from turning_board import board, evidence_of, turned

from polyins.checks import array_mounts
from polyins.reading.imu_stream import mount_rotation
from polyins.studies.data_faults.bundle import GYRO


def test_imus_that_agree_are_not_doubted(tmp_path: Path) -> None:
    for count in (1, 2, 4):
        assert list(array_mounts.find(evidence_of(board(count), tmp_path / str(count)))) == []


@pytest.mark.parametrize("angle_deg", [6.0, 40.0, 90.0, 170.0])
@pytest.mark.parametrize("count", [2, 3])
def test_a_turned_imu_is_named_with_its_mount(count: int, angle_deg: float, tmp_path: Path) -> None:
    turn = Rotation.from_rotvec(np.radians(angle_deg) * np.array([0.6, -0.48, 0.64])).as_matrix()
    spoiled = turned(board(count), count - 1, turn).changed(("checks", "accept"), ["axes"])
    (told,) = array_mounts.find(evidence_of(spoiled, tmp_path))
    assert (told.finding.kind, told.finding.stream) == ("mount", f"imu{count}")
    assert told.finding.size == pytest.approx(angle_deg, abs=0.5)
    (setting,) = told.settings
    off = mount_rotation(setting.value).T @ turn
    assert np.degrees(np.arccos(np.clip(0.5 * (np.trace(off) - 1.0), -1.0, 1.0))) < 0.5


@pytest.mark.parametrize(
    ("names", "scale"),
    [(["gy", "gx", "gz"], [1.0, 1.0, 1.0]), (GYRO, [1.0, -1.0, 1.0]), (GYRO, [-1.0, -1.0, -1.0])],
    ids=["swapped", "one reversed", "all reversed"],
)
def test_columns_of_one_gyro_are_put_right(names: list[str], scale: list[float], tmp_path: Path) -> None:
    bundle = board(3)
    spoiled = bundle.changed(("imus", 1, "columns", "gyro", "names"), names)
    spoiled = spoiled.changed(("imus", 1, "columns", "gyro", "scale"), scale)
    (told,) = array_mounts.find(evidence_of(spoiled, tmp_path / "wrong"))
    assert (told.finding.stream, told.finding.axis) == ("imu2", "gyro")
    for setting in told.settings:
        spoiled = spoiled.changed(setting.keys, setting.value)
    found = evidence_of(spoiled, tmp_path / "right").imus[1].stream.dtheta
    assert np.allclose(found, evidence_of(bundle, tmp_path / "true").imus[1].stream.dtheta)
