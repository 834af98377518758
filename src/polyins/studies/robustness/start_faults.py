"""What makes a start harder, or wrong."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from polyins.model.recording import Recording, StartOptions
from polyins.model.rig import DEG
from polyins.simulation.scenario import Scenario
from polyins.studies.robustness.fault import Draw, Fault, fixes, moved, unchanged, with_fixes, with_rows

KINDS = ("start", "jump", "reset", "rejected", "coverage", "late begin")
WORDS = ("start", "heading", "fix", "standstill")


def _jump(recording: Recording, draw: Draw, *, sizes: tuple[float, float]) -> Recording:
    return moved(recording, fixes(recording).time < 40.0, draw.between(*sizes) * draw.direction())


def _under_way(recording: Recording, draw: Draw) -> Recording:
    """Begin while it drives: all that lies before is lost."""
    for index, stream in enumerate(recording.imus):
        recording = with_rows(recording, index, stream.time >= draw.at)
    recording = with_fixes(recording, fixes(recording).time >= draw.at)
    return replace(recording, start=StartOptions())


def _late_fixes(recording: Recording, draw: Draw) -> Recording:
    return with_fixes(recording, fixes(recording).time >= draw.at)


def _turned(recording: Recording, draw: Draw) -> Recording:
    """Give a heading that is wrong."""
    heading = draw.rng.uniform(40.0, 140.0) * DEG
    return replace(recording, start=replace(recording.start, heading=heading, heading_from="value"))


def _biased(recording: Recording, draw: Draw, *, rate: float) -> Recording:
    """Give all gyros turn-on biases that are far beyond what their figures say."""
    streams = []
    for stream in recording.imus:
        bias = draw.rng.normal(0.0, rate, 3) * np.diff(stream.time, prepend=stream.time[0])[:, None]
        streams.append(replace(stream, dtheta=stream.dtheta + bias))
    return replace(recording, imus=tuple(streams))


def _moving(scenario: Scenario, _: Draw) -> Scenario:
    return scenario.model_copy(update={"static_s": 0.0})


FAULTS = (
    Fault("jump of 50 to 150 m before it moves", "start", partial(_jump, sizes=(50.0, 150.0)), KINDS, WORDS),
    Fault("jump of 5 to 15 m before it moves", "start", partial(_jump, sizes=(5.0, 15.0)), KINDS, WORDS),
    Fault("begins under way", "start", _under_way, KINDS, WORDS),
    Fault("no fix for the first minutes", "start", _late_fixes, KINDS, WORDS),
    Fault("heading typed wrong by 40 to 140 deg", "start", _turned, (*KINDS, "innovations"), WORDS),
    Fault("turn-on biases of 1 deg/s", "start", partial(_biased, rate=1.0 * DEG), KINDS, WORDS),
    Fault("turn-on biases of 3 deg/s", "start", partial(_biased, rate=3.0 * DEG), KINDS, WORDS),
    Fault("no standing start", "start", unchanged, KINDS, WORDS, scenario=_moving),
)
