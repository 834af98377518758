"""Gyros and accelerometers at the end of their range, with the full scale that leaves such rows out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.checks.faults import SAME, clipped
from polyins.config.yaml_document import Setting
from polyins.formats.rows import intervals
from polyins.model.rig import DEG

MOST = 0.5
"""of the rows that may be left out: with more the sensor does not suit"""


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say which axes stay at their largest value; the range of the gyro is the lowest of those of its axes."""
    for one in evidence.imus:
        known = (one.entry.gyro_range_deg_s or one.rows.gyro_range_deg_s) is not None
        found = clipped(one.rows, one.name, one.entry.clock_offset_s, gyro=not known)
        ends = [float(each.size or 0.0) for each in found if str(each.axis).startswith("gyro")]
        settings: tuple[Setting, ...] = ()
        if ends and _share(one, min(ends)) < MOST:
            settings = (one.setting("gyro_range_deg_s", value=min(ends)),)
        for number, finding in enumerate(found):
            yield Diagnosis(finding, settings if number == 0 else ())


def _share(one: ImuEvidence, limit: float) -> float:
    """Return the share of rows that reach a limit, deg/s."""
    rates = np.abs(one.rows.dtheta / intervals(one.rows.time)[:, None]).max(axis=1)
    return float(np.mean(rates >= (1.0 - SAME) * limit * DEG))
