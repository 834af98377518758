"""A KF-GINS configuration through the command's own path gives what KF-GINS gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polyins.model.geodesy import metres_per_unit
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.reading.loading import load

Array = NDArray[np.float64]

DEG = np.pi / 180.0
UNITS = np.repeat([1.0, 1.0, 1.0 / DEG, 3600.0 / DEG, 1e5, 1e6, 1e6], 3)
"""the columns of KF-GINS's files: m, m/s, deg, deg/h, mGal, ppm, ppm"""
SETTLED_AFTER_S = 10.0


@pytest.fixture(scope="module")
def folder(data_folder: Path) -> Path:
    folder = data_folder / "kfgins-parity"
    if not folder.is_dir():
        pytest.skip(f"no data set: {folder}")
    return folder


@pytest.fixture(scope="module")
def solution(folder: Path) -> Solution:
    return batch.run(load(folder / "kf-gins.yaml"), "single")


def rows_at(time: Array, stamps: Array) -> NDArray[np.intp]:
    k = np.searchsorted(time, stamps - 1e-4)
    np.testing.assert_allclose(time[k], stamps, atol=1e-4)
    return k


def wrapped(degrees: Array) -> Array:
    return np.asarray((degrees + 180.0) % 360.0 - 180.0)


def euler_deg(solution: Solution) -> Array:
    """Roll, pitch, heading."""
    return np.asarray(Rotation.from_quat(solution.attitude, scalar_first=True).as_euler("ZYX", degrees=True)[:, ::-1])


def test_the_start_is_the_configurations(solution: Solution, folder: Path) -> None:
    expected = np.loadtxt(folder / "expected_nav.txt.gz")
    # the first record at or after the start only serves as the previous one
    assert solution.start["time_s"] == pytest.approx(100000.0071, abs=0.005)
    assert solution.time[0] <= expected[0, 1]
    assert solution.time[-1] == pytest.approx(expected[-1, 1], abs=0.05)
    assert solution.innovations.accepted.all()
    assert len(solution.innovations.time) in (299, 300)


def test_position_velocity_and_attitude(solution: Solution, folder: Path) -> None:
    expected = np.loadtxt(folder / "expected_nav.txt.gz")
    expected = expected[expected[:, 1] > expected[0, 1] + SETTLED_AFTER_S]
    k = rows_at(solution.time, expected[:, 1])
    assert len(k) > 5500
    position = expected[:, 2:5] * [DEG, DEG, 1.0]
    metres = (solution.position[k] - position) * metres_per_unit(position[0], True)
    assert np.abs(metres).max() < 2e-3
    assert np.abs(solution.velocity[k] - expected[:, 5:8]).max() < 5e-4
    assert np.abs(wrapped(euler_deg(solution)[k] - expected[:, 8:11])).max() < 5e-4


def test_standard_deviations(solution: Solution, folder: Path) -> None:
    expected = np.loadtxt(folder / "expected_std.txt.gz")
    k = rows_at(solution.time, expected[:, 0])
    variances = np.hstack(
        [solution.position_variance, solution.velocity_variance, solution.phi_covariance[:, [0, 3, 5]]]
    )
    np.testing.assert_allclose(np.sqrt(variances[k]) * UNITS[:9], expected[:, 1:10], rtol=1e-3)


def test_imu_errors_and_their_standard_deviations(solution: Solution, folder: Path) -> None:
    expected, std = (np.loadtxt(folder / f"expected_{name}.txt.gz") for name in ("imu_err", "std"))
    k = rows_at(expected[:, 0], solution.imu_error_time[solution.imu_error_time <= expected[-1, 0] + 1e-4])
    ours = solution.imu_errors[: len(k), 0] * UNITS[9:]
    assert len(k) > 290
    assert np.abs((ours - expected[k, 1:]) / std[k, 10:]).max() < 0.01
    np.testing.assert_allclose(solution.imu_error_std[: len(k), 0] * UNITS[9:], std[k, 10:], rtol=1e-3)


def test_the_solution_is_as_good_as_its_gnss(solution: Solution, folder: Path) -> None:
    """Against the truth, not against the other program: both could be wrong."""
    truth = np.loadtxt(folder / "truth.nav.gz")
    inside = (truth[:, 1] > solution.time[0] + SETTLED_AFTER_S) & (truth[:, 1] <= solution.time[-1])
    truth = truth[inside]
    at = np.column_stack([np.interp(truth[:, 1], solution.time, column) for column in solution.position.T])
    position = truth[:, 2:5] * [DEG, DEG, 1.0]
    off = (at - position) * metres_per_unit(position[0], True)
    rms = np.sqrt((off**2).mean(axis=0))
    assert len(truth) > 2500
    assert np.all(rms < 0.05)
    assert np.abs(off).max() < 0.3
    heading = np.interp(truth[:, 1], solution.time, np.unwrap(euler_deg(solution)[:, 2], period=360.0))
    late = truth[:, 1] > truth[0, 1] + 100.0
    assert np.abs(wrapped(heading - truth[:, 10]))[late].max() < 0.5
