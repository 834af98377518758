"""A recording as files: one Parquet table per stream and the YAML configuration that `reading.loading` reads back.

Increments are written as the recording holds them, in array axes; the configuration therefore has no mount rotations.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.config import Filter, HeadingEntry, HeightEntry, ImuEntry, OdometerEntry, SensorEntry, StartEntry
from polyins.config.units import write as write_section
from polyins.config.yaml_document import write_yaml
from polyins.files import whole, write_bytes
from polyins.formats.written_table import (
    ATTITUDE_NAMES,
    GEODETIC_NAMES,
    LOCAL_NAMES,
    SENSOR_NAMES,
    VELOCITY_NAMES,
    write_gnss,
    write_imu,
)
from polyins.model.recording import AidingStream, Recording, Reference, StartOptions
from polyins.model.rig import DEG, AidingSensor, Imu
from polyins.reading.sensor_stream import UNITS

Array = NDArray[np.float64]

CONFIG = "recording.yaml"


SECTIONS: dict[str, type[SensorEntry]] = {"height": HeightEntry, "heading": HeadingEntry, "odometer": OdometerEntry}


def write(recording: Recording, folder: str | Path) -> Path:
    """Write a recording into a folder, which is made if there is none, and return the path of its configuration."""
    place = Path(folder)
    config: dict[str, Any] = {"name": recording.name, "imus": [_imu(imu) for imu in recording.rig.imus]}
    for stream in recording.imus:
        write_imu(place / f"{stream.name}.parquet", stream)
    if recording.gnss is not None:
        config["gnss"] = {"file": "gnss.parquet", "antenna_position_m": recording.rig.antenna.tolist()}
        write_gnss(place / "gnss.parquet", recording.gnss, geodetic=recording.geodetic)
    if recording.reference is not None:
        config["reference"] = {"file": "reference.parquet", "point_m": recording.reference.lever_arm.tolist()}
        write_reference(place / "reference.parquet", recording.reference, geodetic=recording.geodetic)
    for shown in recording.aiding:
        config[shown.kind] = _sensor(recording.rig.sensor(shown.kind), shown)
        write_sensor(place / f"{shown.kind}.parquet", shown)
    if recording.options.nonholonomic is not None:
        assumed = recording.options.nonholonomic
        right, down = assumed.std.tolist()
        config["odometer"] = {
            "position_m": recording.rig.sensor("odometer").position.tolist(),
            **config.get("odometer", {}),
            "constraint_interval_s": assumed.interval,
            "right_std_m_s": right,
            "down_std_m_s": down,
        }
    config["start"] = _start(recording.start, recording.geodetic)
    config["outages"] = [list(outage) for outage in recording.outages]
    config["filter"] = write_section(Filter, recording.options)
    write_bytes(place / CONFIG, write_yaml(config).encode())
    return place / CONFIG


def write_sensor(path: str | Path, stream: AidingStream) -> None:
    """Write what a sensor shows, and its std, as Parquet."""
    from pyarrow import parquet, table

    unit = next(iter(UNITS[stream.kind].values()))
    columns = {"time_s": stream.time, SENSOR_NAMES[stream.kind]: stream.value / unit, "std": stream.std[:, 0] / unit}
    with whole(path) as beside:
        parquet.write_table(table(columns), beside)


def write_reference(path: str | Path, reference: Reference, *, geodetic: bool) -> None:
    """Write positions, and velocities and attitudes where there are any, as Parquet."""
    from pyarrow import parquet, table

    columns = {"time_s": reference.time}
    columns |= _named(*_position_columns(reference.position, geodetic))
    if reference.velocity is not None:
        columns |= _named(VELOCITY_NAMES, reference.velocity)
    if reference.attitude is not None:
        columns |= _named(ATTITUDE_NAMES, reference.attitude / DEG)
    with whole(path) as beside:
        parquet.write_table(table(columns), beside)


def _position_columns(position: Array, geodetic: bool) -> tuple[tuple[str, ...], Array]:
    if geodetic:
        return GEODETIC_NAMES, position / [DEG, DEG, 1.0]
    return LOCAL_NAMES, position * [1.0, 1.0, -1.0]


def _named(names: tuple[str, ...], values: Array) -> dict[str, Array]:
    return dict(zip(names, values.T, strict=True))


def _imu(imu: Imu) -> dict[str, Any]:
    """Return the section of an IMU whose data are in array axes, on a wheel in the module's: x along the axle."""
    entry = {"name": imu.name, "file": f"{imu.name}.parquet"} | write_section(ImuEntry, imu)
    if imu.wheel is not None:
        entry["wheel"]["spin_axis"] = "x"
    return entry


def _start(start: StartOptions, geodetic: bool) -> dict[str, Any]:
    """Return what is known of the start."""
    entry = write_section(StartEntry, replace(start, position=None))
    if start.position is not None:
        columns, unit = (GEODETIC_NAMES, DEG) if geodetic else (("north_m", "east_m", "height_m"), 1.0)
        entry["position"] = dict(zip(columns, (start.position / [unit, unit, 1.0]).tolist(), strict=True))
    return entry


def _sensor(sensor: AidingSensor, stream: AidingStream) -> dict[str, Any]:
    """Return the section of a sensor; right and down of an odometer are as sure at every time."""
    kind = sensor.kind
    entry = {
        "file": f"{kind}.parquet",
        "columns": {"time": {"name": "time_s"}, "value": SENSOR_NAMES[kind], "std": "std"},
    } | write_section(SECTIONS[kind], sensor)
    if kind == "odometer":
        entry["right_std_m_s"], entry["down_std_m_s"] = stream.std[0, 1:].tolist()
    return entry
