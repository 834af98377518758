"""Trials of the data set WID."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.model.recording import Recording
from polyins.model.rig import DEG
from polyins.reading import datasets
from polyins.reading.loading import load
from polyins.reading.wid import configuration


@pytest.fixture(scope="module")
def recording(data_folder: Path) -> Recording:
    return datasets.wid("trial08", gnss=True)


def test_rig(recording: Recording) -> None:
    rig = recording.rig
    names = [f"IMU{n}{end}" for end in ("", "_radial") for n in (1, 2, 3, 4)]
    assert [imu.name for imu in rig.imus] == [*names, "CAR"]
    wheels = {imu.name: imu for imu in rig.imus if imu.wheel is not None}
    assert {name for name, imu in wheels.items() if imu.wheel and imu.wheel.steering} == {
        "IMU1", "IMU3", "IMU1_radial", "IMU3_radial"
    }  # fmt: skip
    second = wheels["IMU2"].wheel
    assert second is not None
    assert second.radius == 0.292
    np.testing.assert_allclose(second.lever_arm, [0.0, -0.0025, 0.0056])
    # true radius of the wheel, as its other chip sees it with its own scale
    derived = wheels["IMU1_radial"].wheel
    assert derived is not None
    assert derived.radius == pytest.approx(0.288 / 1.0064 * 1.0018, abs=1e-6)
    np.testing.assert_allclose(wheels["IMU2"].noise.gyro_scale_std, [3e-3, 1e-4, 1e-4])
    np.testing.assert_allclose(wheels["IMU2"].start_std()[3:6], [0.5, 0.3, 0.3])
    np.testing.assert_allclose(wheels["IMU2"].start_std()[6:9], [0.005, 0.003, 0.003])
    np.testing.assert_allclose(rig.imus[-1].start_std()[:6], [3.0 * DEG] * 3 + [0.05] * 3)
    np.testing.assert_allclose(rig.antenna, [0.32, 0.21, 0.0])


def test_all_wheels_roll_the_same_way_forward(recording: Recording) -> None:
    begin, end = recording.start.time, recording.start.end_time
    for imu, stream in zip(recording.rig.imus, recording.imus, strict=True):
        inside = (stream.time > begin) & (stream.time < end)
        if imu.wheel is not None:
            way = -imu.wheel.radius * stream.dtheta[inside, 0].sum()
            assert way == pytest.approx(392.3, rel=0.005), imu.name


def test_an_off_centre_chip_feels_the_way_to_the_centre(recording: Recording) -> None:
    """What a turning wheel's chip feels on average is the centripetal force, along the lever arm."""
    for imu, stream in zip(recording.rig.imus, recording.imus, strict=True):
        if imu.name.endswith("_radial"):
            assert imu.wheel is not None
            force, arm = stream.dvel[:, 1:].sum(axis=0), imu.wheel.lever_arm[1:]
            cosine = force @ arm / np.linalg.norm(force) / np.linalg.norm(arm)
            assert cosine > 0.995, imu.name


def test_the_tilt_is_taken_out(recording: Recording) -> None:
    """Turning shows in the plane of the wheel as nothing but a constant, the bias."""
    for imu, stream in zip(recording.rig.imus, recording.imus, strict=True):
        if imu.wheel is not None:
            spin, rest = stream.dtheta[:, 0], stream.dtheta[:, 1:]
            slope = np.polyfit(spin, rest, 1)[0]
            assert np.degrees(np.abs(slope)).max() < 0.15, imu.name


def test_gnss_is_where_the_reference_has_it(recording: Recording) -> None:
    gnss, reference = recording.gnss, recording.reference
    assert gnss is not None
    assert reference is not None
    assert not recording.geodetic
    at = np.column_stack([np.interp(reference.time, gnss.time, column) for column in gnss.position.T])
    np.testing.assert_allclose(at, reference.position, atol=0.015)
    np.testing.assert_allclose(gnss.position_std[0], [0.05, 0.05, 0.1])


def test_the_reference_has_heading_and_no_more_attitude(recording: Recording) -> None:
    reference = recording.reference
    assert reference is not None
    assert reference.attitude is not None
    assert np.isnan(reference.attitude[:, :2]).all()
    begin = np.interp(recording.start.time, reference.time, reference.attitude[:, 2])
    assert np.degrees(begin) == pytest.approx(312.45, abs=0.05)
    np.testing.assert_allclose(reference.lever_arm, recording.rig.antenna)


def test_start(recording: Recording) -> None:
    start = recording.start
    assert (start.time, start.static_interval) == (12.7, (0.2, 12.7))
    assert start.heading == pytest.approx(312.45 * DEG)
    assert start.end_time == pytest.approx(123.3)


def test_the_configuration_in_force_gives_the_same_recording(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "again.yaml"
    path.write_text(recording.config_text)
    again = load(path)
    for one, two in zip(recording.imus, again.imus, strict=True):
        np.testing.assert_array_equal(one.dtheta, two.dtheta)
    assert again.config_text == recording.config_text


def test_a_printed_configuration_is_dead_reckoning(data_folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "wid09.yaml"
    path.write_text(datasets.configuration("wid/trial09"))
    recording = load(path)
    assert recording.gnss is None
    assert recording.name == "WID, trial 09"
    assert recording.start.time == 39.8
    assert sum(1 for text in recording.warnings if "gap(s) in the stamps" in text) == 1


def test_a_trial_with_few_sensors(data_folder: Path, tmp_path: Path) -> None:
    shutil.copy(data_folder / "wid" / "calibration.yaml", tmp_path)
    (tmp_path / "trial06").mkdir()
    for name in ("IMU2.csv.gz", "CAR.csv.gz", "reference.csv"):
        (tmp_path / "trial06" / name).symlink_to(data_folder / "wid" / "trial06" / name)
    values = configuration(tmp_path, "06")
    assert [imu["name"] for imu in values["imus"]] == ["IMU2", "CAR"]


@pytest.mark.parametrize("trial", ["trial07", "quick", ""])
def test_unknown_trials(trial: str, data_folder: Path) -> None:
    with pytest.raises(InputError, match=r"no trial .*; expected one of trial02, trial06, trial08, trial09"):
        datasets.wid(trial)


@pytest.mark.parametrize("name", ["wid", "quadrotor/path_9", "wid/"])
def test_names_without_a_configuration(name: str) -> None:
    with pytest.raises(InputError, match="expected wid/trial08"):
        datasets.configuration(name)


def test_a_poor_trial_loads_and_its_bad_fixes_are_left_out(data_folder: Path) -> None:
    reference = datasets.wid("06").reference
    assert reference is not None
    assert len(reference.time) == 246 - 142


def test_offsets_of_clocks_that_nobody_knows(data_folder: Path, tmp_path: Path) -> None:
    """The configuration in force has what was found and finds nothing again."""
    from polyins.config.yaml_document import write_yaml

    values = configuration(data_folder / "wid", "08", gnss=True)
    values["imus"] = [imu for imu in values["imus"] if imu["name"] in ("IMU2", "CAR")]
    known = values["imus"][0]["clock_offset_s"]
    values["imus"][0] |= {"clock_offset_s": 0.0, "time_offset": "estimate"}
    values["gnss"] |= {"clock_offset_s": 7.0, "time_offset": "estimate"}
    path = tmp_path / "drive.yaml"
    path.write_text(write_yaml(values))
    recording = load(path)
    wheel, gnss = recording.clock_offsets
    assert wheel.offset_s == pytest.approx(known, abs=0.02)
    assert gnss.offset_s == pytest.approx(-7.05, abs=0.05)
    path.write_text(recording.config_text)
    again = load(path)
    assert again.clock_offsets == ()
    np.testing.assert_allclose(again.imus[0].time, recording.imus[0].time, atol=1e-9)
    assert again.gnss is not None
    assert recording.gnss is not None
    np.testing.assert_allclose(again.gnss.time, recording.gnss.time, atol=1e-9)
