"""The same IMU twice."""

from __future__ import annotations

from collections.abc import Iterator

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.checks.faults import are_copies
from polyins.model.findings import Finding


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say which IMUs show the samples of one before them, and leave them out."""
    left_out: set[int] = set()
    for k, one in enumerate(evidence.imus):
        for other in evidence.imus[k + 1 :]:
            if other.index in left_out or not are_copies(one.stream, other.stream):
                continue
            left_out.add(other.index)
            yield Diagnosis(
                Finding(
                    "twice",
                    f"IMU {one.name} and IMU {other.name}: their samples are identical",
                    "serious",
                    stream=other.name,
                    remedy=f"name the file of the second sensor, or leave IMU {other.name} out",
                ),
                (other.setting(value=None),),
            )
