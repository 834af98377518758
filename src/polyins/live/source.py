"""Where epochs come from: what every source does, and which one a URL names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Protocol
from urllib.parse import SplitResult, urlsplit

from polyins.errors import InputError
from polyins.live.events import Epoch

POLL = 0.2
"""s after which a source that waits for data looks whether it should stop"""
LOOPBACK = "127.0.0.1"


class Source(Protocol):
    """Epochs as they come; runs in a thread of its own."""

    url: str
    counts: Counter[str]
    """what was refused, by kind"""

    def chunks(self) -> Iterator[list[Epoch]]:
        """Yield what has come; ends with the data, or soon after `stop`."""
        ...

    def stop(self) -> None:
        """Make `chunks` end; called from another thread."""
        ...


def open_source(url: str, imus: tuple[str, ...]) -> Source:
    """Open a live source; `imus` are the names in the configuration. Raises InputError if that cannot be."""
    parts = urlsplit("stdin:" if url == "-" else url)
    if parts.scheme not in _OPENERS:
        known = ", ".join(["replay:", "-", *(f"{scheme}://" for scheme in _OPENERS if scheme != "stdin")])
        raise InputError(f"--source {url}: unknown; expected one of {known}")
    try:
        return _OPENERS[parts.scheme](url, parts, imus)
    except InputError:
        raise
    except (OSError, OverflowError, ValueError) as error:
        raise InputError(f"--source {url}: cannot be opened ({error})") from error


def address(url: str, parts: SplitResult, usual_port: int | None = None) -> tuple[str, int]:
    """Return host, the loopback address unless one is given, and port of a URL."""
    port = usual_port if parts.port is None else parts.port
    if port is None:
        raise InputError(f"{url}: has no port; expected {parts.scheme}://HOST:PORT")
    return parts.hostname or LOOPBACK, port


def _udp(url: str, parts: SplitResult, imus: tuple[str, ...]) -> Source:
    from polyins.live.datagrams import Datagrams, lines_of

    return Datagrams(url, address(url, parts), lines_of)


def _mavlink(url: str, parts: SplitResult, imus: tuple[str, ...]) -> Source:
    from polyins.live.datagrams import Datagrams
    from polyins.live.mavlink import MavlinkReader

    return Datagrams(url, address(url, parts, 14550), MavlinkReader(imus))


def _tcp(url: str, parts: SplitResult, imus: tuple[str, ...]) -> Source:
    from polyins.live.streams import LineStream, TcpLink

    return LineStream(url, TcpLink(address(url, parts)))


def _serial(url: str, parts: SplitResult, imus: tuple[str, ...]) -> Source:
    from polyins.live.streams import LineStream, SerialLink

    return LineStream(url, SerialLink(url, parts), checked=True)


def _stdin(url: str, parts: SplitResult, imus: tuple[str, ...]) -> Source:
    from polyins.live.streams import LineStream, StdinLink

    return LineStream(url, StdinLink())


def _gpsd(url: str, parts: SplitResult, imus: tuple[str, ...]) -> Source:
    from polyins.live import gpsd
    from polyins.live.streams import LineStream, TcpLink

    return LineStream(url, TcpLink(address(url, parts, gpsd.PORT), gpsd.WATCH), gpsd.parse, gpsd.LONGEST)


_OPENERS: dict[str, Callable[[str, SplitResult, tuple[str, ...]], Source]] = {
    "udp": _udp,
    "tcp": _tcp,
    "serial": _serial,
    "stdin": _stdin,
    "gpsd": _gpsd,
    "mavlink": _mavlink,
}
