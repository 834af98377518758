"""Whether positions scatter about their own velocities by more than they state: no filter is needed to see that.

From one fix to the next a position changes by the mean of both velocities times the time, up to how the acceleration
changes, which is small over half a second, and by the noise of both.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.config.yaml_document import Setting
from polyins.model.findings import Finding
from polyins.model.geodesy import displacement

Array = NDArray[np.float64]

LONGEST_S = 0.5
LEAST_FIXES = 40
NOISY = 3.0
"""times what is stated"""
MEDIAN_TO_STD = 1.4826
FIXES = "GNSS position"


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say by how much fixes scatter more than they state."""
    gnss = evidence.recording.gnss
    if gnss is None or gnss.velocity is None or gnss.velocity_std is None or len(gnss.time) < LEAST_FIXES:
        return
    steps = np.diff(gnss.time)[:, None]
    moved = np.diff(displacement(gnss.position, gnss.position[0], evidence.recording.geodetic), axis=0)
    off = moved - 0.5 * steps * (gnss.velocity[1:] + gnss.velocity[:-1])
    near = steps[:, 0] < LONGEST_S
    if near.sum() < LEAST_FIXES:
        return
    size = MEDIAN_TO_STD * np.median(np.abs(off[near]), axis=0)
    of_velocity = np.median(steps[near] * gnss.velocity_std[1:][near], axis=0)
    std = np.sqrt(np.maximum(0.5 * (size**2 - 0.5 * of_velocity**2), 0.0))
    ratio = float(np.max(std / np.median(gnss.position_std, axis=0)))
    if ratio < NOISY:
        return
    yield noisier(ratio, np.maximum(std, np.median(gnss.position_std, axis=0)), ", beside its velocities")


def noisier(ratio: float, std: Array, by: str = "") -> Diagnosis:
    """Return the diagnosis that fixes are noisier than stated; `std`: what they have, m, shape (3,), `by`: by what."""
    right = [float(f"{value:.2g}") for value in std]
    return Diagnosis(
        Finding(
            "noise",
            f"{FIXES}: {ratio:.1f} times as noisy from fix to fix as stated{by}",
            "doubt",
            stream=FIXES,
            size=ratio,
            expected=1.0,
            remedy=f"gnss.position_std_m: [{', '.join(f'{value:g}' for value in right)}]",
        ),
        (Setting(("gnss", "position_std_m"), right),),
    )
