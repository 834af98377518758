"""Memory and time of whole commands over long recordings, which are made first, stretch by stretch.

    python benchmarks/long_recording.py [--hours 24] [--only run,compare,wheels,csv] [--folder DIR] [--keep]

`run` takes 16 IMUs for so many hours; `compare` two methods and 16 IMUs, `wheels` a vehicle with two wheels and a
body IMU, `csv` four IMUs in text, each for a quarter of that. The array drives a circle at constant speed on a local
plane, so that increments are exact and alike all day; the vehicle stands. White noise on every axis. 24 h of 16 IMUs at
200 Hz take 15.5 GB of disk while this runs.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import csv

from polyins.formats.written_table import IMU_NAMES, LOCAL_NAMES, STD_NAMES
from polyins.tools.bench import machine

RATE_HZ = 200.0
SPEED, RADIUS, GRAVITY = 10.0, 300.0, 9.80665
TURN = SPEED / RADIUS
NOISE = np.array(3 * [4e-6] + 3 * [4e-4])
"""std of an increment: rad, m/s"""
ROWS = 120_000
"""of a row group"""
START: dict[str, Any] = {
    "position": {"north_m": 0.0, "east_m": 0.0, "height_m": 0.0},
    "heading_deg": 0.0,
    "heading_from": "value",
}


def positions(count: int) -> np.ndarray:
    """Return where the IMUs of a square board sit, m, shape (count, 3)."""
    side = math.ceil(math.sqrt(count))
    places = [(0.015 * (i // side), 0.015 * (i % side), 0.0) for i in range(count)]
    return np.array(places) - np.mean(places, axis=0)


def on_circle(position: np.ndarray) -> np.ndarray:
    """Return rate and force at a place: turn about down, centripetal force to the right, gravity."""
    return np.array([0.0, 0.0, TURN, -(TURN**2) * position[0], TURN * SPEED - TURN**2 * position[1], -GRAVITY])


def write_imu(path: Path, rows: int, exact: np.ndarray, seed: int) -> None:
    """Write increments of a constant rate and force."""
    rng = np.random.default_rng(seed)
    schema = pa.schema([(name, pa.float64()) for name in IMU_NAMES])
    with opened(path, schema) as writer:
        for first in range(0, rows, ROWS):
            stamps = np.arange(first, min(first + ROWS, rows)) / RATE_HZ
            values = exact / RATE_HZ + NOISE * rng.standard_normal((len(stamps), 6))
            writer.write_table(pa.table([pa.array(column) for column in [stamps, *values.T]], schema=schema))


def opened(path: Path, schema: pa.Schema) -> Any:
    """Open a table, text or Parquet by its suffix."""
    if path.suffix == ".csv":
        return csv.CSVWriter(path, schema)
    return pq.ParquetWriter(path, schema, compression="none", use_dictionary=False)


def write_track(path: Path, time: np.ndarray, noise: float, seed: int) -> None:
    """Write positions on the circle with white noise, m."""
    angle = TURN * time
    exact = np.column_stack([RADIUS * np.sin(angle), RADIUS * (1.0 - np.cos(angle)), np.zeros_like(angle)])
    place = exact + noise * np.random.default_rng(seed).standard_normal(exact.shape)
    columns = [time, *place.T, *np.full((3, len(time)), max(noise, 1e-3))]
    pq.write_table(pa.table(columns, names=["time_s", *LOCAL_NAMES, *STD_NAMES]), path)


def write_array(folder: Path, hours: float, imus: int, suffix: str = ".parquet") -> Path:
    """Write an array that drives and return its configuration."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = round(3600.0 * hours * RATE_HZ)
    entries = []
    for number, position in enumerate(positions(imus), 1):
        write_imu(folder / f"imu{number}{suffix}", rows, on_circle(position), number)
        entries.append({"name": f"imu{number}", "file": f"imu{number}{suffix}", "position_m": position.tolist()})
    seconds = np.arange(1.0, rows / RATE_HZ)
    write_track(folder / "gnss.parquet", seconds, 0.05, 100)
    write_track(folder / "reference.parquet", seconds, 0.0, 101)
    config = {
        "imu_defaults": {"noise": {"grade": "consumer-mems"}},
        "imus": entries,
        "gnss": {"file": "gnss.parquet"},
        "reference": {"file": "reference.parquet"},
        "start": {**START, "time_s": 0.0, "velocity_m_s": [SPEED, 0.0, 0.0], "roll_pitch_deg": [0.0, 0.0]},
        "outages": {"length_s": 30.0, "every_s": 300.0},
    }
    config["start"]["estimate_gyro_bias"] = False
    return written(folder, config)


def write_vehicle(folder: Path, hours: float) -> Path:
    """Write a vehicle that stands, and return its configuration."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = round(3600.0 * hours * RATE_HZ)
    entries = []
    for number, (name, right) in enumerate({"left": -0.4, "right": 0.4, "body": 0.0}.items()):
        write_imu(folder / f"{name}.parquet", rows, np.array([0.0, 0.0, 0.0, 0.0, 0.0, -GRAVITY]), number)
        entries.append({"name": name, "file": f"{name}.parquet", "position_m": [0.0, right, 0.0]})
        if name != "body":
            entries[-1]["wheel"] = {"radius_m": 0.25, "spin_axis": "x"}
    config = {"imu_defaults": {"noise": {"grade": "consumer-mems"}}, "imus": entries, "start": START}
    return written(folder, config)


def written(folder: Path, config: dict[str, Any]) -> Path:
    """Write a configuration and return its path."""
    path = folder / "long.yaml"
    path.write_text(json.dumps(config, indent=1))
    return path


CASES: dict[str, tuple[float, Callable[[Path, float], Path], tuple[str, ...]]] = {
    "run": (1.0, lambda folder, hours: write_array(folder, hours, 16), ("run",)),
    "compare": (
        0.25,
        lambda folder, hours: write_array(folder, hours, 16),
        ("compare", "--methods", "nav-fusion,enav-fusion"),
    ),
    "wheels": (0.25, write_vehicle, ("run", "--method", "triple-ins")),
    "csv": (0.25, lambda folder, hours: write_array(folder, hours, 4, ".csv"), ("run",)),
}
"""share of the hours, what writes the recording, the command"""


def measure(command: tuple[str, ...], config: Path, out: Path) -> dict[str, object]:
    """Run the command in a process of its own; return its figures."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    arguments = [sys.executable, "-c", CHILD, *command, str(config), "--out", str(out), "--json"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    summary = json.loads(done.stdout)
    return {
        "peak_mb": float(done.stderr.split()[-1]) / 1024.0,
        "wall_s": time.perf_counter() - begin,
        "user_s": after.ru_utime - before.ru_utime,
        "system_s": after.ru_stime - before.ru_stime,
        "output_mb": sum(file.stat().st_size for file in out.rglob("*") if file.is_file()) / 1e6,
        "epochs": summary.get("epochs"),
        "filter_s": summary.get("filter_s"),
        "reference": summary.get("reference"),
    }


CHILD = """
import resource, sys
from polyins.cli import main
try:
    main()
finally:
    print("peak", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)
"""


def main() -> None:
    """Print one JSON document."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--only", default=",".join(CASES))
    parser.add_argument("--folder", type=Path, default=None, help="on a disk with room; a temporary one unless given")
    parser.add_argument("--keep", action="store_true", help="leave the recordings there")
    options = parser.parse_args()
    base = Path(tempfile.mkdtemp(prefix="polyins-long-", dir=options.folder))
    runs = {}
    for name in options.only.split(","):
        share, write, command = CASES[name]
        folder, hours = base / name, share * options.hours
        config = write(folder, hours)
        size = sum(file.stat().st_size for file in folder.iterdir())
        figures = measure(command, config, folder / "out")
        runs[name] = {"hours": hours, "recording_mb": size / 1e6, **figures}
        print(name, json.dumps(runs[name]), file=sys.stderr, flush=True)
        if not options.keep:
            shutil.rmtree(folder)
    if not options.keep:
        base.rmdir()
    print(json.dumps({"machine": machine(), "rate_hz": RATE_HZ, "runs": runs}, indent=2))


if __name__ == "__main__":
    main()
