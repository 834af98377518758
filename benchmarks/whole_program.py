"""What whole commands take, warm: start-up, a KF-GINS recording, 1,000 s as text, 1,000 s of 16 IMUs.

    python benchmarks/whole_program.py [--rounds 5]

Every command runs in a process of its own; they take turns, and each figure is the median over the rounds. The KF-GINS
recording is that of the data folder (POLYINS_DATA); the other two are simulated.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from polyins.config.yaml_document import read_yaml, write_yaml
from polyins.formats import kf_gins
from polyins.simulation import files
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario
from polyins.tools.bench import machine

SECONDS = 1000.0


def cases(folder: Path) -> dict[str, list[str]]:
    """Write the recordings and return the commands by name."""
    python, polyins = [sys.executable, "-c"], [sys.executable, "-m", "polyins"]
    out = ["--out", str(folder / "out")]
    array = files.write(simulate(Scenario(duration_s=SECONDS)), folder / "array")
    commands = {
        "import numpy": [*python, "import numpy"],
        "import polyins": [*python, "import polyins"],
        "1,000 s of text, no report": [*polyins, "run", str(as_text(folder / "text")), "--no-report", *out],
        "16 IMUs, 1,000 s of Parquet, no report": [*polyins, "run", str(array), "--no-report", *out],
    }
    parity = Path(os.environ.get("POLYINS_DATA", "")) / "kfgins-parity"
    if parity.is_dir():
        config = unpacked(parity, folder / "parity") / "kf-gins.yaml"
        commands["KF-GINS recording, no report"] = [*polyins, "run", str(config), "--no-report", *out]
        commands["KF-GINS recording"] = [*polyins, "run", str(config), *out]
    return commands


def unpacked(source: Path, folder: Path) -> Path:
    """Copy a recording and unpack what is packed, so that only the program's own reading is timed."""
    shutil.copytree(source, folder)
    for packed in folder.glob("*.gz"):
        subprocess.run(["gunzip", str(packed)], check=True)
    return folder


def as_text(folder: Path) -> Path:
    """Write a recording of one IMU with KF-GINS text files, 200,000 lines; return its configuration."""
    recording = simulate(Scenario(duration_s=SECONDS, imus=Board(count=1)))
    config = files.write(recording, folder)
    assert recording.gnss is not None
    name = recording.imus[0].name
    kf_gins.write_imu_text(folder / f"{name}.txt", recording.imus[0])
    kf_gins.write_gnss(folder / "gnss.txt", replace(recording.gnss, velocity=None, velocity_std=None))
    values = read_yaml(config).values
    values["imus"][0] |= {"file": f"{name}.txt", "format": "kf-gins"}
    values["gnss"] |= {"file": "gnss.txt", "format": "kf-gins"}
    config.write_text(write_yaml(values))
    return config


def timed(command: Sequence[str]) -> tuple[float, float, float]:
    """Run a command; return user CPU, system CPU and wall time, s."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime, after.ru_stime - before.ru_stime, wall


def main() -> None:
    """Print one JSON document."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    load = os.getloadavg()
    with tempfile.TemporaryDirectory(prefix="polyins-whole-") as folder:
        commands = cases(Path(folder))
        for command in commands.values():  # compiles what is not compiled yet
            timed(command)
        taken = {name: [] for name in commands}
        for _ in range(rounds):
            for name, command in commands.items():
                taken[name].append(timed(command))
    results = [
        {
            "name": name,
            **dict(zip(("user_s", "system_s", "wall_s"), np.median(times, axis=0).tolist(), strict=True)),
            "least_user_s": float(np.min(times, axis=0)[0]),
            "least_wall_s": float(np.min(times, axis=0)[2]),
        }
        for name, times in taken.items()
    ]
    wall = {name: np.array(times)[:, 2] for name, times in taken.items()}
    print(
        json.dumps(
            {
                "machine": machine(),
                "load_before": load,
                "load_after": os.getloadavg(),
                "rounds": rounds,
                "import_ratio": float(np.median(wall["import polyins"] / wall["import numpy"])),
                "results": results,
            },
            indent=2,
        )
    )


if __name__ == "__main__":
    main()
