"""The tables that polyins writes, CSV or Parquet: names of their columns, and what is written."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from polyins.files import find, plain_suffix, write_bytes
from polyins.formats.arrow_arrays import to_arrow
from polyins.formats.columns import column_names, read_columns
from polyins.formats.rows import RowSource, SensorRows, Track
from polyins.model.recording import Array, GnssStream, ImuStream
from polyins.model.rig import DEG

if TYPE_CHECKING:
    from polyins.config import ImuColumns, TrackColumns

IMU_NAMES = ("time_s", *(f"dtheta_{axis}_rad" for axis in "xyz"), *(f"dvel_{axis}_m_s" for axis in "xyz"))
GEODETIC_NAMES = ("latitude_deg", "longitude_deg", "height_m")
ABOVE_SEA_NAMES = (*GEODETIC_NAMES[:2], "height_above_sea_m")
LOCAL_NAMES = ("north_m", "east_m", "down_m")
STD_NAMES = ("std_north_m", "std_east_m", "std_down_m")
VELOCITY_NAMES = ("north_velocity_m_s", "east_velocity_m_s", "down_velocity_m_s")
VELOCITY_STD_NAMES = ("std_north_velocity_m_s", "std_east_velocity_m_s", "std_down_velocity_m_s")
ATTITUDE_NAMES = ("roll_deg", "pitch_deg", "heading_deg")
SENSOR_NAMES = {"height": "height_m", "heading": "heading_deg", "odometer": "speed_m_s"}
"""what sensors beside IMUs and GNSS show, by kind"""
SHOWN_NAMES = {**SENSOR_NAMES, "speed": "speed_m_s", "ticks": "ticks"}
"""and what else logs hold"""
METADATA = b"polyins"
"""of a Parquet file, a JSON document"""


def written_imu_columns() -> ImuColumns:
    """Return the columns of an IMU table that polyins wrote."""
    from polyins.config import ImuColumns

    gyro = {"names": IMU_NAMES[1:4], "unit": "rad"}
    accel = {"names": IMU_NAMES[4:7], "unit": "m/s"}
    return ImuColumns.model_validate({"time": {"name": IMU_NAMES[0]}, "gyro": gyro, "accel": accel})


def written_columns(path: str | Path) -> TrackColumns:
    """Return the columns of a table of positions that polyins wrote."""
    from polyins.config import TrackColumns

    names = set(column_names(path))
    known = next((some for some in (GEODETIC_NAMES, ABOVE_SEA_NAMES) if names.issuperset(some)), None)
    geodetic = known is not None and not np.isnan(read_columns(path, GEODETIC_NAMES[:1])[1][0]).all()
    declared: dict[str, object] = {
        "time": {"name": "time_s"},
        "position": {"names": known if geodetic else LOCAL_NAMES} | ({} if geodetic else {"frame": "north-east-down"}),
    }
    for group, columns in (
        ("std", STD_NAMES),
        ("velocity", VELOCITY_NAMES),
        ("velocity_std", VELOCITY_STD_NAMES),
        ("attitude", ATTITUDE_NAMES),
    ):
        if names.issuperset(columns):
            declared[group] = {"names": columns}
    return TrackColumns.model_validate(declared)


def is_written_track(names: Iterable[str]) -> bool:
    """Whether a table with these columns is one of positions that polyins wrote."""
    found = set(names)
    return "time_s" in found and any(map(found.issuperset, (GEODETIC_NAMES, ABOVE_SEA_NAMES, LOCAL_NAMES)))


def utc_of_zero(path: str | Path) -> float | None:
    """Return the Unix time at which the stamps of a Parquet file are zero, s, if polyins wrote it and knew."""
    from pyarrow import ArrowException, parquet

    try:
        metadata = parquet.read_metadata(find(path)).metadata or {}
    except (ArrowException, OSError):  # packed, or damaged, which its reader says
        return None
    known: float | None = json.loads(metadata.get(METADATA, b"{}")).get("utc_of_zero_s")
    return known


def write_imu(path: str | Path, stream: ImuStream, utc_of_zero: float | None = None) -> None:
    """Write increments as CSV or Parquet, by the suffix; `utc_of_zero`: see the function, s."""
    _write(path, IMU_NAMES, [stream.time, stream.dtheta, stream.dvel], utc_of_zero)


def write_sensor(path: str | Path, rows: SensorRows, utc_of_zero: float | None = None) -> None:
    """Write what a sensor shows, and its std where there is one, as CSV or Parquet."""
    name, unit = SHOWN_NAMES[rows.kind], DEG if rows.kind == "heading" else 1.0
    given = {name: rows.value, f"std_{name}": rows.std}
    known = {column: values / unit for column, values in given.items() if values is not None}
    _write(path, ("time_s", *known), [rows.time, *known.values()], utc_of_zero)


def write_gnss(path: str | Path, stream: GnssStream, *, geodetic: bool) -> None:
    """Write fixes with their standard deviations as CSV or Parquet, by the suffix."""
    track = Track(
        RowSource(str(path)),
        stream.time,
        stream.position,
        geodetic,
        position_std=stream.position_std,
        velocity=stream.velocity,
        velocity_std=stream.velocity_std,
    )
    write_track(path, track)


def write_track(path: str | Path, track: Track, utc_of_zero: float | None = None) -> None:
    """Write positions, and what else there is with them, as CSV or Parquet, by the suffix."""
    units = np.array([DEG, DEG, 1.0] if track.geodetic else [1.0, 1.0, -1.0])
    geodetic = ABOVE_SEA_NAMES if track.above_sea else GEODETIC_NAMES
    names = ["time_s", *(geodetic if track.geodetic else LOCAL_NAMES)]
    values = [track.time, track.position / units]
    for extra, block, unit in (
        (STD_NAMES, track.position_std, 1.0),
        (VELOCITY_NAMES, track.velocity, 1.0),
        (VELOCITY_STD_NAMES, track.velocity_std, 1.0),
        (ATTITUDE_NAMES, track.attitude, DEG),
    ):
        if block is not None:
            names += extra
            values.append(block / unit)
    _write(path, names, values, utc_of_zero)


def _write(path: str | Path, names: Sequence[str], values: Sequence[Array], utc_of_zero: float | None = None) -> None:
    from pyarrow import BufferOutputStream, csv, parquet
    from pyarrow import table as arrow_table

    rows = np.column_stack(values)
    table = arrow_table({name: to_arrow(rows[:, n]) for n, name in enumerate(names)})
    if utc_of_zero is not None:
        table = table.replace_schema_metadata({METADATA: json.dumps({"utc_of_zero_s": utc_of_zero})})
    content = BufferOutputStream()
    if plain_suffix(path) == ".parquet":
        # numbers that never repeat gain nothing from a dictionary, but from keeping their like bytes together
        parquet.write_table(table, content, compression="zstd", use_dictionary=False, use_byte_stream_split=True)
    else:
        csv.write_csv(table, content)
    write_bytes(path, content.getvalue().to_pybytes())
