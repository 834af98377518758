"""Gyros and accelerometers at the end of their range, with the full scale that leaves such rows out."""

from __future__ import annotations

from collections.abc import Iterator

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.checks.faults import clipped


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say which axes stay at their largest value."""
    for one in evidence.imus:
        known = (one.entry.gyro_range_deg_s or one.rows.gyro_range_deg_s) is not None
        for finding in clipped(one.rows, one.name, one.entry.clock_offset_s, gyro=not known):
            of_gyro = str(finding.axis).startswith("gyro") and isinstance(finding.size, float)
            yield Diagnosis(finding, (one.setting("gyro_range_deg_s", value=finding.size),) if of_gyro else ())
