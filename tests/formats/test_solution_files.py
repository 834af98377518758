"""Solutions go to files and come back; a file is whole or absent."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from synthetic_solutions import drifting, drive, reference, solution

from polyins.errors import InputError
from polyins.evaluation.summary import summarize
from polyins.files import whole
from polyins.formats.solution_files import IMU_ERRORS, SOLUTION, read_solution, write_solution

COLUMNS = {
    "time_s", "latitude_deg", "longitude_deg", "height_m", "north_velocity_m_s", "east_velocity_m_s",
    "down_velocity_m_s", "roll_deg", "pitch_deg", "heading_deg", "std_north_m", "std_east_m", "std_down_m",
    "std_north_velocity_m_s", "std_east_velocity_m_s", "std_down_velocity_m_s", "std_roll_deg", "std_pitch_deg",
    "std_heading_deg", "std_phi_north_deg", "std_phi_east_deg", "std_phi_down_deg", "north_m", "east_m", "down_m",
}  # fmt: skip
IMU_COLUMNS = {
    "time_s", "imu", *(f"gyro_bias_{axis}_rad_s" for axis in "xyz"), *(f"accel_bias_{axis}_m_s2" for axis in "xyz"),
    *(f"gyro_scale_{axis}" for axis in "xyz"), *(f"accel_scale_{axis}" for axis in "xyz"),
}  # fmt: skip


@pytest.fixture
def drifted():
    return drifting(drive(), "enav-fusion", 3, 0.05, ((1010.0, 1020.0),), seed=4)


def test_the_columns_are_those_that_others_rely_on(drifted, tmp_path):
    write_solution(drifted, tmp_path / "new" / "folder")
    table = pq.read_table(tmp_path / "new" / "folder" / SOLUTION)
    assert set(table.column_names) - {"status"} == COLUMNS
    assert table.num_rows == drifted.time.size
    errors = pq.read_table(tmp_path / "new" / "folder" / IMU_ERRORS)
    assert set(errors.column_names) == IMU_COLUMNS
    assert errors.column("imu").to_pylist()[:4] == ["imu1", "imu2", "imu3", "imu1"]
    assert errors.num_rows == 3 * drifted.imu_error_time.size
    assert sorted(path.name for path in (tmp_path / "new" / "folder").iterdir()) == [IMU_ERRORS, SOLUTION]


def test_values_in_the_files_are_in_the_units_of_their_names(tmp_path):
    truth = drive()
    write_solution(solution(truth), tmp_path)
    table = pq.read_table(tmp_path / SOLUTION).to_pydict()
    np.testing.assert_allclose(table["latitude_deg"][0], 30.5)
    np.testing.assert_allclose(table["heading_deg"], np.degrees(truth.euler[:, 2]) % 360.0, atol=2e-5)
    np.testing.assert_allclose(table["std_phi_down_deg"], np.degrees(0.01))
    np.testing.assert_allclose(table["std_pitch_deg"], np.degrees(0.01))
    np.testing.assert_allclose(table["std_roll_deg"], np.degrees(0.01) / np.cos(0.05))
    np.testing.assert_allclose(table["std_north_velocity_m_s"], 0.1)
    np.testing.assert_allclose(table["north_m"], truth.local[:, 0], atol=0.01)
    np.testing.assert_allclose(table["east_m"], truth.local[:, 1], atol=0.01)
    np.testing.assert_allclose(table["down_m"], 0.0, atol=0.01)


def test_a_local_solution_has_no_latitude_and_starts_at_zero(tmp_path):
    truth = drive()
    shifted = truth.local + np.array([100.0, -50.0, 7.0])
    write_solution(solution(truth, geodetic=False, position=shifted), tmp_path)
    table = pq.read_table(tmp_path / SOLUTION)
    assert table.column("latitude_deg").null_count == truth.time.size
    assert table.column("longitude_deg").null_count == truth.time.size
    assert table.column("north_m")[0].as_py() == 0.0
    np.testing.assert_allclose(table.column("east_m").to_numpy(), truth.local[:, 1], rtol=1e-7, atol=1e-5)
    np.testing.assert_allclose(read_solution(tmp_path).position, shifted, rtol=1e-7, atol=1e-5)


@pytest.mark.parametrize("geodetic", [True, False])
def test_what_was_written_is_read_again(geodetic, tmp_path):
    truth = drive()
    original = replace(drifting(truth, "enav-fusion", 3, 0.05, (), seed=4), point=np.array([0.1, 0.2, 0.3]))
    if not geodetic:
        original = replace(original, geodetic=False, position=truth.local)
    write_solution(original, tmp_path)
    for source in (tmp_path, tmp_path / SOLUTION):
        back = read_solution(source)
        assert (back.method, back.geodetic, back.imu_names) == ("enav-fusion", geodetic, original.imu_names)
        metres = 1e-12 if geodetic else 1e-5
        np.testing.assert_allclose(back.position[:, :2], original.position[:, :2], rtol=0.0, atol=metres)
        np.testing.assert_array_equal(back.position[:, 2], original.position[:, 2])
        for field in ("time", "imu_error_time", "point"):
            np.testing.assert_array_equal(getattr(back, field), getattr(original, field))
        for field in ("velocity", "imu_errors"):
            np.testing.assert_array_equal(getattr(back, field), getattr(original, field).astype(np.float32))
        sign = np.sign(np.sum(back.attitude * original.attitude, axis=1, keepdims=True))
        np.testing.assert_allclose(back.attitude * sign, original.attitude, atol=3e-7)
        np.testing.assert_allclose(back.position_variance, original.position_variance, rtol=3e-7)
        np.testing.assert_allclose(back.phi_covariance, original.phi_covariance, rtol=3e-7, atol=0.0)
        assert back.filter_s == original.filter_s
        assert back.warnings == ()


def test_a_solution_read_again_is_judged_alike(drifted, tmp_path):
    write_solution(drifted, tmp_path)
    truth = reference(drive(), lever_arm=np.array([1.0, 0.5, -0.2]))
    ours, theirs = (summarize(one, truth)["reference"] for one in (drifted, read_solution(tmp_path)))
    assert ours == pytest.approx(theirs, abs=1e-5)


def test_a_file_without_our_notes_is_read_with_a_warning(drifted, tmp_path):
    write_solution(drifted, tmp_path)
    table = pq.read_table(tmp_path / SOLUTION).replace_schema_metadata(None)
    pq.write_table(table, tmp_path / "mine.parquet")
    back = read_solution(tmp_path / "mine.parquet")
    assert back.method == "mine"
    assert back.imu_names == ("imu1", "imu2", "imu3")
    assert any("the array origin is assumed" in warning for warning in back.warnings)


def test_what_is_not_a_solution_is_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"solution\.parquet: no such file"):
        read_solution(tmp_path)
    (tmp_path / "text.parquet").write_text("time_s,latitude_deg\n")
    with pytest.raises(InputError, match=r"text\.parquet: not readable as Parquet"):
        read_solution(tmp_path / "text.parquet")
    pq.write_table(pa.table({"time_s": [0.0], "latitude_deg": [1.0], "height_m": [0.0]}), tmp_path / "few.parquet")
    with pytest.raises(InputError, match=r"few\.parquet: no column"):
        read_solution(tmp_path / "few.parquet")


def test_imu_errors_with_missing_rows_are_refused(drifted, tmp_path):
    write_solution(drifted, tmp_path)
    table = pq.read_table(tmp_path / IMU_ERRORS)
    pq.write_table(table.slice(0, table.num_rows - 1), tmp_path / IMU_ERRORS)
    with pytest.raises(InputError, match="expected one row of each IMU per time"):
        read_solution(tmp_path)


def test_a_failure_leaves_the_old_file_and_no_other(tmp_path):
    target = tmp_path / "summary.json"
    target.write_text("old")

    def fail() -> None:
        with whole(target) as beside:
            beside.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]
    with whole(target) as beside:
        beside.write_text("new")
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]
