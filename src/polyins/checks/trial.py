"""What only a trial run tells: the lever arm and the clock of a receiver, and whether fixes are as good as they state.

Innovations change by J when the antenna is taken elsewhere, or the fixes earlier; runs with it a bit forward, right and
down, and with other stamps, give J, and what makes the innovations least is the likeliest: their likelihood is that of
the fixes. Arm and clock are estimated together, for on a straight drive one looks like the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.checks.fix_scatter import FIXES, NOISY, noisier
from polyins.config.yaml_document import Setting
from polyins.errors import InputError
from polyins.model.findings import Finding
from polyins.model.recording import Array, FilterOptions, Recording

LONGEST_S = 150.0
"""of a recording, that tell"""
LEAST_FIXES = 30
STEP = np.array([0.2, 0.2, 0.2, 0.02])
"""m forward, right, down; s"""
LATE = 3
"""place of the delay"""
STEPS = 3
PARTS = 8
"""of the fixes, which are compared"""
LARGE = 3.0
"""standard deviations, from which an innovation counts by its size, not by its square"""
LEAST = np.array([0.25, 0.25, 0.25, 0.06])
"""m, s: less is not said"""
SURE = 6.0
UNSURE = np.array([0.3, 0.3, 0.3, 0.1])
"""std, m, s, from which a component is not told"""
BETTER = 0.9
"""times the squares of the innovations with the arm as stated, that those with another one have at most"""


@dataclass(frozen=True)
class _Likeliest:
    """How the receiver is mounted and how late it is: forward, right, down, m, and s."""

    value: Array
    std: Array
    better: float
    """squares of the innovations with it, over those with what is stated"""

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which components are told."""
        return self.std < UNSURE


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say what trial runs tell of a receiver; of a rig with wheels nothing."""
    recording, gnss = evidence.recording, evidence.config.gnss
    if recording.gnss is None or recording.rig.has_wheels or gnss is None:
        return
    recording = _short(recording)
    try:
        yield from _noise(recording)
        found = likeliest(recording)
    except InputError:
        return
    if found is None or found.better > BETTER:
        return
    stated = np.append(recording.rig.antenna, 0.0)
    off = np.where(found.known, found.value - stated, 0.0)
    sure = np.abs(off) > SURE * found.std
    if abs(off[LATE]) > LEAST[LATE] and sure[LATE]:
        yield _late(float(off[LATE]), gnss.clock_offset_s)
    elif np.linalg.norm(off[:LATE]) > LEAST[0] and sure[:LATE].any():
        yield _elsewhere(stated[:LATE], off[:LATE])


def _short(recording: Recording) -> Recording:
    begin = recording.start.time or float(min(one.time[0] for one in recording.imus))
    end = begin + LONGEST_S
    if recording.start.end_time is not None:
        end = min(end, recording.start.end_time)
    return replace(recording, start=replace(recording.start, end_time=end), outages=())


def likeliest(recording: Recording) -> _Likeliest | None:
    """Return the likeliest lever arm and delay, or None where too few fixes tell."""
    now = np.append(recording.rig.antenna, 0.0)
    first = best = np.inf
    value, std = now.copy(), np.full(4, np.inf)
    design: Array | None = None
    for _ in range(STEPS):
        left = _innovations(recording, now)
        if len(left) < 3 * LEAST_FIXES:
            return None
        if design is None:
            moved = [_innovations(recording, now + step) for step in np.diag(STEP)]
            if any(len(one) != len(left) for one in moved):
                return None
            design = np.column_stack([(one - left) / step for one, step in zip(moved, STEP, strict=True)])
        if len(left) != len(design):
            break
        cost = _cost(left)
        first = cost if first == np.inf else first
        if cost >= best:
            break
        best, value = cost, now.copy()
        weight = np.minimum(1.0, LARGE / np.maximum(np.abs(left), 1e-9))
        normal = design.T @ (weight[:, None] * design) + 1e-9 * np.eye(4)
        step = np.linalg.solve(normal, design.T @ (weight * left))
        std = _std(design, weight, left - design @ step)
        if np.all(np.abs(np.where(std < UNSURE, step, 0.0)) < 0.5 * LEAST):
            break
        now = now - step
    return _Likeliest(value, std, best / first)


def _std(design: Array, weight: Array, left: Array) -> Array:
    """Return how far what parts of the fixes tell differs from what all tell, (4,), by leaving out each in turn.

    Innovations hang together for longer than one fix, so that their number says too much.
    """
    parts = [np.einsum("mi,m,mj->ij", d, w, d) for d, w in zip(_parts(design), _parts(weight), strict=True)]
    sides = [d.T @ (w * one) for d, w, one in zip(_parts(design), _parts(weight), _parts(left), strict=True)]
    whole, floor = sum(parts), 1e-9 * np.eye(4)
    moved = np.array([np.linalg.solve(whole - a + floor, -b) for a, b in zip(parts, sides, strict=True)])
    jackknife = (PARTS - 1) / PARTS * np.sum((moved - moved.mean(axis=0)) ** 2, axis=0)
    scale = max(1.0, float(np.mean(weight * left**2)))
    return np.asarray(np.sqrt(np.maximum(jackknife, scale * np.diag(np.linalg.inv(whole + floor)))))


def _parts(rows: Array) -> list[Array]:
    """Return parts of what has three rows for each fix."""
    return [np.concatenate(list(part)) for part in np.array_split(rows.reshape(-1, 3, *rows.shape[1:]), PARTS)]


def _cost(left: Array) -> float:
    size = np.abs(left)
    return float(np.sum(np.where(size < LARGE, size**2, 2.0 * LARGE * size - LARGE**2)))


def _innovations(recording: Recording, at: Array) -> Array:
    """Return the innovations of all fixes with that arm and delay, over their std, (3 M,)."""
    from polyins.navigate.batch import run

    assert recording.gnss is not None
    rig, gnss = replace(recording.rig, antenna=at[:LATE]), replace(recording.gnss, time=recording.gnss.time - at[LATE])
    measured = run(replace(recording, rig=rig, gnss=gnss).without_gate(), "single").innovations
    with np.errstate(divide="ignore", invalid="ignore"):
        left = (measured.residual / measured.std).ravel()
    return np.asarray(np.where(np.isfinite(left), left, 0.0))


def _late(late: float, offset: float) -> Diagnosis:
    word = "late" if late > 0.0 else "early"
    right = round(offset - late, 3)
    return Diagnosis(
        Finding(
            "delay",
            f"{FIXES}: {abs(late):.3g} s {word}, as trial runs tell",
            "doubt",
            stream=FIXES,
            size=late,
            expected=0.0,
            remedy=f"gnss.clock_offset_s: {right:g} corrects that",
        ),
        (Setting(("gnss", "clock_offset_s"), right),),
    )


def _elsewhere(stated: Array, off: Array) -> Diagnosis:
    right = [round(float(value), 2) for value in stated + off]
    reverse = np.linalg.norm(stated + off + stated) < 0.5 * np.linalg.norm(off)
    said, shown = (", ".join(f"{value:.2f}" for value in one) for one in (stated, right))
    return Diagnosis(
        Finding(
            "lever arm",
            f"{FIXES}: the antenna is at [{said}] m, trial runs fit best with [{shown}]"
            + (": the sign is wrong" if reverse else ""),
            "doubt",
            stream=FIXES,
            axis="sign" if reverse else "size",
            size=float(np.linalg.norm(off)),
            expected=0.0,
            remedy=f"gnss.antenna_position_m: [{shown}], forward, right, down",
        ),
        (Setting(("gnss", "antenna_position_m"), right),),
    )


def _noise(recording: Recording) -> Iterator[Diagnosis]:
    """Say that fixes scatter by more than they state."""
    from polyins.navigate.batch import run

    # a receiver is judged only where fixes are gated, which configurations of KF-GINS do not say
    gated = replace(recording, options=replace(recording.options, gate_limit=FilterOptions.gate_limit))
    measured = run(gated, "single").innovations
    if measured.noise_ratio is None or len(measured.time) < LEAST_FIXES or recording.gnss is None:
        return
    ratio = float(np.sqrt(np.median(measured.noise_ratio)))
    if ratio < NOISY:
        return
    yield noisier(ratio, np.median(recording.gnss.position_std, axis=0) * ratio)
