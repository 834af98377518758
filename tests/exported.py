"""A solution that is known in closed form, as it is exported."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from synthetic_solutions import Drive, drive, solution

from polyins.model.solution import Solution
from polyins.model.status import COASTING, TRACKING
from polyins.tools.export.writing import ExportOptions, export

BEGIN = datetime(2024, 5, 1, 12, 0, 0, tzinfo=UTC).timestamp()
FIRST_S = 1000.0
"""the first stamp of the solution"""
ALL = ExportOptions()


def known(duration: float = 10.0, **changes: object) -> tuple[Drive, Solution]:
    """Return a drive that begins on 2024-05-01 at 12:00 UTC, and it as a solution that coasts after 5 s."""
    truth = drive(duration=duration)
    status = np.where(truth.time > FIRST_S + 5.0, COASTING, TRACKING).astype(np.uint8)
    usual: dict[str, object] = {
        "utc_of_zero": BEGIN - FIRST_S,
        "status": status,
        "position_variance": np.tile([0.01, 0.04, 0.09], (truth.time.size, 1)),
        "velocity_variance": np.tile([1e-4, 4e-4, 9e-4], (truth.time.size, 1)),
        "phi_covariance": np.tile(np.radians([1.0, 0.0, 0.0, 2.0, 0.0, 3.0]) ** 2, (truth.time.size, 1)),
    }
    return truth, solution(truth, **(usual | changes))


def exported(folder: Path, to: str, options: ExportOptions = ALL, **changes: object) -> tuple[Path, Drive]:
    """Export the known drive; returns the file and the drive."""
    truth, made = known(**changes)
    path = folder / f"out.{to}"
    export(made, path, to, options)
    return path, truth
