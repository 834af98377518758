"""Paper A, Table IV: how long fusion takes beside that of one IMU, with full matrices and with structured ones.

The paper's ratios rest on a covariance prediction with full matrices; the structured one is what polyins uses.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.studies.progress import Steps
from polyins.tools import bench

Array = NDArray[np.float64]

METHODS = {"single": 1, "imu-fusion": 16, "nav-fusion": 16, "enav-fusion": 16}
PAPER_S = {"single": 4.67, "imu-fusion": 5.00, "nav-fusion": 75.00, "enav-fusion": 5.71}
"""for 1,000 s at 200 Hz, rms over four groups"""
PAPER_SIX = {"nav-fusion": 6.05, "enav-fusion": 1.09}
"""six IMUs on flexible rulers: time over that of one"""
EPOCHS = 200_000
ROUNDS, SECONDS = 5, 100.0
QUICK_ROUNDS, QUICK_SECONDS = 3, 80.0

CASES: tuple[bench.Case, ...] = tuple(
    (f"{'dense/' if dense else ''}{name}", name, count, dense)
    for dense in (True, False)
    for name, count in METHODS.items()
)

SIX: tuple[bench.Case, ...] = (
    ("single", "single", 1, True),
    *((name, name, 6, True) for name in METHODS if name != "single"),
)


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Time the methods in turns and return the document; the ratio is the median of those within a round."""
    rounds, seconds = (QUICK_ROUNDS, QUICK_SECONDS) if quick else (ROUNDS, SECONDS)
    steps = Steps(progress, 1.5)
    cost = bench.measure(CASES, rounds, seconds, steps.next())
    six = bench.measure(SIX, rounds, seconds, steps.next(0.5))
    dense, structured = cost[:, : len(METHODS)], cost[:, len(METHODS) :]
    return {
        "target": "a4",
        "paper": {
            "time_s": PAPER_S,
            "ratio": {name: time / PAPER_S["single"] for name, time in PAPER_S.items()},
            "six_imus": {"ratio": PAPER_SIX},
        },
        "polyins": {
            **_table(dense),
            "structured": {**_table(structured), "times_faster": _times_faster(dense, structured)},
            "six_imus": _table(six),
        },
        "settings": {
            "time_s": f"CPU time for {EPOCHS:,} epochs, 1,000 s at 200 Hz, scaled from {seconds:g} s; files left out",
            "ratio": "dense single is the unit of the dense rows, structured single of those under structured",
            "six_imus": "Table V's array, full matrices as in the paper",
            "rounds": rounds,
            "machine": bench.machine(),
        },
    }


def _table(cost: Array) -> dict[str, dict[str, float]]:
    return {
        "time_s": _by_method(np.median(cost, axis=0) * 1e-6 * EPOCHS),
        "ratio": _by_method(np.median(cost / cost[:, :1], axis=0)),
    }


def _times_faster(dense: Array, structured: Array) -> dict[str, float]:
    return _by_method(np.median(dense / structured, axis=0))


def _by_method(values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(METHODS, values, strict=True)}
