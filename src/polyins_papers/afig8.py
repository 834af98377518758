"""Paper A, Fig. 8: the position error of eNav-Fusion of Group 1 over time, through its outages.

It is the scenario of `a3`, uncompensated.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from polyins.evaluation.errors import Errors, compare_to_reference
from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.simulation.run import true_run
from polyins.studies import rigid_array
from polyins.studies.pictures import lines, write_figure

SEED = 1
"""Group 1's in Table III"""
POINTS = 6000
"""of a curve, at most"""


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Return the rms errors inside and outside the outages; `quick` takes the first eleven at 20 Hz."""
    scenario = rigid_array.base_scenario(quick)
    chips = rigid_array.group_chips(1, scenario.imus.count)
    run = rigid_array.with_errors(true_run(scenario), scenario.errors.model_copy(update={"chips": chips}))
    recording = rigid_array.recording_of(run, SEED)
    assert recording.reference is not None
    errors = compare_to_reference(batch.run(recording, "enav-fusion", progress=progress), recording.reference)
    if out is not None:
        write_figure(error_figure(errors), out / "afig8-errors.html")
    return {
        "target": "afig8",
        "paper": {},
        "polyins": parts(errors, recording),
        "settings": {
            "track": rigid_array.provenance(),
            "outages": len(recording.outages),
            "scenario": scenario.model_dump(mode="json", exclude=rigid_array.ELSEWHERE),
        },
    }


def parts(errors: Errors, recording: Recording) -> dict[str, dict[str, float]]:
    """Return rms and largest horizontal error, m, while fixes come and in the outages."""
    inside = np.zeros(len(errors.time), dtype=bool)
    for begin, end in recording.outages:
        # until the first fix has come
        inside |= (errors.time >= begin) & (errors.time <= end + 1.0)
    return {
        name: {"rms_m": rigid_array.rms(errors.horizontal[part]), "largest_m": float(errors.horizontal[part].max())}
        for name, part in {"in outages": inside, "with fixes": ~inside}.items()
    }


def error_figure(errors: Errors) -> Any:
    """Return the picture of the position error over time."""
    every = slice(None, None, max(len(errors.time) // POINTS, 1))
    time = errors.time[every].tolist()
    axes = zip(("north", "east", "down"), errors.position[every].T, strict=True)
    return lines({name: (time, values.tolist()) for name, values in axes}, "time (s)", "error (m)", markers=False)
