"""Which wheels slipped when, and which turn all the time as if their radius were another."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import Finding
from polyins.model.solution import Innovations
from polyins.navigate.slip import UNEXPLAINED, USED_AGAIN

Array = NDArray[np.float64]

WITHHELD = "no wheel speed was used"
UNTOLD = "which is right cannot be told, and their mean was used"

MOST = 20
"""slips of a wheel that are named one by one; of more the longest are"""
LASTING_S = 20.0
"""s, from which a share that stays the same is that of a radius"""
STEADY = 0.25
"""of the mean share: by so much it varies at most, rms"""


def of_wheels(kind: str, measured: Innovations) -> Iterator[Finding]:
    """Return the findings of a kind that measures the speed of wheels."""
    if measured.slip is None or not measured.slip[:, 0].any():
        return
    found, names = measured.slip[:, 0].astype(np.int64), measured.wheels
    slips = np.array([found >> i & 1 != 0 for i in range(len(names))])
    together = np.asarray(slips.all(axis=0) & (len(names) > 1))
    for i, name in enumerate(names):
        yield from _slips(name, measured, slips[i] & ~together, f"{name}: turned", _unused(names))
    yield from _slips(kind, measured, together, "all wheels: turned", WITHHELD)
    differ = (found >> UNEXPLAINED & 1 != 0) & ~slips.any(axis=0)
    yield from _slips(kind, measured, differ, f"{', '.join(names)}: differ", UNTOLD)


def _unused(names: tuple[str, ...]) -> str:
    return "the speed of the others was used" if len(names) > 1 else WITHHELD


def _slips(stream: str, measured: Innovations, where: NDArray[np.bool_], who: str, outcome: str) -> Iterator[Finding]:
    """Return a finding for each time at which that was found; one speed between does not end it."""
    rows = np.flatnonzero(where)
    episodes = np.split(rows, np.flatnonzero(np.diff(rows) > 2) + 1) if rows.size else []
    for episode in sorted(sorted(episodes, key=len)[-MOST:], key=lambda one: int(one[0])):
        more = f", one of {len(episodes)} times" if len(episodes) > MOST else ""
        yield _slip(stream, measured, episode, who, outcome + more)


def _slip(stream: str, measured: Innovations, rows: NDArray[np.intp], who: str, outcome: str) -> Finding:
    assert measured.slip is not None
    bits, off, expected = measured.slip[rows].T
    begin = float(measured.time[rows[0]]) - float(np.median(np.diff(measured.time)))
    end, worst, untold = float(measured.time[rows[-1]]), int(np.argmax(np.abs(off))), outcome.startswith(UNTOLD)
    share = float(np.sum(off) / np.sum(expected)) if np.sum(expected) else 0.0
    steady = float(np.std(off - share * expected)) < STEADY * abs(float(np.mean(off)))
    lasting = end - begin > LASTING_S and steady
    again = (bits.astype(np.int64) >> USED_AGAIN != 0).any()
    way = "" if untold else " too fast," if off[worst] * expected[worst] > 0.0 else " too slowly,"
    remedy = f"{outcome}, then all that there was" if again else outcome
    if lasting:
        direction = "off" if untold else "too small" if share > 0.0 else "too large"
        remedy += f"; as if a radius were {100.0 * abs(share):.1f} % {direction}: measure it"
    return Finding(
        "wheel" if lasting else "slip",
        f"{who}{way} by {abs(off[worst]):.2f} m/s of {abs(expected[worst]):.2f} m/s, from {begin:.2f} to {end:.2f} s",
        "doubt" if again or (untold and end - begin > LASTING_S) else "note",
        stream=stream,
        from_s=begin,
        to_s=end,
        size=float(off[worst]),
        expected=float(expected[worst]),
        remedy=remedy,
    )
