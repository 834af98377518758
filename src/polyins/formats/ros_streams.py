"""What the topics of a bag are: streams of IMUs, receivers, wheels, barometers and poses."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from polyins.formats import ros_fields
from polyins.formats.joined import joined_rates, rates_to_rows
from polyins.formats.log import counted
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, rising
from polyins.model.recording import Array
from polyins.model.rig import DEG

IMU, FIX, PRESSURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/FluidPressure"
ODOMETRY, POSE = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"
IMU_BY_NAME, PLACE_BY_NAME = "an IMU by its fields", "positions by their fields"
FIXES = {-2: "unknown", -1: "none", 0: "single", 1: "sbas", 2: "gbas"}
NO_COVARIANCE = 0
SAME_SENSOR = 0.9
"""of the stamps that two topics share if they tell of one sensor"""
LATE_S, LATEST_S = 0.01, 1.0
"""usual and most, by which recording may be later than the stamps without a word"""
PRESSURE_PA, HEIGHT_M, EXPONENT = 101325.0, 44330.77, 0.190263
"""of the standard atmosphere at the sea, its scale, and the power that a height goes with (ISO 2533)"""

Values = tuple[float, ...]


@dataclass
class Topic:
    """The messages of one topic."""

    kind: str
    values: list[Values] = field(default_factory=list)
    """stamp of the header, s, time of recording, s, and what the kind has"""
    frame: str = ""
    shift: float = 0.0
    """added to the stamps, s"""
    recorded_after: tuple[float, float] = (0.0, 0.0)
    """the stamps, s: usual, most"""

    @property
    def table(self) -> Array:
        """All of `values`, shape (T, ...)."""
        return np.array(self.values, dtype=float)

    def time(self, table: Array) -> Array:
        """Return the stamps, s, shape (T,)."""
        return np.asarray((table[:, 0] if table[:, 0].any() else table[:, 1]) + self.shift)

    def late(self, name: str) -> str:
        """Say by how much recording was later than the stamps, if that is more than nothing."""
        usual, most = self.recorded_after
        if abs(usual) < LATE_S and most < LATEST_S:
            return ""
        return f"{name}: recorded {usual:.3f} s after the header's stamp, {most:.3f} s at most; the stamp counts"


class Streams:
    """The streams of a bag."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.imus: dict[str, ImuRows] = {}
        self.tracks: dict[str, Track] = {}
        self.sensors: dict[str, SensorRows] = {}
        self.unusable: dict[str, str] = {}
        self.notes: list[str] = []
        self._halves: dict[str, tuple[bool, Array]] = {}

    def add(self, topic: str, of: Topic) -> None:
        """Add the streams of a topic."""
        table = of.table
        time = of.time(table)
        source = RowSource(f"{self.path}, {topic}")
        if of.kind == IMU:
            self._add_imu(topic, time, table)
        elif of.kind == IMU_BY_NAME:
            values, units = ros_fields.in_si(table[:, 2:8])
            self.notes.append(f"{topic}: taken as {units}")
            self.imus[topic] = rates_to_rows(self.path, topic, time, values[:, :3], values[:, 3:])
        elif of.kind == FIX:
            self._add_track(topic, _track(source, time, table))
        elif of.kind == PLACE_BY_NAME:
            places, units = ros_fields.in_radians(table[:, 2:5])
            self.notes.append(
                f"{topic}: taken as {units}; nothing tells how good they are, nor what heights count from"
            )
            kept = rising(time, np.isfinite(places).all(axis=1) & places[:, :2].any(axis=1))
            self._add_track(topic, Track(source, time[kept], places[kept]))
        elif of.kind == ODOMETRY:
            self.sensors[topic] = _speed(source, time, table)
        elif of.kind == PRESSURE:
            self.sensors[topic] = _pressure_height(source, time, table)
        else:
            self._add_pose(topic, source, time, table)

    def _add_track(self, topic: str, track: Track) -> None:
        if len(track.time):
            self.tracks[topic] = track

    def _add_imu(self, topic: str, time: Array, table: Array) -> None:
        """Add rates and forces; keep them for later where there are only ones or the others."""
        rates, forces = (
            bool(table[:, first : first + 3].any() and table[:, there].all()) for first, there in ((2, 8), (5, 9))
        )
        if rates and forces:
            self.imus[topic] = rates_to_rows(self.path, topic, time, table[:, 2:5], table[:, 5:8])
        elif rates or forces:
            kept = rising(time)
            columns = slice(2, 5) if rates else slice(5, 8)
            self._halves[topic] = rates, np.column_stack([time, table[:, columns]])[kept]
        turned = table[:, 10:14]
        if turned.any() and not np.array_equal(turned, np.tile([1.0, 0.0, 0.0, 0.0], (len(turned), 1))):
            name = f"{topic} orientation"
            kept = rising(time)
            source = RowSource(f"{self.path}, {name}")
            self.sensors[name] = SensorRows(source, "heading", time[kept], _heading(turned[kept]))
            self.unusable[name] = (
                "is the heading of the sensor's x axis by its own filter; from which direction it counts, and how the "
                "sensor is mounted, no message tells"
            )

    def join_halves(self) -> None:
        """Make one IMU of each pair of topics of which one has rates and one forces."""
        gyros = [topic for topic, (rates, _) in self._halves.items() if rates]
        others = [topic for topic, (rates, _) in self._halves.items() if not rates]
        for gyro in gyros:
            force = max(others, key=lambda one: _common_beginning(one, gyro), default=None)
            if force is None:
                break
            others.remove(force)
            rows = joined_rates(self.path, gyro, self._halves[gyro][1], self._halves[force][1])
            self.imus[gyro] = rows
            self.notes.append(f"{gyro} has rates and {force} forces: taken as one IMU")
        alone = [*gyros[len(self._halves) - len(gyros) :], *others]
        self.notes += [f"{topic} has only rates or only forces and is not used" for topic in alone]

    def _add_pose(self, topic: str, source: RowSource, time: Array, table: Array) -> None:
        kept = rising(time)
        east, north, up = table[kept, 2:5].T
        heading = _heading(table[kept, 5:9])
        pitch_roll = np.full((len(kept), 2), np.nan)
        attitude = np.column_stack([pitch_roll, (heading + np.pi) % (2.0 * np.pi) - np.pi])
        place = np.column_stack([north, east, up])
        self.tracks[topic] = Track(source, time[kept], place, geodetic=False, attitude=attitude)
        name = f"{topic} heading"
        self.sensors[name] = SensorRows(RowSource(f"{self.path}, {name}"), "heading", time[kept], heading)

    def unusable_ones(self) -> dict[str, str]:
        """Return why streams are not to be navigated with."""
        found = dict(self.unusable)
        places = [topic for topic, track in self.tracks.items() if track.geodetic]
        planes = [topic for topic, track in self.tracks.items() if not track.geodetic]
        found |= dict.fromkeys(places[1:], "only one receiver can aid the filter")
        why = "is on a plane of its own, and there are latitudes and longitudes"
        found |= dict.fromkeys(planes, why) if places else dict.fromkeys(planes[1:], "only one can aid the filter")
        found |= {
            f"{topic} heading": f"{topic}: where its plane's north is no message tells" for topic in planes if places
        }
        moved = [name for name, one in self.sensors.items() if one.kind == "odometer" and one.value.any()]
        still = [name for name, one in self.sensors.items() if one.kind == "odometer" and name not in moved]
        found |= dict.fromkeys(still, "all 0: it does not tell the speed")
        found |= dict.fromkeys(moved[1:], "only one odometer can aid the filter")
        heights = [name for name, one in self.sensors.items() if one.kind == "height"]
        found |= dict.fromkeys(heights[1:], "only one barometer can aid the filter")
        return found | self._same_sensors()

    def _same_sensors(self) -> dict[str, str]:
        """Say which topics tell what another one tells, as the filtered and the raw data of one IMU."""
        found: dict[str, str] = {}
        names = list(self.imus)
        for k, name in enumerate(names):
            for other in names[:k]:
                shared = np.isin(self.imus[name].time, self.imus[other].time).mean()
                if other not in found and shared > SAME_SENSOR and _alike(self.imus[name], self.imus[other]):
                    found[name] = f"tells what {other} tells"
        return found


def _alike(one: ImuRows, other: ImuRows) -> bool:
    """Whether rates of the stamps that both have are the same."""
    _, mine, its = np.intersect1d(one.time, other.time, return_indices=True)
    return len(mine) > 0 and bool(np.median(np.abs(one.dtheta[mine] - other.dtheta[its])) == 0.0)


def _common_beginning(one: str, other: str) -> int:
    return next((k for k, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))


def _heading(quaternion: Array) -> Array:
    """Return the heading of the x axis, rad, shape (T,), of attitudes to east, north, up: w x y z, shape (T, 4)."""
    w, x, y, z = quaternion.T
    east, north = w**2 + x**2 - y**2 - z**2, 2.0 * (x * y + w * z)
    return np.asarray(np.arctan2(east, north) % (2.0 * np.pi))


def _track(source: RowSource, time: Array, values: Array) -> Track:
    kept = rising(time, (values[:, 9] >= 0.0) & np.isfinite(values[:, 2:5]).all(axis=1))
    std = np.sqrt(np.maximum(values[kept, 5:8], 0.0))
    told = bool((values[kept, 8] != NO_COVARIANCE).all()) and bool((std > 0.0).all())
    return Track(
        source,
        time[kept],
        values[kept, 2:5] * [DEG, DEG, 1.0],
        position_std=std if told else None,
        quality=counted(values[:, 9], lambda status: FIXES.get(int(status), f"status {status:g}")),
    )


def _speed(source: RowSource, time: Array, values: Array) -> SensorRows:
    kept = rising(time)
    std = np.sqrt(np.maximum(values[kept, 3], 0.0))
    return SensorRows(source, "odometer", time[kept], values[kept, 2], std if (std > 0.0).all() else None)


def _pressure_height(source: RowSource, time: Array, values: Array) -> SensorRows:
    """Return heights in the standard atmosphere: right but for an offset that goes with the weather."""
    kept = rising(time, values[:, 2] > 0.0)
    ratio = values[kept, 2] / PRESSURE_PA
    height = HEIGHT_M * (1.0 - ratio**EXPONENT)
    per_pascal = HEIGHT_M * EXPONENT * ratio ** (EXPONENT - 1.0) / PRESSURE_PA
    std = per_pascal * np.sqrt(np.maximum(values[kept, 3], 0.0))
    return SensorRows(source, "height", time[kept], height, std if (std > 0.0).all() else None)
