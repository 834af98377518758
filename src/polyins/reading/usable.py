"""Which IMUs a run can be made with: those that lie on the others' clock and are mounted as the others show."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from polyins.checks.stream_checks import off_upright
from polyins.config import ImuEntry
from polyins.config.yaml_document import Document
from polyins.errors import ImplausibleError
from polyins.model.findings import LEFT_OUT, Finding
from polyins.model.recording import ImuStream
from polyins.prepare import mounts
from polyins.prepare.timesync import LEAST_COMMON
from polyins.reading.imu_stream import as_mounted

Findings = tuple[Finding, ...]
NONE: Findings = ()


def upright(
    entries: Sequence[ImuEntry],
    places: Sequence[int],
    streams: Sequence[ImuStream],
    document: Document,
    accept: Collection[str] = (),
) -> tuple[list[int], Findings]:
    """Return the indices of those that stand upright, and findings of the others, which most of the array outvote.

    `places`: of the entries in the document; `accept`: what the user vouches for, all of them if "axes". Raises
    InputError, with axes that are right, where as many do not stand.
    """
    body = [i for i, entry in enumerate(entries) if entry.wheel is None and "axes" not in accept]
    fallen: dict[int, str] = {}
    for i in body:
        place = document.place(["imus", places[i], "axes"])
        why = off_upright(place, entries[i].axes, streams[i])
        fallen |= {i: why} if why else {}
    if fallen and 2 * len(fallen) >= len(body):
        raise ImplausibleError("axes", next(iter(fallen.values())))
    others = [streams[i] for i in body if i not in fallen]
    found: list[Finding] = []
    for i, why in fallen.items():
        named = mounts.of_streams(as_mounted(entries[i]), streams[i], others)
        found += [replace(named, severity="note")] if named else []
        text = f"{why}; the run goes on without it"
        span = float(streams[i].time[0]), float(streams[i].time[-1])
        found.append(Finding(LEFT_OUT, text, stream=entries[i].name, from_s=span[0], to_s=span[1]))
    return [i for i in range(len(entries)) if i not in fallen], tuple(found)


def overlapping(entries: Sequence[ImuEntry], spans: Sequence[tuple[float, float]]) -> tuple[list[int], Findings]:
    """Return the indices of the IMUs that measure while another one does, and findings of the others.

    `spans`: s. All are returned where no two do, and on wheels, where none stands in for another.
    """
    if any(entry.wheel for entry in entries):
        return list(range(len(entries))), ()
    begins, ends = np.array(spans).T
    together = np.minimum.outer(ends, ends) - np.maximum.outer(begins, begins)
    np.fill_diagonal(together, -np.inf)
    kept = np.flatnonzero(together.max(axis=1) >= LEAST_COMMON)
    if len(kept) < 2:
        return list(range(len(entries))), ()
    return kept.tolist(), tuple(_apart(entries[i].name, *spans[i]) for i in range(len(entries)) if i not in kept)


def _apart(name: str, begin: float, end: float) -> Finding:
    return Finding(
        LEFT_OUT,
        f"IMU {name}: its stamps, {begin:.3f} to {end:.3f} s, lie apart from the others'; the run goes on without it",
        stream=name,
        from_s=begin,
        to_s=end,
        remedy="clock_offset_s shifts a clock",
    )
