"""A recording through one method: what is laid out, and what the solution says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from array_recordings import ATTITUDE_STD, POSITION_STD, VELOCITY_STD, shaken_path, shaken_recording
from scipy.spatial.transform import Rotation

from polyins.errors import InputError
from polyins.model.geodesy import metres_per_unit
from polyins.model.methods import ARRAY_METHODS as METHODS
from polyins.model.recording import FilterOptions, ImuStream, Recording
from polyins.model.rig import DEG
from polyins.navigate import batch


@pytest.fixture(scope="module")
def recording() -> Recording:
    return shaken_recording(3, 6.0)


@pytest.mark.parametrize("method", METHODS)
def test_a_solution_has_a_row_per_epoch_after_the_start(recording: Recording, method: str) -> None:
    solution = batch.run(recording, method)
    rows = len(recording.imus[0].time) - 1
    assert solution.method == method
    np.testing.assert_array_equal(solution.time, recording.imus[0].time[1:])
    for name, columns in (("position", 3), ("velocity", 3), ("attitude", 4), ("position_variance", 3),
                          ("velocity_variance", 3), ("phi_covariance", 6)):  # fmt: skip
        values = getattr(solution, name)
        assert values.shape == (rows, columns)
        assert np.isfinite(values).all()
    assert np.all(solution.position_variance > 0.0)
    np.testing.assert_allclose(np.linalg.norm(solution.attitude, axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_the_solution_follows_the_truth_at_its_point(recording: Recording, method: str) -> None:
    solution = batch.run(recording, method)
    truth = shaken_path(6.0).truth(solution.time, solution.point)
    metres = metres_per_unit(truth.position[0], True)
    settled = solution.time > 3.0
    assert np.abs((solution.position - truth.position) * metres)[settled].max() < 0.15
    assert np.abs(solution.velocity - truth.velocity)[settled].max() < 0.3
    error = Rotation.from_quat(solution.attitude, scalar_first=True).inv() * Rotation.from_quat(
        truth.quaternion, scalar_first=True
    )
    assert error.magnitude()[settled].max() < 1.0 * DEG


def test_single_describes_its_imu_and_arrays_their_origin(recording: Recording) -> None:
    solution = batch.run(recording, "single", imu=2)
    np.testing.assert_array_equal(solution.point, recording.rig.imus[2].position)
    assert solution.imu_names == ("imu3",)
    fused = batch.run(recording, "enav-fusion")
    np.testing.assert_array_equal(fused.point, np.zeros(3))
    assert fused.imu_names == ("imu1", "imu2", "imu3")
    assert batch.run(recording, "imu-fusion").imu_errors.shape[1] == 1


def test_what_is_known_at_the_start_is_where_the_run_begins(recording: Recording) -> None:
    solution = batch.run(replace(recording.as_published(), gnss=None), "enav-fusion")
    np.testing.assert_allclose(np.sqrt(solution.position_variance[0]), POSITION_STD, rtol=1e-4)
    np.testing.assert_allclose(np.sqrt(solution.velocity_variance[0]), VELOCITY_STD, rtol=0.01)
    np.testing.assert_allclose(np.sqrt(solution.phi_covariance[0, [0, 3, 5]]), ATTITUDE_STD, rtol=0.01)
    known = np.array([imu.initial_errors.as_array() for imu in recording.rig.imus])
    np.testing.assert_array_equal(solution.imu_errors[0], known)
    together = np.sqrt(np.mean([imu.start_std() ** 2 for imu in recording.rig.imus], axis=0))
    np.testing.assert_allclose(solution.imu_error_std[0], np.tile(together, (3, 1)), rtol=1e-5)


def test_each_imu_of_nav_fusion_has_a_std_of_its_own(recording: Recording) -> None:
    solution = batch.run(replace(recording, gnss=None), "nav-fusion")
    for i, imu in enumerate(recording.rig.imus):
        np.testing.assert_allclose(solution.imu_error_std[0, i], imu.start_std(), rtol=1e-5)


def test_imu_errors_are_logged_once_a_second(recording: Recording) -> None:
    solution = batch.run(recording, "nav-fusion")
    np.testing.assert_allclose(solution.imu_error_time, 0.01 + np.arange(6.0), atol=1e-9)
    assert solution.imu_errors.shape == solution.imu_error_std.shape == (6, 3, 12)
    assert np.isfinite(solution.imu_errors).all()
    assert np.all(solution.imu_error_std > 0.0)


def test_the_variance_of_nav_fusion_as_published_is_the_mean_of_its_filters(recording: Recording) -> None:
    fused = batch.run(recording.as_published(), "nav-fusion")
    alone = [batch.run(recording, "single", imu=i) for i in range(3)]
    for name in ("position_variance", "velocity_variance", "phi_covariance"):
        mean = np.mean([getattr(one, name) for one in alone], axis=0)
        np.testing.assert_allclose(getattr(fused, name), mean, rtol=1e-8, atol=1e-12)


def test_innovations_say_what_each_fix_brought(recording: Recording) -> None:
    assert recording.gnss is not None
    innovations = batch.run(recording, "enav-fusion").innovations
    np.testing.assert_array_equal(innovations.time, recording.gnss.time)
    assert innovations.accepted.all()
    assert not innovations.reset.any()
    assert np.all(innovations.std > recording.gnss.position_std)
    assert np.all(innovations.nis > 0.0)
    # the diagonal alone gives the same to a factor
    assert np.all(np.abs(np.log(innovations.nis / ((innovations.residual / innovations.std) ** 2).sum(axis=1))) < 3.0)


def test_progress_ends_at_one(recording: Recording) -> None:
    shares: list[float] = []
    batch.run(recording, "single", progress=shares.append)
    assert shares == [1.0]


def test_warnings_of_data_and_clocks_reach_the_solution(recording: Recording) -> None:
    imus = list(recording.imus)
    kept = (imus[1].time < 3.0) | (imus[1].time > 3.3)
    imus[1] = ImuStream(imus[1].name, imus[1].time[kept], imus[1].dtheta[kept], imus[1].dvel[kept])
    solution = batch.run(replace(recording, imus=tuple(imus), warnings=("height: guessed",)), "enav-fusion")
    assert "height: guessed" in solution.warnings
    assert any("imu2" in warning and "gap" in warning for warning in solution.warnings)


def test_the_start_says_where_each_value_came_from(recording: Recording) -> None:
    start = batch.run(recording, "enav-fusion").start
    assert start["time_s"] == 0.005
    for name in ("position", "velocity", "roll_pitch", "heading"):
        assert start[name] == "given"


def test_an_unknown_method_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match="did you mean 'nav-fusion'"):
        batch.run(recording, "nav-fuson")


def test_an_end_before_the_start_is_refused(recording: Recording) -> None:
    start = replace(recording.start, time=2.0, end_time=1.0)
    with pytest.raises(InputError, match="end"):
        batch.run(replace(recording, start=start), "enav-fusion")


def test_gravity_of_the_plane_is_the_given_one() -> None:
    """An array at rest on a plane stays there with the gravity that it feels, and falls with another."""
    time = np.arange(1, 601) / 100.0
    rest = np.tile([0.0, 0.0, -9.7 * 0.01], (600, 1))
    moving = shaken_recording(1, 6.0, equal=True)
    imu = replace(moving.rig.imus[0], initial_errors=type(moving.rig.imus[0].initial_errors)(), position=np.zeros(3))
    start = replace(moving.start, time=0.01, position=np.zeros(3), velocity=np.zeros(3), roll_pitch=np.zeros(2))
    standing = Recording(
        replace(moving.rig, imus=(imu,)),
        (ImuStream("imu1", time, np.zeros((600, 3)), rest),),
        geodetic=False,
        start=start,
        options=FilterOptions(gravity=9.7),
    )
    still = batch.run(standing, "single")
    assert np.abs(still.position).max() < 1e-12
    falling = batch.run(replace(standing, options=FilterOptions(gravity=9.8)), "single")
    assert falling.position[-1, 2] == pytest.approx(-0.5 * 0.1 * 5.99**2, rel=1e-9)
