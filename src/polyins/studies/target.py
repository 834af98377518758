"""What a row of the tables of targets says: a table or figure that can be printed again."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Document = dict[str, Any]


@dataclass(frozen=True)
class Target:
    """One table or figure."""

    name: str
    run: str
    """`module:function`, called with (quick, progress), and the folder for pictures where there are some"""
    published: str = ""
    """whose figures stand beside ours; none are published of our own tables"""
    datasets: tuple[str, ...] = ()
    """without which it cannot be had, or has stand-ins which the document names"""
    pictures: bool = False
    """whether it leaves pages whose names begin with its own"""
    seconds: tuple[float, float] = (5.0, 30.0)
    """about how long it takes on one core, quick and in full, for the bar and to begin with the longest"""
    alone: bool = False
    """it measures time: it runs when nothing else does"""
    print_tables: str = ""
    """`module:function` that prints its figures, where a row for each would be too many"""

    def reproduce(self, quick: bool, progress: Callable[[float], None], out: Path) -> Document:
        """Return its document, whose settings say whether it is the quick form; pictures are left in `out`."""
        function = named(self.run)
        document = function(quick, progress, out) if self.pictures else function(quick, progress)
        return {**document, "settings": {**document["settings"], "quick": quick}}

    def print(self, figures: Mapping[str, Any]) -> bool:
        """Print figures by a function of its own, if it has one; return whether it has."""
        if self.print_tables:
            named(self.print_tables)(figures)
        return bool(self.print_tables)


def named(place: str) -> Callable[..., Any]:
    """Return the function of a place `module:function`."""
    module, _, function = place.partition(":")
    found: Callable[..., Any] = getattr(importlib.import_module(module), function)
    return found
