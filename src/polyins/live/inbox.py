"""What the threads of the sources hand to the one that navigates."""

from __future__ import annotations

import threading

from polyins.live.events import Epoch

FULL = 200_000
"""epochs; a source that brings more waits, and what a socket cannot hold then is lost and counted there"""


class Inbox:
    """Epochs in the order of their arrival, of bounded number."""

    def __init__(self, sources: int) -> None:
        self.open = sources
        """sources that have not ended"""
        self.closed = False
        self.epochs: list[Epoch] = []
        self.changed = threading.Condition()

    def put(self, epochs: list[Epoch]) -> None:
        """Add epochs, when there is room for them."""
        with self.changed:
            while len(self.epochs) >= FULL and not self.closed:
                self.changed.wait()
            self.epochs += epochs
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

    def take(self, timeout: float) -> list[Epoch] | None:
        """Return all that is there, after waiting for at most `timeout`, s; None when nothing can come any more."""
        with self.changed:
            if not self.epochs and self.open:
                self.changed.wait(timeout)
            if not self.epochs and not self.open:
                return None
            epochs, self.epochs = self.epochs, []
            self.changed.notify_all()
            return epochs
