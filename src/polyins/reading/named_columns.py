"""The streams of a table that nobody has described: IMUs and positions, by the names of columns and size of values."""

from __future__ import annotations

from polyins.errors import InputError
from polyins.formats.columns import OpenTable
from polyins.reading.half_imu import HalfImu, half_of
from polyins.reading.sensor_columns import axes_of, pairs
from polyins.reading.table_imus import imus_of, rows_of_sensors
from polyins.reading.table_positions import positions_of
from polyins.reading.table_stream import TableStream
from polyins.reading.time_columns import time_column


def streams_of(opened: OpenTable) -> list[TableStream] | HalfImu:
    """Return the streams of a table with names; raise InputError if the names say nothing."""
    time = time_column(opened)
    axes = axes_of(opened.names)
    sensors = pairs(axes)
    found: list[TableStream] = []
    if time is not None and sensors:
        found += imus_of(opened, time, sensors)
    elif time is not None and (rows := rows_of_sensors(opened, time)) is not None:
        found.append(rows)
    elif time is not None and (half := half_of(opened, time, axes)) is not None:
        return half
    if time is not None and (track := positions_of(opened, time, beside=bool(found))) is not None:
        found.append(track)
    if not found:
        raise InputError(
            f"{opened.path}: columns {', '.join(name for name in opened.names if name) or '(no header)'} are of no "
            "known meaning; expected names such as time, gyro_x, acc_x or time, latitude, longitude, height (else "
            "declare them as columns)"
        )
    return found
