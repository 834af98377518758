"""An autopilot's IMUs and its GNSS from MAVLink messages, by pymavlink.

The autopilot's first IMU is the first of the configuration, and so on. Axes are forward, right, down; stamps are those
of the messages, seconds since the autopilot started or of Unix time, as it sends them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.live.lines import LONGEST_INTERVAL, geodetic_position, imu_epoch
from polyins.live.source import RefusedError
from polyins.navigate.samples import Array, GnssFix, ImuSample, Sample

MILLI_G = 9.80665e-3  # m/s^2
RAW_KINDS = ("RAW_IMU", "SCALED_IMU", "HIGHRES_IMU")
"""Of the first IMU, from coarse to fine; the finest that comes is used."""
THREE_DIMENSIONS = 3
NO_ACCURACY = 0
NO_VELOCITY = 8 + 16
"""flags of GPS_INPUT: horizontal, vertical velocity to be ignored"""


class MavlinkReader:
    """Turns datagrams of MAVLink into samples."""

    def __init__(self, imus: tuple[str, ...]) -> None:
        try:
            from pymavlink.dialects.v20 import common
        except ImportError:
            raise InputError("--source mavlink: needs pymavlink; expected pip install 'polyins[mavlink]'") from None
        self.imus = imus
        self.link: Any = common.MAVLink(None)
        self.link.robust_parsing = True
        self.kinds: dict[int, str] = {}
        """message by which each IMU is followed"""
        self.newest: dict[int, float] = {}
        """stamp of each IMU's last message, s"""
        self.readers: dict[str, Callable[[Any], Sample | None]] = {
            "RAW_IMU": lambda m: self._imu(m, m.id, m.time_usec * 1e-6, 1e-3, MILLI_G),
            "SCALED_IMU": lambda m: self._imu(m, 0, m.time_boot_ms * 1e-3, 1e-3, MILLI_G),
            "SCALED_IMU2": lambda m: self._imu(m, 1, m.time_boot_ms * 1e-3, 1e-3, MILLI_G),
            "SCALED_IMU3": lambda m: self._imu(m, 2, m.time_boot_ms * 1e-3, 1e-3, MILLI_G),
            "HIGHRES_IMU": lambda m: self._imu(m, m.id, m.time_usec * 1e-6, 1.0, 1.0),
            "GPS_RAW_INT": _raw_fix,
            "GPS_INPUT": _input_fix,
        }

    def __call__(self, datagram: bytes, counts: Counter[str]) -> list[Sample]:
        """Return the samples of a datagram; what is refused is counted by kind, messages of other kinds are not."""
        samples = []
        for message in self.link.parse_buffer(datagram) or ():
            kind = message.get_type()
            try:
                if kind == "BAD_DATA":
                    raise RefusedError("malformed")
                if kind in self.readers and (sample := self.readers[kind](message)) is not None:
                    samples.append(sample)
            except RefusedError as error:
                counts[str(error)] += 1
        return samples

    def _imu(self, message: Any, number: int, time: float, gyro: float, accel: float) -> ImuSample | None:
        """Return the increments since the message before; None for the first, and where a finer message is followed."""
        if number >= len(self.imus):
            raise RefusedError("unknown IMU")
        if not self._followed(number, message.get_type()):
            return None
        before, self.newest[number] = self.newest.get(number), max(time, self.newest.get(number, time))
        if before is None:
            return None
        interval = time - before
        if interval <= 0.0:
            raise RefusedError("duplicated" if interval == 0.0 else "reordered")
        if interval > LONGEST_INTERVAL:
            return None
        rates = np.array([message.xgyro, message.ygyro, message.zgyro]) * gyro
        forces = np.array([message.xacc, message.yacc, message.zacc]) * accel
        if not np.isfinite(rates).all() or not np.isfinite(forces).all():
            raise RefusedError("non-finite")
        return imu_epoch(self.imus[number], time, rates * interval, forces * interval)

    def _followed(self, number: int, kind: str) -> bool:
        known = self.kinds.get(number)
        if known is None or (kind in RAW_KINDS and known in RAW_KINDS and _finer(kind, known)):
            self.kinds[number] = kind
            self.newest.pop(number, None)  # the stamps of another message may count from elsewhere
        return self.kinds[number] == kind


def _finer(kind: str, known: str) -> bool:
    return RAW_KINDS.index(kind) > RAW_KINDS.index(known)


def _raw_fix(message: Any) -> GnssFix:
    if message.fix_type < THREE_DIMENSIONS:
        raise RefusedError("no fix in three dimensions")
    above_sea = message.alt_ellipsoid == 0  # it is an extension that old senders leave out
    height = 1e-3 * (message.alt if above_sea else message.alt_ellipsoid)
    position = geodetic_position(message.lat * 1e-7, message.lon * 1e-7, height)
    std = _std(1e-3 * message.h_acc, 1e-3 * message.v_acc)
    return GnssFix(message.time_usec * 1e-6, position, std, above_sea=above_sea)


def _input_fix(message: Any) -> GnssFix:
    if message.fix_type < THREE_DIMENSIONS:
        raise RefusedError("no fix in three dimensions")
    position = geodetic_position(message.lat * 1e-7, message.lon * 1e-7, message.alt)
    velocity = velocity_std = None
    if not message.ignore_flags & NO_VELOCITY and message.speed_accuracy > NO_ACCURACY:
        velocity = np.array([message.vn, message.ve, message.vd])
        velocity_std = np.full(3, float(message.speed_accuracy))
    std = _std(message.horiz_accuracy, message.vert_accuracy)
    return GnssFix(message.time_usec * 1e-6, position, std, velocity, velocity_std, above_sea=True)


def _std(horizontal: float, vertical: float) -> Array | None:
    """Return north, east, down; None where the receiver gives none."""
    if horizontal <= NO_ACCURACY or vertical <= NO_ACCURACY:
        return None
    return np.array([horizontal, horizontal, vertical], dtype=float)
