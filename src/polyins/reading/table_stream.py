"""A stream of a table, and how the table is read as it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from polyins.config import ImuColumns, TrackColumns
from polyins.formats.rows import ImuRows, Track
from polyins.reading.doubts import Doubt


@dataclass(frozen=True)
class TableStream:
    """One stream of a table, how it is read, and what to check."""

    rows: ImuRows | Track
    columns: ImuColumns | TrackColumns | None = None
    """None: those that polyins writes"""
    taken: str = ""
    """as what it was taken"""
    doubts: tuple[Doubt, ...] = ()

    @property
    def guesses(self) -> tuple[str, ...]:
        """What was taken for granted, as sentences."""
        texts = (self.taken, *(doubt.text for doubt in self.doubts))
        return tuple(f"{self.rows.source.path}: {text}" for text in texts if text)


def stream_name(streams: Sequence[TableStream], index: int) -> str:
    """Return how a stream of a table is called: imu1, imu2, ... or positions."""
    if isinstance(streams[index].rows, Track):
        return "positions"
    return f"imu{1 + sum(isinstance(one.rows, ImuRows) for one in streams[:index])}"
