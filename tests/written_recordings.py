"""Small recordings written to a folder: two IMUs at rest for 10 s, GNSS, a reference, and their configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

RATE_HZ = 50.0
SECONDS = 10.0
GRAVITY = 9.80665
BEGIN = 100.0


def still_imu(rows: int = int(RATE_HZ * SECONDS), begin: float = BEGIN) -> np.ndarray:
    """time, gyro (rad/s), specific force (m/s^2) in forward-right-down axes, one row each 20 ms."""
    time = begin + np.arange(rows) / RATE_HZ
    gyro = 0.001 * np.sin(np.outer(time, [1.0, 1.7, 2.3]))
    force = np.tile([0.02, -0.01, -GRAVITY], (rows, 1))
    return np.column_stack([time, gyro, force])


def as_increments(rows: np.ndarray) -> np.ndarray:
    rows = rows.copy()
    rows[:, 1:] /= RATE_HZ
    return rows


def fixes() -> np.ndarray:
    """time, latitude deg, longitude deg, height m, std north, east, down m, once a second."""
    time = BEGIN + 0.5 + np.arange(SECONDS - 0.5)
    return np.column_stack([time, np.tile([30.5, 114.4, 20.0, 0.02, 0.02, 0.04], (len(time), 1))])


def write_rows(path: Path, rows: np.ndarray, header: str = "", delimiter: str = " ") -> Path:
    np.savetxt(path, rows, fmt="%.9f", delimiter=delimiter, header=header, comments="")
    return path


TABLE_COLUMNS = {
    "time": {"name": "t", "unit": "s"},
    "gyro": {"names": ["gx", "gy", "gz"], "unit": "rad/s"},
    "accel": {"names": ["ax", "ay", "az"], "unit": "m/s^2"},
}


def write_recording(folder: Path) -> dict[str, Any]:
    """Write `a.txt` (KF-GINS), `b.csv` (table), `gnss.txt`; return the configuration as plain values."""
    write_rows(folder / "a.txt", as_increments(still_imu()))
    write_rows(folder / "b.csv", still_imu(), "t,gx,gy,gz,ax,ay,az", ",")
    write_rows(folder / "gnss.txt", fixes())
    return {
        "imus": [
            {"name": "a", "file": "a.txt", "format": "kf-gins"},
            {"name": "b", "file": "b.csv", "format": "table", "columns": TABLE_COLUMNS, "position_m": [0.0, 0.1, 0.0]},
        ],
        "gnss": {"file": "gnss.txt", "format": "kf-gins", "antenna_position_m": [0.1, 0.0, -0.5]},
    }


def write_config(folder: Path, values: dict[str, Any], name: str = "drive.yaml") -> Path:
    path = folder / name
    with path.open("w") as file:
        YAML().dump(values, file)
    return path
