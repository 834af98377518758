"""Clocks that do not agree: of IMUs, of fixes, and those that count other seconds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.checks.fix_scatter import FIXES
from polyins.config.yaml_document import Setting
from polyins.errors import ImplausibleError
from polyins.model.findings import Finding
from polyins.model.recording import Array
from polyins.prepare import timesync
from polyins.prepare.blocks import Blocks
from polyins.prepare.data_findings import of_data
from polyins.prepare.delays import (
    AS_GOOD,
    COURSE_LIKE,
    HARMFUL,
    LEAST_IMU_DELAY,
    LEAST_TURNS,
    SURE,
    Turns,
    lag,
    turns_of_course,
)

LEAP_S = {
    16.0: "GPS is ahead of UTC by that up to 2015",
    17.0: "GPS is ahead of UTC by that up to 2016",
    18.0: "GPS is ahead of UTC by that since 2017",
    19.0: "TAI is ahead of GPS by that",
    35.0: "TAI is ahead of UTC by that up to 2015",
    36.0: "TAI is ahead of UTC by that up to 2016",
    37.0: "TAI is ahead of UTC by that since 2017",
}
"""whole seconds between clocks"""
NEAR_S = 0.4
"""of whole seconds"""
LEAST_LEAP = 2.0
"""s: shorter delays are those of receivers"""
DELAY = "delay"


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Give all that data say before every run, with the offsets of clocks, and what a run does not look for."""
    recording = evidence.recording
    aligned = timesync.align(recording.imus, bridge=not recording.rig.has_wheels)
    try:
        found = of_data(recording, aligned, float(aligned.time[-1]))
    except ImplausibleError:
        accepting = replace(recording, accepted=(*recording.accepted, DELAY))
        found = of_data(accepting, aligned, float(aligned.time[-1]))
        found = tuple(replace(one, severity="serious") if one.kind == DELAY else one for one in found)
    if not recording.rig.has_wheels:
        blocks = Blocks.of(aligned)
        found = (*found, *_of_pair(evidence, blocks))
        late = next((one for one in found if one.kind == DELAY and one.stream == FIXES), None)
        leap = _leap(evidence, blocks, late)
        found = tuple(one for one in found if one is not late or leap is None) + (() if leap is None else (leap,))
    for one in found:
        yield _diagnosis(one, evidence)


def _of_pair(evidence: Evidence, blocks: Blocks) -> Iterator[Finding]:
    """Say by how much the second of two IMUs is late."""
    if len(evidence.recording.imus) != 2:
        return
    first, second = (np.ascontiguousarray(blocks.rates[:, :3, i].T) for i in (0, 1))
    told = lag(second, first, blocks.interval)
    if told is None or abs(told[0]) <= max(LEAST_IMU_DELAY, SURE * told[1]):
        return
    name, other = evidence.recording.rig.imus[1].name, evidence.recording.rig.imus[0].name
    late = "late" if told[0] > 0.0 else "early"
    yield Finding(
        DELAY,
        f"{name}: {abs(told[0]):.3g} s {late} against {other}, as its turns tell",
        "doubt" if abs(told[0]) > HARMFUL else "note",
        stream=name,
        size=told[0],
        expected=0.0,
        remedy=f"clock_offset_s: {-told[0]:.3g} corrects that",
    )


def _leap(evidence: Evidence, blocks: Blocks, late: Finding | None) -> Finding | None:
    """Return that fixes fit as well with the whole seconds between two clocks as with the delay that was found.

    Bends that come again fit many delays; of those the seconds that clocks differ by are the likeliest.
    """
    gnss = evidence.recording.gnss
    found = 0.0 if late is None else float(late.size or 0.0)
    if gnss is None or (abs(found) < LEAST_LEAP and late is not None):
        return None
    turns = turns_of_course(gnss, evidence.recording.geodetic)
    steps = np.diff(blocks.time, prepend=blocks.time[0] - blocks.interval)
    yaw = np.cumsum(blocks.middle[:, 2] * steps)
    known = _likeness(turns, blocks.time, yaw, found)
    likes = {size: _likeness(turns, blocks.time, yaw, size) for seconds in LEAP_S for size in (seconds, -seconds)}
    best = max(likes, key=lambda size: likes[size])
    if likes[best] < COURSE_LIKE or 1.0 - likes[best] > AS_GOOD * (1.0 - known):
        return None
    return Finding(DELAY, "", "serious", stream=FIXES, size=best, expected=0.0)


def _likeness(turns: Turns, time: Array, yaw: Array, delay: float) -> float:
    """Return the correlation of the turns of course and gyros at about that delay."""
    inside = (turns.begin - delay > time[0]) & (turns.end - delay < time[-1])
    if inside.sum() < LEAST_TURNS:
        return 0.0
    rows = np.flatnonzero(inside)
    some = turns.at(slice(int(rows[0]), int(rows[-1]) + 1))
    own = some.centred(some.turned)
    shifted = some.centred(some.by_gyros(time, yaw, delay + np.arange(-NEAR_S, NEAR_S + 0.05, 0.1)[:, None]))
    size = np.linalg.norm(shifted, axis=1) * np.linalg.norm(own)
    return float(np.max(shifted @ own / np.maximum(size, 1e-12)))


def _diagnosis(finding: Finding, evidence: Evidence) -> Diagnosis:
    """Return a finding with the offset that corrects it, if it is a delay that does harm."""
    if finding.kind != DELAY or finding.severity == "note" or not isinstance(finding.size, float):
        return Diagnosis(finding)
    if finding.stream == FIXES:
        finding = _leap_named(finding)
        assert evidence.config.gnss is not None
        assert isinstance(finding.size, float)
        right = round(evidence.config.gnss.clock_offset_s - finding.size, 3)
        return Diagnosis(finding, (Setting(("gnss", "clock_offset_s"), right),))
    own = next(one for one in evidence.imus if one.name == finding.stream)
    offset = own.entry.clock_offset_s - float(finding.size or 0.0)
    return Diagnosis(finding, (own.setting("clock_offset_s", value=round(offset, 4)),))


def _leap_named(finding: Finding) -> Finding:
    """Return the finding of late fixes with the seconds that two clocks differ by, if it is as much."""
    size = float(finding.size or 0.0)
    whole = next((seconds for seconds in LEAP_S if abs(abs(size) - seconds) < NEAR_S), None)
    if whole is None:
        return finding
    late = "late" if size > 0.0 else "early"
    signed = float(np.copysign(whole, size))
    return Finding(
        "leap seconds",
        f"{FIXES}: {abs(size):.1f} s {late}, as their course tells; {whole:.0f} s: {LEAP_S[whole]}",
        "serious",
        stream=FIXES,
        from_s=finding.from_s,
        to_s=finding.to_s,
        size=signed,
        expected=0.0,
        remedy=f"gnss.clock_offset_s: {-signed:.0f} corrects that",
    )
