"""Paper B's Fig. 8: Body/Wheel-INS and its parts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from polyins.reproduce import subsystems

RUNS = {
    "Body/Wheel-INS": "body-wheel-ins/left2/body2",
    "Left Wheel-INS": "wheel-ins/left2",
    "Body-INS": "body-ins/left2/body2",
}
PAPER = {
    "Body/Wheel-INS": (0.72, 1.20),
    "Left Wheel-INS": (1.34, 3.82),
}


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Run the chips of the figure, draw it into `out`, and return the `bfig8` document."""
    return subsystems.reproduce("bfig8", RUNS, PAPER, quick, progress, out)
