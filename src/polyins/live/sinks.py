"""Where states go: lines of JSON, NMEA over TCP or UDP, a Parquet log."""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from math import floor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import SplitResult, parse_qs, urlsplit

import numpy as np

from polyins.errors import InputError
from polyins.files import whole
from polyins.formats.solution_files import arrow_columns, status_to_arrow
from polyins.live import nmea
from polyins.live.snapshot import Snapshot, columns
from polyins.live.source import address
from polyins.version import __version__

if TYPE_CHECKING:
    from pyarrow.parquet import ParquetWriter

BLOCK = 4096
"""rows that the log keeps before it writes them"""


ROUNDING = 1e-6
"""of an interval between two states, which stamps are exact to"""


class Sink(Protocol):
    """Takes a snapshot at a time."""

    def take(self, snapshot: Snapshot) -> None:
        """Pass a snapshot on."""
        ...

    def close(self) -> None:
        """Finish; called once."""
        ...


class Outlet:
    """A sink and when it is next due."""

    def __init__(self, sink: Sink, rate_hz: float) -> None:
        self.sink = sink
        self.rate_hz = rate_hz
        self.due = float("-inf")
        """s, of the state"""

    def offer(self, snapshot: Snapshot) -> None:
        """Pass the snapshot on, if it is due."""
        time = snapshot.state.time
        if time >= self.due:
            self.sink.take(snapshot)
            self.due = (floor(time * self.rate_hz + ROUNDING) + 1.0 - ROUNDING) / self.rate_hz


class JsonLines:
    """One JSON document per line on standard output."""

    def __init__(self) -> None:
        self.read = True

    def take(self, snapshot: Snapshot) -> None:
        """Print the state; raises BrokenPipeError, once, when nobody reads any more."""
        if not self.read:
            return
        try:
            sys.stdout.write(json.dumps(snapshot.row, allow_nan=False) + "\n")
            sys.stdout.flush()
        except BrokenPipeError:
            self.read = False
            # what is still buffered would be written at exit, and fail again
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise

    def close(self) -> None:
        """Nothing is left to do."""


class NmeaDatagrams:
    """Sentences to one address, a state to a datagram."""

    def __init__(self, target: tuple[str, int], geoid_height: float | None) -> None:
        self.target = target
        self.geoid_height = geoid_height
        self.socket = socket.socket(socket.AF_INET6 if ":" in target[0] else socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)

    def take(self, snapshot: Snapshot) -> None:
        """Send the sentences; that nobody listens is no error."""
        text = "".join(nmea.sentences(snapshot.row, self.geoid_height))
        try:
            self.socket.sendto(text.encode(), self.target)
        except OSError:
            return

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()


class NmeaServer:
    """Sentences to all who connect; who does not keep up is disconnected."""

    def __init__(self, at: tuple[str, int], geoid_height: float | None) -> None:
        self.geoid_height = geoid_height
        family = socket.AF_INET6 if ":" in at[0] else socket.AF_INET
        self.server = socket.create_server(at, family=family)
        self.clients: list[socket.socket] = []
        threading.Thread(target=self._accept, name="nmea", daemon=True).start()

    def take(self, snapshot: Snapshot) -> None:
        """Send the sentences to all."""
        data = "".join(nmea.sentences(snapshot.row, self.geoid_height)).encode()
        for client in tuple(self.clients):
            try:
                if client.send(data) == len(data):
                    continue
            except OSError:
                pass
            self.clients.remove(client)
            client.close()

    def close(self) -> None:
        """Disconnect all."""
        with suppress(OSError):
            self.server.shutdown(socket.SHUT_RDWR)  # wakes the thread that accepts
        for one in (self.server, *self.clients):
            one.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self.server.accept()
            except OSError:
                return
            client.setblocking(False)
            self.clients.append(client)


class ParquetLog:
    """States in a file with the columns of `solution.parquet`; whole when it is closed, absent until then."""

    def __init__(self, path: Path, metadata: dict[str, object]) -> None:
        self.path = path
        self.metadata = metadata
        self.pending: list[Snapshot] = []
        self.stack = ExitStack()
        self.writer: ParquetWriter | None = None

    def take(self, snapshot: Snapshot) -> None:
        """Add a row."""
        self.pending.append(snapshot)
        if len(self.pending) >= BLOCK:
            self._write()

    def close(self) -> None:
        """Write what is left and give the file its name; without a row there is no file."""
        if self.pending:
            self._write()
        self.stack.close()

    def _write(self) -> None:
        import pyarrow as pa

        first = self.pending[0]
        values = columns([snapshot.state for snapshot in self.pending], first.origin, first.geodetic)
        arrays = arrow_columns(values)
        arrays["status"] = status_to_arrow(np.array([snapshot.status for snapshot in self.pending]))
        arrays["dead_reckoning"] = pa.array([snapshot.dead_reckoning for snapshot in self.pending])
        table = pa.table(arrays)
        if self.writer is None:
            self.writer = self._opened(table.schema, first)
        self.writer.write_table(table)
        self.pending = []

    def _opened(self, schema: Any, first: Snapshot) -> ParquetWriter:
        from pyarrow.parquet import ParquetWriter

        metadata = {"polyins": __version__, "origin": first.origin.tolist(), "point": [0.0, 0.0, 0.0], **self.metadata}
        beside = self.stack.enter_context(whole(self.path))
        schema = schema.with_metadata({b"polyins": json.dumps(metadata)})
        return self.stack.enter_context(ParquetWriter(beside, schema, compression="zstd", use_dictionary=False))


def open_sink(url: str, rate_hz: float, geodetic: bool, geoid_height: float | None) -> Outlet:
    """Open the sink that a URL names; raises InputError if that cannot be. `rate_hz` holds unless the URL says one."""
    parts = urlsplit(url)
    given = parse_qs(parts.query)
    if parts.scheme not in _OPENERS or set(given) - {"rate"}:
        raise InputError(f"--sink {url}: unknown; expected ndjson:, nmea+tcp://HOST:PORT or nmea+udp://HOST:PORT")
    if parts.scheme != "ndjson" and not geodetic:
        raise InputError(f"--sink {url}: positions are on a plane; NMEA tells latitude and longitude only")
    try:
        rate = float(given["rate"][0]) if given else rate_hz
        if not 0.0 < rate <= 10e3:
            raise ValueError(f"rate is {rate:g}; expected above 0")
        return Outlet(_OPENERS[parts.scheme](url, parts, geoid_height), rate)
    except InputError:
        raise
    except (OSError, OverflowError, ValueError) as error:
        raise InputError(f"--sink {url}: {error}") from error


_OPENERS: dict[str, Callable[[str, SplitResult, float | None], Sink]] = {
    "ndjson": lambda url, parts, geoid: JsonLines(),
    "nmea+tcp": lambda url, parts, geoid: NmeaServer(address(url, parts, 10110), geoid),
    "nmea+udp": lambda url, parts, geoid: NmeaDatagrams(address(url, parts, 10110), geoid),
}
