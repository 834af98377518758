"""Which live source a URL names."""

from __future__ import annotations

from collections.abc import Callable
from urllib.parse import SplitResult, urlsplit

from polyins.errors import InputError
from polyins.live.source import Source, address


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
