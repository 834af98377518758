"""PX4's ULog, by pyulog.

Stamps are microseconds since boot, axes forward, right, down. `sensor_combined` has mean rates and forces of the
primary IMU at the logger's full rate; `vehicle_imu` has increments of each IMU over `delta_angle_dt`, which with the
default logging profile is one interval in a hundred. Heights are above the ellipsoid.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.files import find
from polyins.formats.joined import rates_to_rows
from polyins.formats.library import damage_named, heard, needed
from polyins.formats.log import Log, counted, fastest
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, rising
from polyins.model.attitude import euler_angles
from polyins.model.recording import Array
from polyins.model.rig import DEG

RECEIVERS = ("vehicle_gps_position", "sensor_gps")
ATTITUDES = ("vehicle_attitude", "vehicle_attitude_groundtruth")
PLACES = ("vehicle_local_position", "vehicle_local_position_groundtruth")
TRUE_PLACE = "vehicle_global_position_groundtruth"
TOPICS = ("sensor_combined", "vehicle_imu", *RECEIVERS, *ATTITUDES, *PLACES, TRUE_PLACE)
WHOLE = 0.9
"""of the time that increments must cover for a stream to show the motion"""
THREE_DIMENSIONS = 3
FIXES = {0: "none", 1: "none", 2: "2D", 3: "3D", 4: "DGPS", 5: "float", 6: "fix", 8: "extrapolated"}
PROFILE = (
    "set SDLOG_PROFILE to log the IMUs at full rate, or list vehicle_imu in etc/logging/logger_topics.txt on the card"
)

Topic = dict[str, Any]


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError for a damaged file or without pyulog."""
    found = find(path)
    library = needed("pyulog", "px4", found)
    with damage_named(found, "PX4 ULog"):
        with heard() as said:
            log = library.ULog(str(found), list(TOPICS), disable_str_exceptions=True)
        topics = {name: {one.multi_id: one.data for one in log.data_list if one.name == name} for name in TOPICS}
        imus, unusable = _imus(found, topics)
        tracks = _tracks(found, topics)
        places, headings = _places(found, topics), _headings(found, topics)
        unusable |= dict.fromkeys(list(tracks)[1:], f"{next(iter(tracks), '')} is the receiver that PX4 used")
        unusable |= {name: "PX4's own estimate, on a plane" for name in places if TRUE_PLACE not in name}
        unusable |= {
            name: "the truth of a simulation, whose heights were not logged"
            for name in places
            if TRUE_PLACE in name and not places[name].position[:, 2].any()
        }
        unusable |= dict.fromkeys((name for name in headings if "truth" in name), "the truth of a simulation")
        known = log.initial_parameters
        return Log(
            "boot",
            imus,
            tracks | places,
            headings,
            unusable,
            utc_of_zero=_utc_of_zero(topics),
            upright=True,
            references=frozenset(name for name in places if TRUE_PLACE in name),
            fix_age=known["EKF2_GPS_DELAY"] * 1e-3 if "EKF2_GPS_DELAY" in known else None,
            antenna=_antenna(known),
            notes=(
                *said,
                *(f"nothing logged for {one.duration} ms at {one.timestamp * 1e-6:.3f} s" for one in log.dropouts),
            ),
        )


def _imus(path: Path, topics: dict[str, dict[int, Topic]]) -> tuple[dict[str, ImuRows], dict[str, str]]:
    rows: dict[str, ImuRows] = {}
    unusable: dict[str, str] = {}
    for number, topic in sorted(topics["vehicle_imu"].items()):
        name = f"vehicle_imu[{number}]"
        rows[name], covered = _increments(path, name, topic)
        if covered < WHOLE:
            rate = (len(rows[name].time) - 1) / max(np.ptp(rows[name].time), 1e-9)
            unusable[name] = f"{rate:.3g} Hz with {100 * covered:.2g} % of the motion; to have it, {PROFILE}"
    whole = len(rows) - len(unusable)
    for number, topic in sorted(topics["sensor_combined"].items()):
        name = f"sensor_combined[{number}]"
        time = topic["timestamp"] * 1e-6
        rows[name] = rates_to_rows(path, name, time, _three(topic, "gyro_rad"), _three(topic, "accelerometer_m_s2"))
        if whole:
            unusable[name] = "is one of the vehicle_imu"
    return rows, unusable


def _increments(path: Path, name: str, topic: Topic) -> tuple[ImuRows, float]:
    """Return the rows of an IMU, and which part of the time its increments cover.

    Where that is little they are taken as mean rates, as which they can be looked at.
    """
    time = topic["timestamp_sample"] * 1e-6
    unit = 1e-6 if np.median(topic["delta_angle_dt"]) > 1.0 else 1.0  # us since 1.12, s before
    angle_time, velocity_time = topic["delta_angle_dt"] * unit, topic["delta_velocity_dt"] * unit
    covered = float(np.sum(angle_time[1:]) / (time[-1] - time[0])) if len(time) > 1 else 0.0
    dtheta, dvel = _three(topic, "delta_angle"), _three(topic, "delta_velocity")
    if covered >= WHOLE:
        return ImuRows(RowSource(f"{path}, {name}"), time, dtheta, dvel), covered
    rates, forces = dtheta / angle_time[:, None], dvel / velocity_time[:, None]
    return rates_to_rows(path, name, time, rates, forces), covered


def _tracks(path: Path, topics: dict[str, dict[int, Topic]]) -> dict[str, Track]:
    named = [(f"{kind}[{number}]", topic) for kind in RECEIVERS for number, topic in sorted(topics[kind].items())]
    return {name: _track(path, name, topic) for name, topic in named if (topic["fix_type"] >= THREE_DIMENSIONS).any()}


def _track(path: Path, name: str, topic: Topic) -> Track:
    """Return the fixes in three dimensions, with the receiver's accuracies; `eph` is taken for each of two axes."""
    quality = counted(topic["fix_type"], lambda kind: FIXES.get(int(kind), f"type {kind}"))
    whole = "latitude_deg" in topic
    names = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m") if whole else ("lat", "lon", "alt_ellipsoid")
    units = [DEG, DEG, 1.0] if whole else [1e-7 * DEG, 1e-7 * DEG, 1e-3]
    position = np.column_stack([topic[one] for one in names]) * units
    time = topic["timestamp"] * 1e-6
    kept = rising(time, topic["fix_type"] >= THREE_DIMENSIONS)
    std = np.column_stack([topic["eph"], topic["eph"], topic["epv"]]).astype(float)
    velocity = np.column_stack([topic[f"vel_{axis}_m_s"] for axis in "ned"]).astype(float)
    velocity_std = np.repeat(topic["s_variance_m_s"][:, None].astype(float), 3, axis=1)
    told = bool((velocity_std[kept] > 0.0).all()) and bool(topic["vel_ned_valid"][kept].all())
    return Track(
        RowSource(f"{path}, {name}"),
        time[kept],
        position[kept],
        position_std=std[kept],
        velocity=velocity[kept] if told else None,
        velocity_std=velocity_std[kept] if told else None,
        quality=quality,
    )


def _places(path: Path, topics: dict[str, dict[int, Topic]]) -> dict[str, Track]:
    """Return the positions of PX4's own filter on its plane, and what a simulation knows, with the attitude."""
    found = {}
    for kind in PLACES:
        for number, topic in sorted(topics[kind].items()):
            name = f"{kind}[{number}]"
            place, velocity = (np.column_stack([topic[v + axis] for axis in "xyz"]).astype(float) for v in ("", "v"))
            time = topic["timestamp"] * 1e-6
            kept = rising(time)
            source = RowSource(f"{path}, {name}")
            position = place[kept] * [1.0, 1.0, -1.0]
            found[name] = Track(source, time[kept], position, geodetic=False, velocity=velocity[kept])
    truth, turned = topics[TRUE_PLACE].get(0), topics[ATTITUDES[1]].get(0)
    if truth is not None and turned is not None and "alt_ellipsoid" in truth:
        time, angles = truth["timestamp"] * 1e-6, np.unwrap(_angles(turned), axis=0)
        own = turned["timestamp"] * 1e-6
        kept = rising(time)
        kept = kept[(time[kept] >= own[0]) & (time[kept] <= own[-1])]
        attitude = np.column_stack([np.interp(time[kept], own, angle) for angle in angles.T])
        attitude = (attitude + np.pi) % (2.0 * np.pi) - np.pi
        position = np.column_stack([truth["lat"] * DEG, truth["lon"] * DEG, truth["alt_ellipsoid"]]).astype(float)
        name = f"{TRUE_PLACE}[0]"
        found[name] = Track(RowSource(f"{path}, {name}"), time[kept], position[kept], attitude=attitude)
    return found


def _angles(topic: Topic) -> Array:
    """Return roll, pitch, heading, rad, shape (T, 3)."""
    return np.asarray(euler_angles(np.column_stack([topic[f"q[{k}]"] for k in range(4)]).astype(float)))


def _headings(path: Path, topics: dict[str, dict[int, Topic]]) -> dict[str, SensorRows]:
    """Return the heading of PX4's own filter, and that of a simulation."""
    found = {}
    for kind in ATTITUDES:
        for number, topic in sorted(topics[kind].items()):
            name = f"{kind}[{number}]"
            heading = _angles(topic)[:, 2]
            found[name] = SensorRows(RowSource(f"{path}, {name}"), "heading", topic["timestamp"] * 1e-6, heading)
    return found


def _utc_of_zero(topics: dict[str, dict[int, Topic]]) -> float | None:
    """Return Unix time less time since boot."""
    for topic in (topic for kind in RECEIVERS for topic in topics[kind].values()):
        known = (topic["time_utc_usec"] > 0) & (topic["fix_type"] >= THREE_DIMENSIONS)
        if known.any():
            apart = topic["time_utc_usec"][known].astype(float) - topic["timestamp"][known].astype(float)
            return fastest(apart * 1e-6)
    return None


def _antenna(parameters: dict[str, Any]) -> tuple[float, float, float] | None:
    """Return where the antenna is from the IMU: both are set from the body's origin."""
    names = [(f"EKF2_GPS_POS_{axis}", f"EKF2_IMU_POS_{axis}") for axis in "XYZ"]
    if not all(antenna in parameters and imu in parameters for antenna, imu in names):
        return None
    x, y, z = (round(float(parameters[antenna]) - float(parameters[imu]), 4) for antenna, imu in names)
    return x, y, z


def _three(topic: Topic, name: str) -> Array:
    values = np.column_stack([topic[f"{name}[{axis}]"] for axis in range(3)]).astype(float)
    if not len(values):
        raise InputError(f"{name} has no rows")
    return values
