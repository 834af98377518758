"""The start of a run: one search for batch, long recordings and live, for arrays and for rigs with wheels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from polyins.model.recording import Recording
from polyins.prepare import alignment, course
from polyins.prepare.alignment import Start
from polyins.prepare.timesync import Aligned

Run = Callable[[Recording], course.Track]
"""navigates a recording from heading zero; returns the dead-reckoned track"""


def find(recording: Recording, aligned: Aligned, run: Run) -> Start:
    """Find the start of a recording whose IMUs are on one time base; raise InputError where nothing gives it.

    A vehicle whose wheels measure how it moves finds its heading by its own dead reckoning, which `run` does.
    """
    if not recording.rig.has_wheels or not course.is_wanted(recording):
        return alignment.find_start(recording, aligned)
    if recording.start.goes_on:
        # under way the heading is that at the very start
        ahead = replace(recording, start=replace(recording.start, heading=0.0, heading_from="value"))
        begins = alignment.find_start(ahead, aligned)
        if begins.sources["time"] == alignment.ROLLING:
            recording = replace(recording, start=replace(recording.start, time=begins.time))
    begin = alignment.find_start(course.blind(recording), aligned).time
    found = course.find(recording, begin, run)
    known = replace(recording.start, heading=found.heading, heading_from="value")
    start = alignment.find_start(replace(recording, start=known), aligned)
    std = start.attitude_std
    if recording.start.attitude_std is None:
        std = np.array([std[0], std[1], found.std])
    return replace(start, attitude_std=std, sources={**start.sources, "heading": found.source})


def same(one: Start | None, other: Start) -> bool:
    """Whether further data have not changed a start."""
    return one is not None and all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("time", "position", "velocity", "attitude", "position_std", "attitude_std", "imu_errors")
    )
