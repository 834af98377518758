"""GPS time and UTC."""

from __future__ import annotations

import numpy as np

from polyins.model.recording import Array

WEEK_S = 604800.0
DAY_S = 86400.0
EARLIEST_UNIX_S = 1e9
"""stamps above this are seconds of Unix time, below they count from elsewhere"""
GPS_EPOCH = np.datetime64("1980-01-06T00:00:00", "s")
LEAP_DAYS = np.array(
    ["1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01", "1988-01-01", "1990-01-01", "1991-01-01", "1992-07-01",
     "1993-07-01", "1994-07-01", "1996-01-01", "1997-07-01", "1999-01-01", "2006-01-01", "2009-01-01", "2012-07-01",
     "2015-07-01", "2017-01-01"],
    dtype="datetime64[s]",
)  # fmt: skip
"""From each of these days on GPS time is one second more ahead of UTC (IERS Bulletin C)."""


def utc_of_week(week: Array, second: Array) -> Array:
    """Return Unix time, s, of GPS weeks and seconds of them."""
    gps = week * WEEK_S + second
    epoch = float(GPS_EPOCH.astype(float))
    leaps = np.arange(1, len(LEAP_DAYS) + 1)
    begins = LEAP_DAYS.astype(float) - epoch + leaps  # of each new difference, in GPS time
    return np.asarray(epoch + gps - np.searchsorted(begins, gps, side="right"))


def leap_seconds(utc: Array) -> Array:
    """Return by how much GPS time is ahead of UTC at Unix times, s."""
    return np.searchsorted(LEAP_DAYS.astype(float), utc, side="right").astype(float)
