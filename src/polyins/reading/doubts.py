"""What the values of a table leave open."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Doubt:
    """Why to check how a table was taken."""

    text: str
    about: Literal["columns", "stamps", "units", "heights"]


def distinct(doubts: Iterable[Doubt | None]) -> tuple[Doubt, ...]:
    """Return the doubts that there are, each once."""
    return tuple(dict.fromkeys(doubt for doubt in doubts if doubt is not None))
