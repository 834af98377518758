"""Bags written by rosbags: what each topic is, and on which clock."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shutil import make_archive
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from polyins.errors import InputError
from polyins.formats.recognize import data_format
from polyins.formats.ros_bag import read
from polyins.model.rig import DEG

BEGIN = 1700000000.0
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
Messages = Sequence[tuple[str, float, Any]]
"""topic, time of recording, s, and message"""


def make(kind: str, store: Any = ROS2, **values: Any) -> Any:
    return store.types[kind](**values)


def header(stamp: float, frame: str = "imu", store: Any = ROS2) -> Any:
    sec = int(np.floor(stamp))
    time = make("builtin_interfaces/msg/Time", store, sec=sec, nanosec=round((stamp - sec) * 1e9))
    more = {"seq": 0} if store is ROS1 else {}
    return make("std_msgs/msg/Header", store, stamp=time, frame_id=frame, **more)


def vector(values: Sequence[float], store: Any = ROS2) -> Any:
    return make("geometry_msgs/msg/Vector3", store, **dict(zip("xyz", map(float, values), strict=True)))


def quaternion(values: Sequence[float], store: Any = ROS2) -> Any:
    return make("geometry_msgs/msg/Quaternion", store, **dict(zip("wxyz", map(float, values), strict=True)))


def imu(stamp: float, gyro: Sequence[float], force: Sequence[float], store: Any = ROS2, **more: Any) -> Any:
    without = np.array([-1.0] + [0.0] * 8)
    given = {
        "orientation": quaternion([1, 0, 0, 0], store),
        "orientation_covariance": without,
        "angular_velocity_covariance": np.zeros(9),
        "linear_acceleration_covariance": np.zeros(9),
    }
    given |= {"angular_velocity": vector(gyro, store), "linear_acceleration": vector(force, store)}
    return make("sensor_msgs/msg/Imu", store, header=header(stamp, store=store), **(given | more))


def fix(stamp: float, store: Any = ROS2, variance: float = 4.0, kind: int = 2) -> Any:
    status = make("sensor_msgs/msg/NavSatStatus", store, status=0, service=1)
    place = {"latitude": 48.0, "longitude": 11.0, "altitude": 500.0}
    covariance = np.diag([variance, 2.0 * variance, 4.0 * variance]).ravel()
    more = {"position_covariance": covariance, "position_covariance_type": kind}
    return make("sensor_msgs/msg/NavSatFix", store, header=header(stamp, "gps", store), status=status, **place, **more)


def odometry(stamp: float, speed: float) -> Any:
    zero = make("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
    pose = make("geometry_msgs/msg/Pose", position=zero, orientation=quaternion([1, 0, 0, 0]))
    twist = make("geometry_msgs/msg/Twist", linear=vector([speed, 0, 0]), angular=vector([0, 0, 0]))
    return make(
        "nav_msgs/msg/Odometry",
        header=header(stamp, "odom"),
        child_frame_id="base",
        pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36)),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    )


def pressure(stamp: float, pascal: float, variance: float = 0.0) -> Any:
    return make("sensor_msgs/msg/FluidPressure", header=header(stamp), fluid_pressure=pascal, variance=variance)


def pose(stamp: float, place: Sequence[float], turned: Sequence[float]) -> Any:
    x, y, z = place
    of = make(
        "geometry_msgs/msg/Pose",
        position=make("geometry_msgs/msg/Point", x=x, y=y, z=z),
        orientation=quaternion(turned),
    )
    return make("geometry_msgs/msg/PoseStamped", header=header(stamp, "map"), pose=of)


def bag(folder: Path, messages: Messages, plugin: StoragePlugin = StoragePlugin.MCAP, store: Any = ROS2) -> Path:
    if store is ROS1:
        path = folder / "a.bag"
        with Writer1(path) as writer:
            _write(writer, messages, store, store.serialize_ros1)
        return path
    with Writer2(folder / "bag", version=9, storage_plugin=plugin) as writer:
        _write(writer, messages, store, store.serialize_cdr)
    return next(path for path in (folder / "bag").iterdir() if path.suffix in (".mcap", ".db3"))


def _write(writer: Any, messages: Messages, store: Any, serialize: Any) -> None:
    connections: dict[str, Any] = {}
    for topic, recorded, message in messages:
        kind = message.__msgtype__
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, kind, typestore=store)
        writer.write(connections[topic], round(recorded * 1e9), serialize(message, kind))


def times(count: int = 50, step: float = 0.01, begin: float = BEGIN) -> np.ndarray:
    return begin + step * np.arange(count)


STILL = ([0.01, 0.02, 0.03], [0.1, 0.2, 9.8])


@pytest.mark.parametrize(
    ("store", "plugin", "kind"),
    [
        (ROS1, StoragePlugin.MCAP, "ros1-bag"),
        (ROS2, StoragePlugin.MCAP, "mcap"),
        (ROS2, StoragePlugin.SQLITE3, "ros2-sqlite"),
    ],
)
def test_several_imus_and_a_receiver_in_every_kind_of_bag(
    store: Any, plugin: StoragePlugin, kind: str, tmp_path: Path
) -> None:
    messages: list[tuple[str, float, Any]] = []
    for k, t in enumerate(times()):
        if not 20 <= k < 30:  # a gap
            messages.append(("/a", t + 0.03, imu(t, [0.01 * k, 0, 0], STILL[1], store)))
        messages.append(("/b", t + 0.04, imu(t + 0.004, *STILL, store)))
        messages += [("/fix", t + 0.05, fix(t, store))] if k % 10 == 0 else []
    path = bag(tmp_path, messages, plugin, store)
    assert data_format(path) == kind
    log = read(path)
    assert (log.clock, log.utc_of_zero, log.unusable) == ("unix", 0.0, {})
    assert [len(rows.time) for rows in log.imus.values()] == [40, 50]
    np.testing.assert_allclose(log.imus["/b"].time, times() + 0.004, atol=1e-6)
    np.testing.assert_allclose(log.imus["/b"].dtheta / 0.01, np.tile(STILL[0], (50, 1)), rtol=1e-4)
    np.testing.assert_allclose(log.imus["/a"].dtheta[20, 0], 0.01 * 0.3, rtol=1e-4)  # the first after the gap
    np.testing.assert_allclose(log.tracks["/fix"].position_std[0], np.sqrt([8.0, 4.0, 16.0]))
    assert any(text.startswith("/a: recorded 0.030 s after") for text in log.notes)


def test_a_std_of_zero_is_none(tmp_path: Path) -> None:
    path = bag(tmp_path, [("/fix", t, fix(t, variance=0.0)) for t in times(5)])
    assert read(path).tracks["/fix"].position_std is None


def test_raw_and_filtered_topics_of_one_sensor_are_one_imu(tmp_path: Path) -> None:
    turned = {"orientation": quaternion([np.cos(0.5), 0, 0, np.sin(0.5)]), "orientation_covariance": np.zeros(9)}
    messages = []
    for k, t in enumerate(times()):
        rate = [0.01 * k, 0.0, 0.0]
        messages += [("/imu/raw", t, imu(t, rate, STILL[1])), ("/imu/data", t, imu(t, rate, STILL[1], **turned))]
    log = read(bag(tmp_path, messages))
    assert log.unusable["/imu/raw"] == "tells what /imu/data tells"
    # one radian counter-clockwise from east
    np.testing.assert_allclose(log.sensors["/imu/data orientation"].value, np.pi / 2 - 1.0)
    assert "from which direction it counts" in log.unusable["/imu/data orientation"]


def test_gyro_and_accelerometer_on_topics_of_their_own_are_one_imu(tmp_path: Path) -> None:
    without = np.array([-1.0] + [0.0] * 8)
    messages = []
    for t in times():
        gyro = imu(t, STILL[0], [0, 0, 0], linear_acceleration_covariance=without)
        accel = imu(t + 0.002, [0, 0, 0], STILL[1], angular_velocity_covariance=without)
        messages += [("/camera/gyro", t, gyro), ("/camera/accel", t + 0.002, accel)]
    log = read(bag(tmp_path, messages))
    assert list(log.imus) == ["/camera/gyro"]
    np.testing.assert_allclose(log.imus["/camera/gyro"].dvel / 0.01, np.tile(STILL[1], (50, 1)), rtol=1e-4)
    assert any("taken as one IMU" in text for text in log.notes)


def test_of_odometers_the_one_that_moves_is_used(tmp_path: Path) -> None:
    messages = []
    for k, t in enumerate(times()):
        messages += [("/a/odom", t, odometry(t, 0.0)), ("/b/odom", t, odometry(t, 0.1 * k))]
    log = read(bag(tmp_path, messages))
    np.testing.assert_allclose(log.sensors["/b/odom"].value, 0.1 * np.arange(50))
    assert log.unusable == {"/a/odom": "all 0: it does not tell the speed"}


def test_pressure_is_a_height_in_the_standard_atmosphere(tmp_path: Path) -> None:
    # ISO 2533: 101325 Pa at the sea, 89874.6 Pa at 1000 m
    told = [pressure(t, [101325.0, 89874.6][k % 2], 100.0) for k, t in enumerate(times(10))]
    rows = read(bag(tmp_path, [("/baro", t, one) for t, one in zip(times(10), told, strict=True)])).sensors["/baro"]
    np.testing.assert_allclose(rows.value, [0.0, 1000.0] * 5, atol=0.5)
    np.testing.assert_allclose(rows.std, 0.87, atol=0.06)  # 10 Pa, 8.3 cm each at the sea and 9.2 at 1000 m


def test_poses_are_positions_on_a_plane_with_a_heading(tmp_path: Path) -> None:
    north = [np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)]
    messages = [("/mocap", t, pose(t, [1.0, 2.0, 3.0], north)) for t in times(5)]
    log = read(bag(tmp_path, messages))
    track = log.tracks["/mocap"]
    assert not track.geodetic
    np.testing.assert_allclose(track.position, np.tile([2.0, 1.0, 3.0], (5, 1)))
    np.testing.assert_allclose(track.attitude[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.sin(log.sensors["/mocap heading"].value), 0.0, atol=1e-12)
    both = read(bag(tmp_path / "both", [*messages, *(("/fix", t, fix(t)) for t in times(5))]))
    assert "on a plane of its own" in both.unusable["/mocap"]
    assert "/fix" not in both.unusable


DEFINITION = """
std_msgs/Header header
geometry_msgs/Vector3 gyro
float64[3] accel_g
"""
PLACE = """
std_msgs/Header header
int32 lat
int32 lon
int32 alt
"""


def own_type(name: str, text: str) -> Any:
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(text, name))
    return store


def test_unknown_types_are_known_by_their_fields(tmp_path: Path) -> None:
    store = own_type("vendor_msgs/msg/Motion", DEFINITION.replace("accel_g", "accel"))
    store.register(get_types_from_msg(PLACE, "vendor_msgs/msg/Where"))
    messages = []
    for t in times():
        values = {"gyro": vector([10.0, 0.0, -20.0]), "accel": np.array([0.0, 0.0, 1.0])}
        messages.append(("/imu", t, store.types["vendor_msgs/msg/Motion"](header=header(t), **values)))
        where = {"lat": 480000000, "lon": 110000000, "alt": 500000}
        messages.append(("/gps", t, store.types["vendor_msgs/msg/Where"](header=header(t), **where)))
    log = read(bag(tmp_path, messages, store=store))
    rows = log.imus["/imu"]
    np.testing.assert_allclose(rows.dtheta / 0.01, np.tile([10 * DEG, 0, -20 * DEG], (50, 1)), rtol=1e-4)
    np.testing.assert_allclose(rows.dvel[:, 2] / 0.01, 9.80665, rtol=1e-4)
    np.testing.assert_allclose(log.tracks["/gps"].position[0], [48 * DEG, 11 * DEG, 500.0])
    assert any("taken as deg/s and g" in text for text in log.notes)
    assert any("nothing tells how good they are" in text for text in log.notes)


def test_a_type_whose_definition_is_missing_is_named(tmp_path: Path) -> None:
    import sqlite3

    store = own_type("vendor_msgs/msg/Motion", DEFINITION)
    values = {"gyro": vector([0, 0, 0]), "accel_g": np.zeros(3)}
    messages: list[tuple[str, float, Any]] = [
        ("/own", t, store.types["vendor_msgs/msg/Motion"](header=header(t), **values)) for t in times(3)
    ]
    messages += [("/imu", t, imu(t, *STILL)) for t in times(3)]
    path = bag(tmp_path, messages, StoragePlugin.SQLITE3, store)
    with sqlite3.connect(path) as base:
        base.execute("delete from message_definitions")
    (path.parent / "metadata.yaml").unlink()
    log = read(path)
    assert list(log.imus) == ["/imu"]
    assert any("does not hold the type's definition" in text for text in log.notes)


def test_headers_of_another_clock_are_brought_to_that_of_the_others(tmp_path: Path) -> None:
    messages = []
    for k, t in enumerate(times()):
        boot = t - BEGIN + 100.0
        messages += [("/imu", t + 0.002 + 0.001 * (k % 3), imu(boot, *STILL)), ("/fix", t, fix(t))]
    log = read(bag(tmp_path, messages))
    assert log.clock == "unix"
    np.testing.assert_allclose(log.imus["/imu"].time, times() + 0.002, atol=1e-6)
    assert log.clock_offsets == {"/imu": pytest.approx(BEGIN - 100.0 + 0.002)}
    assert any("headers count from elsewhere" in text for text in log.notes)


def test_headers_that_all_count_from_elsewhere_stay(tmp_path: Path) -> None:
    messages = [
        (topic, t + 0.001, made(t - BEGIN))
        for t in times()
        for topic, made in (("/imu", lambda s: imu(s, *STILL)), ("/fix", fix))
    ]
    messages = messages[2:]  # no stamp of zero
    log = read(bag(tmp_path, messages))
    assert (log.clock, log.clock_offsets) == ("boot", {})
    np.testing.assert_allclose(log.imus["/imu"].time, times()[1:] - BEGIN, atol=1e-6)
    assert log.utc_of_zero == pytest.approx(BEGIN + 0.001)


def test_messages_without_stamps_are_those_of_recording(tmp_path: Path) -> None:
    log = read(bag(tmp_path, [("/imu", t, imu(0.0, *STILL)) for t in times()]))
    np.testing.assert_allclose(log.imus["/imu"].time, times(), atol=1e-6)


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_cut_short_is_refused_by_name(plugin: StoragePlugin, tmp_path: Path) -> None:
    path = bag(tmp_path, [("/imu", t, imu(t, *STILL)) for t in times(2000)], plugin)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(
        InputError, match=r"cannot be read as a ROS bag .*is it damaged\? .*mends one whose end is missing"
    ):
        read(path)


def test_a_bag_without_anything_to_navigate_with(tmp_path: Path) -> None:
    text = make("std_msgs/msg/String", data="hello")
    with pytest.raises(InputError, match="holds no messages of"):
        read(bag(tmp_path, [("/text", BEGIN, text)]))


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_the_folder_of_a_bag_is_the_bag(plugin: StoragePlugin, tmp_path: Path) -> None:
    file = bag(tmp_path, [("/imu", t, imu(t, *STILL)) for t in times()], plugin)
    assert data_format(file.parent) == data_format(file)
    one, other = read(file.parent).imus["/imu"], read(file).imus["/imu"]
    np.testing.assert_array_equal(one.time, other.time)
    np.testing.assert_array_equal(one.dvel, other.dvel)


@pytest.mark.parametrize("store", [ROS1, ROS2])
def test_a_bag_is_known_by_what_is_in_it(store: Any, tmp_path: Path) -> None:
    file = bag(tmp_path, [("/imu", t, imu(t, *STILL, store)) for t in times()], store=store)
    renamed = file.rename(tmp_path / "recording.dat")
    assert len(read(renamed).imus["/imu"].time) == 50


def test_an_archive_of_a_bag_is_refused(tmp_path: Path) -> None:
    file = bag(tmp_path, [("/imu", t, imu(t, *STILL)) for t in times()])
    packed = make_archive(str(tmp_path / "packed"), "zip", file.parent)
    with pytest.raises(InputError, match="expected it unpacked"):
        read(packed)
