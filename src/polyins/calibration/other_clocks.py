"""The clocks of all streams beside the IMUs, by whatever motion these show: positions, headings, attitudes, speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from polyins.calibration.motion import RunningSums
from polyins.calibration.offsets import ATTITUDE_WINDOW, WINDOW, body_offset, find_offset, gnss_offset
from polyins.calibration.receiver_clock import Body, Path, Problem, receiver_offset
from polyins.calibration.sightings import Sightings
from polyins.errors import InputError
from polyins.model.recording import AidingStream, Array, GnssStream, ImuStream, Offset, Reference
from polyins.model.rig import Imu

LEAST_SPEED, LEAST_CLIMB = 0.05, 0.05
"""m/s and m, rms over a window: less is no motion"""
SEEN_AS = {"heading": "heading", "odometer": "speed"}
UNKNOWN_STD = 0.05
"""m, of positions of a reference, which states none"""


@dataclass(frozen=True)
class Attitudes:
    """Attitudes, compared by how they turn."""

    time: Array
    """s, shape (M,)"""
    attitude: Array
    """roll, pitch, heading, rad, shape (M, 3)"""
    least: float = 0.003
    """rad"""

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant, s."""
        return float(self.time[0]), float(self.time[-1])

    def between(self, begin: Array, end: Array) -> Array:
        """Return the rotation vectors from one attitude to the other, in body axes, rad, shape (M, 3)."""
        from scipy.spatial.transform import Rotation, Slerp

        held = Slerp(self.time, Rotation.from_euler("ZYX", self.attitude[:, ::-1]))
        first, last = (held(np.clip(at, *self.span)) for at in (begin, end))
        return np.asarray((first.inv() * last).as_rotvec())


@dataclass(frozen=True)
class Movers:
    """What the clocks of other streams are compared with: the IMUs, on one clock."""

    imus: Sequence[Imu]
    streams: Sequence[ImuStream]
    gravity: float
    """m/s^2, where positions are on a local plane"""

    @property
    def wheeled(self) -> bool:
        """Whether one is on a wheel."""
        return any(imu.wheel is not None for imu in self.imus)

    def of_positions(self, name: str, gnss: GnssStream, geodetic: bool, antenna: Array) -> Offset:
        """Find what brings positions to the clock of the IMUs: by the spin of wheels, or by the body's trajectory."""
        if self.wheeled:
            return gnss_offset(self.imus, self.streams, gnss, geodetic, name)
        body = Body.of(self.imus, self.streams)
        return receiver_offset(body, Path.of(name, gnss, geodetic, self.gravity, antenna - body.place))

    def path(self, gnss: GnssStream, geodetic: bool, antenna: Array) -> Path:
        """Return what a receiver says whose clock is known."""
        return Path.of("GNSS", gnss, geodetic, self.gravity, antenna)

    def of_reference(self, reference: Reference, geodetic: bool) -> Offset:
        """Find what brings a reference to the clock of the IMUs: by its attitude, or else by its positions."""
        if reference.attitude is not None:
            turning = Attitudes(reference.time, reference.attitude)
            return body_offset("reference", turning, self.imus, self.streams, ATTITUDE_WINDOW)
        std = np.full(reference.position.shape, UNKNOWN_STD)
        gnss = GnssStream(reference.time, reference.position, std)
        return self.of_positions("reference", gnss, geodetic, reference.lever_arm)

    def of_sensor(self, stream: AidingStream, arm: Array, path: Path | None) -> Offset:
        """Find what brings headings, speeds and heights to the clock of the IMUs.

        Where there is a receiver, whose clock is known, headings and speeds by the trajectory that it and a body give,
        and heights by its own; else headings by the body's rates and speeds by its forces. `arm`: to what measures, m.
        """
        at_first = self._at_first(stream, None if path is None else path.gnss)
        if path is None or self.wheeled or stream.kind not in SEEN_AS:
            return at_first
        body = Body.of(self.imus, self.streams)
        path, arm = replace(path, arm=path.arm - body.place), arm - body.place
        values, std = stream.value[:, None], stream.std[:, :1]
        seen = Sightings(stream.kind, SEEN_AS[stream.kind], stream.time, values, std, arm)
        return Problem(body, path, (*path.seen, seen), stream.kind).offset([at_first.offset_s])

    def _at_first(self, stream: AidingStream, gnss: GnssStream | None) -> Offset:
        if stream.kind == "heading":
            shown = RunningSums(stream.time, np.unwrap(stream.value)[:, None])
            return body_offset(stream.kind, shown, self.imus, self.streams, WINDOW)
        if stream.kind == "odometer":
            shown = RunningSums(stream.time, stream.value[:, None], least=LEAST_SPEED)
            return body_offset(stream.kind, shown, self.imus, self.streams, WINDOW)
        if gnss is None:
            raise InputError("height: its clock's offset is found by the heights of GNSS; expected a section gnss")
        climbed = RunningSums(gnss.time, gnss.position[:, 2:], least=LEAST_CLIMB)
        shown = RunningSums(stream.time, stream.value[:, None], least=LEAST_CLIMB)
        return find_offset(stream.kind, shown, "GNSS", climbed)
