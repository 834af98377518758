"""Gaps in the data of all IMUs, with the receiver going on or silent too."""

from __future__ import annotations

from functools import partial

from polyins.model.recording import Recording
from polyins.studies.robustness.fault import Draw, Fault, during, with_fixes, with_rows

KINDS = ("gap", "pause", "restart", "silent")


def paused(recording: Recording, at: float, length: float) -> Recording:
    """Return the recording without the data of any IMU for a while, s."""
    for index, stream in enumerate(recording.imus):
        recording = with_rows(recording, index, (stream.time < at) | (stream.time >= at + length))
    return recording


def _gap(recording: Recording, draw: Draw, *, length: float, fixes: bool) -> Recording:
    recording = paused(recording, draw.at, length)
    if recording.gnss is not None and not fixes:
        recording = with_fixes(recording, ~during(recording, draw.at, length))
    return recording


def _fault(length: float, fixes: bool) -> Fault:
    also = "" if fixes else " and GNSS"
    return Fault(f"gap of {length:g} s in all IMUs{also}", "gap", partial(_gap, length=length, fixes=fixes), KINDS)


ARRAY = tuple(_fault(length, fixes) for length in (2.0, 10.0, 30.0, 60.0, 150.0) for fixes in (True, False))
LONG = tuple(_fault(600.0, fixes) for fixes in (True, False))
"""for a recording of their own, of a quarter of an hour"""
WHEELS = tuple(_fault(length, True) for length in (2.0, 10.0, 30.0, 60.0))
