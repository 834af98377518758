"""Bags of ROS 1 and ROS 2 (SQLite, MCAP), by rosbags.

Topics of sensor_msgs/Imu, sensor_msgs/NavSatFix and nav_msgs/Odometry are streams; others are left aside. Stamps are
those of the headers, Unix time, or the time of recording where a topic has none. Altitudes are above the ellipsoid, as
the message's definition has them.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.files import find
from polyins.formats.log import Log, counted, damage_named, needed, rates_to_rows, rising
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track
from polyins.model.recording import Array
from polyins.model.rig import DEG

FIXES = {-2: "unknown", -1: "none", 0: "single", 1: "sbas", 2: "gbas"}
NO_COVARIANCE = 0

Rows = dict[str, list[tuple[float, ...]]]


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError for a damaged file, none of these messages, or without rosbags."""
    found = find(path)
    highlevel, types = needed("rosbags.highlevel", "ros", found), needed("rosbags.typesys", "ros", found)
    with damage_named(found, "a ROS bag"):
        known = types.get_typestore(types.Stores.LATEST)
        with highlevel.AnyReader([found], default_typestore=known) as bag:
            rows = {kind: _rows(bag, kind) for kind in VALUES}
    if not any(rows.values()):
        raise InputError(f"{found}: holds no messages of {', '.join(VALUES)}; expected some")
    imus = {topic: _imu(found, topic, np.array(values)) for topic, values in rows["sensor_msgs/msg/Imu"].items()}
    tracks = {
        topic: _track(found, topic, np.array(values)) for topic, values in rows["sensor_msgs/msg/NavSatFix"].items()
    }
    tracks = {topic: track for topic, track in tracks.items() if len(track.time)}
    speeds = {topic: _speed(found, topic, np.array(values)) for topic, values in rows["nav_msgs/msg/Odometry"].items()}
    others = dict.fromkeys(list(tracks)[1:], "only one receiver can aid the filter")
    others |= dict.fromkeys(list(speeds)[1:], "only one odometer can aid the filter")
    return Log("unix", imus, tracks, speeds, others, utc_of_zero=0.0)


def _imu_values(message: Any) -> tuple[float, ...]:
    rate, force = message.angular_velocity, message.linear_acceleration
    return rate.x, rate.y, rate.z, force.x, force.y, force.z


def _fix_values(message: Any) -> tuple[float, ...]:
    covariance, kind = message.position_covariance, message.position_covariance_type
    place = message.latitude, message.longitude, message.altitude
    return *place, covariance[4], covariance[0], covariance[8], kind, message.status.status


def _speed_values(message: Any) -> tuple[float, ...]:
    return message.twist.twist.linear.x, message.twist.covariance[0]


VALUES = {
    "sensor_msgs/msg/Imu": _imu_values,
    "sensor_msgs/msg/NavSatFix": _fix_values,
    "nav_msgs/msg/Odometry": _speed_values,
}
"""what is read of each type of message"""


def _rows(bag: Any, kind: str) -> Rows:
    """Return the values of each topic of a type; first the stamp of the header, then the time of recording, s."""
    found: Rows = defaultdict(list)
    connections = [one for one in bag.connections if one.msgtype == kind]
    for connection, recorded, raw in bag.messages(connections) if connections else ():
        message = bag.deserialize(raw, kind)
        stamp = message.header.stamp
        found[connection.topic].append((stamp.sec + stamp.nanosec * 1e-9, recorded * 1e-9, *VALUES[kind](message)))
    return dict(found)


def _time(values: Array) -> Array:
    return values[:, 0] if values[:, 0].any() else values[:, 1]


def _imu(path: Path, topic: str, values: Array) -> ImuRows:
    return rates_to_rows(path, topic, _time(values), values[:, 2:5], values[:, 5:8])


def _track(path: Path, topic: str, values: Array) -> Track:
    time = _time(values)
    fixed = np.flatnonzero((values[:, 9] >= 0.0) & np.isfinite(values[:, 2:5]).all(axis=1))
    kept = fixed[rising(time[fixed])]
    std = np.sqrt(np.maximum(values[kept, 5:8], 0.0))
    told = bool((values[kept, 8] != NO_COVARIANCE).all())
    return Track(
        RowSource(f"{path}, {topic}"),
        time[kept],
        values[kept, 2:5] * [DEG, DEG, 1.0],
        position_std=std if told else None,
        quality=counted(values[:, 9], lambda status: FIXES.get(int(status), f"status {status:g}")),
    )


def _speed(path: Path, topic: str, values: Array) -> SensorRows:
    time = _time(values)
    kept = rising(time)
    std = np.sqrt(np.maximum(values[kept, 3], 0.0))
    source = RowSource(f"{path}, {topic}")
    return SensorRows(source, "odometer", time[kept], values[kept, 2], std if (std > 0.0).all() else None)
