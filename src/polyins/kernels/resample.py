"""Increments of one IMU over the intervals of another clock, so that no rotation or velocity is lost or counted twice.

A sample is taken as constant within its own interval, which is the same as interpolating the running sum.
"""

from __future__ import annotations

from typing import NamedTuple

from polyins.kernels.jit import Array, entry, kernel

TOGETHER = 8
"""streams interleaved at once: their numbers fill a cache line"""
BLOCK = 256
"""epochs of one axis at once: what they write stays in the cache until the other axes have had their turn"""


class Samples(NamedTuple):
    """Samples of one IMU."""

    stamps: Array
    """s (S,), each ends the interval of a sample"""
    values: Array
    """(S, 6)"""
    first: int
    last: int
    """behind the last that counts"""
    before: float
    """s, where the interval of the first begins"""


class Waiting(NamedTuple):
    """Samples of N IMUs that wait."""

    stamps: Array
    """s (N, S)"""
    values: Array
    """(N, S, 6)"""
    first: Array
    last: Array
    before: Array
    """(N,), see `Samples`"""


@kernel
def resample_interval(samples: Samples, begin: float, end: float, out: Array) -> None:
    """Write into `out` (6,) what samples measured between `begin` and `end`."""
    stamps, values = samples.stamps, samples.values
    for a in range(6):
        out[a] = 0.0
    left = samples.before
    for j in range(samples.first, samples.last):
        right = stamps[j]
        if left >= end:
            break
        if right > begin:
            inside = 1.0
            if left < begin or right > end:
                inside = (min(right, end) - max(left, begin)) / (right - left)
            for a in range(6):
                out[a] += inside * values[j, a]
        left = right


@entry
def resample(stamps: Array, values: Array, before: float, time: Array, begin: float, out: Array) -> None:
    """Write into `out` (T, 6) what was measured in each interval that ends at `time` (T,); the first begins at `begin`.

    Where there are no samples, nothing was measured.
    """
    first = 0
    for k in range(len(time)):
        while first < len(stamps) and stamps[first] <= begin:
            before = stamps[first]
            first += 1
        last = first
        while last < len(stamps) and stamps[last] < time[k]:
            last += 1
        samples = Samples(stamps, values, first, min(last + 1, len(stamps)), before)
        resample_interval(samples, begin, time[k], out[k])
        begin = time[k]


@entry
def assemble(waiting: Waiting, longest: Array, begin: float, end: float, increments: Array, missing: Array) -> None:
    """Take from waiting samples what they measured between `begin` and `end`, and let those go that end.

    Writes `increments` (N, 6), and `missing` (N,) where an interval longer than `longest` (N,) or the end of the
    samples reaches into this one.
    """
    stamps, first, last, before = waiting.stamps, waiting.first, waiting.last, waiting.before
    for i in range(stamps.shape[0]):
        samples = Samples(stamps[i], waiting.values[i], first[i], last[i], before[i])
        resample_interval(samples, begin, end, increments[i])
        missing[i] = False
        left = before[i]
        for j in range(first[i], last[i]):
            if left < end and stamps[i, j] - left > longest[i] and stamps[i, j] > begin:
                missing[i] = True
            left = stamps[i, j]
        if left < end:
            missing[i] = True
        while first[i] < last[i] and stamps[i, first[i]] <= end:
            before[i] = stamps[i, first[i]]
            first[i] += 1


@entry
def covered_until(stamps: Array, first: Array, last: Array, before: Array, longest: Array, out: Array) -> None:
    """Write into `out` (N,) up to when the waiting samples follow each other by no more than `longest` (N,)."""
    for i in range(stamps.shape[0]):
        out[i] = before[i]
        for j in range(first[i], last[i]):
            if stamps[i, j] - out[i] > longest[i]:
                break
            out[i] = stamps[i, j]


@entry
def interleave(streams: tuple[Array, ...], first: int, row: int, out: Array) -> None:
    """Write the vectors of eight streams, each (T, 3), side by side into `out` (T, 6, N) from stream `first` on.

    Their axes go into rows `row` ... `row` + 2. Streams beyond N are not written.
    """
    a, b, c, d, e, f, g, h = streams
    count = out.shape[2] - first
    for begin in range(0, out.shape[0], BLOCK):
        for j in range(3):
            for k in range(begin, min(begin + BLOCK, out.shape[0])):
                to = out[k, row + j, first:]
                if count >= TOGETHER:
                    to[0], to[1], to[2], to[3] = a[k, j], b[k, j], c[k, j], d[k, j]
                    to[4], to[5], to[6], to[7] = e[k, j], f[k, j], g[k, j], h[k, j]
                else:
                    for i in range(count):
                        to[i] = streams[i][k, j]
