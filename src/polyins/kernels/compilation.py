"""Compilation of kernels seen and told: it happens once, and takes long."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from polyins.screen import say


@contextmanager
def watched(begins: Callable[[], None] | None = None) -> Iterator[Callable[[], float]]:
    """Give a function that returns for how many seconds kernels were compiled inside the block so far.

    `begins` is called when the first compilation begins. What is loaded from the cache does not count.
    """
    from numba.core import event

    class Listener(event.Listener):
        depth, since, total = 0, 0.0, 0.0

        def on_start(self, event: Any) -> None:
            if not self.depth:
                if begins and not self.total:
                    begins()
                self.since = time.perf_counter()
            self.depth += 1

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            if not self.depth:
                self.total += time.perf_counter() - self.since

    listener = Listener()
    with event.install_listener("numba:compile", listener):
        yield lambda: listener.total


@contextmanager
def compilation_said() -> Iterator[None]:
    """Say when kernels are compiled inside the block, which happens once after installing, and how long it took."""

    def begins() -> None:
        say(
            "polyins: compiling the kernels, about half a minute, once; later runs load them "
            "(polyins warmup compiles them all beforehand)"
        )

    with watched(begins) as seconds:
        try:
            yield
        finally:
            if seconds():
                say(f"polyins: compiled for {seconds():.1f} s")
