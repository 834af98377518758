"""From one data file format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore
from synthetic_solutions import drive, solution
from written_recordings import as_increments, fixes, still_imu, write_config, write_rows

from polyins.errors import InputError
from polyins.formats import kf_gins, table, written_table
from polyins.formats.recognize import read_log
from polyins.formats.solution_files import write_solution
from polyins.reading.guess import read_stream
from polyins.reading.loading import load
from polyins.tools.convert import convert


@pytest.mark.parametrize(
    "chain", [("a.bin", "b.csv", "c.parquet", "d.bin"), ("a.parquet", "b.bin", "c.csv.gz", "d.bin")]
)
def test_imu_data_pass_through_all_formats_unchanged(chain: tuple[str, ...], tmp_path: Path) -> None:
    source = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    original = kf_gins.read_imu(source)
    for name in chain:
        assert convert(source, tmp_path / name) == ()
        source = tmp_path / name
    final = kf_gins.read_imu(source)
    for field in ("time", "dtheta", "dvel"):
        np.testing.assert_array_equal(getattr(final, field), getattr(original, field))


def test_positions_pass_through_all_formats(tmp_path: Path) -> None:
    source = write_rows(tmp_path / "gnss.txt", fixes())
    original = kf_gins.read_gnss(source)
    convert(source, tmp_path / "a.csv")
    convert(tmp_path / "a.csv", tmp_path / "b.parquet")
    convert(tmp_path / "b.parquet", tmp_path / "c.txt")
    final = kf_gins.read_gnss(tmp_path / "c.txt")
    np.testing.assert_allclose(final.position, original.position, rtol=1e-13)
    np.testing.assert_allclose(final.position_std, original.position_std)


def test_a_table_by_the_names_of_its_columns(tmp_path: Path) -> None:
    rows = still_imu()
    rows[:, 1:4] = np.degrees(rows[:, 1:4])
    write_rows(tmp_path / "log.csv", rows, "timestamp,gyro_x(deg/s),gyro_y(deg/s),gyro_z(deg/s),acc_x,acc_y,acc_z", ",")
    (guess,) = convert(tmp_path / "log.csv", tmp_path / "log.bin")
    assert "taken as time in s, gyro in deg/s, accel in m/s^2" in guess
    read = kf_gins.read_imu(tmp_path / "log.bin")
    np.testing.assert_allclose(read.dtheta, as_increments(still_imu())[:, 1:4], atol=1e-9)


def test_a_navigation_result_keeps_velocity_and_attitude(tmp_path: Path) -> None:
    (tmp_path / "truth.nav").write_text("0 1.0 30 114 20 1 2 3 4 5 6\n0 2.0 30 114 20 1 2 3 4 5 6\n")
    convert(tmp_path / "truth.nav", tmp_path / "truth.parquet")
    track = table.read_track(tmp_path / "truth.parquet")
    np.testing.assert_array_equal(track.velocity[0], [1, 2, 3])
    np.testing.assert_allclose(np.degrees(track.attitude[0]), [4, 5, 6])


LOG_BEGIN = 1_700_000_000


def write_bag(path: Path) -> Path:
    """An MCAP log of an IMU, fixes and an odometer; ten seconds."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = {"/imu/data": "sensor_msgs/msg/Imu", "/fix": "sensor_msgs/msg/NavSatFix", "/odom": "nav_msgs/msg/Odometry"}
    make = store.types
    zero, none = make["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), np.zeros(9)
    turn = make["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    spread = np.diag([0.04, 0.01, 0.09]).ravel()  # east, north, up

    def header(second: float) -> Any:
        stamp = make["builtin_interfaces/msg/Time"](LOG_BEGIN + int(second), round(second % 1.0 * 1e9))
        return make["std_msgs/msg/Header"](stamp, "")

    def messages(topic: str, k: int) -> Any:
        if topic == "/imu/data":
            force = make["geometry_msgs/msg/Vector3"](0.1, 0.0, 9.8)
            rate = make["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.01 * k)
            return make[kinds[topic]](header(k / 50), turn, none, rate, none, force, none)
        if topic == "/fix":
            status = make["sensor_msgs/msg/NavSatStatus"](0, 1)
            return make[kinds[topic]](header(k), status, 47.0 + 1e-6 * k, 8.0, 400.0, spread, 2)
        point = make["geometry_msgs/msg/Point"](0.0, 0.0, 0.0)
        pose = make["geometry_msgs/msg/PoseWithCovariance"](make["geometry_msgs/msg/Pose"](point, turn), np.zeros(36))
        twist = make["geometry_msgs/msg/Twist"](make["geometry_msgs/msg/Vector3"](0.5, 0.0, 0.0), zero)
        moved = make["geometry_msgs/msg/TwistWithCovariance"](twist, np.full(36, 0.01))
        return make[kinds[topic]](header(k), "base_link", pose, moved)

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        for topic, kind in kinds.items():
            schema = writer.register_schema(kind, "ros2msg", store.generate_msgdef(kind, ros_version=2)[0].encode())
            channel = writer.register_channel(topic, "cdr", schema)
            for k in range(500 if topic == "/imu/data" else 10):
                data = bytes(store.serialize_cdr(messages(topic, k), kind))
                writer.add_message(channel, LOG_BEGIN * 10**9 + k, data, 0)
        writer.finish()
    return path


def test_a_log_becomes_a_folder_with_a_file_for_each_stream(tmp_path: Path) -> None:
    convert(write_bag(tmp_path / "log.mcap"), tmp_path / "streams")
    names = {path.name for path in (tmp_path / "streams").iterdir()}
    assert names == {"imu-data.parquet", "fix.parquet", "odom.parquet"}
    assert {path.name for path in tmp_path.iterdir()} == {"log.mcap", "streams"}
    log = read_log(tmp_path / "log.mcap")
    imu, fixes_read = table.read_imu(tmp_path / "streams/imu-data.parquet"), tmp_path / "streams/fix.parquet"
    for field in ("time", "dtheta", "dvel"):
        np.testing.assert_array_equal(getattr(imu, field), getattr(log.imus["/imu/data"], field))
    track = table.read_track(fixes_read)
    np.testing.assert_allclose(track.position, log.tracks["/fix"].position, rtol=1e-15)
    np.testing.assert_array_equal(track.position_std[0], [0.1, 0.2, 0.3])
    assert written_table.utc_of_zero(fixes_read) == 0.0


def test_what_a_log_became_runs_as_the_log_does(tmp_path: Path) -> None:
    convert(write_bag(tmp_path / "log.mcap"), tmp_path / "streams")
    start = {"heading_deg": 0.0}
    of_log = {"imus": [{"file": "log.mcap"}], "gnss": {"file": "log.mcap"}, "odometer": {"file": "log.mcap"}}
    of_tables = {
        "imus": [{"file": "streams/imu-data.parquet"}],
        "gnss": {"file": "streams/fix.parquet"},
        "odometer": {"file": "streams/odom.parquet"},
    }
    axes = {"imu_defaults": {"axes": ["x", "-y", "-z"]}}
    log, tables = (
        load(write_config(tmp_path, {**axes, **values, "start": start}, f"{name}.yaml"))
        for name, values in (("log", of_log), ("tables", of_tables))
    )
    np.testing.assert_array_equal(log.imus[0].dvel, tables.imus[0].dvel)
    np.testing.assert_allclose(log.gnss.position, tables.gnss.position, rtol=1e-15)
    np.testing.assert_array_equal(log.aiding[0].value, tables.aiding[0].value)
    np.testing.assert_array_equal(log.aiding[0].std, tables.aiding[0].std)
    assert log.utc_of_zero == tables.utc_of_zero == 0.0


def test_one_stream_of_a_log_by_its_name(tmp_path: Path) -> None:
    log = write_bag(tmp_path / "log.mcap")
    convert(log, tmp_path / "imu.csv", "/imu/data")
    assert len(table.read_imu(tmp_path / "imu.csv").time) == 500
    with pytest.raises(InputError, match=r"holds /imu/data, /fix, /odom; expected one stream by --stream, or OUT with"):
        convert(log, tmp_path / "out.csv")
    with pytest.raises(InputError, match=r"--stream /imu: is not in .*; expected one of /imu/data, /fix, /odom"):
        convert(log, tmp_path / "out.csv", "/imu")
    with pytest.raises(InputError, match=r"a sensor of odometer shows has no such format; expected \.csv"):
        convert(log, tmp_path / "out.bin", "/odom")
    with pytest.raises(InputError, match=r"--stream a: .*gnss\.txt holds one stream"):
        convert(write_rows(tmp_path / "gnss.txt", fixes()), tmp_path / "out.csv", "a")
    assert not list(tmp_path.glob("out*"))


def test_heights_above_the_sea_stay_what_they_are(tmp_path: Path) -> None:
    header = (
        "% (lat/lon/height=WGS84/geodetic,Q=1:fix)\n%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn sde sdu\n"
    )
    rows = "".join(f"2312 {100 + k}.5 30.5 114.4 20.0 1 12 0.02 0.02 0.04 0 0 0 0 0\n" for k in range(9))
    (tmp_path / "sea.pos").write_text(header + rows)
    for name in ("sea.csv", "sea.parquet"):
        convert(tmp_path / "sea.pos", tmp_path / name)
        track = table.read_track(tmp_path / name)
        assert track.above_sea
        np.testing.assert_array_equal(track.position[:, 2], 20.0)
        stream, guesses = read_stream(tmp_path / name)
        assert stream.above_sea
        assert guesses == ()
    with pytest.raises(InputError, match="KF-GINS has ellipsoidal ones"):
        convert(tmp_path / "sea.pos", tmp_path / "sea.txt")


def test_a_solution_becomes_a_table_of_text(tmp_path: Path) -> None:
    made = solution(drive())
    write_solution(made, tmp_path)
    convert(tmp_path / "solution.parquet", tmp_path / "solution.csv")
    track = table.read_track(tmp_path / "solution.csv")
    np.testing.assert_allclose(track.position, made.position, rtol=1e-15)
    np.testing.assert_allclose(track.velocity, made.velocity, atol=1e-6)


def test_what_exists_stays(tmp_path: Path) -> None:
    source = write_rows(tmp_path / "gnss.txt", fixes())
    (tmp_path / "a.csv").write_text("mine")
    (tmp_path / "streams").mkdir()
    with pytest.raises(InputError, match=r"a\.csv: exists; expected the name of a new one"):
        convert(source, tmp_path / "a.csv")
    with pytest.raises(InputError, match="streams: exists"):
        convert(write_bag(tmp_path / "log.mcap"), tmp_path / "streams")
    assert (tmp_path / "a.csv").read_text() == "mine"


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        ("imu.txt", "out.xyz", r"out\.xyz: has suffix '\.xyz'; expected \.csv, \.parquet"),
        ("gnss.txt", "out.bin", r"out\.bin: positions have no binary format"),
        ("truth.nav", "out.txt", r"a KF-GINS file holds latitude, longitude and std"),
        ("drive.yaml", "out.csv", r"drive\.yaml: looks like a configuration; expected IMU data or positions"),
        ("words.txt", "out.csv", r"words\.txt: is of no known format"),
        ("odd.csv", "out.csv", r"odd\.csv: columns a, b, c, d are of no known meaning"),
        ("nowhere.txt", "out.bin", r"nowhere\.txt: no such file"),
    ],
)
def test_what_cannot_be_converted(source: str, target: str, message: str, tmp_path: Path) -> None:
    write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    write_rows(tmp_path / "gnss.txt", fixes())
    (tmp_path / "truth.nav").write_text("0 1.0 30 114 20 1 2 3 4 5 6\n")
    (tmp_path / "drive.yaml").write_text("imus:\n  - file: imu.txt\n")
    (tmp_path / "words.txt").write_text("some words\nand more\n")
    (tmp_path / "odd.csv").write_text("a,b,c,d\n1,2,3,4\n2,3,4,5\n")
    with pytest.raises(InputError, match=message):
        convert(tmp_path / source, tmp_path / target)
    assert not (tmp_path / target).exists()


def test_rates_without_header_become_increments(tmp_path: Path) -> None:
    warnings = convert(write_rows(tmp_path / "rates.txt", still_imu()), tmp_path / "out.txt")
    assert any("columns are told by their values" in text for text in warnings)
    np.testing.assert_allclose(
        kf_gins.read_imu(tmp_path / "out.txt").dvel, as_increments(still_imu())[:, 4:], atol=1e-9
    )
