"""One IMU as configured: its file read, checked, and turned into array axes on the recording's clock."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.checks import stream_checks
from polyins.checks.faults import clipped, without_faults
from polyins.checks.no_data import within_any_range, without_nonsense
from polyins.config import ImuEntry, InitialStd
from polyins.config.fields import IDENTITY, Matrix
from polyins.config.units import read
from polyins.config.wheel_mount import wheel_rotation
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.files import find_named
from polyins.formats import kf_gins, table, xsens_dot
from polyins.formats.recognize import imu_format
from polyins.formats.rows import ImuRows, intervals, without
from polyins.model.axes import axes_matrix
from polyins.model.findings import Finding
from polyins.model.recording import Array, ImuStream
from polyins.model.rig import DEG, Imu, ImuErrors, NoiseGrade
from polyins.prepare.plausible import limits_of
from polyins.reading.log_streams import imu_of

FULL = 0.9985
"""A rate above this part of the full scale has reached it: 32767 counts of 16.4 in a deg/s end at 1998 deg/s."""
MOST_SATURATED = 0.5
"""of the rows: with more of them it is the range or the unit that is wrong"""
MOST_LOST = 0.1
"""of the rows of the only IMU that are no numbers or out of order"""


@dataclass(frozen=True)
class ReadImu:
    """What the file of one IMU says."""

    entry: ImuEntry
    imu: Imu
    """its mount and errors"""
    rows: ImuRows
    """that show something of the motion"""
    stream: ImuStream
    """the same in array axes, on a wheel in the module's"""
    findings: tuple[Finding, ...]
    """what is left out of the file, and what reaches the end of a range"""

    def check(self, accept: Collection[str] = ()) -> tuple[str, ...]:
        """Return warnings of rates and units; raise InputError for those that cannot be right and are not accepted."""
        return checked(self.rows, self.entry, accept)


def read_imu(entry: ImuEntry, index: int, document: Document, *, alone: bool) -> ReadImu:
    """Read the IMU of that index; `alone`: there is no other one that could go on without it.

    Raises InputError for a file that cannot be read; of an IMU that is alone, too, if many rows are not numbers or out
    of order.
    """
    with document.at(["imus", index, "file"]):
        find_named(entry.file)
    rows, found = measured(_rows(entry, document.place(["imus", index])), entry, alone=alone)
    rows, saturated = _within_range(rows, entry)
    range_known = (entry.gyro_range_deg_s or rows.gyro_range_deg_s) is not None
    at_its_end = clipped(rows, entry.name, entry.clock_offset_s, gyro=not range_known) if len(rows.time) > 1 else ()
    with document.at(["imus", index]):
        return ReadImu(entry, as_mounted(entry), rows, in_array_axes(rows, entry), (*found, *saturated, *at_its_end))


def measured(rows: ImuRows, entry: ImuEntry, *, alone: bool, first_row: int = 0) -> tuple[ImuRows, tuple[Finding, ...]]:
    """Leave out the rows that show nothing of the motion, and say so; `alone` as for `read_imu`.

    `first_row`: of the rows in the file.
    """
    name, offset = entry.name, entry.clock_offset_s
    known, (rows, found) = rows, without_nonsense(rows, name, offset)
    if alone and len(rows.time) < max(2.0, (1.0 - MOST_LOST) * len(known.time)):
        stream_checks.check_rows(known, first_row)
    rows, beyond = within_any_range(rows, name, offset, limits_of(on_wheel=entry.wheel is not None))
    rows, faults = without_faults(rows, name, offset)
    return rows, (*found, *beyond, *faults)


def in_array_axes(rows: ImuRows, entry: ImuEntry) -> ImuStream:
    """Return rows as increments in array axes, on a wheel in the module's, on the recording's clock."""
    gyro, accel = to_array_axes(entry)
    dtheta, dvel = mapped(gyro, rows.dtheta), mapped(accel, rows.dvel)
    return ImuStream(entry.name, entry.clock.common(rows.time), dtheta, dvel)


def to_array_axes(entry: ImuEntry) -> tuple[Array, Array]:
    """Return the matrices that correct increments of gyro and accelerometers and turn them, shape (3, 3) each.

    They lead to intervals of the common clock, too: what becomes of a rate over an interval by a clock that is slow is
    too little.
    """
    rotation, drift = sensor_rotation(entry), entry.clock.drift
    rotation = (1.0 + drift) * rotation if drift else rotation
    return _corrected_then(rotation, entry.gyro_matrix), _corrected_then(rotation, entry.accel_matrix)


def _corrected_then(rotation: Array, matrix: Matrix) -> Array:
    return rotation if matrix == IDENTITY else np.asarray(rotation @ np.array(matrix))


def as_mounted(entry: ImuEntry) -> Imu:
    """Return what a configuration says of an IMU."""
    noise = read(entry.noise, NoiseGrade)
    std = initial_std(entry.initial_std, noise.slow_std())
    return read(entry, Imu, noise=noise, rotation=sensor_rotation(entry), initial_std=std)


def _rows(entry: ImuEntry, place: str) -> ImuRows:
    kind: str = entry.format
    if kind == "auto":
        kind = "table" if entry.columns else imu_format(entry.file)
    if kind == "log":
        return _counted(imu_of(entry.file, entry.stream), entry)
    if entry.stream:
        raise InputError(f"{place}: stream is given; expected it of a log with several only")
    if entry.columns and kind != "table":
        raise InputError(f"{place}: columns are given and format is {kind}; expected columns with format table only")
    if kind == "wheel-ins":
        return kf_gins.read_rates(entry.file, entry.rate_hz)
    if kind == "xsens-dot":
        return xsens_dot.read_imu(entry.file, entry.rate_hz)
    if kind == "table":
        return table.read_imu(entry.file, entry.columns, entry.rate_hz)
    return _counted(kf_gins.read_imu(entry.file), entry)


def _counted(rows: ImuRows, entry: ImuEntry) -> ImuRows:
    """Take row number / rate for the stamps, if the entry says so."""
    return replace(rows, time=np.arange(len(rows.time)) / entry.rate_hz) if entry.rate_hz else rows


def checked(rows: ImuRows, entry: ImuEntry, accept: Collection[str] = ()) -> tuple[str, ...]:
    """Return warnings of rates and units; raise InputError for those that cannot be right and are not accepted."""
    if entry.wheel is None:
        return stream_checks.check_imu(rows, accept=accept)
    return stream_checks.check_imu(rows, stream_checks.WHEEL_RATE_RAD_S, entry.wheel.radius_m, accept)


def _within_range(rows: ImuRows, entry: ImuEntry) -> tuple[ImuRows, tuple[Finding, ...]]:
    """Leave out rows whose rate reaches the gyro's full scale: how fast it turned then is not known."""
    limit = entry.gyro_range_deg_s or rows.gyro_range_deg_s
    if limit is None or len(rows.time) < 2:
        return rows, ()
    with np.errstate(invalid="ignore", divide="ignore"):
        rates = np.abs(rows.dtheta / intervals(rows.time)[:, None]).max(axis=1) / DEG
    saturated = rates >= FULL * limit
    count = int(np.sum(saturated))
    if not count:
        return rows, ()
    if count > MOST_SATURATED * len(rates) and not rows.units_known:
        raise InputError(
            f"{rows.source.path}: {count} of {len(rates)} rows reach the gyro's full scale, {limit:g} deg/s; expected "
            "few: gyro_range_deg_s or the unit is wrong, or the sensor does not suit"
        )
    first, last = rows.time[np.flatnonzero(saturated)[[0, -1]]] + entry.clock_offset_s
    finding = Finding(
        "saturation",
        f"{rows.source.path}: the gyro reaches its full scale, {limit:g} deg/s, in {count} row(s), the first at "
        f"{first:.3f} s; they are left out",
        stream=entry.name,
        axis="gyro",
        from_s=float(first),
        to_s=float(last),
        size=float(count),
    )
    return without(rows, saturated), (finding,)


def sensor_rotation(entry: ImuEntry) -> NDArray[np.float64]:
    """Return the matrix that maps sensor vectors to the array's axes, on a wheel to the module's, shape (3, 3)."""
    if entry.wheel is not None:
        return wheel_rotation(entry.wheel)
    return mount_rotation(entry.mount_deg) @ axes_matrix(entry.axes)


def mapped(matrix: Array, increments: Array) -> Array:
    """Return matrix @ increment of each row, shape (T, 3), to the same bits one by one and all at once."""
    if np.array_equal(matrix, np.eye(3)):
        return increments
    # a matrix product would wake every BLAS thread for a 3 x 3 matrix
    return np.asarray(np.einsum("ij,tj->ti", matrix, increments))


def mount_rotation(mount_deg: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return Rz(yaw) Ry(pitch) Rx(roll), shape (3, 3), of roll, pitch, yaw in degrees."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(np.radians(mount_deg)), np.sin(np.radians(mount_deg))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def initial_std(std: InitialStd, otherwise: ImuErrors) -> ImuErrors:
    """Return in SI how sure the initial errors of an IMU are; `otherwise` has what is not given."""
    known = vars(read(std, ImuErrors))
    return replace(otherwise, **{name: value for name, value in known.items() if value is not None})
