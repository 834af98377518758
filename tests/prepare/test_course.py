"""A stretch of track that tells the heading is over where it is far enough, or long enough, whatever comes later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_vehicle import drive
from numpy.typing import NDArray

from polyins.model.recording import GnssStream, Recording
from polyins.prepare import course

RECORDING = drive(gnss=True)
SPEED = 2.0
"""m/s"""


def along(place: NDArray[np.float64]) -> Recording:
    """The recording with fixes at places a second apart, m north, east."""
    position = np.column_stack([place, np.zeros(len(place))])
    gnss = GnssStream(np.arange(len(place), dtype=float), position, np.full((len(place), 3), 0.02))
    return replace(RECORDING, gnss=gnss)


def circle(metres: float, radius: float = 10.0) -> Recording:
    angle = np.arange(0.0, metres, SPEED) / radius
    return along(radius * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)]))


def straight(metres: float) -> Recording:
    way = np.arange(0.0, metres, SPEED)
    return along(np.column_stack([way, 0.0 * way]))


def test_a_straight_track_is_decided_once_it_is_far() -> None:
    assert not course.is_decided(straight(60.0), 0.0)
    assert course.is_decided(straight(80.0), 0.0)


def test_a_track_that_bends_is_decided_once_it_is_long() -> None:
    assert not course.is_decided(circle(120.0), 0.0)
    assert course.is_decided(circle(150.0), 0.0)


def test_noise_at_rest_makes_no_track() -> None:
    noise = np.random.default_rng(2).normal(0.0, 0.02, (2000, 2))
    assert not course.is_decided(along(noise), 0.0)


@pytest.mark.parametrize("of", [circle, straight])
def test_what_comes_later_changes_nothing(of: type) -> None:
    ends = []
    for metres in (200.0, 400.0):
        recording = of(metres)
        assert recording.gnss is not None
        ends.append(course._end(recording, recording.gnss, 0.0))
    assert ends[0] == ends[1]
