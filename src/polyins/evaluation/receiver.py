"""What was wrong with a receiver of positions, and by how much: noise, jumps, a delay, stds that are too modest."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import Finding
from polyins.model.solution import Innovations

Array = NDArray[np.float64]

LEAST = 20
"""fixes from which noise and delay are told"""
MUCH_NOISE = 100.0
"""times the stated variance, from which it is doubted what the filter made of the first of them"""
SOON = 6
"""fixes in which noise is found"""
NOISY_SHARE = 0.02
LONGEST_BREAK = 5.0
"""s between two fixes of one jump, or two changes of the velocity that tell a delay"""
LEAST_DELAY, MOST_DELAY = 0.03, 3.0
"""s: beyond, the changes are those of something else"""
SURE = 5.0
"""standard deviations by which a delay is not zero"""
EXPLAINED = 0.04
"""share of the changes that a delay has to explain"""
TOO_MODEST = 0.1
"""of what is stated: innovations that are smaller"""


def of_receiver(kind: str, measured: Innovations) -> Iterator[Finding]:
    """Return the findings of a kind that measures positions."""
    yield from _jumps(kind, measured)
    if measured.time.size < LEAST:
        return
    yield from _noise(kind, measured)
    yield from _delay(kind, measured)
    yield from _modesty(kind, measured)


def _jumps(kind: str, measured: Innovations) -> Iterator[Finding]:
    """Say where fixes were off for a while, and by how much."""
    doubted = np.flatnonzero(~measured.accepted | measured.reset)
    if not doubted.size:
        return
    breaks = np.flatnonzero((np.diff(doubted) > 1) | (np.diff(measured.time[doubted]) > LONGEST_BREAK)) + 1
    groups = np.split(doubted, breaks)
    longest = max(groups, key=lambda rows: measured.time[rows[-1]] - measured.time[rows[0]])
    offset = np.median(measured.residual[longest], axis=0)
    begin, end = float(measured.time[longest[0]]), float(measured.time[longest[-1]])
    size, axis = float(np.linalg.norm(offset)), measured.axes[int(np.argmax(np.abs(offset)))]
    more = "" if len(groups) == 1 else f", the longest of {len(groups)} times"
    yield Finding(
        "jump",
        f"{kind}: off by {size:.3g} m from {begin:.2f} to {end:.2f} s, mostly {axis}{more}; those fixes weighed little",
        stream=kind,
        axis=axis,
        from_s=begin,
        to_s=end,
        size=size,
        expected=0.0,
    )


def _noise(kind: str, measured: Innovations) -> Iterator[Finding]:
    """Say that a receiver is noisier from fix to fix than it states."""
    assert measured.noise_ratio is not None
    noisy = np.flatnonzero(measured.noise_ratio > 1.0)
    if noisy.size < max(LEAST, NOISY_SHARE * measured.time.size):
        return
    ratio = float(np.sqrt(np.median(measured.noise_ratio[noisy])))
    begin, end = float(measured.time[noisy[0]]), float(measured.time[noisy[-1]])
    yield Finding(
        "noise",
        f"{kind}: {ratio:.1f} times as noisy from fix to fix as stated, in {noisy.size} of {measured.time.size} fixes"
        f" from {begin:.1f} to {end:.1f} s; that noise was used",
        "doubt" if ratio**2 > MUCH_NOISE and _believed(measured, int(noisy[0])) else "note",
        stream=kind,
        from_s=begin,
        to_s=end,
        size=ratio,
        expected=1.0,
        remedy="position_std_m takes the place of what the file says",
    )


def _believed(measured: Innovations, first: int) -> bool:
    """Whether fixes were believed, just before their noise was found, that were much worse than stated."""
    before = slice(max(0, first - SOON), first)
    scaled = measured.nis[before] / np.maximum(measured.rows[before], 1)
    return bool(np.any(scaled[measured.accepted[before]] > MUCH_NOISE))


def _modesty(kind: str, measured: Innovations) -> Iterator[Finding]:
    """Say that a receiver is much better from fix to fix than it states.

    The difference of two changes is the noise of three fixes, with six times the variance of one.
    """
    if measured.change is None or not measured.change.any():
        return  # no changes are noted without a gate
    near = np.flatnonzero((np.diff(measured.time)[1:] < LONGEST_BREAK) & (np.diff(measured.time)[:-1] < LONGEST_BREAK))
    if near.size < LEAST:
        return
    noise = np.diff(measured.change, axis=0)[near + 1] / np.sqrt(6.0)
    ratio = float(np.median(np.sqrt(np.mean((noise / measured.std[near + 2]) ** 2, axis=1))))
    if ratio < TOO_MODEST:
        text = f"{kind}: {1.0 / ratio:.0f} times less noisy from fix to fix than stated: its std is too large"
        yield Finding("too modest", text, stream=kind, size=ratio, expected=1.0)


def _delay(kind: str, measured: Innovations) -> Iterator[Finding]:
    """Say that positions are late: they then change as the vehicle did before, by the delay times its acceleration."""
    if measured.change is None or measured.gained is None:
        return
    steps = np.diff(measured.time)
    near = np.flatnonzero((steps < LONGEST_BREAK) & measured.accepted[1:]) + 1
    gained = measured.gained[near, :2].ravel()
    change = measured.change[near, :2].ravel()
    power = float(np.sum(gained**2))
    if near.size < LEAST or power <= 0.0:
        return
    delay = float(np.sum(gained * change) / power)
    left = float(np.mean((change - delay * gained) ** 2))
    std = float(np.sqrt(left / power))
    explained = 1.0 - left / max(float(np.mean(change**2)), 1e-30)
    if not max(LEAST_DELAY, SURE * std) <= abs(delay) <= MOST_DELAY or explained < EXPLAINED:
        return
    late = "late" if delay > 0.0 else "early"
    yield Finding(
        "delay",
        f"{kind}: about {abs(delay):.2f} s {late}, as its changes and those of the velocity tell",
        "doubt",
        stream=kind,
        size=delay,
        expected=0.0,
        remedy="gnss.time_offset: estimate finds how much; gnss.clock_offset_s shifts the stamps",
    )
