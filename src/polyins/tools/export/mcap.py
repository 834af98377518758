"""MCAP of ROS 2 messages, as Foxglove and RViz show them; written by mcap, serialized by rosbags.

`map` is east, north, up (REP 103) at the solution's first position, `base_link` forward, left, up of the body. Stamps
are Unix time where the recording tells UTC, else its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import IO, Any

import numpy as np

from polyins.errors import InputError
from polyins.formats.library import needed
from polyins.model.recording import Array
from polyins.model.rig import DEG
from polyins.model.status import ALIGNING, ATTITUDE_ONLY, COASTING, STATUSES, TRACKING
from polyins.tools.export.trace import NANOSECONDS, PHI_STD, POSITION_STD, VELOCITY, VELOCITY_STD, Trace
from polyins.version import __version__

MAP, BODY = "map", "base_link"
MOST_ON_PATH = 5000
"""poses of the path, which is one message"""
DIAGNOSED_EVERY_NS = NANOSECONDS
OK, WARN, ERROR = 0, 1, 2
LEVELS = {ALIGNING: WARN, TRACKING: OK, COASTING: WARN}
"""of a status; ERROR of others"""
SEVERITIES = {"note": OK, "doubt": WARN, "serious": ERROR}
FIXED, NOT_FIXED, GPS = 0, -1, 1
DIAGONAL_KNOWN = 2
ENU = [1, 0, 2]
TOPICS = {
    "/polyins/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/polyins/velocity": "geometry_msgs/msg/Vector3Stamped",
    "/polyins/path": "nav_msgs/msg/Path",
    "/polyins/fix": "sensor_msgs/msg/NavSatFix",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/tf": "tf2_msgs/msg/TFMessage",
}

Stamped = tuple[str, int, Any]
"""topic, ns, message"""


def write(file: IO[bytes], trace: Trace) -> None:
    """Write the messages in order; raises InputError without mcap and rosbags, and for stamps before zero."""
    if trace.nanoseconds[0] < 0:
        raise InputError(f"{trace.source}: stamps begin below zero, which MCAP has not; expected --utc-of-zero")
    library = needed("mcap.writer", "export", trace.source, "written")
    types = needed("rosbags.typesys", "export", trace.source, "written")
    messages = _Messages(types.get_typestore(types.Stores.ROS2_HUMBLE), trace)
    writer = library.Writer(file)
    writer.start(profile="ros2", library=f"polyins {__version__}")
    channels = {}
    for topic, kind in TOPICS.items():
        text, _ = messages.store.generate_msgdef(kind, ros_version=2)
        schema = writer.register_schema(kind, "ros2msg", text.encode())
        channels[topic] = writer.register_channel(topic, "cdr", schema)
    for topic, stamp, message in messages:
        data = bytes(messages.store.serialize_cdr(message, TOPICS[topic]))
        writer.add_message(channels[topic], stamp, data, stamp)
    writer.finish()


class _Messages:
    """The messages of a trace."""

    def __init__(self, store: Any, trace: Trace) -> None:
        self.store = store
        self.trace = trace

    def _make(self, kind: str, *values: Any) -> Any:
        package, _, name = kind.partition("/")
        return self.store.types[f"{package}/msg/{name}"](*values)

    def _header(self, stamp: int, frame: str) -> Any:
        return self._make("std_msgs/Header", self._time(stamp), frame)

    def _time(self, stamp: int) -> Any:
        return self._make("builtin_interfaces/Time", *divmod(stamp, NANOSECONDS))

    @cached_property
    def _poses(self) -> list[Any]:
        places, turns = self.trace.east_north_up.tolist(), np.roll(self.trace.attitude, -1, axis=1).tolist()
        return [
            self._make(
                "geometry_msgs/Pose",
                self._make("geometry_msgs/Point", *place),
                self._make("geometry_msgs/Quaternion", *turn),
            )
            for place, turn in zip(places, turns, strict=True)
        ]

    def __iter__(self) -> Iterator[Stamped]:
        trace, stamps = self.trace, [int(stamp) for stamp in self.trace.nanoseconds]
        yield "/polyins/path", stamps[0], self._path(stamps)
        if trace.findings:
            findings = [self._finding(one) for one in trace.findings]
            yield "/diagnostics", stamps[0], self._diagnostics(stamps[0], findings)
        variances = _variances(trace)
        velocities = (trace.block(*VELOCITY)[:, ENU] * [1.0, 1.0, -1.0]).tolist()
        fixes = self._fixes(stamps) if trace.geodetic else iter(())
        diagnosed = (-1, -1)
        for row, (stamp, pose) in enumerate(zip(stamps, self._poses, strict=True)):
            header = self._header(stamp, MAP)
            known = self._make("geometry_msgs/PoseWithCovariance", pose, np.diag(variances[row]).ravel())
            yield "/polyins/pose", stamp, self._make("geometry_msgs/PoseWithCovarianceStamped", header, known)
            speed = self._make("geometry_msgs/Vector3", *velocities[row])
            yield "/polyins/velocity", stamp, self._make("geometry_msgs/Vector3Stamped", header, speed)
            yield "/tf", stamp, self._transform(header, pose)
            yield from ((("/polyins/fix", stamp, fix),) if (fix := next(fixes, None)) is not None else ())
            now = (stamp // DIAGNOSED_EVERY_NS, int(trace.status[row]))
            if now != diagnosed:
                diagnosed = now
                yield "/diagnostics", stamp, self._diagnostics(stamp, [self._state(row)])

    def _path(self, stamps: Sequence[int]) -> Any:
        every = -(-len(stamps) // MOST_ON_PATH)
        poses = [
            self._make("geometry_msgs/PoseStamped", self._header(stamp, MAP), pose)
            for stamp, pose in zip(stamps[::every], self._poses[::every], strict=True)
        ]
        return self._make("nav_msgs/Path", self._header(stamps[0], MAP), poses)

    def _transform(self, header: Any, pose: Any) -> Any:
        moved = self._make("geometry_msgs/Vector3", pose.position.x, pose.position.y, pose.position.z)
        transform = self._make("geometry_msgs/Transform", moved, pose.orientation)
        stamped = self._make("geometry_msgs/TransformStamped", header, BODY, transform)
        return self._make("tf2_msgs/TFMessage", [stamped])

    def _fixes(self, stamps: Sequence[int]) -> Iterator[Any]:
        """Give NavSatFix; the altitude is above the ellipsoid, or no number where it is not known to be."""
        trace = self.trace
        height = trace.above_ellipsoid
        altitude = np.full(len(trace), np.nan) if height is None else height
        variance = trace.block(*POSITION_STD)[:, ENU] ** 2
        for row, place in enumerate(trace.block("latitude_deg", "longitude_deg").tolist()):
            lost = trace.status[row] >= ATTITUDE_ONLY
            yield self._make(
                "sensor_msgs/NavSatFix",
                self._header(stamps[row], BODY),
                self._make("sensor_msgs/NavSatStatus", NOT_FIXED if lost else FIXED, GPS),
                *place,
                float(altitude[row]),
                np.diag(variance[row]).ravel(),
                DIAGONAL_KNOWN,
            )

    def _state(self, row: int) -> Any:
        status = int(self.trace.status[row])
        names = [name for name in (*POSITION_STD, *VELOCITY_STD, *PHI_STD) if name in self.trace.values]
        values = {name: f"{self.trace[name][row]:.6g}" for name in names}
        return self._status(LEVELS.get(status, ERROR), "navigation", STATUSES[status], values)

    def _finding(self, finding: Mapping[str, Any]) -> Any:
        level = SEVERITIES.get(finding["severity"], ERROR)
        values = {key: str(finding[key]) for key in ("stream", "from_s", "to_s", "remedy") if finding.get(key)}
        return self._status(level, f"finding: {finding['kind']}", finding["text"], values)

    def _status(self, level: int, name: str, message: str, values: Mapping[str, str]) -> Any:
        pairs = [self._make("diagnostic_msgs/KeyValue", key, value) for key, value in values.items()]
        return self._make("diagnostic_msgs/DiagnosticStatus", level, f"polyins: {name}", message, "", pairs)

    def _diagnostics(self, stamp: int, statuses: list[Any]) -> Any:
        return self._make("diagnostic_msgs/DiagnosticArray", self._header(stamp, ""), statuses)


def _variances(trace: Trace) -> Array:
    """Return variances of x, y, z and of turns about them, m^2 and rad^2, shape (T, 6)."""
    turns = trace.block(*PHI_STD)[:, ENU] * DEG
    return np.hstack([trace.block(*POSITION_STD)[:, ENU], turns]) ** 2
