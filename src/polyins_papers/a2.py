"""Paper A, Table II: how often each step is done in one second with one fix.

polyins's side is counted while the engine runs: it splits the interval in which the fix falls, and fuses the solutions
of an epoch once, for its output and for the next prediction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from polyins_papers import operations

IMUS = 16
QUICK_IMUS = 4


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Count executions in the engine's Python form with 16 IMUs, or 4 if `quick`, and return the document."""
    imus = QUICK_IMUS if quick else IMUS
    counted = operations.measure(imus)["executions"]
    if progress:
        progress(1.0)
    return {
        "target": "a2",
        "paper": table(imus),
        "polyins": counted,
        "settings": {
            "imus": imus,
            "gain": "once for each covariance; stands for H, K and P",
            "feedback": "once for each IMU; stands for residual, correction and feedback",
        },
    }


def table(imus: int) -> dict[str, dict[str, int]]:
    """Return the paper's table for that many IMUs."""
    rows = {
        "single": (200, 200, 1, 1, 0, 0),
        "nav-fusion": (200 * imus, 200 * imus, imus, imus, 0, 200 * imus),
        "enav-fusion": (200 * imus, 200, 1, imus, 200 * imus, (200 * 2 + 1) * imus),
    }
    return {method: dict(zip(operations.EXECUTED, row, strict=True)) for method, row in rows.items()}
