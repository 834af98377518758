"""The share done of a target that takes several steps of much the same length, in turn or at once."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Steps:
    """Counts steps; each reports its own share, from 0 to 1. Safe to use from several threads."""

    def __init__(self, progress: Callable[[float], None] | None, total: float) -> None:
        self._progress = progress
        self._total = total
        self._done = 0.0
        self._lock = threading.Lock()

    def next(self, weight: float = 1.0) -> Callable[[float], None]:
        """Begin the next step, as long as `weight` ordinary ones, and return what it is to report to."""
        before = 0.0

        def report(share: float) -> None:
            nonlocal before
            with self._lock:
                self._done += weight * (share - before)
                before = share
                if self._progress:
                    self._progress(self._done / self._total)

        return report
