"""What only a trial run tells: the lever arm of the antenna, and whether fixes are as good as they state.

An innovation of a fix changes by J when the antenna is taken elsewhere; runs with it a bit forward, right and down give
J, and the arm that makes the innovations least is the likeliest: their likelihood is that of the fixes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.config.yaml_document import Setting
from polyins.errors import InputError
from polyins.model.findings import Finding
from polyins.model.recording import Array, Recording

LONGEST_S = 150.0
"""of a recording, that tell"""
LEAST_FIXES = 30
STEP_M = 0.2
STEPS = 3
PARTS = 8
"""of the fixes, which are compared"""
LARGE = 3.0
"""standard deviations, from which an innovation counts by its size, not by its square"""
LEAST_M = 0.25
SURE = 6.0
UNSURE_M = 0.3
"""std, from which a component of the arm is not told"""
BETTER = 0.9
"""times the squares of the innovations with the arm as stated, that those with another one have at most"""
NOISY = 3.0
"""times what a receiver states"""
FIXES = "GNSS position"


@dataclass(frozen=True)
class _Arm:
    """An estimated lever arm."""

    value: Array
    std: Array
    better: float
    """squares of the innovations with it, over those with the arm as stated"""


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say what trial runs tell of a receiver; of a rig with wheels nothing."""
    recording = evidence.recording
    if recording.gnss is None or recording.rig.has_wheels or evidence.config.gnss is None:
        return
    recording = _short(recording)
    try:
        yield from _noise(recording)
        arm = lever_arm(recording)
    except InputError:
        return
    if arm is not None:
        yield from _told(recording.rig.antenna, arm)


def _short(recording: Recording) -> Recording:
    begin = recording.start.time or float(min(one.time[0] for one in recording.imus))
    end = begin + LONGEST_S
    if recording.start.end_time is not None:
        end = min(end, recording.start.end_time)
    return replace(recording, start=replace(recording.start, end_time=end), outages=())


def lever_arm(recording: Recording) -> _Arm | None:
    """Return the likeliest lever arm, forward, right, down, m, or None where too few fixes tell."""
    stated = recording.rig.antenna
    arm, first, best = stated.copy(), np.inf, np.inf
    design: Array | None = None
    std = np.full(3, np.inf)
    for _ in range(STEPS):
        left = _innovations(recording, arm)
        if len(left) < 3 * LEAST_FIXES:
            return None
        if design is None:
            moved = [_innovations(recording, arm + STEP_M * axis) for axis in np.eye(3)]
            if any(len(one) != len(left) for one in moved):
                return None
            design = np.column_stack([(one - left) / STEP_M for one in moved])
        if len(left) != len(design):
            return None
        cost = _cost(left)
        first = cost if first == np.inf else first
        if cost >= best:
            break
        best, value = cost, arm.copy()
        weight = np.minimum(1.0, LARGE / np.maximum(np.abs(left), 1e-9))
        normal = design.T @ (weight[:, None] * design) + 1e-9 * np.eye(3)
        step = np.linalg.solve(normal, design.T @ (weight * left))
        std = _std(design, weight, left - design @ step)
        if np.linalg.norm(np.where(std < UNSURE_M, step, 0.0)) < LEAST_M:
            break
        arm = arm - step
    return _Arm(value, std, best / first)


def _std(design: Array, weight: Array, left: Array) -> Array:
    """Return how far the arm that parts of the fixes tell differs from that of all, (3,), by leaving out each in turn.

    Innovations hang together for longer than one fix, so that their number says too much.
    """
    parts = [np.einsum("mi,m,mj->ij", d, w, d) for d, w in zip(_parts(design), _parts(weight), strict=True)]
    sides = [d.T @ (w * one) for d, w, one in zip(_parts(design), _parts(weight), _parts(left), strict=True)]
    whole, floor = sum(parts), 1e-9 * np.eye(3)
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


def _innovations(recording: Recording, arm: Array) -> Array:
    """Return the innovations of all fixes with the antenna there, over their std, (3 M,)."""
    from polyins.navigate.batch import run

    measured = run(replace(recording, rig=replace(recording.rig, antenna=arm)).without_gate(), "single").innovations
    with np.errstate(divide="ignore", invalid="ignore"):
        left = (measured.residual / measured.std).ravel()
    return np.asarray(np.where(np.isfinite(left), left, 0.0))


def _told(stated: Array, arm: _Arm) -> Iterator[Diagnosis]:
    known = arm.std < UNSURE_M
    off = np.where(known, arm.value - stated, 0.0)
    if np.linalg.norm(off) < LEAST_M or arm.better > BETTER or not np.any(np.abs(off) > SURE * arm.std):
        return
    right = [round(float(value), 2) for value in stated + off]
    reverse = np.linalg.norm((arm.value + stated)[known]) < 0.5 * np.linalg.norm(off)
    said, shown = (", ".join(f"{value:.2f}" for value in one) for one in (stated, right))
    yield Diagnosis(
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

    measured = run(recording, "single").innovations
    if measured.noise_ratio is None or len(measured.time) < LEAST_FIXES or recording.gnss is None:
        return
    ratio = float(np.sqrt(np.median(measured.noise_ratio)))
    if ratio < NOISY:
        return
    std = np.median(recording.gnss.position_std, axis=0) * ratio
    right = [float(f"{value:.2g}") for value in std]
    yield Diagnosis(
        Finding(
            "noise",
            f"{FIXES}: {ratio:.1f} times as noisy from fix to fix as stated",
            "doubt",
            stream=FIXES,
            size=ratio,
            expected=1.0,
            remedy=f"gnss.position_std_m: [{', '.join(f'{value:g}' for value in right)}]",
        ),
        (Setting(("gnss", "position_std_m"), right),),
    )
