"""What a program has to say of data and results beside its figures: findings, and the verdict that they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

Severity = Literal["note", "doubt", "serious"]
Level = Literal["trust", "doubt", "do-not-use"]

TRUST: Level = "trust"
DOUBT: Level = "doubt"
DO_NOT_USE: Level = "do-not-use"
LEVELS: tuple[Level, ...] = (TRUST, DOUBT, DO_NOT_USE)
"""from good to bad"""

SILENT = "silent"
"""kind of the finding that an IMU gave no data for a while, which the others bridged"""
LEFT_OUT = "left out"
"""kind of the finding that a run goes on without an IMU, for a while or throughout"""


@dataclass(frozen=True)
class Finding:
    """One thing that a user has to know."""

    kind: str
    """what it is, from a small set of words, see the reference"""
    text: str
    """the sentence; names stream, size and time"""
    severity: Severity = "note"
    """note: the standard deviations hold; doubt: one may be wrong by more than 3 times; serious: by more than 10"""
    stream: str = ""
    """the name of an IMU, GNSS, or a kind of measurement; empty: the run"""
    axis: str | None = None
    from_s: float | None = None
    """s, on the clock of the recording"""
    to_s: float | None = None
    size: float | str | None = None
    """how much it is, in the unit that the text has"""
    expected: float | str | None = None
    remedy: str = ""
    """what to do"""

    @property
    def sentence(self) -> str:
        """What it is and what to do."""
        return f"{self.text}; {self.remedy}" if self.remedy else self.text

    def document(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return asdict(self)


@dataclass(frozen=True)
class Verdict:
    """Whether a result can be built on."""

    findings: tuple[Finding, ...]

    @property
    def level(self) -> Level:
        """By the worst of the findings."""
        severities = {finding.severity for finding in self.findings}
        return DO_NOT_USE if "serious" in severities else DOUBT if "doubt" in severities else TRUST

    @property
    def warnings(self) -> list[str]:
        """All findings as sentences, but for IMUs that fell silent."""
        return [one.sentence for one in self.findings if one.kind != SILENT]

    @property
    def faults(self) -> list[str]:
        """IMUs that fell silent, as sentences."""
        return [one.sentence for one in self.findings if one.kind == SILENT]

    @property
    def reasons(self) -> list[str]:
        """The sentences of what is more than a note, the worst first."""
        worst = sorted(self.findings, key=lambda one: ("serious", "doubt", "note").index(one.severity))
        return [one.sentence for one in worst if one.severity != "note"]

    def document(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {"level": self.level, "findings": [finding.document() for finding in self.findings]}


def notes(texts: Sequence[str], kind: str = "data") -> tuple[Finding, ...]:
    """Return sentences as findings that leave the verdict as it is."""
    return tuple(Finding(kind, text) for text in texts)
