"""The lines of a configuration, each with what it assumes."""

from __future__ import annotations

from dataclasses import dataclass, replace

from polyins.model.findings import Finding

CHECK = "# CHECK:"
TURNED = Finding("mount", "", "doubt", remedy="give axes in a configuration (polyins init writes one)")
"""of what would turn the heading if it were wrong"""
DATUM_UNKNOWN = Finding("height datum", "", axis="height", remedy="say height and geoid_height_m in a configuration")
"""of heights that count from a surface that nothing tells"""
UNIT_GUESSED = Finding(
    "units", "", "doubt", remedy="give columns with unit and scale in a configuration (polyins init writes one)"
)
"""of values whose unit is told by their size"""


@dataclass(frozen=True)
class Assumption:
    """What nothing tells, and was taken to be so."""

    sentence: str
    finding: Finding | None = None
    """the doubt that a result has with it"""


@dataclass(frozen=True)
class Line:
    """A line of YAML, and why to check it, if it is guessed or unknown."""

    yaml: str
    why: str = ""
    doubt: Finding | None = None
    """what it makes a result doubtful by, without the text"""

    def __str__(self) -> str:
        return "  ".join(part for part in (self.yaml, f"{CHECK} {self.why}" if self.why else "") if part)

    @property
    def assumption(self) -> Assumption | None:
        """What it assumes."""
        if not self.why:
            return None
        value = self.yaml.strip()
        sentence = f"assumed {value} ({self.why})" if value else self.why
        return Assumption(sentence, replace(self.doubt, text=sentence) if self.doubt else None)
