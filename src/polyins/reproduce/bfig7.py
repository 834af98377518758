"""Paper B's Fig. 7: Dual Wheel-INS and its parts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from polyins.reproduce import subsystems

RUNS = {
    "Dual Wheel-INS": "dual-wheel-ins/left1/right4",
    "Left Wheel-INS": "wheel-ins/left1",
    "Right Wheel-INS": "wheel-ins/right4",
}
PAPER = {
    "Dual Wheel-INS": (0.56, 0.95),
    "Left Wheel-INS": (0.59, 1.93),
    "Right Wheel-INS": (1.00, 2.28),
}


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Run the chips of the figure, draw it into `out`, and return the `bfig7` document."""
    return subsystems.reproduce("bfig7", RUNS, PAPER, quick, progress, out)
