"""Memory and time of a long recording: made stretch by stretch, run by the command line, peak memory measured.

    python benchmarks/long_recording.py --hours 1 --hours 4 [--imus 16] [--folder DIR] [--keep]

An array on a vehicle that drives a circle at constant speed on a local plane, so that increments are exact and alike
all day; white noise on every axis. 24 h of 16 IMUs at 200 Hz take 15.5 GB of disk while this runs.
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
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from polyins.formats.table import IMU_NAMES, LOCAL_NAMES, STD_NAMES
from polyins.tools.bench import machine

RATE_HZ = 200.0
SPEED, RADIUS, GRAVITY = 10.0, 300.0, 9.80665
TURN = SPEED / RADIUS
NOISE = np.array(3 * [4e-6] + 3 * [4e-4])
"""std of an increment: rad, m/s"""
ROWS = 120_000
"""of a row group"""


def positions(count: int) -> np.ndarray:
    """Return where the IMUs of a square board sit, m, shape (count, 3)."""
    side = math.ceil(math.sqrt(count))
    places = [(0.015 * (i // side), 0.015 * (i % side), 0.0) for i in range(count)]
    return np.array(places) - np.mean(places, axis=0)


def write_imu(path: Path, rows: int, position: np.ndarray, seed: int) -> None:
    """Write increments: turn about down, centripetal force to the right, gravity, at the IMU's own place."""
    rng = np.random.default_rng(seed)
    force = np.array([-(TURN**2) * position[0], TURN * SPEED - TURN**2 * position[1], -GRAVITY])
    exact = np.array([0.0, 0.0, TURN, *force]) / RATE_HZ
    schema = pa.schema([(name, pa.float64()) for name in IMU_NAMES])
    with pq.ParquetWriter(path, schema, compression="none", use_dictionary=False) as writer:
        for first in range(0, rows, ROWS):
            stamps = np.arange(first, min(first + ROWS, rows)) / RATE_HZ
            values = exact + NOISE * rng.standard_normal((len(stamps), 6))
            writer.write_table(pa.table([pa.array(column) for column in [stamps, *values.T]], schema=schema))


def write_track(path: Path, time: np.ndarray, noise: float, seed: int) -> None:
    """Write positions on the circle with white noise, m."""
    angle = TURN * time
    exact = np.column_stack([RADIUS * np.sin(angle), RADIUS * (1.0 - np.cos(angle)), np.zeros_like(angle)])
    place = exact + noise * np.random.default_rng(seed).standard_normal(exact.shape)
    columns = [time, *place.T, *np.full((3, len(time)), max(noise, 1e-3))]
    pq.write_table(pa.table(columns, names=["time_s", *LOCAL_NAMES, *STD_NAMES]), path)


def write_recording(folder: Path, hours: float, imus: int) -> Path:
    """Write a recording and return its configuration."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = round(3600.0 * hours * RATE_HZ)
    entries = []
    for number, position in enumerate(positions(imus), 1):
        write_imu(folder / f"imu{number}.parquet", rows, position, number)
        entries.append({"name": f"imu{number}", "file": f"imu{number}.parquet", "position_m": position.tolist()})
    seconds = np.arange(1.0, rows / RATE_HZ)
    write_track(folder / "gnss.parquet", seconds, 0.05, 100)
    write_track(folder / "reference.parquet", seconds, 0.0, 101)
    config = {
        "imu_defaults": {"noise": {"grade": "consumer-mems"}},
        "imus": entries,
        "gnss": {"file": "gnss.parquet"},
        "reference": {"file": "reference.parquet"},
        "start": {
            "time_s": 0.0,
            "position": {"north_m": 0.0, "east_m": 0.0, "height_m": 0.0},
            "velocity_m_s": [SPEED, 0.0, 0.0],
            "roll_pitch_deg": [0.0, 0.0],
            "heading_deg": 0.0,
            "heading_from": "value",
            "estimate_gyro_bias": False,
        },
        "outages": {"length_s": 30.0, "every_s": 300.0},
    }
    path = folder / "long.yaml"
    path.write_text(json.dumps(config, indent=1))
    return path


def measure(config: Path, out: Path) -> dict[str, object]:
    """Run the command in a process of its own; return its figures."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    command = [sys.executable, "-c", CHILD, "run", str(config), "--out", str(out), "--no-report", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    summary = json.loads(done.stdout)
    return {
        "epochs": summary["epochs"],
        "peak_mb": float(done.stderr.split()[-1]) / 1024.0,
        "wall_s": time.perf_counter() - begin,
        "user_s": after.ru_utime - before.ru_utime,
        "system_s": after.ru_stime - before.ru_stime,
        "filter_s": summary["filter_s"],
        "solution_mb": (out / "solution.parquet").stat().st_size / 1e6,
        "reference": summary["reference"],
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
    parser.add_argument("--hours", type=float, action="append", required=True)
    parser.add_argument("--imus", type=int, default=16)
    parser.add_argument("--folder", type=Path, default=None, help="on a disk with room; a temporary one unless given")
    parser.add_argument("--keep", action="store_true", help="leave the recordings there")
    options = parser.parse_args()
    base = Path(tempfile.mkdtemp(prefix="polyins-long-", dir=options.folder))
    runs = []
    for hours in options.hours:
        folder = base / f"{hours:g}h"
        config = write_recording(folder, hours, options.imus)
        size = sum(file.stat().st_size for file in folder.iterdir())
        runs.append({"hours": hours, "recording_mb": size / 1e6, **measure(config, folder / "out")})
        if not options.keep:
            shutil.rmtree(folder)
    if not options.keep:
        base.rmdir()
    print(json.dumps({"machine": machine(), "imus": options.imus, "rate_hz": RATE_HZ, "runs": runs}, indent=2))


if __name__ == "__main__":
    main()
