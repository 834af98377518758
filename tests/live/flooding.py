"""Datagrams that have no business in a stream: malformed, duplicated, reordered, from the future, oversized."""

import random
from collections.abc import Iterator

KINDS = ("malformed", "duplicated", "reordered", "future", "oversized")


def flood(good: list[bytes], seed: int) -> Iterator[tuple[str, bytes]]:
    """Yield kind and datagram without end; `good` grows as the stream goes on, the newest last.

    Duplicates and reordered ones carry nothing that was not sent before; the reordered are at least three seconds late.
    """
    chance = random.Random(seed)
    while True:
        kind = chance.choice(KINDS)
        recent = good[chance.randrange(max(0, len(good) - 20), len(good))] if good else b""
        if kind == "malformed":
            yield kind, _damaged(recent, chance)
        elif kind == "oversized":
            yield kind, chance.choice([recent[:60] + b"9" * 600, chance.randbytes(8193)])
        elif kind == "duplicated" and good:
            yield kind, recent
        elif kind == "future" and good:
            yield kind, _restamped(recent, chance.choice([3.0, 60.0, 1e6, 1e9]))
        elif kind == "reordered" and good:
            yield kind, _restamped(recent, -chance.choice([3.001, 60.0013, 1e6]))


def _damaged(line: bytes, chance: random.Random) -> bytes:
    cut = line[: chance.randrange(0, max(1, len(line) - 30))]
    return chance.choice(
        [b"", cut, chance.randbytes(60).hex().encode(), line.replace(b",", b";"), line + b",1,2", b"polyins1,x,1"]
    )


def _restamped(line: bytes, by: float) -> bytes:
    fields = line.split(b",")
    stamp = 2 if fields[1] in (b"gnss", b"plane") else 3
    fields[stamp] = repr(float(fields[stamp]) + by).encode()
    return b",".join(fields)
