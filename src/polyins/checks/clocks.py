"""Clocks that do not agree: of IMUs, of fixes, and those that count other seconds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.config.yaml_document import Setting
from polyins.errors import ImplausibleError
from polyins.model.findings import Finding
from polyins.prepare import timesync
from polyins.prepare.blocks import Blocks
from polyins.prepare.data_findings import of_data
from polyins.prepare.delays import (
    FARTHEST_FIXES,
    HARMFUL,
    LEAST_IMU_DELAY,
    LEAST_TURNS,
    SURE,
    best_delay,
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
FIXES, DELAY = "GNSS position", "delay"


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
        if not any(one.kind == DELAY and one.stream == FIXES for one in found):
            found = (*found, *_leap(evidence, blocks))
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


def _leap(evidence: Evidence, blocks: Blocks) -> Iterator[Finding]:
    """Say whether fixes fit with whole seconds added that are farther off than delays are looked for."""
    gnss = evidence.recording.gnss
    if gnss is None:
        return
    turns = turns_of_course(gnss, evidence.recording.geodetic)
    steps = np.diff(blocks.time, prepend=blocks.time[0] - blocks.interval)
    yaw = np.cumsum(blocks.middle[:, 2] * steps)
    for seconds in LEAP_S:
        if seconds < FARTHEST_FIXES:
            continue
        for size in (seconds, -seconds):
            moved = replace(turns, begin=turns.begin - size, end=turns.end - size)
            inside = (moved.begin > blocks.time[0]) & (moved.end < blocks.time[-1])
            if inside.sum() < LEAST_TURNS:
                continue
            rows = np.flatnonzero(inside)
            told = best_delay(blocks.time, yaw, moved.at(slice(int(rows[0]), int(rows[-1]) + 1)))
            if told is not None and abs(told[0]) < NEAR_S:
                yield Finding(DELAY, "", "serious", stream=FIXES, size=size + told[0], expected=0.0)
                return


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
