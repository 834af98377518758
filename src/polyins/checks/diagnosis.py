"""What a check makes: a finding, and what puts it right."""

from __future__ import annotations

from dataclasses import dataclass

from polyins.config.yaml_document import Setting
from polyins.model.findings import Finding


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong, and the settings of a configuration in which it is right."""

    finding: Finding
    settings: tuple[Setting, ...] = ()
    """none: no configuration can put it right"""
