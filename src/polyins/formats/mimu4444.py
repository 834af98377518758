"""MIMU4444, a board of eight MPU-9150: packets of its binary stream.

A packet has 106 bytes, big-endian: aa, its number, 64, the counter of a 64 MHz clock, acceleration and rate of each
chip in counts (2048 LSB/g, 16.4 LSB/(deg/s)), and the sum of all bytes before. Number and counter wrap. Chips 2, 4, 6
and 8 are on the other side: their axes are -y, -x, -z of the others'. Where `IMU_positions.csv` lies beside the file it
tells where each chip is, m.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import find, read_bytes, read_text
from polyins.formats.joined import rates_to_rows
from polyins.formats.log import Log
from polyins.model.axes import Axes
from polyins.model.recording import Array
from polyins.model.rig import DEG

CHIPS = 8
PACKET = np.dtype(
    [
        ("begin", "u1"),
        ("number", ">u2"),
        ("kind", "u1"),
        ("counter", ">u4"),
        ("values", ">i2", (CHIPS, 6)),
        ("sum", ">u2"),
    ]
)
TICKS_PER_S = 64e6
COUNTER_RANGE, NUMBER_RANGE = 2**32, 2**16
ACCEL_M_S2 = 9.80665 / 2048.0
GYRO_RAD_S = DEG / 16.4
FULL_SCALE = 32760
"""counts, from which on a rate is at the end of the range: not every chip reaches the last ones"""
FULL_SCALE_DEG_S = 32767 / 16.4
OTHER_SIDE: Axes = ("-y", "-x", "-z")
POSITIONS = "IMU_positions.csv"


def fits(head: bytes) -> bool:
    """Whether two packets follow each other near the beginning, which may be within one."""
    marks, size = b"\xaa\x64\xaa\x64", PACKET.itemsize
    return any(
        bytes(head[k + n] for n in (0, 3, size, size + 3)) == marks for k in range(min(2 * size, len(head) - size - 3))
    )


def read(path: str | Path) -> Log:
    """Read the eight IMUs; raises InputError if fewer than two packets are whole."""
    found = find(path)
    content = read_bytes(found)
    begins = _whole_packets(content)
    if len(begins) < 2:
        raise InputError(f"{found}: {len(begins)} whole packet(s) of MIMU4444; expected more; is it damaged?")
    size = PACKET.itemsize
    packets = np.frombuffer(b"".join(content[at : at + size] for at in begins), PACKET)
    time, lost = _time(packets["counter"], packets["number"])
    names = [f"imu{number}" for number in range(1, CHIPS + 1)]
    forces, rates = packets["values"][:, :, :3], packets["values"][:, :, 3:]
    imus = {
        name: replace(
            rates_to_rows(found, name, time, rates[:, chip] * GYRO_RAD_S, forces[:, chip] * ACCEL_M_S2),
            units_known=True,
            gyro_range_deg_s=FULL_SCALE_DEG_S,
        )
        for chip, name in enumerate(names)
    }
    between = len(content) - size * len(begins)
    return Log(
        "boot",
        imus,
        {},
        {},
        axes=dict.fromkeys(names[1::2], OTHER_SIDE),
        points=_points(found.parent / POSITIONS),
        notes=(
            *((f"{between} bytes are no whole packets and are left out",) if between else ()),
            *((f"{lost} packet(s) are missing by their numbers",) if lost else ()),
            *_saturated(rates),
        ),
    )


def _whole_packets(content: bytes) -> list[int]:
    """Return where packets begin whose sum is right."""
    size, found, at = PACKET.itemsize, [], content.find(b"\xaa")
    while 0 <= at <= len(content) - size:
        packet = content[at : at + size]
        if packet[3] == 0x64 and sum(packet[:-2]) & 0xFFFF == int.from_bytes(packet[-2:], "big"):
            found.append(at)
            at += size
        else:
            at += 1
        at = content.find(b"\xaa", at)
    return found


def _time(counter: NDArray[np.uint32], number: NDArray[np.uint16]) -> tuple[Array, int]:
    """Return the counter in s, running on over its wraps, also over those in gaps, and how many packets are missing."""
    ticks = np.asarray(np.diff(counter.astype(np.int64)), np.int64) % COUNTER_RANGE
    ahead = np.asarray(np.diff(number.astype(np.int64)), np.int64) % NUMBER_RANGE
    usual = float(np.median(ticks))
    wraps = np.maximum(np.round((ahead * usual - ticks) / COUNTER_RANGE), 0.0)
    steps = (ticks + wraps * COUNTER_RANGE) / TICKS_PER_S
    return counter[0] / TICKS_PER_S + np.concatenate([[0.0], np.cumsum(steps)]), int(np.sum(np.maximum(ahead - 1, 0)))


def _saturated(rates: NDArray[np.int16]) -> list[str]:
    """Say of each chip how many of its rates, shape (T, 8, 3), are at an end of their range."""
    at_end = (np.abs(rates.astype(int)) >= FULL_SCALE).any(axis=2).sum(axis=0)
    return [
        f"imu{chip}: the rates of {count} of {len(rates)} rows are at full scale, 2000 deg/s"
        for chip, count in enumerate(at_end, 1)
        if count
    ]


def _points(path: Path) -> dict[str, tuple[float, float, float]]:
    """Return where each chip is, if the file is there."""
    if not path.is_file():
        return {}
    lines = [line.split(",") for line in read_text(path).splitlines()]
    rows = {fields[0].strip(): fields[1:] for fields in lines if len(fields) > CHIPS}
    try:
        axes = [[float(text) for text in rows[axis][:CHIPS]] for axis in "xyz"]
    except (KeyError, ValueError):
        raise InputError(f"{path}: has no rows x, y, z of {CHIPS} numbers; expected where each chip is") from None
    return {f"imu{chip}": (x, y, z) for chip, (x, y, z) in enumerate(zip(*axes, strict=True), 1)}
