"""What the threads of the sources hand to the one that navigates."""

from __future__ import annotations

import threading

from polyins.navigate.samples import Sample

FULL = 200_000
"""samples; a source that brings more waits, and what a socket cannot hold then is lost and counted there"""


class Inbox:
    """Samples in the order of their arrival, of bounded number."""

    def __init__(self, sources: int) -> None:
        self.open = sources
        """sources that have not ended"""
        self.closed = False
        self.samples: list[Sample] = []
        self.changed = threading.Condition()

    def put(self, samples: list[Sample]) -> None:
        """Add samples, when there is room for them."""
        with self.changed:
            while len(self.samples) >= FULL and not self.closed:
                self.changed.wait()
            self.samples += samples
            self.changed.notify_all()

    def source_ended(self) -> None:
        """Say that one source brings no more."""
        with self.changed:
            self.open -= 1
            self.changed.notify_all()

    def close(self) -> None:
        """Let no source wait any more."""
        with self.changed:
            self.closed = True
            self.changed.notify_all()

    def take(self, timeout: float) -> list[Sample] | None:
        """Return all that is there, after waiting for at most `timeout`, s; None when nothing can come any more."""
        with self.changed:
            if not self.samples and self.open:
                self.changed.wait(timeout)
            if not self.samples and not self.open:
                return None
            samples, self.samples = self.samples, []
            self.changed.notify_all()
            return samples
