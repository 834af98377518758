"""Bags of ROS 1 and ROS 2 (SQLite, MCAP), by rosbags.

Topics of sensor_msgs/Imu, NavSatFix and FluidPressure, nav_msgs/Odometry and geometry_msgs/PoseStamped are streams;
messages of types that are not ROS's own are known by the names of their fields, see `ros_fields`. Stamps are those of
the headers, Unix time, or the time of recording where a topic has none; topics whose headers count from elsewhere are
brought to the time of recording. Altitudes are above the ellipsoid, as the message's definition has them; axes of poses
are taken as east, north, up and forward, left, up (REP 103).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_head
from polyins.formats import ros_fields
from polyins.formats.bundle import is_bundle
from polyins.formats.library import damage_named, needed
from polyins.formats.log import Clock, Log
from polyins.formats.ros_streams import (
    FIX,
    IMU,
    IMU_BY_NAME,
    ODOMETRY,
    PLACE_BY_NAME,
    POSE,
    PRESSURE,
    Streams,
    Topic,
    Values,
)
from polyins.model.recording import Array

OWN_PACKAGES = (
    "actionlib_msgs", "diagnostic_msgs", "geometry_msgs", "nav_msgs", "rcl_interfaces", "rosgraph_msgs", "sensor_msgs",
    "shape_msgs", "std_msgs", "stereo_msgs", "tf2_msgs", "trajectory_msgs", "visualization_msgs",
)  # fmt: skip
"""whose other messages hold nothing to navigate with"""
MENDED = {
    ".bag": " rosbag reindex mends one whose end is missing",
    ".mcap": " mcap recover mends one whose end is missing",
    ".db3": " sqlite3 FILE .recover mends one whose end is missing",
}
"""by suffix, the tools that people have"""
BEGINS = {".bag": b"#ROSBAG V2", ".mcap": b"\x89MCAP0\r\n", ".db3": b"SQLite format 3\0"}
"""by suffix, how such files begin"""
SAME_CLOCK_S = 10.0
"""by which a header's stamp may be off the time of recording, if both are Unix time"""


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError for a damaged file, none of these messages, or without rosbags."""
    found = find(path)
    if is_bundle(found) and found.is_file():
        raise InputError(f"{found}: is an archive of a ROS 2 bag; expected it unpacked")
    highlevel, types = needed("rosbags.highlevel", "ros", found), needed("rosbags.typesys", "ros", found)
    with damage_named(found, "a ROS bag", MENDED.get(found.suffix, "")):
        known = types.get_typestore(types.Stores.LATEST)
        with _under_its_suffix(found) as named, highlevel.AnyReader([named], default_typestore=known) as bag:
            topics, notes = _topics(bag)
        if not topics:
            raise InputError(f"{found}: holds no messages of {', '.join(VALUES)} with a use; expected some")
        clock, zero = _on_one_clock(topics)
        streams = Streams(found)
        for topic, messages in topics.items():
            streams.add(topic, messages)
        streams.join_halves()
        return Log(
            clock,
            streams.imus,
            streams.tracks,
            streams.sensors,
            streams.unusable_ones(),
            utc_of_zero=zero,
            notes=(
                *notes,
                *streams.notes,
                *_moved(topics),
                *(said for topic, one in topics.items() if (said := one.late(topic))),
            ),
            clock_offsets={topic: one.shift for topic, one in topics.items() if one.shift},
        )


@contextmanager
def _under_its_suffix(path: Path) -> Iterator[Path]:
    """Give a bag under a name by which rosbags, which goes by names, knows what it is."""
    head = read_head(path, 16) if path.is_file() else b""
    suffix = next((suffix for suffix, begin in BEGINS.items() if head.startswith(begin)), path.suffix)
    if path.suffix == suffix:
        yield path
        return
    with TemporaryDirectory() as folder:
        named = Path(folder) / f"bag{suffix}"
        named.symlink_to(path.resolve())
        yield named


def _moved(topics: Mapping[str, Topic]) -> tuple[str, ...]:
    return tuple(
        f"{name}: headers count from elsewhere; {topic.shift:.3f} s more is the time of recording, late by what the "
        "fastest message took"
        for name, topic in topics.items()
        if topic.shift
    )


def _imu_values(message: Any) -> Values:
    rate, force, turned = message.angular_velocity, message.linear_acceleration, message.orientation
    there = [
        float(one[0]) != -1.0 for one in (message.angular_velocity_covariance, message.linear_acceleration_covariance)
    ]
    told = float(message.orientation_covariance[0]) != -1.0
    return (rate.x, rate.y, rate.z, force.x, force.y, force.z, *there, *(_quaternion(turned) if told else (0.0,) * 4))


def _quaternion(of: Any) -> Values:
    return of.w, of.x, of.y, of.z


def _fix_values(message: Any) -> Values:
    covariance, kind = message.position_covariance, message.position_covariance_type
    place = message.latitude, message.longitude, message.altitude
    return *place, covariance[4], covariance[0], covariance[8], kind, message.status.status


def _speed_values(message: Any) -> Values:
    return message.twist.twist.linear.x, message.twist.covariance[0]


def _pressure_values(message: Any) -> Values:
    return message.fluid_pressure, message.variance


def _pose_values(message: Any) -> Values:
    place = message.pose.position
    return place.x, place.y, place.z, *_quaternion(message.pose.orientation)


VALUES: dict[str, Callable[[Any], Values]] = {
    IMU: _imu_values,
    FIX: _fix_values,
    ODOMETRY: _speed_values,
    PRESSURE: _pressure_values,
    POSE: _pose_values,
}
"""what is read of each type of message"""


def _topics(bag: Any) -> tuple[dict[str, Topic], list[str]]:
    """Return the topics that hold something to navigate with, in the order of their names, and what else to say."""
    topics: dict[str, Topic] = {}
    readers: dict[str, Callable[[Any], Values]] = {}
    notes: list[str] = []
    for connection in sorted(bag.connections, key=lambda one: str(one.topic)):
        if connection.msgtype in VALUES:
            readers[connection.topic] = VALUES[connection.msgtype]
            topics.setdefault(connection.topic, Topic(connection.msgtype))
        elif connection.msgtype.partition("/")[0] not in OWN_PACKAGES:
            kind, names, said = _unknown(bag, connection)
            notes += [said] if said else []
            if names:
                readers[connection.topic] = _by_names(names)
                topics.setdefault(connection.topic, Topic(kind))
    wanted = [one for one in bag.connections if one.topic in readers]
    for connection, recorded, raw in bag.messages(wanted) if wanted else ():
        message = bag.deserialize(raw, connection.msgtype)
        topic = topics[connection.topic]
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        seconds = 0.0 if stamp is None else stamp.sec + stamp.nanosec * 1e-9
        topic.frame = topic.frame or getattr(getattr(message, "header", None), "frame_id", "")
        topic.values.append((seconds, recorded * 1e-9, *readers[connection.topic](message)))
    return {name: topic for name, topic in topics.items() if topic.values}, notes


def _unknown(bag: Any, connection: Any) -> tuple[str, tuple[str, ...], str]:
    """Return what messages of a type that is not ROS's own are, their fields, and what to say of them."""
    of = f"{connection.topic} ({connection.msgtype})"
    try:
        first = next(bag.messages([connection]), None)
        known = ros_fields.numbers(bag.deserialize(first[2], connection.msgtype)) if first else {}
    except (KeyError, ValueError):
        return "", (), f"{of}: the bag does not hold the type's definition, so it is not read"
    if names := ros_fields.imu_names(known):
        return IMU_BY_NAME, names, f"{of}: taken as an IMU: {', '.join(names)}"
    if names := ros_fields.place_names(known):
        return PLACE_BY_NAME, names, f"{of}: taken as positions: {', '.join(names)}"
    return "", (), ""


def _by_names(names: Sequence[str]) -> Callable[[Any], Values]:
    def values(message: Any) -> Values:
        known = ros_fields.numbers(message)
        return tuple(known.get(name, np.nan) for name in names)

    return values


def _on_one_clock(topics: Mapping[str, Topic]) -> tuple[Clock, float]:
    """Bring the topics to one clock; returns which, and Unix time when it shows zero.

    Headers that count from elsewhere than recording are left where all of them do alike, as in a simulation.
    """
    apart: dict[str, Array] = {}
    for name, topic in topics.items():
        table = topic.table
        if table[:, 0].any():
            apart[name] = table[:, 1] - table[:, 0]
    usual = {name: float(np.median(late)) for name, late in apart.items()}
    if not usual or max(map(abs, usual.values())) <= SAME_CLOCK_S:
        for name, late in apart.items():
            topics[name].recorded_after = usual[name], float(np.max(late))
        return "unix", 0.0
    if len(apart) == len(topics) and max(usual.values()) - min(usual.values()) <= SAME_CLOCK_S:
        return "boot", min(float(late.min()) for late in apart.values())
    for name, late in apart.items():
        if abs(usual[name]) > SAME_CLOCK_S:
            topics[name].shift = float(late.min())
    return "unix", 0.0
