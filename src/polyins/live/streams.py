"""Streams of lines: TCP, a serial port, standard input."""

from __future__ import annotations

import os
import select
import socket
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, Protocol
from urllib.parse import SplitResult, parse_qs

from polyins.errors import InputError
from polyins.live import lines
from polyins.live.source import POLL, RefusedError
from polyins.live.stamp_check import StampCheck
from polyins.navigate.samples import Sample
from polyins.screen import say

AT_ONCE = 65536  # bytes
AGAIN = 1.0  # s, between two attempts to connect
USUAL_BAUD = 115200


class Link(Protocol):
    """Where bytes come from."""

    ends: bool
    """whether an end is the end of the data; otherwise it is tried again"""

    def open(self) -> None:
        """Connect; raises OSError."""
        ...

    def read(self) -> bytes | None:
        """Return what has come, nothing if nothing did for a while, None at the end; raises OSError."""
        ...

    def close(self) -> None:
        """Disconnect."""
        ...


class TcpLink:
    """A connection to a server, which is greeted."""

    ends = False

    def __init__(self, address: tuple[str, int], greeting: bytes = b"") -> None:
        self.address = address
        self.greeting = greeting
        self.socket: socket.socket | None = None

    def open(self) -> None:
        """Connect; raises OSError."""
        self.socket = socket.create_connection(self.address, timeout=AGAIN)
        self.socket.sendall(self.greeting)
        self.socket.settimeout(POLL)

    def read(self) -> bytes | None:
        """Return what has come, as `Link` says."""
        assert self.socket is not None
        try:
            return self.socket.recv(AT_ONCE) or None
        except TimeoutError:
            return b""

    def close(self) -> None:
        """Disconnect."""
        if self.socket is not None:
            self.socket.close()


class SerialLink:
    """A serial port, by pyserial."""

    ends = False

    def __init__(self, url: str, parts: SplitResult) -> None:
        try:
            import serial
        except ImportError:
            raise InputError(f"--source {url}: needs pyserial; expected pip install 'polyins[serial]'") from None
        given = parse_qs(parts.query)
        if set(given) - {"baud"} or not parts.path:
            raise InputError(f"--source {url}: expected serial:///dev/NAME?baud={USUAL_BAUD}")
        baud = int(given.get("baud", [str(USUAL_BAUD)])[0])
        self.port: Any = serial.Serial(None, baud, timeout=POLL)
        self.port.port = parts.path

    def open(self) -> None:
        """Open the port; raises OSError."""
        self.port.open()

    def read(self) -> bytes | None:
        """Return what has come, as `Link` says."""
        return bytes(self.port.read(max(1, self.port.in_waiting)))

    def close(self) -> None:
        """Close the port."""
        self.port.close()


class StdinLink:
    """Standard input."""

    ends = True

    def open(self) -> None:
        """Nothing is to be done."""

    def read(self) -> bytes | None:
        """Return what has come, as `Link` says."""
        ready, _, _ = select.select([sys.stdin.fileno()], [], [], POLL)
        return (os.read(sys.stdin.fileno(), AT_ONCE) or None) if ready else b""

    def close(self) -> None:
        """Leave it open: it is not ours."""


class LineStream:
    """What the lines of a stream say; a lost connection is made again."""

    def __init__(
        self,
        url: str,
        link: Link,
        parse: Callable[[bytes], Sample | None] = lines.parse,
        longest: int = lines.LONGEST,
        checked: bool = False,
    ) -> None:
        self.url = url
        self.link = link
        self.parse = parse
        self.longest = longest
        self.counts: Counter[str] = Counter()
        self.stamps = StampCheck(self.counts) if checked else None
        self.stopped = False
        self.rest = b""

    def chunks(self) -> Iterator[list[Sample]]:
        """Yield what has come, as `Source` says."""
        said = ""
        while not self.stopped:
            try:
                self.link.open()
                said = ""
                yield from self._until_the_end()
                reason = "the other side ended the connection"
            except OSError as error:
                reason = str(error)
            finally:
                self.link.close()
            if self.link.ends or self.stopped:
                break
            if reason != said:
                say(f"{self.url}: {reason}; trying again every {AGAIN:g} s")
            said = reason
            self.counts["connections lost"] += 1
            self._wait()
        if self.stamps is not None:
            yield self.stamps.release(time.monotonic())

    def stop(self) -> None:
        """Let `chunks` end."""
        self.stopped = True

    def _wait(self) -> None:
        until = time.monotonic() + AGAIN
        while not self.stopped and time.monotonic() < until:
            time.sleep(POLL)

    def _until_the_end(self) -> Iterator[list[Sample]]:
        self.rest = b""
        while not self.stopped:
            data = self.link.read()
            if data is None:
                yield self.taken(b"\n" if self.rest else b"")
                return
            yield self.taken(data)

    def taken(self, data: bytes) -> list[Sample]:
        """Return what the lines say that end in `data`; the beginning of the next one is kept."""
        *whole, self.rest = (self.rest + data).split(b"\n")
        if len(self.rest) > self.longest:
            # of a line without an end, only that it is too long matters
            self.rest = self.rest[: self.longest + 1]
        samples = [sample for line in whole if line.strip() and (sample := self._parsed(line)) is not None]
        return samples if self.stamps is None else self.stamps.admit(samples, time.monotonic())

    def _parsed(self, line: bytes) -> Sample | None:
        try:
            return self.parse(line)
        except RefusedError as error:
            self.counts[str(error)] += 1
            return None
