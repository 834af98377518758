"""Where everything rests, and where nothing was recorded: notes for a user who looks for his data."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.model.findings import Finding
from polyins.model.recording import Array, usual_interval
from polyins.navigate.restart import pauses

WINDOW_S = 1.0
LEAST_S = 3.0
QUIET_RAD_S = 0.02
"""std of the rates, rad/s, and of the force, m/s^2, over a second at rest"""
QUIET_M_S2 = 0.3
BIAS_RAD_S = 0.06
SLOW_M_S = 0.3
MOST_NAMED = 5


def rest(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say where the first IMU rests, and the receiver does not move."""
    if not evidence.body:
        return
    stream = evidence.body[0].stream
    rows = max(round(WINDOW_S / usual_interval(stream.time)), 2)
    count = len(stream.time) // rows
    if not count:
        return
    used = count * rows
    steps = np.maximum(np.diff(stream.time, prepend=stream.time[0] - usual_interval(stream.time))[:used, None], 1e-9)
    rates, forces = ((one[:used] / steps).reshape(count, rows, 3) for one in (stream.dtheta, stream.dvel))
    quiet = (rates.std(axis=1).max(axis=1) < QUIET_RAD_S) & (forces.std(axis=1).max(axis=1) < QUIET_M_S2)
    quiet &= np.linalg.norm(rates.mean(axis=1), axis=1) < BIAS_RAD_S
    edges = stream.time[np.minimum(np.arange(count + 1) * rows, len(stream.time) - 1)]
    quiet &= ~_moves(evidence, edges) & (np.diff(edges) < 2.0 * WINDOW_S)
    stretches = [(b, e) for b, e in _stretches(quiet, edges) if e - b >= LEAST_S]
    for begin, end in sorted(stretches, key=lambda one: one[0] - one[1])[:MOST_NAMED]:
        text = f"at rest from {begin:.1f} to {end:.1f} s, as IMU {stream.name} shows"
        yield Diagnosis(Finding("rest", text, stream=stream.name, from_s=begin, to_s=end, size=end - begin))


def _moves(evidence: Evidence, edges: Array) -> NDArray[np.bool_]:
    """Return in which windows the receiver moves."""
    gnss = evidence.recording.gnss
    if gnss is None or gnss.velocity is None:
        return np.zeros(len(edges) - 1, dtype=bool)
    speed = np.linalg.norm(gnss.velocity[:, :2], axis=1)
    fast = np.concatenate([[0], np.cumsum(speed > SLOW_M_S)])
    at = np.searchsorted(gnss.time, edges)
    return np.asarray(np.diff(fast[at]) > 0)


def _stretches(where: NDArray[np.bool_], edges: Array) -> Iterator[tuple[float, float]]:
    ends = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    for begin, end in zip(ends[::2], ends[1::2], strict=True):
        yield float(edges[begin]), float(edges[end])


def breaks(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say where no IMU has data; a run takes it up anew after each."""
    for one in pauses(evidence.recording):
        yield Diagnosis(
            Finding(
                "pause",
                f"no IMU has data from {one.begin:.3f} to {one.end:.3f} s, {one.end - one.begin:.2f} s; a run begins "
                "anew after it",
                from_s=one.begin,
                to_s=one.end,
                size=one.end - one.begin,
                remedy="start.time_s and start.end_time_s choose a part",
            )
        )
