"""A recording as files: one Parquet table per stream and the YAML configuration that `reading.loading` reads back.

Increments are written as the recording holds them, in array axes; the configuration therefore has no mount rotations.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.config.yaml_document import write_yaml
from polyins.files import whole, write_bytes
from polyins.formats.table import ATTITUDE_NAMES, GEODETIC_NAMES, LOCAL_NAMES, VELOCITY_NAMES, write_gnss, write_imu
from polyins.model.recording import AidingStream, FilterOptions, Recording, Reference, RollingOptions, StartOptions
from polyins.model.rig import DEG, HOUR, MGAL, PPM, AidingSensor, Imu, ImuErrors, NoiseGrade, Wheel

Array = NDArray[np.float64]

CONFIG = "recording.yaml"


_VALUES = {"height": "height_m", "heading": "heading_deg", "odometer": "speed_m_s"}
_OFFSETS = {"height": "bias_std_m", "heading": "offset_std_deg", "odometer": "scale_std"}
_UNITS = {"height": 1.0, "heading": DEG, "odometer": 1.0}


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
    config["filter"] = _filter(recording.options)
    if recording.rig.has_wheels:
        config["filter"]["rolling"] = _rolling(recording.options.rolling)
    write_bytes(place / CONFIG, write_yaml(config).encode())
    return place / CONFIG


def write_sensor(path: str | Path, stream: AidingStream) -> None:
    """Write what a sensor shows, and its std, as Parquet."""
    from pyarrow import parquet, table

    unit = _UNITS[stream.kind]
    columns = {"time_s": stream.time, _VALUES[stream.kind]: stream.value / unit, "std": stream.std[:, 0] / unit}
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
    entry: dict[str, Any] = {
        "name": imu.name,
        "file": f"{imu.name}.parquet",
        "position_m": _in(1.0, imu.position),
        "noise": _noise(imu.noise),
        "initial_errors": _errors(imu.initial_errors),
    }
    if imu.initial_std is not None:
        entry["initial_std"] = _errors(imu.initial_std)
    if imu.wheel is not None:
        entry["wheel"] = _wheel(imu.wheel)
    if imu.module:
        entry["module"] = imu.module
    if imu.mount_std:
        entry["mount_std_deg"] = imu.mount_std / DEG
    return entry


def _wheel(wheel: Wheel) -> dict[str, Any]:
    """Return a wheel whose IMU's data are in module axes: x along the axle to the right."""
    return {
        "radius_m": wheel.radius,
        "spin_axis": "x",
        "lever_arm_m": _in(1.0, wheel.lever_arm),
        "steering": wheel.steering,
        "radius_std": wheel.radius_std,
        "lever_arm_std_m": wheel.lever_arm_std,
    }


def _noise(grade: NoiseGrade) -> dict[str, Any]:
    """Return a grade in the units of datasheets."""
    return {
        "angle_random_walk_deg_sqrt_h": _in(DEG / np.sqrt(HOUR), grade.angle_random_walk),
        "velocity_random_walk_m_s_sqrt_h": _in(1.0 / np.sqrt(HOUR), grade.velocity_random_walk),
        "gyro_bias_deg_h": _in(DEG / HOUR, grade.gyro_bias_std),
        "accel_bias_mgal": _in(MGAL, grade.accel_bias_std),
        "gyro_scale_ppm": _in(PPM, grade.gyro_scale_std),
        "accel_scale_ppm": _in(PPM, grade.accel_scale_std),
        "correlation_time_h": grade.correlation_time / HOUR,
    }


def _errors(errors: ImuErrors) -> dict[str, Any]:
    return {
        "gyro_bias_deg_s": _in(DEG, errors.gyro_bias),
        "accel_bias_m_s2": _in(1.0, errors.accel_bias),
        "gyro_scale_ppm": _in(PPM, errors.gyro_scale),
        "accel_scale_ppm": _in(PPM, errors.accel_scale),
    }


def _in(unit: float, value: Array) -> list[float]:
    """Return a value in a unit, without the noise of the conversion in the last digit."""
    return [float(f"{number:.15g}") for number in value / unit]


def _start(start: StartOptions, geodetic: bool) -> dict[str, Any]:
    """Return what is known of the start under the names of the configuration."""
    names = {
        "time": ("time_s", 1.0),
        "end_time": ("end_time_s", 1.0),
        "velocity": ("velocity_m_s", 1.0),
        "roll_pitch": ("roll_pitch_deg", DEG),
        "heading": ("heading_deg", DEG),
        "static_interval": ("static_interval_s", 1.0),
        "position_std": ("position_std_m", 1.0),
        "velocity_std": ("velocity_std_m_s", 1.0),
        "attitude_std": ("attitude_std_deg", DEG),
    }
    known = {name: getattr(start, name) for name in names if getattr(start, name) is not None}
    entry = {names[name][0]: (np.asarray(value) / names[name][1]).tolist() for name, value in known.items()}
    if start.position is not None:
        columns, unit = (GEODETIC_NAMES, DEG) if geodetic else (("north_m", "east_m", "height_m"), 1.0)
        entry["position"] = dict(zip(columns, (start.position / [unit, unit, 1.0]).tolist(), strict=True))
    return entry | {"heading_from": start.heading_from, "estimate_gyro_bias": start.estimate_gyro_bias}


def _sensor(sensor: AidingSensor, stream: AidingStream) -> dict[str, Any]:
    """Return the section of a sensor; right and down of an odometer are as sure at every time."""
    kind = sensor.kind
    entry: dict[str, Any] = {
        "file": f"{kind}.parquet",
        "columns": {"time": {"name": "time_s"}, "value": _VALUES[kind], "std": "std"},
        "position_m": sensor.position.tolist(),
        _OFFSETS[kind]: sensor.offset_std / _UNITS[kind],
    }
    if kind == "height":
        entry["bias_random_walk_m_sqrt_s"] = sensor.offset_random_walk
    if kind == "odometer":
        entry["right_std_m_s"], entry["down_std_m_s"] = stream.std[0, 1:].tolist()
    return entry


def _filter(options: FilterOptions) -> dict[str, Any]:
    units = {"gnss_snap": "gnss_snap_s", "gravity": "gravity_m_s2"}
    names = [item.name for item in fields(options) if item.name not in ("rolling", "nonholonomic", "standstill")]
    rest = options.standstill
    standstill = rest and {
        "interval_s": rest.interval,
        "velocity_std_m_s": rest.velocity_std,
        "rate_std_deg_s": rest.rate_std / DEG,
    }
    return {units.get(name, name): getattr(options, name) for name in names} | {"standstill": standstill}


def _rolling(options: RollingOptions) -> dict[str, Any]:
    return {
        "speed_interval_s": options.speed_interval,
        "speed_window_s": options.speed_window,
        "predict": options.predict,
        "wheel_speed_std_m_s": _in(1.0, options.wheel_speed_std),
        "body_speed_std_m_s": _in(1.0, options.body_speed_std),
        "constraint_interval_s": options.constraint_interval,
        "constraint_std_m": options.constraint_std,
        "standstill": options.standstill,
    }
