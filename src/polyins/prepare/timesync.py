"""Streams of several IMUs onto one time base, by integrating increments and never by sampling rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, usual_interval

Array = NDArray[np.float64]

LATE = 1.0
"""s: an IMU that begins so long after the others or ends so long before them is not waited for"""
LEAST_COMMON = 2.0
"""s that each IMU has in common with another one"""

GAP = 3.5
"""An interval longer than this many nominal ones is a gap: what was measured in it is lost."""


@dataclass(frozen=True)
class Aligned:
    """Increments of N IMUs over common intervals."""

    time: Array
    """s, shape (T,)"""
    increments: Array
    """dtheta (rad) and dvel (m/s) over the interval that ends at `time`, shape (T, 6, N)"""
    findings: tuple[Finding, ...]
    missing: NDArray[np.bool_]
    """where an IMU has a gap, shape (T, N); what stands there is bridged, or zero"""

    @property
    def rate_hz(self) -> float:
        """Nominal rate: one over the usual interval."""
        return 1.0 / usual_interval(self.time)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as sentences."""
        return tuple(finding.sentence for finding in self.findings)

    def between(self, begin: float, end: float) -> Aligned:
        """Return the epochs with begin <= time <= end."""
        first, last = np.searchsorted(self.time, [begin, np.nextafter(end, np.inf)])
        part = slice(first, last)
        return Aligned(self.time[part], self.increments[part], self.findings, self.missing[part])


@dataclass(frozen=True)
class Whole:
    """What is known of whole streams, parts of which are aligned."""

    gap_counts: tuple[int, ...]
    begins: Array
    """first stamp of each, s, shape (N,); infinite without any"""
    ends: Array
    """last stamp of each, s, shape (N,)"""
    intervals: Array
    """the usual one of each, s, shape (N,)"""

    @classmethod
    def of(cls, streams: tuple[ImuStream, ...]) -> Whole:
        """Look at streams that are whole."""
        intervals = np.array([usual_interval(one.time) if len(one.time) > 1 else np.nan for one in streams])
        intervals[np.isnan(intervals)] = np.nanmedian(intervals)
        gaps = (gaps_of(stream.time, usual) for stream, usual in zip(streams, intervals, strict=True))
        begins = np.array([one.time[0] if len(one.time) else np.inf for one in streams])
        ends = np.array([one.time[-1] if len(one.time) else -np.inf for one in streams])
        return cls(tuple(map(len, gaps)), begins, ends, intervals)

    @property
    def order(self) -> list[int]:
        """In which their stamps become those of all: a gap in the first one's is one for all."""
        begin, end = common_begin(self.begins), common_end(self.ends)
        return sorted(
            range(len(self.ends)),
            key=lambda i: (self.gap_counts[i] + (self.begins[i] > begin), self.ends[i] < end),
        )


def align(streams: tuple[ImuStream, ...], bridge: bool = True, whole: Whole | None = None) -> Aligned:
    """Bring the streams onto the time stamps of the first one without gaps, within their common span.

    The increments of the others are shared out between its intervals, so that no rotation or velocity is lost or
    counted twice. Where one IMU has a gap, it is given the mean of those that have none there; where all have one,
    the mean of the rates on both sides; without `bridge` the gap is left empty, and the time begins when all have
    begun. Any gap is a warning. `whole`: of longer streams, whose parts these are; a part is empty of a stream that has
    ended or not begun. Raises InputError if less than two seconds are common.
    """
    if whole is None:
        whole = Whole.of(streams)
        check_common([stream.name for stream in streams], whole, wait=not bridge)
    gaps_by_stream = [gaps_of(*of) for of in zip((stream.time for stream in streams), whole.intervals, strict=True)]
    time = _common_time(streams, whole, wait=not bridge)
    on_base: list[tuple[Array, Array]] = []
    missing = np.zeros((len(time), len(streams)), dtype=bool)
    findings = late_beginnings([stream.name for stream in streams], whole.begins, wait=not bridge)
    for i, (stream, known) in enumerate(zip(streams, gaps_by_stream, strict=True)):
        if not stream.time.size:
            on_base.append((np.zeros((len(time), 3)), np.zeros((len(time), 3))))
        elif len(stream.time) == len(time) and np.array_equal(stream.time, time):
            on_base.append((stream.dtheta, stream.dvel))
        else:
            values = _resample(stream, time, float(whole.intervals[i]))
            on_base.append((values[:, :3], values[:, 3:]))
        gaps = [g for g in known if g[1] > time[0] and g[0] < time[-1]]
        begins, stops = float(whole.begins[i]), max(float(whole.ends[i]), time[0])
        missing[: np.searchsorted(time, begins) + 1 if begins - time[0] > LATE else 0, i] = True
        if time[-1] - stops > LATE:
            gaps.append((stops, float(time[-1])))
        for begin, end in gaps:
            missing[np.searchsorted(time, begin, "right") : np.searchsorted(time, end) + 1, i] = True
        if gaps:
            findings.append(gap_finding(stream.name, gaps))
    increments = _interleaved(on_base, len(time))
    if missing.any():
        if bridge:
            _bridge(time, increments, missing)
        else:
            increments[np.broadcast_to(missing[:, None, :], increments.shape)] = 0.0
    return Aligned(time, increments, tuple(findings), missing)


def late_beginnings(names: Sequence[str], begins: Array, *, wait: bool) -> list[Finding]:
    """Say which IMUs begin late; with `wait` the others have to wait for the last one, whose measurements count then.

    `begins`: first stamp of each, s, shape (N,), infinite without any.
    """
    first, latest = float(begins.min()), int(np.argmax(begins))
    late = [latest] if wait else range(len(names))
    return [_late(names[i], float(begins[i]), first, wait) for i in late if LATE < begins[i] - first < np.inf]


def _late(name: str, begin: float, first: float, wait: bool) -> Finding:
    after = f"IMU {name}: begins at {begin:.3f} s, {begin - first:.1f} s after the first one; "
    text = after + ("what the others measured before is not used" if wait else "the others go on without it until then")
    return Finding("late begin", text, stream=name, from_s=first, to_s=begin, size=begin - first)


def common_begin(begins: Array) -> float:
    """Return when a recording begins whose streams begin then, s; one that begins long after others has a gap."""
    return float(begins[begins < begins.min() + LATE].max())


def common_end(ends: Array) -> float:
    """Return when a recording ends whose streams end then, s; one that stops long before others has a gap."""
    return float(ends[ends > ends.max() - LATE].min())


def _interleaved(streams: Sequence[tuple[Array, Array]], epochs: int) -> Array:
    """Return the increments of all streams side by side, shape (T, 6, N)."""
    from polyins.kernels.resample import TOGETHER, interleave

    increments = np.empty((epochs, 6, len(streams)))
    for first in range(0, len(streams), TOGETHER):
        some = [streams[min(i, len(streams) - 1)] for i in range(first, first + TOGETHER)]
        for row, vectors in enumerate(zip(*some, strict=True)):
            # of one layout, for which the kernel is compiled once
            alike = tuple(np.require(each, np.float64, ["C", "W"]) for each in vectors)
            interleave(alike, first, 3 * row, increments)
    return increments


def least_common(begins: Array, ends: Array, *, wait: bool) -> float:
    """Return how long all IMUs measure together, s; without `wait`, each with the one that overlaps it most.

    `begins`, `ends`: shape (N,), s.
    """
    if wait or len(begins) == 1:
        return float(ends.min() - begins.max())
    together = np.minimum.outer(ends, ends) - np.maximum.outer(begins, begins)
    np.fill_diagonal(together, -np.inf)
    return float(together.max(axis=1).min())


def check_common(names: Sequence[str], whole: Whole, *, wait: bool) -> None:
    """Raise InputError if streams of those names have less than two seconds in common, see `least_common`."""
    there = np.isfinite(whole.begins)
    if least_common(whole.begins[there], whole.ends[there], wait=wait) < LEAST_COMMON:
        every = zip(names, whole.begins, whole.ends, strict=True)
        spans = ", ".join(f"{name} {begin:.3f} to {end:.3f} s" for name, begin, end in every if np.isfinite(begin))
        raise InputError(f"imus: less than two common seconds ({spans}); expected streams that overlap on one clock")


def _common_time(streams: tuple[ImuStream, ...], whole: Whole, *, wait: bool) -> Array:
    """Return the stamps of the stream with the fewest gaps, filled up in them with those of others.

    The time goes on where a stream ends for good while others go on; it begins with the first ones, or with `wait` when
    all have begun.
    """
    there = [stream for stream in streams if stream.time.size]
    begins = np.array([stream.time[0] for stream in there])
    begin = float(begins.max()) if wait else common_begin(begins)
    end = common_end(np.array([stream.time[-1] for stream in there]))
    ordered = [streams[i] for i in whole.order]
    base: Array = ordered[0].time[(ordered[0].time >= begin) & (ordered[0].time <= end)]
    nominal = float(whole.intervals[whole.order[0]])
    empty = _empty_until(base, begin, end, nominal)
    for stream in ordered[1:]:
        parts = [base]
        for first, last in empty:
            inside = (stream.time > first + 0.5 * nominal) & (stream.time < last - 0.5 * nominal)
            parts.append(stream.time[inside])
        if any(map(len, parts[1:])):
            base = np.sort(np.concatenate(parts))
            empty = _empty_until(base, begin, end, nominal)
    return base


def _empty_until(base: Array, begin: float, end: float, nominal: float) -> list[tuple[float, float]]:
    """Return the gaps of a clock, and what it lacks at the beginning and until the end: all, if it is not there."""
    if not base.size:
        return [(begin - nominal, end + nominal)]
    before = [(begin - nominal, float(base[0]))] if base[0] - begin > GAP * nominal else []
    after = [(float(base[-1]), end + nominal)] if end - base[-1] > GAP * nominal else []
    return [*before, *gaps_of(base, nominal), *after]


def _resample(stream: ImuStream, time: Array, usual: float) -> Array:
    """Return what was measured over the intervals of `time`, (T, 6); a sample is constant within its own."""
    from polyins.kernels.resample import resample

    stamps, values = np.ascontiguousarray(stream.time), np.hstack([stream.dtheta, stream.dvel])
    out = np.empty((len(time), values.shape[1]))
    resample(stamps, values, stamps[0] - usual, np.ascontiguousarray(time), time[0] - usual_interval(time), out)
    return out


def gaps_of(stamps: Array, usual: float) -> list[tuple[float, float]]:
    """Return where stamps are missing: the last before and the first after each gap, s; `usual`: their interval, s."""
    where = np.flatnonzero(np.diff(stamps) > GAP * usual)
    return [(float(stamps[k]), float(stamps[k + 1])) for k in where]


def gap_finding(name: str, gaps: Sequence[tuple[float, float]]) -> Finding:
    """Say how many gaps an IMU has and where the longest is."""
    begin, end = max(gaps, key=lambda gap: gap[1] - gap[0])
    count = "a gap" if len(gaps) == 1 else f"{len(gaps)} gaps, the longest"
    text = f"IMU {name}: {count} of {end - begin:.3f} s at {begin:.3f} s"
    return Finding("gap", text, stream=name, from_s=begin, to_s=end, size=end - begin)


def _bridge(time: Array, increments: Array, missing: NDArray[np.bool_]) -> None:
    have = ~missing
    some = missing.any(axis=1) & have.any(axis=1)
    for k in np.flatnonzero(some):
        increments[k][:, missing[k]] = increments[k][:, have[k]].mean(axis=1, keepdims=True)
    none = np.flatnonzero(~have.any(axis=1))
    intervals = np.diff(time, prepend=2 * time[0] - time[1])
    good = np.flatnonzero(have.any(axis=1))
    for k in none:
        before = good[good < k][-1:] if (good < k).any() else good[:1]
        after = good[good > k][:1] if (good > k).any() else good[-1:]
        rates = [increments[j[0]] / intervals[j[0]] for j in (before, after)]
        increments[k] = 0.5 * (rates[0] + rates[1]) * intervals[k]
