"""How long tables take to read, as ratios to pandas' own reader on the same machine.

`python benchmarks/tables.py [ROWS]` writes an IMU's rows (720,000 unless said otherwise: an hour at 200 Hz) as CSV and
as padded text, reads each by turns with pandas and with polyins, and prints the ratio of the least CPU time of each,
that other jobs move less than the clock. `read` is the table alone, `checked` an IMU with all its checks.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from polyins.config import ImuColumns, ImuEntry
from polyins.config.yaml_document import as_document
from polyins.formats.table import read_imu
from polyins.reading import imu_stream

ROWS = 720_000
TURNS = 5
NAMES = ("t", "gx", "gy", "gz", "ax", "ay", "az")
COLUMNS = ImuColumns.model_validate(
    {
        "time": {"name": "t"},
        "gyro": {"names": NAMES[1:4], "unit": "rad/s"},
        "accel": {"names": NAMES[4:7], "unit": "m/s^2"},
    }
)


def write(folder: Path, rows: int) -> dict[str, Path]:
    """Write the table in both forms."""
    rng = np.random.default_rng(0)
    values = rng.normal(0.0, 0.05, (rows, 6))
    values[:, 5] -= 9.81
    stamps = np.arange(1, rows + 1) / 200.0
    table = np.column_stack([stamps, values])
    np.savetxt(folder / "imu.csv", table, fmt="%.6f", delimiter=",", header=",".join(NAMES), comments="")
    header = " ".join(f"{name:>14}" for name in NAMES)
    np.savetxt(folder / "padded.txt", table, fmt="%14.6f", header=header, comments="")
    return {"csv": folder / "imu.csv", "padded": folder / "padded.txt"}


def checked(path: Path) -> None:
    """Read an IMU as a recording does."""
    entry = ImuEntry.model_validate({"name": "imu1", "file": str(path), "columns": COLUMNS})
    document = as_document(path, "imus: []")
    imu_stream.read_imu(entry, 0, document, alone=True).check()


def fastest(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the least CPU time of each, s, taken by turns so that what else runs meets all alike."""
    found = dict.fromkeys(calls, np.inf)
    for _ in range(TURNS):
        for name, call in calls.items():
            begin = time.process_time()
            call()
            found[name] = min(found[name], time.process_time() - begin)
    return found


def main() -> None:
    """Print the ratios."""
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else ROWS
    with tempfile.TemporaryDirectory() as folder:
        for form, path in write(Path(folder), rows).items():
            options = {} if form == "csv" else {"sep": r"\s+"}
            times = fastest(
                {
                    "pandas": lambda path=path, options=options: pd.read_csv(path, **options),
                    "read": lambda path=path: read_imu(path, COLUMNS),
                    "checked": lambda path=path: checked(path),
                }
            )
            ratios = ", ".join(f"{name} {times[name] / times['pandas']:.2f}" for name in ("read", "checked"))
            print(f"{form}: pandas {times['pandas']:.2f} s; {ratios}")


if __name__ == "__main__":
    main()
