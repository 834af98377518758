"""Paper B's Fig. 9: Triple INS and its parts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from polyins.reproduce import subsystems

RUNS = {
    "Triple INS": "triple-ins/left1/right2/body4",
    "Left Wheel-INS": "wheel-ins/left1",
    "Right Wheel-INS": "wheel-ins/right2",
    "Body-INS": "body-ins/left1/body4",
}
PAPER = {
    "Triple INS": (0.73, 1.50),
    "Left Wheel-INS": (0.59, 1.93),
    "Right Wheel-INS": (1.19, 2.52),
}


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Run the chips of the figure, draw it into `out`, and return the `bfig9` document."""
    return subsystems.reproduce("bfig9", RUNS, PAPER, quick, progress, out)
