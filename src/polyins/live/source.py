"""Where samples come from: what every source does, and which one a URL names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Protocol
from urllib.parse import SplitResult

from polyins.errors import InputError
from polyins.navigate.samples import Sample

POLL = 0.2
"""s after which a source that waits for data looks whether it should stop"""
LOOPBACK = "127.0.0.1"


class RefusedError(Exception):
    """A sample that cannot be used; the message is the kind under which it is counted."""


class Source(Protocol):
    """Samples as they come; runs in a thread of its own."""

    url: str
    counts: Counter[str]
    """what was refused, by kind"""

    def chunks(self) -> Iterator[list[Sample]]:
        """Yield what has come; ends with the data, or soon after `stop`."""
        ...

    def stop(self) -> None:
        """Make `chunks` end; called from another thread."""
        ...


def address(url: str, parts: SplitResult, usual_port: int | None = None) -> tuple[str, int]:
    """Return host, the loopback address unless one is given, and port of a URL."""
    port = usual_port if parts.port is None else parts.port
    if port is None:
        raise InputError(f"{url}: has no port; expected {parts.scheme}://HOST:PORT")
    return parts.hostname or LOOPBACK, port
