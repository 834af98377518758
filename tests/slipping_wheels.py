"""The small car of `driven_vehicle`, whose wheels slip when and as much as a test says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from driven_vehicle import driven

from polyins.model.recording import Recording
from polyins.simulation.path import smooth_steps
from polyins.simulation.rolling import roll
from polyins.simulation.run import TrueRun, record, true_run
from polyins.simulation.scenario import SensorErrors
from polyins.simulation.wheels import wheel_increments

RISE = 0.02
"""s from rolling to slipping"""

Slips = Mapping[str, Sequence[tuple[float, float, float]]]
"""of a wheel: from when, s; for how long, s; by which share it turns more than it rolls"""


@lru_cache(maxsize=1)
def rolling() -> TrueRun:
    """The car on wheels that roll."""
    return true_run(driven(errors=SensorErrors()))


def slipping(slips: Slips, seed: int = 1) -> Recording:
    """Its recording with those slips, the first named first."""
    run = rolling()
    wheels, spinning = list(run.wheels), list(run.spinning)
    for i, module in enumerate(run.scenario.wheels):
        knots = [(0.0, 0.0)]
        for begin, length, share in slips.get(module.name, ()):
            knots += [(begin - RISE, 0.0), (begin, share), (begin + length, share), (begin + length + RISE, 0.0)]
        knots.append((run.path.duration, 0.0))
        slip = smooth_steps(*np.array(knots).T)
        wheels[i] = roll(run.path, module.position_m, module.radius_m, phase=1.0 + i, slip=slip)
        spinning[i] = wheel_increments(wheels[i], run.scenario.rate_hz)
    return record(replace(run, wheels=tuple(wheels), spinning=tuple(spinning)), seed=seed).recording
