"""Logs of real vehicles: read is what their own libraries read, and one command makes a recording of each."""

from __future__ import annotations

import gzip
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from polyins import cli
from polyins.errors import InputError
from polyins.formats import geoid
from polyins.formats.log import Log
from polyins.formats.recognize import data_format, read_log
from polyins.formats.rows import ImuRows, Track, intervals
from polyins.formats.rtklib import read_gnss
from polyins.formats.solution_files import read_solution
from polyins.model.axes import axes_matrix
from polyins.model.geodesy import displacement
from polyins.model.rig import DEG
from polyins.reading.guess import read_stream
from polyins.reading.loading import load, load_settings
from polyins.tools.inspect import inspect
from polyins.tools.propose.proposal import propose, settings_of

LOGS = [
    "ulog/ekf_failure.ulg",
    "ulog/roboto.ulg",
    "ulog/small.ulg",
    "ulog/tagged.ulg",
    "dataflash/log0036.bin",
    "dataflash/sample.bin",
    "rosbag/husky.bag",
    "rosbag2/husky.db3",
    "mcap/husky.mcap",
]
SENSORS = {"attitude": ("heading", -1), "wheel": ("odometer", 3)}
"""by section of what is expected: the kind, and where in a row its value stands"""


@pytest.fixture(scope="module")
def expected(logs: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((logs / "expected.json").read_text())
    return found


def agree_with_samples(time: np.ndarray, values: np.ndarray, samples: dict[str, list[float]], tolerance: float) -> None:
    for row, sample in samples.items():
        wanted = np.array(sample[: 1 + values.shape[1]])
        assert time[int(row)] == pytest.approx(wanted[0], abs=1e-6)
        np.testing.assert_allclose(values[int(row)], wanted[1:], rtol=1e-6, atol=tolerance)


def check_imus(log: Log, wanted: dict[str, Any]) -> None:
    assert set(log.imus) == set(wanted)
    for name, facts in wanted.items():
        rows = log.imus[name]
        assert len(rows.time) == facts["rows"]
        assert (rows.time[0], rows.time[-1]) == pytest.approx((facts["first_s"], facts["last_s"]), abs=1e-6)
        assert 1.0 / np.median(np.diff(rows.time)) == pytest.approx(facts["median_rate_hz"], rel=1e-6)
        steps = intervals(rows.time)[:, None]
        rates = np.column_stack([rows.dtheta / steps, rows.dvel / steps])
        agree_with_samples(rows.time, rates, facts["sample"], 1e-8)
        np.testing.assert_allclose(rates[:, :3].mean(axis=0), facts["gyro_mean_rad_s"], rtol=1e-5, atol=1e-8)
        np.testing.assert_allclose(rates[:, 3:].mean(axis=0), facts["accel_mean_m_s2"], rtol=1e-5)


def check_tracks(log: Log, wanted: dict[str, Any]) -> None:
    receivers = {name: facts for name, facts in wanted.items() if "rows_3d_fix" in facts}
    assert {name for name in log.tracks if log.tracks[name].quality} == set(receivers)
    for name, facts in receivers.items():
        track = log.tracks[name]
        assert sum(track.quality.values()) == facts["rows"]
        assert len(track.time) == facts["rows_3d_fix"]
        if facts["rows_3d_fix"] == facts["rows"]:
            rows = facts["sample"]
            place = track.position / [DEG, DEG, 1.0]
            agree_with_samples(track.time, place[:, :2], rows, 2e-10)
            height = place[[int(row) for row in rows], 2]
            np.testing.assert_allclose(height, [row[3] for row in rows.values()], atol=1e-3)
            assert track.time[-1] == pytest.approx(facts["last_s"], abs=1e-6)


def check_sensors(log: Log, wanted: dict[str, Any]) -> None:
    for section, (kind, place) in SENSORS.items():
        known = {name: rows for name, rows in log.sensors.items() if rows.kind == kind}
        assert len(known) == len(wanted.get(section, {}))
        for name, rows in known.items():
            facts = wanted[section][name.removesuffix(" orientation")]
            assert len(rows.time) == facts["rows"]
            scale = 1.0 / DEG if kind == "heading" else 1.0
            for row, sample in facts["sample"].items():
                assert rows.time[int(row)] == pytest.approx(sample[0], abs=1e-6)
                angle = 90.0 - sample[place] if "ENU" in facts["columns"] else sample[place]
                off = rows.value[int(row)] * scale - angle
                assert (off + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("name", LOGS)
def test_streams_are_what_the_own_library_reads(name: str, logs: Path, expected: dict[str, Any]) -> None:
    log, wanted = read_log(logs / name), expected[name]
    check_imus(log, wanted["imu"])
    check_tracks(log, wanted["gnss"])
    check_sensors(log, wanted)
    check_estimates(log, wanted.get("position", {}))


def check_estimates(log: Log, wanted: dict[str, Any]) -> None:
    """What autopilots estimate themselves is there, though it is not navigated with."""
    for name, facts in wanted.items():
        track = log.tracks[name]
        assert name in log.unusable
        assert len(track.time) == facts["rows"]
        place = 7 if "roll" in facts["columns"] else 1
        for row, sample in facts["sample"].items():
            at = int(row)
            assert track.time[at] == pytest.approx(sample[0], abs=1e-6)
            np.testing.assert_allclose(track.position[at] * [1, 1, -1], sample[place : place + 3], atol=1e-6)
            assert track.velocity is not None
            np.testing.assert_allclose(track.velocity[at], sample[4:7], atol=1e-6)


@pytest.mark.parametrize("name", LOGS)
def test_a_proposal_is_a_recording(name: str, logs: Path, tmp_path: Path) -> None:
    config = tmp_path / "proposed.yaml"
    config.write_text(propose([logs / name]).text)
    recording = load(config)
    assert recording.gnss is not None
    assert len(recording.imus) == (2 if "dataflash" in name else 1)
    assert any("assumed" in text for text in load_settings(settings_of([logs / name])).warnings)


@pytest.mark.parametrize("name", LOGS)
def test_info_says_what_each_stream_is_good_for(name: str, logs: Path) -> None:
    facts = inspect(logs / name)
    assert facts["kind"] == "log"
    assert facts["problems"] == []
    assert {stream["kind"] for stream in facts["streams"] if stream["usable"]} >= {"imu", "positions"}


def test_thin_imus_of_px4_are_named_with_what_to_set(logs: Path) -> None:
    log = read_log(logs / "ulog" / "ekf_failure.ulg")
    assert "2 Hz" in log.unusable["vehicle_imu[1]"]
    assert "SDLOG_PROFILE" in log.unusable["vehicle_imu[1]"]
    assert (log.fix_age, log.antenna) == (pytest.approx(0.11), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", ["ulog/ekf_failure.ulg", "dataflash/log0036.bin"])
def test_utc_of_a_fix(name: str, logs: Path, expected: dict[str, Any]) -> None:
    log = read_log(logs / name)
    (receiver,) = [facts for one, facts in expected[name]["gnss"].items() if one in ("vehicle_gps_position[0]", "GPS")]
    row = receiver["sample"]["0"]
    # GPS time was 17 s ahead of UTC in 2016, when the second log was written
    utc = row[-1] if "ulog" in name else 315964800 + row[-2] * 604800 + row[-1] - 17
    assert log.utc_of_zero is not None
    assert log.utc_of_zero + row[0] == pytest.approx(utc, abs=0.25)


def test_positions_computed_afterwards_come_to_the_clock_of_the_log(
    logs: Path, expected: dict[str, Any], tmp_path: Path
) -> None:
    fixes = list(expected["ulog/ekf_failure.ulg"]["gnss"]["vehicle_gps_position[0]"]["sample"].values())
    header = "%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)"
    rows = []
    for fix in fixes:
        week, second = divmod(fix[-1] + 18 - 315964800, 604800)  # 18 leap seconds
        rows.append(f"{week:.0f} {second:.3f} {fix[1]:.9f} {fix[2]:.9f} {fix[3]:.4f} 1 12 0.01 0.01 0.02")
    path = tmp_path / "ppk.pos"
    path.write_text("\n".join([header, *rows]))
    recording = load_settings(settings_of([logs / "ulog" / "ekf_failure.ulg", path]))
    assert recording.gnss is not None
    assert recording.reference is None
    # fixes are 0.11 s old when they are stamped
    np.testing.assert_allclose(recording.gnss.time, [fix[0] - 0.11 for fix in fixes], atol=0.1)
    np.testing.assert_allclose(recording.gnss.position_std, np.tile([0.01, 0.01, 0.02], (3, 1)))


def test_the_forward_axis_of_a_robot_on_its_side(logs: Path) -> None:
    assert "axes: [-z, x, -y]" in propose([logs / "rosbag" / "husky.bag"]).text


def test_a_stream_has_to_be_named_where_there_are_several(logs: Path, tmp_path: Path) -> None:
    config = tmp_path / "two.yaml"
    config.write_text(f"imus: [{{file: {logs / 'dataflash' / 'log0036.bin'}}}]\nstart: {{heading_deg: 0}}\n")
    with pytest.raises(InputError, match=r"no stream is named; expected one of IMU, IMU2"):
        load(config)
    config.write_text(config.read_text().replace(".bin", ".bin, stream: IMU3"))
    with pytest.raises(InputError, match=r"'IMU3' is named; expected one of IMU, IMU2"):
        load(config)


@pytest.mark.parametrize("name", ["dataflash", "log", "matlab", "mcap", "rosbag", "sqlite", "ubx", "ulog"])
def test_random_bytes_are_refused(name: str, logs: Path) -> None:
    with pytest.raises(InputError, match=r"damaged|not read|no known|neither|holds no"):
        inspect(logs / "cases" / "unknown-binary" / f"{name}.bin")


@pytest.mark.parametrize("name", ["static-120s", "turns-80s"])
def test_an_array_of_bytes(name: str, logs: Path, expected: dict[str, Any], tmp_path: Path) -> None:
    path = logs / "array-binary" / f"{name}.bin"
    log, facts = read_log(path), expected[f"array-binary/{name}.bin"]
    check_imus(log, facts["imu"])
    saturated = [imu["rows_saturated"] for imu in facts["imu"].values() if imu["rows_saturated"]]
    said = [int(re.search(r"rates of (\d+)", note)[1]) for note in log.notes if "full scale" in note]
    assert said == saturated
    assert log.points["imu8"] == (0.00945, -0.00945, -0.001)
    config = tmp_path / "proposed.yaml"
    config.write_text(propose([path]).text)
    assert len(load(config).imus) == 8


def test_chips_on_both_sides_of_a_board_turn_alike(logs: Path) -> None:
    log = read_log(logs / "array-binary" / "turns-80s.bin")
    turns = {name: rows.dtheta @ axes_matrix(log.axes.get(name, ("x", "y", "z"))).T for name, rows in log.imus.items()}
    for name in turns:
        for axis in range(3):
            assert np.corrcoef(turns["imu1"][:, axis], turns[name][:, axis])[0, 1] > 0.99


@pytest.mark.parametrize("name", ["lckf", "tckf"])
def test_streams_of_vectornav(name: str, logs: Path, expected: dict[str, Any], tmp_path: Path) -> None:
    paths = [logs / "vectornav" / f"{name}-{part}.csv" for part in ("imu", "gnss")]
    check_imus(read_log(paths[0]), expected[f"vectornav/{name}-imu.csv"]["imu"])
    track, facts = read_log(paths[1]).tracks["GNSS1"], expected[f"vectornav/{name}-gnss.csv"]["gnss"]["GNSS1"]
    assert len(track.time) == facts["rows_3d_fix"]
    for row, sample in facts["sample"].items():
        at = int(row)
        assert track.time[at] == pytest.approx(sample[-1], abs=1e-6)
        np.testing.assert_allclose(track.position[at] / [DEG, DEG, 1.0], sample[1:4], rtol=0.0, atol=1e-9)
        assert track.velocity is not None
        assert track.position_std is not None
        np.testing.assert_allclose(track.velocity[at], sample[4:7], atol=1e-9)
        np.testing.assert_allclose(track.position_std[at], sample[7:10], atol=1e-9)
    config = tmp_path / "proposed.yaml"
    config.write_text(propose(paths).text)
    assert load(config).gnss is not None


def common_imu(logs: Path) -> np.ndarray:
    """t, gyro, force of the drive that the cases repeat."""
    with gzip.open(logs / "cases" / "common" / "imu.csv.gz", "rt") as file:
        return np.loadtxt(file, delimiter=",", skiprows=1)


@pytest.mark.parametrize(
    ("name", "turned", "offset"),
    [
        ("xsens-mt/mt.txt", [1, -1, -1], 99.975),
        ("preamble/imu.csv", [1, 1, 1], 36000.0),
        ("euroc", [1, 1, 1], 1403636579.758555392),
        ("euroc/mav0/imu0/data.csv", [1, 1, 1], 1403636579.758555392),
    ],
)
def test_the_common_drive(name: str, turned: list[int], offset: float, logs: Path) -> None:
    log, wanted = read_log(logs / "cases" / name), common_imu(logs)
    (rows,) = log.imus.values()
    values = np.column_stack([rows.dtheta, rows.dvel]) / intervals(rows.time)[:, None]
    np.testing.assert_allclose(rows.time, wanted[:, 0] + offset, atol=1e-6)
    np.testing.assert_allclose(values[:, :3], wanted[:, 1:4] * turned, atol=1e-6, rtol=1e-4)
    np.testing.assert_allclose(values[:, 3:], wanted[:, 4:7] * turned, atol=6e-5, rtol=1e-4)


def test_a_folder_of_a_phone(logs: Path) -> None:
    rows = read_log(logs / "cases" / "split-gyro-accel").imus["imu"]
    values = np.column_stack([rows.dtheta, rows.dvel]) / intervals(rows.time)[:, None]
    wanted = common_imu(logs)
    off = values - np.column_stack([np.interp(rows.time, wanted[:, 0], axis) for axis in wanted[:, 1:].T])
    off -= off.mean(axis=0)  # biases of the common drive
    assert np.sqrt(np.mean(off[:, :3] ** 2)) < 0.01
    assert np.sqrt(np.mean(off[:, 3:] ** 2)) < 0.1
    assert 1.0 / np.median(np.diff(rows.time)) == pytest.approx(40.0, rel=0.01)


def test_positions_of_a_tracker(logs: Path) -> None:
    track = read_log(logs / "cases" / "euroc").tracks["leica0"]
    assert (len(track.time), track.geodetic) == (80, False)


@pytest.mark.parametrize("name", ["headerless-7/imu.csv", "numeric-11/imu.csv"])
def test_numbers_without_header_are_not_taken_for_kf_gins(name: str, logs: Path) -> None:
    assert data_format(logs / "cases" / name) == "table"
    assert inspect(logs / "cases" / name)["kind"] == "imu"


def test_both_orders_of_thirteen_columns(logs: Path) -> None:
    from polyins.formats import kf_gins

    first, matlab = (
        kf_gins.read_gnss(logs / "cases" / "kf-gins-13" / name) for name in ("velocity-first.txt", "matlab.txt")
    )
    np.testing.assert_array_equal(first.velocity, matlab.velocity)
    np.testing.assert_array_equal(first.position_std, matlab.position_std)
    assert matlab.position_std is not None
    np.testing.assert_allclose(matlab.position_std, np.tile([0.02, 0.02, 0.04], (len(matlab.time), 1)))
    assert first.warnings == ()
    assert "taken as std" in matlab.warnings[0]


POSITIONS = [
    "ecef_gpst2_111_dd",
    "header_missing",
    "lla_gpst2_111_dd",
    "lla_gpst2_111_ds",
    "lla_gpst_000_dd",
    "lla_jst_111_dd",
    "lla_utc_111_dd",
    "spirent",
]


@pytest.mark.parametrize("name", POSITIONS)
def test_positions_of_rtklib_in_all_forms(name: str, logs: Path, expected: dict[str, Any]) -> None:
    facts = expected[f"rtklib-pos/{name}.pos"]["gnss"]["pos"]
    track, _ = read_stream(logs / "rtklib-pos" / f"{name}.pos")
    assert isinstance(track, Track)
    assert len(track.time) == facts["rows"]
    for row, sample in facts["sample"].items():
        at = int(row)
        assert track.time[at] == pytest.approx(sample[0], abs=1e-6)
        np.testing.assert_allclose(track.position[at, :2] / DEG, sample[1:3], rtol=0.0, atol=2e-10)
        assert track.position[at, 2] == pytest.approx(sample[3], abs=2e-4)
        if "ecef" not in name and len(sample) > 9:
            assert track.velocity is not None
            np.testing.assert_allclose(track.velocity[at], np.array(sample[9:12]) * [1, 1, -1], atol=1e-12)


def test_ecef_and_degrees_of_one_drive(logs: Path) -> None:
    folder = logs / "cases" / "pos-jst-ecef"
    tracks = [read_gnss(folder / f"{name}.pos") for name in ("gpst", "utc", "jst", "ecef-gpst", "ecef-jst")]
    for track in tracks:
        assert (track.time[0], track.time[-1]) == pytest.approx((36000.25, 36010.25), abs=1e-3)
        assert track.velocity is not None
        assert track.position_std is not None
        off = displacement(track.position, tracks[0].position[0], True)
        np.testing.assert_allclose(off, displacement(tracks[0].position, tracks[0].position[0], True), atol=1e-3)
        np.testing.assert_allclose(track.velocity, tracks[0].velocity, atol=1e-4)
        np.testing.assert_allclose(track.position_std, np.tile([0.02, 0.02, 0.04], (41, 1)), atol=5e-4)


@pytest.mark.parametrize("name", ["neo-m8l", "neo-m8u", "zed-f9p-hp", "zed-f9r"])
def test_positions_of_ublox(name: str, logs: Path, expected: dict[str, Any]) -> None:
    log, wanted = read_log(logs / "ubx" / f"{name}.ubx"), expected[f"ubx/{name}.ubx"]["gnss"]
    rapid = {"HNR-PVT"} & set(log.tracks)
    assert set(log.tracks) - rapid == set(wanted)
    for kind in (one for one in wanted if one.startswith("NAV")):
        track, facts = log.tracks[kind], wanted[kind]
        assert len(track.time) == facts["rows_3d_fix"]
        assert (track.time[0], track.time[-1]) == (facts["first_s"], facts["last_s"])
        for row, sample in facts["sample"].items():
            place = track.position[int(row)] / [DEG, DEG, 1.0]
            np.testing.assert_allclose(place, sample[1:4], rtol=0.0, atol=1e-9)
    coarse, row = log.tracks["NAV-PVT"], wanted["NAV-PVT"]["sample"]["0"]
    assert coarse.velocity is not None
    assert coarse.position_std is not None
    np.testing.assert_allclose(coarse.velocity[0], row[5:8], atol=1e-12)
    np.testing.assert_allclose(coarse.position_std[0], [row[8], row[8], row[9]], atol=1e-12)
    assert log.utc_of_zero is not None
    utc = np.datetime64(row[-1].split()[0]).astype("datetime64[s]").astype(float)
    assert log.utc_of_zero + coarse.time[0] == pytest.approx(utc, abs=0.51)


@pytest.mark.parametrize("name", ["neo-m8l", "neo-m8u"])
def test_sensors_of_ublox(name: str, logs: Path, expected: dict[str, Any]) -> None:
    log, wanted = read_log(logs / "ubx" / f"{name}.ubx"), expected[f"ubx/{name}.ubx"]
    meas, offset = log.imus["ESF-MEAS"], log.clock_offsets["ESF-MEAS"]
    steps = intervals(meas.time)[:, None]
    gyro, force = (wanted["imu"][f"ESF-MEAS {one}"] for one in ("gyro", "accel"))
    assert len(meas.time) == gyro["rows"] == force["rows"]
    assert 1.0 / np.median(np.diff(meas.time)) == pytest.approx(gyro["median_rate_hz"], rel=1e-6)
    agree_with_samples(meas.time - offset, meas.dtheta / steps, gyro["sample"], 1e-8)
    np.testing.assert_allclose((meas.dvel / steps).mean(axis=0), force["mean"], atol=0.03)  # at the gyro's stamps
    if "ESF-RAW" in wanted["imu"]:
        check_imus(replace(log, imus={"ESF-RAW": moved_back(log, "ESF-RAW")}), {"ESF-RAW": wanted["imu"]["ESF-RAW"]})
    for row, sample in wanted.get("wheel", {}).get("ESF-MEAS", {}).get("sample", {}).items():
        ticks = log.sensors["ESF-MEAS single tick"]
        assert ticks.time[int(row)] - offset == pytest.approx(sample[0], abs=1e-6)
        assert ticks.value[int(row)] == sample[2]
    if "attitude" in wanted:
        facts, shown = wanted["attitude"]["HNR-ATT"], log.sensors["HNR-ATT"]
        assert len(shown.time) == facts["rows"]
        for row, sample in facts["sample"].items():
            assert shown.time[int(row)] == pytest.approx(sample[0])
            assert shown.value[int(row)] / DEG == pytest.approx(sample[3])
            assert shown.std is not None
            assert shown.std[int(row)] / DEG == pytest.approx(sample[6])
        facts, track = wanted["position"]["HNR-PVT"], log.tracks["HNR-PVT"]
        assert len(track.time) == facts["rows"]
        for row, sample in facts["sample"].items():
            np.testing.assert_allclose(track.position[int(row)] / [DEG, DEG, 1.0], sample[1:4], atol=1e-9)


def moved_back(log: Log, name: str) -> ImuRows:
    return replace(log.imus[name], time=log.imus[name].time - log.clock_offsets[name])


def test_a_receiver_alone_is_no_recording(logs: Path) -> None:
    with pytest.raises(InputError, match=r"no IMU data; expected at least one file of them beside .*NAV-PVT"):
        propose([logs / "ubx" / "zed-f9r.ubx"])


def run(log: Path, out: Path, *more: str) -> dict[str, Any]:
    done = CliRunner().invoke(cli.cli, ["run", str(log), *more, "--json", "--no-report", "--out", str(out)])
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_one_command_from_a_log_of_px4_to_a_result(logs: Path, tmp_path: Path) -> None:
    summary = run(logs / "ulog" / "small.ulg", tmp_path)
    assert summary["verdict"]["level"] == "trust"
    assert summary["coverage"]["of_recording"] > 0.95
    assert "sensor of heading" in summary["start"]["heading"]
    assert any("vehicle_imu[2] is not used: 2 Hz" in text for text in summary["warnings"])
    assert (tmp_path / "solution.parquet").is_file()


def test_a_forward_axis_that_nothing_tells_is_doubted(logs: Path, tmp_path: Path) -> None:
    common = logs / "cases" / "common"
    inputs = [str(common / name) for name in ("imu.csv", "gnss.csv")]
    done = CliRunner().invoke(cli.cli, ["run", *inputs, "--json", "--no-report", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    verdict = json.loads(done.stdout)["verdict"]
    assert verdict["level"] == "doubt"
    assert ["forward is a guess" in one["text"] for one in verdict["findings"] if one["severity"] == "doubt"] == [True]


def test_one_command_from_a_log_of_ardupilot_to_a_result(logs: Path, tmp_path: Path) -> None:
    summary = run(logs / "dataflash" / "sample.bin", tmp_path)
    assert summary["imus"] == 2
    assert summary["verdict"]["level"] in ("trust", "doubt")
    assert any("no IMU has data for 627.9 s" in text for text in summary["warnings"])
    grid = geoid.library() is not None
    assert any("above the sea" in text for text in summary["warnings"])
    assert summary["heights"] == ("ellipsoidal" if grid else "sea-level")
    time = read_solution(tmp_path).time
    assert time[0] < 215.0
    assert time[-1] > 880.0  # armed again
    assert not ((time > 252.0) & (time < 879.0)).any()


@pytest.mark.parametrize("imu", ["IMU", "IMU2"])
def test_each_imu_of_a_log_alone_by_its_name_there(imu: str, logs: Path, tmp_path: Path) -> None:
    summary = run(logs / "dataflash" / "log0036.bin", tmp_path, "--imu", imu)
    assert (summary["method"], summary["imus"]) == ("single", 1)
    assert "sensor of heading" in summary["start"]["heading"]
    assert summary["verdict"]["level"] != "do-not-use"
    assert summary["measurements"]["heading"]["count"] > 100


def test_an_unknown_file_among_others_is_named_and_the_rest_is_run(logs: Path, tmp_path: Path) -> None:
    unknown = str(logs / "cases" / "unknown-binary" / "log.bin")
    summary = run(logs / "ulog" / "small.ulg", tmp_path, unknown)
    assert any("no known binary format" in text for text in summary["warnings"])
    done = CliRunner().invoke(cli.cli, ["info", str(logs / "ulog" / "small.ulg"), unknown, "--json"])
    assert [one["kind"] for one in json.loads(done.stdout)["files"]] == ["log", "unknown"]
    assert isinstance(done.exception, InputError)


def test_what_rests_without_a_heading_is_refused_with_what_would_help(logs: Path, tmp_path: Path) -> None:
    log = str(logs / "ubx" / "neo-m8u.ubx")
    done = CliRunner().invoke(cli.cli, ["run", log, "--no-report", "--out", str(tmp_path)])
    assert isinstance(done.exception, InputError)
    assert "start.heading_deg" in str(done.exception)
    assert "polyins init" in str(done.exception)


def test_a_receiver_with_sensors_of_its_own_gives_a_result(logs: Path, tmp_path: Path) -> None:
    summary = run(logs / "ubx" / "neo-m8l.ubx", tmp_path)
    assert summary["verdict"]["level"] == "doubt"  # of hands nobody knows which way they point
    assert any("agree with ESF-INS" in text for text in summary["warnings"])
    assert any("own fusion with its sensors" in text for text in summary["warnings"])


@pytest.mark.parametrize(("name", "day"), [("boat", "2018-08-20"), ("m9n", "2020-07-11")])
def test_positions_of_nmea(name: str, day: str, logs: Path, expected: dict[str, Any]) -> None:
    track, wanted = read_log(logs / "nmea" / f"{name}.nmea").tracks["GGA"], expected[f"nmea/{name}.nmea"]["gnss"]
    midnight = np.datetime64(day, "s").astype(float)
    assert len(track.time) == wanted["GGA"]["rows_3d_fix"]
    for row, sample in wanted["GGA"]["sample"].items():
        at = int(row)
        assert track.time[at] - midnight == sample[0]
        np.testing.assert_allclose(track.position[at, :2] / DEG, sample[1:3], rtol=0.0, atol=1e-9)
        assert track.position[at, 2] == pytest.approx(sample[3] + sample[4], abs=1e-9)
    if "GST" in wanted:
        np.testing.assert_array_equal(track.position_std[30], wanted["GST"]["sample"]["30"][1:])
    else:
        assert track.position_std is None


def test_speeds_and_headings_of_nmea(logs: Path, expected: dict[str, Any]) -> None:
    log, wanted = read_log(logs / "nmea" / "boat.nmea"), expected["nmea/boat.nmea"]
    midnight = np.datetime64("2018-08-20", "s").astype(float)
    magnetic, facts = log.sensors["HDG"], wanted["heading"]["HDG"]
    assert len(magnetic.time) == facts["rows"]
    assert (np.diff(magnetic.time) > 0.0).all()
    for row, (heading, variation, _) in facts["sample"].items():
        assert magnetic.value[int(row)] / DEG == pytest.approx(heading + variation)
    speed, facts = log.sensors["RMC"], wanted["gnss"]["RMC"]
    assert len(speed.time) == facts["rows"] - facts["stamps_not_rising"]
    assert (speed.time[0] - midnight, speed.time[-1] - midnight) == (facts["first_s"], facts["last_s"])
    np.testing.assert_allclose(speed.value[0], facts["sample"]["0"][3])
    water, facts = log.sensors["VHW"], wanted["speed"]["VHW"]
    assert len(water.time) == facts["rows"]
    for row, sample in facts["sample"].items():
        assert water.value[int(row)] == pytest.approx(sample[2] * 1852 / 3600)
    assert "through water" in log.unusable["VHW"]
    assert "no sentence (GST) tells how good" in log.notes[0]
