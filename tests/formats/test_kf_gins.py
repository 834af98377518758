"""KF-GINS's data files and its configuration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from written_recordings import as_increments, fixes, still_imu, write_rows

from polyins.errors import InputError
from polyins.formats import kf_gins
from polyins.model.recording import GnssStream, ImuStream
from polyins.model.rig import DEG, HOUR
from polyins.reading.loading import load

CONFIGURATION = """\
# as that program reads it
imupath: "imu.txt"
gnsspath: "gnss.txt"
outputpath: "./out"
imudatalen: 7
imudatarate: 50
starttime: "102.5"
endtime: {endtime}
initpos: [30.5, 114.4, 20.0]
initvel: [1, 2, 3]
initatt: [0.5, -1.0, 185.0]
initgyrbias: [36, 0, 0]
initaccbias: [100, 0, 0]
initgyrscale: [300, 0, 0]
initaccscale: [0, 0, -200]
initposstd: [0.1, 0.2, 0.3]
initvelstd: [0.05, 0.05, 0.05]
initattstd: [0.5, 0.5, 1.0]
imunoise:
  arw: [0.6, 0.6, 0.6]
  vrw: [1.2, 1.2, 1.2]
  gbstd: [50, 60, 70]
  abstd: [250, 250, 250]
  gsstd: [1000, 1000, 1000]
  asstd: [900, 900, 900]
  corrtime: 4
antlever: [0.1, -0.3, -0.2]
{more}
"""


def write_files(folder: Path, endtime: str = "-1", more: str = "") -> Path:
    write_rows(folder / "imu.txt", as_increments(still_imu()))
    write_rows(folder / "gnss.txt", fixes())
    path = folder / "kf-gins.yaml"
    path.write_text(CONFIGURATION.format(endtime=endtime, more=more))
    return path


def test_configuration_in_si(tmp_path: Path) -> None:
    recording = load(write_files(tmp_path))
    start, imu, options = recording.start, recording.rig.imus[0], recording.options
    assert (start.time, start.end_time) == (102.5, None)
    np.testing.assert_allclose(start.position, [30.5 * DEG, 114.4 * DEG, 20.0], rtol=1e-15)
    np.testing.assert_array_equal(start.velocity, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(start.roll_pitch, [0.5 * DEG, -1.0 * DEG])
    assert start.heading == pytest.approx(185.0 * DEG)
    assert not start.estimate_gyro_bias
    np.testing.assert_array_equal(start.position_std, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(start.attitude_std, np.array([0.5, 0.5, 1.0]) * DEG)
    np.testing.assert_allclose(imu.initial_errors.as_array(), [
        36 * DEG / HOUR, 0, 0, 1e-3, 0, 0, 3e-4, 0, 0, 0, 0, -2e-4,
    ])  # fmt: skip
    np.testing.assert_allclose(imu.noise.angle_random_walk, 0.01 * DEG)
    np.testing.assert_allclose(imu.noise.velocity_random_walk, 0.02)
    np.testing.assert_allclose(imu.noise.gyro_bias_std, np.array([50, 60, 70]) * DEG / HOUR)
    assert imu.noise.correlation_time == 4 * HOUR
    np.testing.assert_allclose(imu.start_std()[[0, 1, 2, 9]], [*np.array([50, 60, 70]) * DEG / HOUR, 9e-4])
    assert (options.gate_limit, options.gnss_snap) == (None, 1e-3)
    np.testing.assert_array_equal(recording.rig.antenna, [0.1, -0.3, -0.2])
    assert recording.geodetic
    assert recording.reference is None


def test_initial_std_of_their_own(tmp_path: Path) -> None:
    more = "initbgstd: [360, 360, 360]\ninitbastd: [10, 10, 10]\ninitsgstd: [1, 1, 1]\ninitsastd: [2, 2, 2]"
    std = load(write_files(tmp_path, more=more)).rig.imus[0].start_std()
    np.testing.assert_allclose(std, np.repeat([0.1 * DEG, 1e-4, 1e-6, 2e-6], 3))


def test_output_path_is_ignored_and_said_so(tmp_path: Path) -> None:
    (warning,) = load(write_files(tmp_path)).warnings
    assert "line 4: outputpath: is ignored" in warning


def test_the_first_of_two_keys_counts_and_said_so(tmp_path: Path) -> None:
    recording = load(write_files(tmp_path, endtime="105", more="endtime: 107"))
    assert recording.start.end_time == 105.0
    assert any('duplicate key "endtime"; the first one counts' in text for text in recording.warnings)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("initpos: [30.5, 114.4, 20.0]\n", "", r"kf-gins\.yaml: initpos: is missing"),
        ("[30.5, 114.4, 20.0]", "[30.5, 114.4]", r"line 9: initpos: is \[30\.5, 114\.4\]; expected three numbers"),
        ("corrtime: 4", "corrtime: long", r"line 26: imunoise\.corrtime: is 'long'; expected a number"),
        ("gbstd: [50", "gbstd: [-50", r"line 22: imunoise\.gbstd: is .*; expected no negative number"),
        ('"gnss.txt"', "7", r"line 3: gnsspath: is 7; expected a file name"),
        ('"gnss.txt"', '"nowhere.txt"', r"nowhere\.txt: no such file"),
        ('"102.5"', "90", r"start\.time_s: is 90\.000; expected a time within the data"),
    ],
)
def test_wrong_configuration(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = write_files(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match=message):
        load(path)


def test_the_configuration_in_force_is_polyins_yaml_of_the_same_recording(tmp_path: Path) -> None:
    recording = load(write_files(tmp_path))
    (tmp_path / "config.yaml").write_text(recording.config_text)
    again = load(tmp_path / "config.yaml")
    assert again.config_text == recording.config_text
    np.testing.assert_array_equal(again.rig.imus[0].start_std(), recording.rig.imus[0].start_std())
    np.testing.assert_array_equal(again.start.position, recording.start.position)


@settings(deadline=None, max_examples=30)
@given(arrays(float, (5, 6), elements=st.floats(-1e3, 1e3)))
def test_binary_gives_back_every_bit(tmp_path_factory: pytest.TempPathFactory, values: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("binary") / "imu.bin"
    stream = ImuStream("a", np.arange(5.0) + 0.1, values[:, :3], values[:, 3:])
    kf_gins.write_imu_binary(path, stream)
    rows = kf_gins.read_imu(path)
    np.testing.assert_array_equal(rows.time, stream.time)
    np.testing.assert_array_equal(rows.dtheta, stream.dtheta)
    np.testing.assert_array_equal(rows.dvel, stream.dvel)


def test_text_keeps_twelve_digits_and_nanoseconds(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=(50, 6))
    stream = ImuStream("a", 456300.0 + np.arange(50) / 200.0, values[:, :3], values[:, 3:])
    kf_gins.write_imu_text(tmp_path / "imu.txt", stream)
    rows = kf_gins.read_imu(tmp_path / "imu.txt")
    np.testing.assert_allclose(rows.time, stream.time, atol=1e-9)
    np.testing.assert_allclose(rows.dvel, stream.dvel, rtol=1e-12)


def test_commas_and_tabs_separate_too(tmp_path: Path) -> None:
    (tmp_path / "imu.txt").write_text("1,2, 3 ,4,5,6,7\n2\t2\t3\t4\t5\t6\t8\n")
    np.testing.assert_array_equal(kf_gins.read_imu(tmp_path / "imu.txt").dvel, [[5, 6, 7], [5, 6, 8]])


def test_gnss_of_thirteen_columns_has_the_velocity_first(tmp_path: Path) -> None:
    (tmp_path / "gnss.txt").write_text("1 30 114 20 1 2 3 0.1 0.2 0.3 0.01 0.02 0.03\n")
    track = kf_gins.read_gnss(tmp_path / "gnss.txt")
    np.testing.assert_array_equal(track.velocity, [[1, 2, 3]])
    np.testing.assert_array_equal(track.position_std, [[0.1, 0.2, 0.3]])
    np.testing.assert_array_equal(track.velocity_std, [[0.01, 0.02, 0.03]])


@pytest.mark.parametrize("velocity", [False, True])
def test_gnss_written_and_read(velocity: bool, tmp_path: Path) -> None:
    rows = fixes()
    position = rows[:, 1:4] * [DEG, DEG, 1.0]
    speed = np.tile([1.0, -2.0, 0.5], (len(rows), 1)) if velocity else None
    stream = GnssStream(rows[:, 0], position, rows[:, 4:7], speed, None if speed is None else np.abs(speed))
    kf_gins.write_gnss(tmp_path / "gnss.txt", stream)
    track = kf_gins.read_gnss(tmp_path / "gnss.txt")
    np.testing.assert_allclose(track.position, position, rtol=1e-13)
    np.testing.assert_allclose(track.position_std, rows[:, 4:7])
    assert (track.velocity is not None) is velocity


def test_parity_set(data_folder: Path) -> None:
    folder = data_folder / "kfgins-parity"
    recording = load(folder / "kf-gins.yaml")
    assert len(recording.imus[0].time) == 60019
    assert recording.imus[0].rate_hz == pytest.approx(200.0)
    truth = kf_gins.read_nav(folder / "truth.nav")
    assert truth.attitude is not None
    assert truth.velocity is not None
    # The antenna is the lever arm away from the IMU's true position; the array stands still at first.
    offset = (recording.gnss.position[0] - truth.position[10]) * [6.35e6, 6.378e6 * np.cos(0.5316), 1.0]
    heading = truth.attitude[10, 2]
    forward, right, down = recording.rig.antenna
    lever = [
        forward * np.cos(heading) - right * np.sin(heading),
        forward * np.sin(heading) + right * np.cos(heading),
        -down,
    ]
    np.testing.assert_allclose(offset, lever, atol=0.15)


def test_reference_by_the_name_of_a_nav_file(data_folder: Path, tmp_path: Path) -> None:
    folder = data_folder / "kfgins-parity"
    path = tmp_path / "drive.yaml"
    files = {"imus": "[{file: %s/imu.txt}]", "gnss": "{file: %s/gnss.txt}", "reference": "{file: %s/truth.nav}"}
    path.write_text("".join(f"{key}: {value % folder}\n" for key, value in files.items()))
    reference = load(path).reference
    assert reference is not None
    assert reference.velocity is not None
    assert reference.attitude is not None
    assert len(reference.time) == 3001


def test_lines_that_were_cut_are_left_out_and_named(tmp_path: Path) -> None:
    rows = as_increments(still_imu())
    whole = write_rows(tmp_path / "imu.txt", rows).read_text()
    (tmp_path / "cut.txt").write_text(whole[30:-25])
    found = kf_gins.read_imu(tmp_path / "cut.txt")
    np.testing.assert_allclose(found.time, rows[1:-1, 0], atol=1e-9)
    assert f"lines 1 and {len(rows)} are cut off" in found.warnings[0]
    assert found.source.place(0).endswith("line 2")
