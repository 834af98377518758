"""What no sensor measures: the range beyond which a sample is no data."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Largest rates of an IMU, in any axis."""

    rate: float
    """rad/s"""
    force: float
    """m/s^2"""
    rms_rate: float
    """rad/s, over a recording"""


BODY = Limits(80.0, 500.0, rms_rate=10.0)
"""Gyros for navigation end at 4,000 deg/s, their accelerometers at 40 g."""
WHEEL = Limits(400.0, 5000.0, rms_rate=100.0)
"""Gyros for fast spin end at 20,000 deg/s; off the axis of a wheel its centripetal acceleration comes on top."""


def limits_of(*, on_wheel: bool) -> Limits:
    """Return the range of an IMU."""
    return WHEEL if on_wheel else BODY
