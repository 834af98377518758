"""A stream in the midst of junk gives, to the bit, the states of the stream alone; what is junk is counted."""

from collections import Counter
from collections.abc import Iterator
from functools import partial
from itertools import islice
from pathlib import Path

import flooding
import pytest

from polyins.live.conversion import Conversion
from polyins.live.datagrams import Datagrams, lines_of
from polyins.live.session import Session
from polyins.live.sinks import Outlet
from polyins.live.snapshot import Snapshot
from polyins.live.source import RefusedError
from polyins.navigate.starter import Starter
from polyins.reading import loading

JUNK = 20
"""datagrams for each good one"""
DELAY = 0.5
SECONDS = 20.0


class Kept:
    def __init__(self) -> None:
        self.rows: list[dict[str, float | None]] = []

    def take(self, snapshot: Snapshot) -> None:
        self.rows.append(snapshot.row)

    def close(self) -> None:
        pass


def with_junk(datagrams: list[bytes]) -> Iterator[tuple[str, bytes]]:
    sent: list[bytes] = []
    junk = flooding.flood(sent, seed=3)
    for datagram in datagrams:
        yield from islice(junk, JUNK)
        sent.append(datagram)
        yield "good", datagram


def navigated(config: Path, datagrams: list[tuple[str, bytes]], samples: int) -> tuple[list[object], Counter[str]]:
    """Take datagrams, the good ones at the time that their number says, and return the states and what was refused."""
    from polyins.navigate.navigator import Navigator

    settings = loading.read_config(config)
    blank, _ = loading.without_data(settings.config, settings.document)
    conversion = Conversion(settings.config, blank.geodetic)
    source, kept = Datagrams("udp://127.0.0.1:0", ("127.0.0.1", 0), lines_of), Kept()
    begin = partial(Navigator, blank.rig, method="enav-fusion", options=blank.options, delay=DELAY)
    session = Session(Starter(blank, DELAY, needs_fix=True), begin, [Outlet(kept, 50.0)])
    good = 0
    for kind, datagram in datagrams:
        good += kind == "good"
        for sample in source.taken([datagram], good / samples * SECONDS):
            try:
                session.take(conversion.taken(sample))
            except RefusedError as error:
                source.counts[str(error)] += 1
    for sample in source.stamps.release(SECONDS):
        session.take(sample)
    session.finish()
    source.socket.close()
    return kept.rows, session.refused() + source.counts


@pytest.fixture(scope="module")
def stream(datagrams: list[bytes]) -> list[bytes]:
    return datagrams[: int(len(datagrams) * SECONDS / 50.0)]


def test_good_data_are_unaffected_and_junk_is_counted(no_files: Path, stream: list[bytes]) -> None:
    alone, nothing = navigated(no_files, [("good", datagram) for datagram in stream], len(stream))
    mixed = list(with_junk(stream))
    flooded, refused = navigated(no_files, mixed, len(stream))
    assert len(alone) > 500
    assert flooded == alone
    sent = Counter(kind for kind, _ in mixed)
    assert refused["future-stamped"] == sent["future"]
    assert refused["malformed"] + refused["oversized"] == sent["malformed"] + sent["oversized"]
    assert refused["oversized"] >= sent["oversized"]
    assert refused.total() - nothing.total() == sent.total() - sent["good"]
