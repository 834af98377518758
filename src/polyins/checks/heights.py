"""Whether heights of fixes and of the reference count from one surface: the geoid is up to 107 m off the ellipsoid."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.checks.fix_scatter import FIXES
from polyins.config.yaml_document import Setting
from polyins.model.findings import Finding

LEAST_FIXES = 10
LEAST_M = 5.0
SPREAD = 0.3
"""of the difference, by which it may vary: heights in another unit, or a drift, vary more"""
GEOID_M = (-107.0, 86.0)


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say by how much heights of fixes are below those of the reference all along."""
    recording, entry = evidence.recording, evidence.config.gnss
    gnss, reference = recording.gnss, recording.reference
    if gnss is None or reference is None or entry is None or not recording.geodetic:
        return
    inside = (gnss.time > reference.time[0]) & (gnss.time < reference.time[-1])
    if inside.sum() < LEAST_FIXES:
        return
    # both describe points of their own, down from the array's origin
    lower = float(reference.lever_arm[2] - recording.rig.antenna[2])
    off = np.interp(gnss.time[inside], reference.time, reference.position[:, 2]) + lower - gnss.position[inside, 2]
    size, spread = float(np.median(off)), float(np.quantile(off, 0.9) - np.quantile(off, 0.1))
    if abs(size) < max(LEAST_M, spread / SPREAD):
        return
    geoid = (entry.geoid_height_m or 0.0) + size
    whole = GEOID_M[0] < geoid < GEOID_M[1] and entry.height != "as-given"
    yield Diagnosis(
        Finding(
            "height datum",
            f"GNSS position: its heights are {abs(size):.1f} m {'below' if size > 0.0 else 'above'} those of the "
            "reference all along: one counts from the sea, the other from the ellipsoid",
            "doubt",
            stream=FIXES,
            axis="height",
            size=size,
            expected=0.0,
            remedy=f"gnss.height: sea-level with geoid_height_m: {geoid:.1f}, or that of the reference",
        ),
        (
            (Setting(("gnss", "height"), "sea-level"), Setting(("gnss", "geoid_height_m"), round(geoid, 2)))
            if whole
            else ()
        ),
    )
