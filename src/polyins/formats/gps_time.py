"""GPS time and UTC."""

from __future__ import annotations

import numpy as np

from polyins.formats.rtklib import GPS_EPOCH, LEAP_DAYS, WEEK_S
from polyins.model.recording import Array


def utc_of_week(week: Array, second: Array) -> Array:
    """Return Unix time, s, of GPS weeks and seconds of them."""
    gps = week * WEEK_S + second
    epoch = float(GPS_EPOCH.astype(float))
    leaps = np.arange(1, len(LEAP_DAYS) + 1)
    begins = LEAP_DAYS.astype(float) - epoch + leaps  # of each new difference, in GPS time
    return np.asarray(epoch + gps - np.searchsorted(begins, gps, side="right"))
