"""Datagrams over UDP, refused by kind where they are not what they should be."""

from __future__ import annotations

import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator

from polyins.live import lines
from polyins.live.receive import Receiver
from polyins.live.source import POLL, RefusedError
from polyins.live.stamp_check import StampCheck
from polyins.navigate.samples import Sample

LONGEST = 8192
"""bytes of a datagram"""
BUFFER = 16 * 1024 * 1024
"""bytes that the system is asked to keep while the program is busy"""

Parser = Callable[[bytes, Counter[str]], list[Sample]]


def lines_of(datagram: bytes, counts: Counter[str]) -> list[Sample]:
    """Return the samples of a datagram of lines; what is refused is counted by kind."""
    samples = []
    for line in datagram.splitlines():
        try:
            samples.append(lines.parse(line))
        except RefusedError as error:
            counts[str(error)] += 1
    return samples


class Datagrams:
    """A bound socket and what its datagrams say."""

    def __init__(self, url: str, address: tuple[str, int], parse: Parser) -> None:
        self.url = url
        self.counts: Counter[str] = Counter()
        self.parse = parse
        self.stamps = StampCheck(self.counts)
        self.stopped = False
        self.socket = socket.socket(socket.AF_INET6 if ":" in address[0] else socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(address)
        self.receiver = Receiver(self.socket, LONGEST, BUFFER, POLL)

    def chunks(self) -> Iterator[list[Sample]]:
        """Yield what has come, as `Source` says."""
        with self.socket:
            while not self.stopped:
                datagrams = self.receiver.receive()
                if self.receiver.lost:
                    self.counts["lost before they were read"] = self.receiver.lost
                yield self.taken(datagrams, time.monotonic())
            yield self.stamps.release(time.monotonic())

    def stop(self) -> None:
        """Let `chunks` end."""
        self.stopped = True

    def taken(self, datagrams: list[bytes], now: float) -> list[Sample]:
        """Return what datagrams say that arrived at `now`, s, on a steady clock."""
        samples = []
        for datagram in datagrams:
            if len(datagram) > LONGEST:
                self.counts["oversized"] += 1
            elif not datagram.strip():
                self.counts["malformed"] += 1
            else:
                samples += self.parse(datagram, self.counts)
        return self.stamps.admit(samples, now)
