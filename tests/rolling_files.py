"""A small vehicle written to a folder: IMUs on three wheels and the body for 40 s, GNSS, and their configuration.

It stands for 5 s, speeds up to 4 m/s and weaves; the front wheel is steered. The sensors on the wheels have z outward.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Values = dict[str, Any]

RATE_HZ = 100.0
SECONDS = 40.0
REST_S = 5.0
RADIUS = 0.3
WHEELS = {"rear-right": (0.0, 0.5), "rear-left": (0.0, -0.5), "front-right": (1.5, 0.5)}
HEADER = "t,gx,gy,gz,ax,ay,az"
COLUMNS = {
    "time": {"name": "t"},
    "gyro": {"names": ["gx", "gy", "gz"], "unit": "rad/s"},
    "accel": {"names": ["ax", "ay", "az"], "unit": "m/s^2"},
}


def stamps() -> Array:
    return np.arange(1, int(RATE_HZ * SECONDS) + 1) / RATE_HZ


def speed(time: Array) -> Array:
    return 4.0 * (1.0 - np.exp(-np.maximum(time - REST_S, 0.0) / 3.0)) * (1.0 + 0.2 * np.sin(0.9 * time))


def yaw_rate(time: Array) -> Array:
    return 0.3 * np.sin(0.5 * time) * (time > REST_S)


def steering_rate(time: Array) -> Array:
    """Of the front wheel against the body."""
    return 0.25 * np.cos(0.8 * time) * (time > REST_S)


def wheel_rows(name: str, radius: float = RADIUS) -> Array:
    """time, rates, specific forces in sensor axes: z along the axle outward, in the middle of each interval."""
    time = stamps()
    middle = time - 0.5 / RATE_HZ
    x, y = WHEELS[name]
    yaw = yaw_rate(middle)
    spin = -(speed(middle) - yaw * y) / radius
    if x > 0.0:
        yaw = yaw + steering_rate(middle)
    angle = np.cumsum(spin) / RATE_HZ
    acceleration = np.gradient(speed(middle), middle)
    # at angle zero the module's y points backwards and its z down
    sin, cos = np.sin(angle), np.cos(angle)
    rate = np.column_stack([spin, yaw * sin, yaw * cos])
    force = np.column_stack([speed(middle) * yaw, -acceleration * cos - 9.8 * sin, acceleration * sin - 9.8 * cos])
    return np.column_stack([time, as_sensor(rate, y), as_sensor(force, y)])


def as_sensor(module: Array, right: float) -> Array:
    """From the module's axes (x along the axle to the right) to those of a sensor with z outward."""
    return module[:, [1, 2, 0]] if right > 0.0 else module[:, [2, 1, 0]] * [1.0, 1.0, -1.0]


def body_rows() -> Array:
    time = stamps()
    middle = time - 0.5 / RATE_HZ
    zero = np.zeros(len(time))
    force = [np.gradient(speed(middle), middle), speed(middle) * yaw_rate(middle), zero - 9.8]
    return np.column_stack([time, zero, zero, yaw_rate(middle), *force])


def fixes() -> Array:
    """time, north, east, height m, once a second."""
    time = stamps()
    heading = np.cumsum(yaw_rate(time)) / RATE_HZ
    north, east = (np.cumsum(speed(time) * axis(heading)) / RATE_HZ for axis in (np.cos, np.sin))
    return np.column_stack([time, north, east, 0.0 * time])[99::100]


def write_rows(path: Path, rows: Array, header: str = HEADER) -> Path:
    np.savetxt(path, rows, fmt="%.9f", delimiter=",", header=header, comments="")
    return path


@cache
def whole_files() -> dict[str, bytes]:
    """The files of the vehicle as it should be, by name."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        for wheel in WHEELS:
            write_rows(folder / f"{wheel}.csv", wheel_rows(wheel))
        write_rows(folder / "body.csv", body_rows())
        write_rows(folder / "gnss.csv", fixes(), "t,n,e,h")
        return {path.name: path.read_bytes() for path in folder.iterdir()}


def write_vehicle(folder: Path) -> Values:
    """Write the files; return the configuration as plain values."""
    for name, content in whole_files().items():
        (folder / name).write_bytes(content)
    wheels = [
        {
            "name": name,
            "file": f"{name}.csv",
            "position_m": [x, y, 0.0],
            "wheel": {
                "radius_m": RADIUS,
                "spin_axis": "z" if y > 0.0 else "-z",
                "side": "right" if y > 0.0 else "left",
                "steering": x > 0.0,
            },
        }
        for name, (x, y) in WHEELS.items()
    ]
    return {
        "imu_defaults": {"format": "table", "columns": COLUMNS},
        "imus": [*wheels, {"name": "body", "file": "body.csv", "position_m": [0.2, 0.0, -0.3]}],
        "gnss": {
            "file": "gnss.csv",
            "columns": {
                "time": {"name": "t"},
                "position": {"names": ["n", "e", "h"], "frame": "north-east-up"},
            },
            "position_std_m": 0.1,
        },
    }
