"""NMEA 0183: what sentences that are read and those that are written have in common."""

from __future__ import annotations

from functools import reduce
from operator import xor

KNOT = 1852.0 / 3600.0
"""m/s"""


def checksum(body: bytes) -> int:
    """Return the exclusive or of all bytes."""
    return reduce(xor, body, 0)
