"""What is looked for in fixes before any filter sees them: repeated positions, other units, leaps of stamps, outages.

The fixes are used as they are: what a finding says, the receiver's judge has to live with.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polyins.model.findings import Finding
from polyins.model.geodesy import displacement
from polyins.model.gps_time import WEEK_S
from polyins.model.recording import GnssStream, usual_interval

STREAM = "GNSS position"
REPEATED = 3
"""fixes in a row at one place, to the last digit"""
MOVED = 5.0
"""standard deviations from there to the fix that follows: less, and the vehicle may stand"""
UNITS = (("feet", 1.0 / 0.3048), ("cm", 100.0), ("mm", 1000.0))
"""in which heights may be for a while, and how many of them are a metre"""
SAME_HEIGHT = 0.02
"""relative, by which a height may change from one fix to the next beside its unit"""
LEAST_HEIGHT = 5.0
"""m: lower ones tell no unit"""
NEAR_ZERO, FAR_FROM_ZERO = 1e-5, 1e-3
"""rad: latitudes and longitudes of a receiver without a fix, and those that are so by no chance"""
GONE_S, GONE_INTERVALS = 10.0, 5.0
"""s, and times the usual interval: a longer time without fixes is an outage"""


def of_fixes(gnss: GnssStream, geodetic: bool, end: float) -> tuple[Finding, ...]:
    """Return what is wrong with fixes; `end`: of the IMUs' data, s."""
    if len(gnss.time) < 2:
        return ()
    nowhere = _nowhere(gnss) if geodetic else ()
    return (*_frozen(gnss, geodetic), *_units(gnss), *nowhere, *_leaps(gnss), *_outages(gnss, end))


def _frozen(gnss: GnssStream, geodetic: bool) -> Iterator[Finding]:
    same = np.concatenate([[False], (np.diff(gnss.position[:, :2], axis=0) == 0.0).all(axis=1), [False]])
    begins = np.flatnonzero(~same[:-1] & same[1:])
    ends = np.flatnonzero(same[:-1] & ~same[1:])
    found = []
    for begin, last in zip(begins, ends, strict=True):
        if last - begin + 1 < REPEATED or last + 1 == len(gnss.time):
            continue
        step = displacement(gnss.position[last + 1 : last + 2], gnss.position[last], geodetic)[0, :2]
        size = float(np.hypot(*step))
        if size > MOVED * float(np.hypot(*gnss.position_std[last + 1, :2])):
            found.append((float(gnss.time[begin]), float(gnss.time[last]), int(last - begin + 1), size))
    if not found:
        return
    begin_s, end_s, count, size = max(found, key=lambda one: one[1] - one[0])
    more = "" if len(found) == 1 else f", the longest of {len(found)} times"
    yield Finding(
        "frozen",
        f"{STREAM}: {count} fixes at one place from {begin_s:.2f} to {end_s:.2f} s, the next {size:.3g} m away{more}",
        stream=STREAM,
        from_s=begin_s,
        to_s=end_s,
        size=size,
        expected=0.0,
        remedy="the receiver repeats itself: leave such fixes out, or state their std",
    )


def _units(gnss: GnssStream) -> Iterator[Finding]:
    """Say where heights are in another unit for a while: they leap by its factor, and back."""
    height, std = np.abs(gnss.position[:, 2]), gnss.position_std[:, 2]
    leaps = np.abs(np.diff(height)) > MOVED * np.hypot(std[1:], std[:-1])
    told = leaps & (np.minimum(height[1:], height[:-1]) > LEAST_HEIGHT)
    ratio = np.divide(height[1:], height[:-1], out=np.ones(len(told)), where=told)
    for unit, factor in UNITS:
        begins = np.flatnonzero(np.abs(ratio / factor - 1.0) < SAME_HEIGHT) + 1
        if not begins.size:
            continue
        begin, ends = int(begins[0]), np.flatnonzero(np.abs(ratio * factor - 1.0) < SAME_HEIGHT)
        ends = ends[ends >= begin]
        last = int(ends[0]) if ends.size else len(height) - 1
        yield Finding(
            "units",
            f"{STREAM}: {last - begin + 1} heights from {gnss.time[begin]:.2f} to {gnss.time[last]:.2f} s are"
            f" {ratio[begin - 1]:.4g} times that before, as if they were in {unit}",
            stream=STREAM,
            axis="height",
            from_s=float(gnss.time[begin]),
            to_s=float(gnss.time[last]),
            size=float(ratio[begin - 1]),
            expected=1.0,
            remedy="convert them, or leave such fixes out",
        )


def _nowhere(gnss: GnssStream) -> Iterator[Finding]:
    """Say where latitude and longitude are next to zero, which those of the others are not."""
    off = np.abs(gnss.position[:, :2]).max(axis=1)
    rows = np.flatnonzero(off < NEAR_ZERO)
    if not rows.size or np.median(off) < FAR_FROM_ZERO:
        return
    begin_s, end_s = float(gnss.time[rows[0]]), float(gnss.time[rows[-1]])
    yield Finding(
        "place",
        f"{STREAM}: {rows.size} fixes at latitude and longitude 0 from {begin_s:.2f} to {end_s:.2f} s: the receiver had"
        " none, or counts in other units",
        stream=STREAM,
        from_s=begin_s,
        to_s=end_s,
        size=float(np.degrees(off[rows].max())),
        remedy="leave such fixes out",
    )


def _leaps(gnss: GnssStream) -> Iterator[Finding]:
    steps = np.diff(gnss.time)
    usual = usual_interval(gnss.time)
    for row in np.flatnonzero(np.abs(steps - WEEK_S) <= max(GONE_S, GONE_INTERVALS * usual))[:1]:
        at = float(gnss.time[row])
        yield Finding(
            "clock",
            f"{STREAM}: the stamps leap by a week, {steps[row]:.0f} s, at {at:.2f} s; the fixes after it are not used",
            stream=STREAM,
            from_s=at,
            to_s=float(gnss.time[row + 1]),
            size=float(steps[row]),
            expected=usual,
            remedy="count the time of the week on through its end",
        )


def _outages(gnss: GnssStream, end: float) -> Iterator[Finding]:
    """Say where there is no fix for long, up to the end of the IMUs' data."""
    time = np.append(gnss.time[gnss.time < end], end)
    steps = np.diff(time)
    gone = np.flatnonzero(steps > max(GONE_S, GONE_INTERVALS * usual_interval(gnss.time)))
    if not gone.size:
        return
    longest = int(gone[np.argmax(steps[gone])])
    more = "" if len(gone) == 1 else f", the longest of {len(gone)} times"
    yield Finding(
        "outage",
        f"{STREAM}: no fix for {steps[longest]:.1f} s from {time[longest]:.2f} s{more}",
        stream=STREAM,
        from_s=float(time[longest]),
        to_s=float(time[longest + 1]),
        size=float(steps[longest]),
        expected=usual_interval(gnss.time),
    )
