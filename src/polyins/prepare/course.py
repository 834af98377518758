"""The heading at the start of a vehicle with wheels: how its dead-reckoned track must be turned to lie on GNSS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.geodesy import displacement
from polyins.model.recording import GnssStream, Recording
from polyins.model.rig import DEG
from polyins.model.solution import Solution

Array = NDArray[np.float64]
Track = Solution
"""as dead reckoning from heading zero gives it"""

LENGTH, LONGEST = 50.0, 100.0
"""m from its beginning, and along it, over which a track is compared; farther on dead reckoning bends"""
STEP = 5.0
"""m between the fixes by which it is known how long a track is: their noise makes it longer"""
FARTHER = 1.3
"""That many times the length by GNSS is farther than it by dead reckoning, whose radii may be wrong by a tenth."""
SHORTEST = 5.0
LEAST_STD = 0.1 * DEG
BY_CHANCE = 2.0
"""sigma of a mean square"""
DRIFT_STD = 1.0 * DEG
"""of the heading over the length, where the noise of fixes hides it"""
AROUND = 5
"""fixes: their median outvotes two that lie"""


@dataclass(frozen=True)
class Course:
    """A heading and where it came from."""

    heading: float
    """rad"""
    std: float
    """rad"""
    source: str


def is_wanted(recording: Recording) -> bool:
    """Whether the heading of a recording is to come from GNSS."""
    start = recording.start
    return recording.gnss is not None and (
        start.heading_from == "gnss-course" or (start.heading_from == "auto" and start.heading is None)
    )


def blind(recording: Recording) -> Recording:
    """Return the recording without GNSS, starting with heading zero."""
    assert recording.gnss is not None
    origin = recording.gnss.position[0] if recording.start.position is None else recording.start.position
    start = replace(recording.start, heading=0.0, heading_from="value", position=origin)
    return replace(recording, gnss=None, outages=(), start=start)


def is_decided(recording: Recording, begin: float) -> bool:
    """Whether the fixes reach beyond the stretch that is compared: further ones do not change the heading."""
    assert recording.gnss is not None
    return _end(recording, recording.gnss, begin) is not None


def find(recording: Recording, begin: float, navigate: Callable[[Recording], Track]) -> Course:
    """Dead-reckon with heading zero by `navigate` and fit the track to GNSS; raise InputError if it is too short.

    `begin`: when the run starts, s. The rotation is the one of least squares in the horizontal plane, robust against
    single wrong fixes.
    """
    gnss, alone = recording.gnss, blind(recording)
    assert gnss is not None
    solution = navigate(replace(alone, start=replace(alone.start, end_time=_end(recording, gnss, begin))))
    track, fixes = _pairs(recording, gnss, solution)
    reach = float(np.max(np.linalg.norm(track - track[:1], axis=1), initial=0.0))
    if reach < SHORTEST:
        raise InputError(
            f"start: no heading: the vehicle goes {reach:.1f} m while there is GNSS;"
            f" expected {SHORTEST:g} m or start.heading_deg"
        )
    kept = np.ones(len(track), dtype=bool)
    for _ in range(3):
        angle, residual = _rotation(track, fixes, kept)
        kept = residual <= 3.0 * np.median(residual) + 1e-6
    std = max(LEAST_STD, _std(track, residual, _noise(gnss)))
    return Course(angle, std, f"dead-reckoned track turned onto GNSS over {reach:.0f} m")


def _end(recording: Recording, gnss: GnssStream, begin: float) -> float | None:
    """Return when the first stretch is surely over: as soon as three fixes in a row are far enough from its begin."""
    ahead = gnss.time >= begin
    time, position = gnss.time[ahead], gnss.position[ahead]
    if not len(time):
        return recording.start.end_time
    place = displacement(position, position[0], recording.geodetic)[:, :2]
    way, noise = np.linalg.norm(place, axis=1), 10.0 * float(gnss.position_std[:, :2].max())
    far = way > FARTHER * LENGTH + noise
    lasting = np.flatnonzero(far[:-2] & far[1:-1] & far[2:]) + 2
    known = np.inf if recording.start.end_time is None else recording.start.end_time
    long = _after(place, FARTHER * LONGEST, STEP + noise)
    ends = [known, *(float(time[k]) for k in (*lasting[:1], *([] if long is None else [long])))]
    return min(ends) if np.isfinite(min(ends)) else None


def _after(place: Array, length: float, step: float) -> int | None:
    """Return the first of places, (M, 2), up to which their track is that long, m, in steps of so many; None: none."""
    last, gone = place[0], 0.0
    for k, one in enumerate(place):
        chord = float(np.linalg.norm(one - last))
        if chord > step:
            last, gone = one, gone + chord
        if gone > length:
            return k
    return None


def _pairs(recording: Recording, gnss: GnssStream, solution: Track) -> tuple[Array, Array]:
    """Return the antenna as dead-reckoned and as fixed at the fixes of the first stretch, m north and east."""
    from scipy.spatial.transform import Rotation

    antenna = Rotation.from_quat(solution.attitude, scalar_first=True).apply(recording.rig.antenna)
    way = displacement(solution.position, solution.position[0], recording.geodetic) + antenna
    shown = (gnss.time >= solution.time[0]) & (gnss.time <= solution.time[-1])
    for first, last in recording.outages:
        shown &= ~((gnss.time > first) & (gnss.time < last))
    if shown.any():
        begin = min(int(np.searchsorted(solution.time, gnss.time[shown][0])), len(way) - 1)
        along = np.cumsum(np.linalg.norm(np.diff(way[begin:, :2], axis=0, prepend=way[begin : begin + 1, :2]), axis=1))
        far = np.flatnonzero((np.linalg.norm(way[begin:, :2] - way[begin, :2], axis=1) > LENGTH) | (along > LONGEST))
        shown &= gnss.time <= (solution.time[begin + far[0]] if len(far) else solution.time[-1])
    fixes = displacement(gnss.position[shown], gnss.position[0], recording.geodetic)[:, :2]
    track = np.column_stack([np.interp(gnss.time[shown], solution.time, way[:, k]) for k in range(2)])
    return track, fixes


def _rotation(track: Array, fixes: Array, kept: NDArray[np.bool_]) -> tuple[float, Array]:
    """Return the angle that turns the track onto the fixes, rad, and how far each then is from it, m."""
    a, b = track - track[kept].mean(axis=0), fixes - fixes[kept].mean(axis=0)
    cosine = float(np.sum(a[kept] * b[kept]))
    sine = float(np.sum(a[kept, 0] * b[kept, 1] - a[kept, 1] * b[kept, 0]))
    angle = float(np.arctan2(sine, cosine))
    c, s = np.cos(angle), np.sin(angle)
    turned = np.column_stack([c * a[:, 0] - s * a[:, 1], s * a[:, 0] + c * a[:, 1]])
    return angle, np.linalg.norm(turned - b, axis=1)


def _noise(gnss: GnssStream) -> float:
    """Return the usual variance of a fix in the horizontal plane, m^2."""
    return float(np.median(np.sum(gnss.position_std[:, :2] ** 2, axis=1)))


def _std(track: Array, residual: Array, noise: float) -> float:
    """Return the std of the angle, rad.

    The noise of fixes is white. What is left beyond it is a drift of the heading: one that bends a straight track turns
    its beginning by sqrt(15) times the angle under which the residuals are seen. A drift that the noise hides is as
    large as dead reckoning may have. A fix that lies is no drift: it is outvoted by those around it.
    """
    count, window = len(track), min(AROUND, len(track))
    squares = float(np.mean(np.sum((track - track.mean(axis=0)) ** 2, axis=1)))
    usual = np.median(np.lib.stride_tricks.sliding_window_view(residual, window), axis=1)
    left, by_chance = float(np.mean(usual**2)), noise / np.sqrt(count)
    drift = 15.0 * max(0.0, left - noise - BY_CHANCE * by_chance) / squares
    hidden = min(15.0 * by_chance / squares, DRIFT_STD**2)
    return float(np.sqrt(2.0 * left / count / squares + drift + hidden))
