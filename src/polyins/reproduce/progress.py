"""The share done of a target that takes several steps of much the same length."""

from __future__ import annotations

from collections.abc import Callable


class Steps:
    """Counts steps; each reports its own share, from 0 to 1."""

    def __init__(self, progress: Callable[[float], None] | None, total: int) -> None:
        self._progress = progress
        self._total = total
        self._begun = 0

    def next(self) -> Callable[[float], None]:
        """Begin the next step and return what it is to report to."""
        before, self._begun = self._begun, self._begun + 1

        def report(share: float) -> None:
            if self._progress:
                self._progress((before + share) / self._total)

        return report
