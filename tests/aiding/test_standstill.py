"""Standstills of a vehicle: told from straight driving, and used to calibrate gyros."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_vehicle import drive, with_rolling

import polyins as pi
from polyins.aiding import rolling
from polyins.navigate import batch
from polyins.simulation.scenario import Errors


def test_driving_straight_on_is_no_standstill() -> None:
    """A body turns as little then as at a stop: the wheels tell them apart."""
    recording = drive()
    run = batch.prepare(recording, "body-ins")
    run.advance(1, len(run.inputs.time))
    assert run.rolling is not None
    reference = recording.reference
    assert reference is not None
    assert reference.velocity is not None
    shown = reference.time > run.start.time
    standing = np.mean(np.linalg.norm(reference.velocity[shown], axis=1) < 0.01) * (reference.time[-1] - run.start.time)
    assert run.rolling.memory[rolling.STILL] == pytest.approx(standing, abs=2.5)


def test_at_a_stop_the_gyros_are_calibrated() -> None:
    recording = drive(errors=Errors(noise=True, biases=True, scales=False, turn_on_share=1.0))
    # the bias is not taken from the standstill, which is still ahead of the start
    start = replace(recording.start, time=1.0, static_interval=(0.0, 1.0), estimate_gyro_bias=False)
    recording = replace(recording, start=start)
    with_stops = pi.run(recording, "triple-ins")
    without_stops = pi.run(with_rolling(recording, standstill=False), "triple-ins")
    assert np.all(with_stops.imu_error_std[8, :, :3] < 0.75 * without_stops.imu_error_std[8, :, :3])
