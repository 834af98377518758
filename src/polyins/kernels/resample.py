"""Increments of one IMU over the intervals of another clock, so that no rotation or velocity is lost or counted twice.

A sample is taken as constant within its own interval, which is the same as interpolating the running sum.
"""

from __future__ import annotations

from polyins.kernels.jit import Array, entry, kernel

TOGETHER = 8
"""streams interleaved at once: their numbers fill a cache line"""
BLOCK = 256
"""epochs of one axis at once: what they write stays in the cache until the other axes have had their turn"""


@kernel
def resample_interval(
    stamps: Array, values: Array, first: int, last: int, before: float, begin: float, end: float, out: Array
) -> None:
    """Write into `out` (6,) what samples `first` ... `last` - 1 measured between `begin` and `end`.

    `stamps` (S,) ends each sample's interval, `values` is (S, 6); `before` is where the interval of `first` begins.
    """
    for a in range(6):
        out[a] = 0.0
    left = before
    for j in range(first, last):
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
        resample_interval(stamps, values, first, min(last + 1, len(stamps)), before, begin, time[k], out[k])
        begin = time[k]


@entry
def assemble(
    stamps: Array,
    values: Array,
    first: Array,
    last: Array,
    before: Array,
    longest: Array,
    begin: float,
    end: float,
    increments: Array,
    missing: Array,
) -> None:
    """Take from the waiting samples of N IMUs what they measured between `begin` and `end`, and let those go that end.

    `stamps` (N, B) and `values` (N, B, 6) hold the samples `first` (N,) ... `last` - 1; `before` (N,) is where each
    first one begins. Writes `increments` (N, 6), and `missing` (N,) where an interval longer than `longest` (N,) or the
    end of the samples reaches into this one.
    """
    for i in range(stamps.shape[0]):
        resample_interval(stamps[i], values[i], first[i], last[i], before[i], begin, end, increments[i])
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
                    _some(a[k, j], b[k, j], c[k, j], d[k, j], e[k, j], f[k, j], g[k, j], to)


@kernel
def _some(a: float, b: float, c: float, d: float, e: float, f: float, g: float, to: Array) -> None:
    """Write the first of at most seven numbers."""
    for i, value in enumerate((a, b, c, d, e, f, g)):
        if i < len(to):
            to[i] = value
