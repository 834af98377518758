"""How many recordings per second a machine navigates, with one thread and with one for each core."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.tools import bench
from polyins.tools.parallel import Progress, cores, run_all

RECORDINGS = 8
"""at a time"""
ROUNDS = 9
SECONDS = 300.0
METHOD = "enav-fusion"


def throughput(progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Return the `throughput` document: recordings per second of wall time, from a recording in memory to its solution.

    One recording of 300 s, 16 IMUs at 200 Hz, is navigated 8 times. One thread and all cores take turns; the ratio is
    the median of those within a round.
    """
    recording = bench.array(16, SECONDS)
    counts = (1, cores())
    run_all([partial(_navigate, recording)])  # loads the kernels
    rates = np.empty((ROUNDS, 2))
    for k in range(ROUNDS):
        for j, count in enumerate(counts):
            begin = time.perf_counter()
            run_all([partial(_navigate, recording)] * RECORDINGS, threads=count)
            rates[k, j] = RECORDINGS / (time.perf_counter() - begin)
            if progress:
                progress((2 * k + j + 1) / (2 * ROUNDS))
    return {
        "machine": bench.machine(),
        "method": METHOD,
        "recording": {"imus": 16, "rate_hz": 200.0, "duration_s": SECONDS},
        "threads": list(counts),
        "recordings_per_s": np.median(rates, axis=0).tolist(),
        "ratio": float(np.median(rates[:, 1] / rates[:, 0])),
        "rounds": ROUNDS,
    }


def _navigate(recording: Recording, tell: Progress) -> float:
    return batch.run(recording, METHOD, progress=tell).filter_s
