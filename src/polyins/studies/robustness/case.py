"""Cases: a fault, drawn, in a recording that a seed draws, and the method that is to live with it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from polyins.model.recording import Recording
from polyins.simulation.run import record, true_run
from polyins.simulation.scenario import Scenario
from polyins.studies.robustness import gap_faults, gnss_faults, imu_faults, start_faults, wheel_faults
from polyins.studies.robustness.fault import DRAWN, Draw, Fault
from polyins.studies.scenario_files import scenarios

SCENARIOS = scenarios(__package__, "scenarios")
FUSED = ("enav-fusion", "nav-fusion", "imu-fusion")
RECEIVING = ("enav-fusion", "single")
ROLLING = ("triple-ins", "dual-wheel-ins", "body-wheel-ins", "triple-ins/centralized")
WITH_BODY = ("triple-ins", "body-wheel-ins", "triple-ins/centralized")

PARTS: tuple[tuple[str, tuple[Fault, ...], tuple[str, ...]], ...] = (
    ("four", imu_faults.ONE, FUSED),
    ("sixteen", imu_faults.ONE[8:18] + imu_faults.HALF, FUSED),
    ("fixes", gnss_faults.FAULTS, RECEIVING),
    ("fixes", gap_faults.ARRAY, FUSED),
    ("pause", gap_faults.LONG, FUSED),
    ("fixes", start_faults.FAULTS, RECEIVING),
    ("wheels", wheel_faults.ON_WHEELS, ROLLING),
    ("wheels", wheel_faults.ON_BODY, WITH_BODY),
    ("wheels", gap_faults.WHEELS, ROLLING),
)
"""which faults are put into which recording, and the methods that take turns"""
DRAWS = 7919
"""apart from the seeds of the recordings"""


@dataclass(frozen=True)
class Case:
    """One fault in one recording."""

    fault: Fault
    scenario: str
    method: str
    seed: int
    number: int
    """of the draw"""

    @property
    def name(self) -> str:
        """What it is, in words."""
        return f"{self.scenario}: {self.fault.name}"

    @property
    def blamed(self) -> str:
        """The name that a finding has to say, or nothing."""
        if self.fault.whose != DRAWN:
            return self.fault.whose
        return good(self.scenario, self.seed).rig.imus[self._draw().imu].name

    def recording(self) -> Recording:
        """Return the recording with the fault in it."""
        return self.fault.inject(self._without(), self._draw())

    def _without(self) -> Recording:
        if self.fault.scenario is None:
            return good(self.scenario, self.seed)
        return _recorded(self.fault.scenario(SCENARIOS[self.scenario], self._draw()), self.seed)

    def _draw(self) -> Draw:
        rng = np.random.default_rng([DRAWS, self.seed, self.number])
        known = good(self.scenario, self.seed)
        end = float(known.imus[0].time[-1])
        return Draw(rng, float(rng.uniform(0.3, 0.45) * end), int(rng.integers(len(known.imus))))


@cache
def good(scenario: str, seed: int) -> Recording:
    """Return the recording without a fault."""
    return _recorded(SCENARIOS[scenario], seed)


def _recorded(scenario: Scenario, seed: int) -> Recording:
    return record(true_run(scenario.model_copy(update={"seed": seed})), seed=seed).recording


def cases(seeds: tuple[int, ...]) -> list[Case]:
    """Return all cases; the seeds take turns, and the methods."""
    found: list[Case] = []
    for scenario, faults, methods in PARTS:
        for number, fault in enumerate(faults):
            seed = seeds[number % len(seeds)]
            method = methods[(number // len(seeds)) % len(methods)]
            found.append(Case(fault, scenario, method, seed, len(found)))
    return found
