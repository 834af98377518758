"""Whether a run finds a start: what it needs besides good data."""

from __future__ import annotations

from collections.abc import Iterator

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.errors import InputError
from polyins.model.findings import Finding


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say why the usual method finds none."""
    from polyins.navigate.batch import find_start
    from polyins.navigate.choice import usual_method

    try:
        find_start(evidence.recording, usual_method(evidence.recording.rig))
    except InputError as refusal:
        yield Diagnosis(Finding("start", str(refusal), "serious", remedy="give start.heading_deg, or what it asks for"))
