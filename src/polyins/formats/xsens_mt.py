"""Text exports of Xsens's MT Manager: lines that begin with `//`, a header, columns between tabs.

`Acc_X` is m/s^2 and `Gyr_X` rad/s, instants in the sensor's axes. `SampleTimeFine` counts 1e-4 s, `PacketCounter`
packets modulo 65536, which stand for the time where there is no SampleTimeFine and the header tells the update rate.
The DOT's exports have the same names, with deg/s and us: they are another format. Orientation is read where the header
says of which frame it is: the heading is where the sensor's x axis points.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_bytes
from polyins.formats.joined import rates_to_rows
from polyins.formats.log import Log
from polyins.formats.rows import ImuRows, RowSource, SensorRows, rising
from polyins.formats.text_rows import TextRows, header_line, lines_before, read_rows
from polyins.model.recording import Array
from polyins.model.rig import DEG

HEADER = r"(^|[\t,;])\"?(Acc_X\"?[\t,;].*Gyr_X|VelInc_X\"?[\t,;].*OriInc_q?[w0]|OriInc_q?[w0]\"?[\t,;].*VelInc_X)"
VELOCITIES = ("VelInc_X", "VelInc_Y", "VelInc_Z")
RATES, FORCES = ("Gyr_X", "Gyr_Y", "Gyr_Z"), ("Acc_X", "Acc_Y", "Acc_Z")
QUATERNION = ("Quat_q0", "Quat_q1", "Quat_q2", "Quat_q3")
MATRIX = ("Mat[1][1]", "Mat[2][1]")
"""where the sensor's x axis points, in the frame of the orientation"""
VALUES = r"PacketCounter|SampleTimeFine|(Acc|Gyr|VelInc)_[XYZ]|OriInc_([wxyz]|q[0-3])|Quat_q[0-3]|Mat\[[12]\]\[1\]|Yaw"
TICK_S = 1e-4
TICK_RANGE, PACKET_RANGE = 2**32, 2**16
RATE_AGREES = 0.05
SLOWEST_S = 0.2
"""between rows of a sensor whose rate the header does not tell"""
EAST_NORTH = {
    "ENU": ((1.0, 0.0), (0.0, 1.0)),
    "NED": ((0.0, 1.0), (1.0, 0.0)),
    "NWU": ((0.0, -1.0), (1.0, 0.0)),
}
"""by frame, what makes east and north of its x and y"""


def fits(head: bytes) -> bool:
    """Whether it has the header of MT Manager, and not that of a DOT."""
    lines = head.decode("utf-8-sig", errors="replace").splitlines()
    header = next((n for n, line in enumerate(lines) if re.search(HEADER, line)), None)
    if header is None or any(line.startswith(("DeviceTag", "sep=")) for line in lines[:header]):
        return False
    return lines[0].startswith("//") or "\t" in lines[header]


def read(path: str | Path) -> Log:
    """Read IMU and heading; raises InputError for a damaged file or one without stamps."""
    found = find(path)
    content = read_bytes(found)
    header = header_line(content, HEADER)
    if header is None:
        raise InputError(f"{found}: no header with Acc_X and Gyr_X; expected an export of MT Manager")
    *comments, names = lines_before(content, header)
    delimiter = next(mark for mark in "\t;," if mark in names)
    rows = read_rows(str(found), content, header, delimiter, wanted=VALUES)
    turns = [f"OriInc_{one}" for one in ("wxyz" if "OriInc_w" in rows.columns else ("q0", "q1", "q2", "q3"))]
    whole = rows.has(*RATES, *FORCES)
    if not whole and not rows.has(*turns, *VELOCITIES):
        raise InputError(f"{found}: no row has rates and accelerations; expected Acc_X, ... and Gyr_X, ...")
    rows = rows.whole(*RATES, *FORCES) if whole else rows.whole(*turns, *VELOCITIES)
    time, notes = _time(found, rows, _told(comments, r"Update Rate: *([\d.]+)"))
    headings, frame_note = _heading(found, rows, time, _frame(comments))
    return Log(
        "boot",
        {
            "imu": rates_to_rows(found, "imu", time, rows.of(*RATES), rows.of(*FORCES))
            if whole
            else ImuRows(RowSource(f"{found}, imu"), time, _rotation_vectors(rows.of(*turns)), rows.of(*VELOCITIES))
        },
        {},
        headings,
        notes=(*rows.warnings, *notes, *frame_note),
    )


def _rotation_vectors(quaternions: Array) -> Array:
    """Return the turns, rad, shape (T, 3), of unit quaternions, scalar first."""
    quaternions = quaternions * np.where(quaternions[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(quaternions[:, 1:], axis=1)
    angle = 2.0 * np.arctan2(sine, quaternions[:, 0])
    return np.asarray(quaternions[:, 1:] * np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 2.0)[:, None])


def _told(comments: list[str], pattern: str) -> float | None:
    found = re.search(pattern, "\n".join(comments))
    return float(found[1]) if found else None


def _frame(comments: list[str]) -> str | None:
    found = re.search(r"Coordinate system: *(\w+)", "\n".join(comments))
    return found[1] if found else None


def _time(path: Path, rows: TextRows, rate_hz: float | None) -> tuple[Array, list[str]]:
    """Return stamps of the sensor's counter, or of packets at the update rate; and what to say of them."""
    if rows.has("SampleTimeFine"):
        ticks = rows.columns["SampleTimeFine"]
        if not np.isfinite(ticks).all():
            raise InputError(f"{path}: SampleTimeFine is missing in {np.sum(~np.isfinite(ticks))} row(s)")
        time = _unwrapped(ticks, TICK_RANGE) * TICK_S
        usual = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        if not rate_hz and usual > SLOWEST_S:
            raise InputError(
                f"{path}: SampleTimeFine in 1e-4 s makes {1.0 / usual:.3g} Hz; is it the export of a DOT, with us and "
                "deg/s?"
            )
        if rate_hz and usual > 0.0 and abs(usual * rate_hz - 1.0) > RATE_AGREES:
            said = f"SampleTimeFine makes {1.0 / usual:.5g} Hz, the header says {rate_hz:g} Hz: is its unit not 1e-4 s?"
            return time, [said]
        return time, []
    if rows.has("PacketCounter") and rate_hz:
        count = rows.columns["PacketCounter"]
        return (_unwrapped(count, PACKET_RANGE) - count[0]) / rate_hz, [
            f"stamps are PacketCounter at the header's {rate_hz:g} Hz: there is no SampleTimeFine"
        ]
    raise InputError(f"{path}: no SampleTimeFine, nor PacketCounter with an update rate; expected stamps")


def _unwrapped(count: Array, turn: int) -> Array:
    """Return a counter that runs on where it starts again from zero; single steps back are left as they are."""
    wraps = np.cumsum(np.diff(count, prepend=count[:1]) < -0.5 * turn)
    return np.asarray(count + wraps * float(turn))


def _heading(path: Path, rows: TextRows, time: Array, frame: str | None) -> tuple[dict[str, SensorRows], list[str]]:
    """Return where the x axis points, clockwise from the frame's north."""
    if rows.has(*MATRIX):
        pointing = rows.of(*MATRIX)
    elif rows.has(*QUATERNION):
        w, x, y, z = rows.of(*QUATERNION).T
        pointing = np.column_stack([w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z)])
    elif rows.has("Yaw"):
        yaw = rows.columns["Yaw"] * DEG
        pointing = np.column_stack([np.cos(yaw), np.sin(yaw)])
    else:
        return {}, []
    if frame not in EAST_NORTH:
        return {}, ["orientation is not read: the header does not tell its frame (Coordinate system: ENU, NED, NWU)"]
    east, north = np.array(EAST_NORTH[frame]) @ pointing.T
    kept = rising(time, np.isfinite(pointing).all(axis=1))
    source = RowSource(f"{path}, orientation")
    heading = SensorRows(source, "heading", time[kept], np.arctan2(east, north)[kept])
    return {"orientation": heading}, ["orientation: of the sensor's x axis; its north is magnetic, or arbitrary"]
