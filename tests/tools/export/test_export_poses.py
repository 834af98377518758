"""TUM and KITTI, read by evo."""

from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface
from exported import exported, known

from polyins.model.attitude import rotation_matrices
from polyins.tools.export.writing import export


def test_evo_reads_a_tum_trajectory_in_east_north_up(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "tum")
    read = file_interface.read_tum_trajectory_file(path)
    assert read.check()[0]
    np.testing.assert_allclose(read.timestamps, truth.time, atol=1e-9)
    # the drive's metres are laid on the ellipsoid with the radii of the start
    np.testing.assert_allclose(read.positions_xyz, truth.local[:, [1, 0, 2]], atol=5e-3)


def test_the_body_looks_along_the_velocity_with_its_left_to_the_left(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "tum")
    turns = np.array([pose[:3, :3] for pose in file_interface.read_tum_trajectory_file(path).poses_se3])
    frd_in_ned = rotation_matrices(truth.attitude)
    for flu, sign in ((0, 1.0), (1, -1.0), (2, -1.0)):  # forward, left, up are forward, -right, -down
        in_ned = sign * frd_in_ned[:, :, flu]
        np.testing.assert_allclose(turns[:, :, flu], in_ned[:, [1, 0, 2]] * [1.0, 1.0, -1.0], atol=1e-8)
    ahead = truth.velocity[:, [1, 0]] / np.linalg.norm(truth.velocity, axis=1)[:, None]
    assert np.sum(turns[:, :2, 0] * ahead, axis=1).min() > 0.99  # of a level unit vector, nose up by 0.05 rad


def test_evo_reads_kitti_poses_that_are_those_of_tum(tmp_path: Path) -> None:
    kitti = file_interface.read_kitti_poses_file(exported(tmp_path, "kitti")[0])
    tum = file_interface.read_tum_trajectory_file(exported(tmp_path, "tum")[0])
    assert kitti.check()[0]
    np.testing.assert_allclose(kitti.poses_se3, tum.poses_se3, atol=1e-6)


@pytest.mark.parametrize("to", ["tum", "kitti"])
def test_a_solution_on_a_plane_has_poses(to: str, tmp_path: Path) -> None:
    truth, made = known(geodetic=False)
    assert export(made, tmp_path / "out", to) == ()
    readers = {"tum": file_interface.read_tum_trajectory_file, "kitti": file_interface.read_kitti_poses_file}
    np.testing.assert_allclose(readers[to](tmp_path / "out").positions_xyz, truth.local[:, [1, 0, 2]], atol=1e-5)
