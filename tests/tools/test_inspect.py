"""What is in a file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from written_recordings import as_increments, fixes, still_imu, write_config, write_recording, write_rows

from polyins.tools.inspect import inspect, listing


def test_imu_data(tmp_path: Path) -> None:
    facts = inspect(write_rows(tmp_path / "imu.txt", as_increments(still_imu())))
    assert (facts["kind"], facts["format"], facts["rows"]) == ("imu", "kf-gins", 500)
    assert facts["rate_hz"] == pytest.approx(50.0)
    assert (facts["begin_s"], facts["end_s"]) == (100.0, 109.98)
    assert facts["gravity_axis"] == "-z"
    assert facts["accel_norm_m_s2"] == pytest.approx(9.80665, rel=1e-3)
    assert facts["gaps"] == {"count": 0, "largest_s": None, "at_s": None}
    assert facts["problems"] == []
    json.dumps(facts, allow_nan=False)


def test_spoilt_data_are_described_not_refused(tmp_path: Path) -> None:
    rows = as_increments(still_imu())
    rows[10, 0] = rows[9, 0]
    rows[20, 2] = np.nan
    rows[[30, 31]] = rows[[31, 30]]
    facts = inspect(write_rows(tmp_path / "imu.txt", np.delete(rows, slice(100, 150), axis=0)))
    assert (facts["repeated_stamps"], facts["unsorted_stamps"], facts["nan_values"]) == (1, 1, 1)
    assert facts["gaps"]["largest_s"] == pytest.approx(1.02)
    assert facts["gaps"]["at_s"] == pytest.approx(101.98)
    assert "line 21: gyro is missing" in facts["problems"][0]
    json.dumps(facts, allow_nan=False)


def test_rates_without_header_are_rates(tmp_path: Path) -> None:
    facts = inspect(write_rows(tmp_path / "imu.txt", still_imu()))
    assert (facts["format"], facts["problems"]) == ("table", [])
    assert facts["units"] == {"gyro": "rad/s", "accel": "m/s^2"}
    assert facts["accel_mean_m_s2"] == pytest.approx([0.02, -0.01, -9.80665])


def test_positions(tmp_path: Path) -> None:
    facts = inspect(write_rows(tmp_path / "gnss.txt", fixes()))
    assert (facts["kind"], facts["format"], facts["rate_hz"]) == ("positions", "kf-gins-gnss", 1.0)
    assert facts["first"] == {"latitude_deg": 30.5, "longitude_deg": 114.4, "height_m": 20.0}
    assert facts["median_std_m"] == [0.02, 0.02, 0.04]


def test_a_configuration(tmp_path: Path) -> None:
    facts = inspect(write_config(tmp_path, write_recording(tmp_path)))
    assert (facts["kind"], facts["format"]) == ("configuration", "polyins")
    assert [imu["name"] for imu in facts["imus"]] == ["a", "b"]
    assert facts["gnss"]["rows"] == 10
    assert facts["reference"] is None
    json.dumps(facts, allow_nan=False)


def test_listing_for_a_reader(tmp_path: Path) -> None:
    lines = listing(inspect(write_config(tmp_path, write_recording(tmp_path)))).splitlines()
    assert lines[1:3] == ["kind: configuration", "format: polyins"]
    assert lines.count("imus:") == 2
    assert "  name: b" in lines
    assert "  begin_s: 100.5" in lines
    assert not any(line.endswith("None") for line in lines)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("kfgins-parity/imu.txt", "kf-gins"),
        ("kfgins-parity/gnss.txt", "kf-gins-gnss"),
        ("kfgins-parity/truth.nav", "kf-gins-nav"),
        ("kfgins-parity/expected_nav.txt", "kf-gins-nav"),
        ("kfgins-parity/kf-gins.yaml", "kf-gins"),
        ("quadrotor/RAW_1111/IMU_3.csv", "xsens-dot"),
        ("quadrotor/Horizontal/path_1/GT.csv", "table"),
        ("wid/trial08/CAR.csv", "xsens-dot"),
        ("whu-array/gnss_group1.txt", "kf-gins-gnss"),
        ("wheelins-parity/wheel_imu.bin", "kf-gins"),
    ],
)
def test_formats_of_real_files(name: str, kind: str, data_folder: Path) -> None:
    facts = inspect(data_folder / name)
    assert facts["format"] == kind
    json.dumps(facts, allow_nan=False)
