"""Calibration and clock offsets from the drives of WID against what a careful study found (`calibration.yaml`)."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polyins.calibration.drive import calibrate
from polyins.calibration.estimates import Calibration
from polyins.calibration.offsets import gnss_offset, imu_offsets
from polyins.config.yaml_document import read_yaml
from polyins.model.recording import Recording
from polyins.reading import datasets

WHEELS = [f"IMU{number}{place}" for number in (1, 2, 3, 4) for place in ("", "_radial")]
GROUPS_S = 132.711


@pytest.fixture(scope="module")
def wid(data_folder: Path) -> dict[str, Any]:
    folder = data_folder / "wid"
    if not folder.is_dir():
        pytest.skip(f"no data set WID: {folder} is not a folder")
    os.environ["POLYINS_DATA"] = str(data_folder)
    return read_yaml(folder / "calibration.yaml").values


@pytest.fixture(scope="module")
def calibration(wid: dict[str, Any]) -> Calibration:
    return calibrate(datasets.wid("trial02", gnss=True))


def value(calibration: Calibration, imu: str, key: str) -> Any:
    return next(one.value for one in calibration.imus[imu] if one.key == key)


@pytest.mark.parametrize("name", ["IMU2", "IMU4"])
def test_radii(wid: dict[str, Any], calibration: Calibration, name: str) -> None:
    assert value(calibration, name, "wheel.radius_m")[0] == pytest.approx(wid["wheels"][name]["radius_eff"], abs=5e-4)


@pytest.mark.parametrize("name", WHEELS)
def test_spin_axes(wid: dict[str, Any], calibration: Calibration, name: str) -> None:
    expected = wid["wheels"][name]
    assert value(calibration, name, "wheel.tilt_deg") == pytest.approx(expected["spin_tilt_deg"], abs=0.15)
    assert value(calibration, name, "wheel.spin_axis") == ("z" if expected["gz_sign_forward"] < 0 else "-z")


@pytest.mark.parametrize("name", WHEELS)
def test_lever_arms(wid: dict[str, Any], calibration: Calibration, name: str) -> None:
    expected = wid["wheels"][name]
    _, y, z = np.multiply(-1e3, value(calibration, name, "wheel.lever_arm_m"))
    found = np.array([y, z] if expected["gz_sign_forward"] < 0 else [z, y])
    # the study divided by the squared rate about the sensor's z, which is smaller than that about the tilted axle
    found *= 1.0 + np.sum(np.square(np.radians(expected["spin_tilt_deg"])))
    assert found == pytest.approx(expected["imu_pos_from_axle_mm"], abs=1.5)


def test_body_pitch(wid: dict[str, Any], calibration: Calibration) -> None:
    expected = wid["body"]["C_b_v_euler_deg"]
    roll, pitch, yaw = value(calibration, "CAR", "mount_deg")
    assert pitch == pytest.approx(expected["pitch"], abs=0.5)
    assert roll == pytest.approx(expected["roll"], abs=1.5)
    assert yaw == pytest.approx(expected["yaw"], abs=3.0)


def test_track(wid: dict[str, Any], calibration: Calibration) -> None:
    right, left = (value(calibration, name, "~right_of_antenna_m")[0] for name in ("IMU2", "IMU4"))
    assert right - left == pytest.approx(wid["vehicle"]["track_m"], abs=0.08)


@pytest.mark.parametrize("trial", ["02", "08", "09"])
def test_offsets_of_clocks_never_synchronised(wid: dict[str, Any], trial: str) -> None:
    recording = on_their_own_clocks(wid, trial)
    used = [i for i, imu in enumerate(recording.rig.imus) if imu.name in ("IMU2", "IMU4", "CAR")]
    imus, streams = [recording.rig.imus[i] for i in used], [recording.imus[i] for i in used]
    found = {one.name: one.offset_s for one in imu_offsets(imus, streams, 0)}
    assert found["IMU4"] == pytest.approx(-GROUPS_S, abs=0.02)
    assert found["CAR"] == pytest.approx(-GROUPS_S, abs=0.02)
    for i, group in ((0, 1), (1, 2)):
        assert recording.gnss is not None
        offset = gnss_offset([imus[i]], [streams[i]], recording.gnss, recording.geodetic)
        expected = -wid["trials"][trial][f"t_mru_minus_t_group{group}_s"]
        assert offset.offset_s == pytest.approx(expected, abs=0.03)


def on_their_own_clocks(wid: dict[str, Any], trial: str) -> Recording:
    """Take the known offsets out of the trial's streams."""
    from dataclasses import replace

    recording = datasets.wid(f"trial{trial}", gnss=True)
    shifts = {
        name: wid["trials"][trial][f"t_mru_minus_t_group{group}_s"]
        for group in (1, 2)
        for name in wid["format"][f"clock_group{group}"]
    }
    streams = tuple(replace(stream, time=stream.time - shifts[stream.name]) for stream in recording.imus)
    return replace(recording, imus=streams)
