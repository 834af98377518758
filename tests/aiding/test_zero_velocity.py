"""Standstills of a vehicle: what no velocity says, and when it is taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import BODY, Check, Moving
from driven_vehicle import drive, with_rolling

import polyins as pi
from polyins.aiding import kinds
from polyins.navigate import batch, update
from polyins.simulation.scenario import SensorErrors

EVENT = np.array([kinds.ZERO_VELOCITY, 1.0])


@pytest.mark.parametrize("s", [0, BODY])
def test_of_a_vehicle(vehicle: Moving, check_design: Check, s: int) -> None:
    check_design(vehicle, EVENT, s)


def test_of_an_array(array: Moving, check_design: Check) -> None:
    check_design(array, EVENT)


def test_driving_straight_on_is_no_standstill() -> None:
    """A body turns as little then as at a stop: the wheels tell them apart."""
    recording = drive()
    run = batch.prepare(recording, "body-ins")
    run.advance(1, len(run.inputs.time))
    reference = recording.reference
    assert reference is not None
    assert reference.velocity is not None
    shown = reference.time > run.start.time
    standing = np.mean(np.linalg.norm(reference.velocity[shown], axis=1) < 0.01) * (reference.time[-1] - run.start.time)
    taken = (run.inputs.event_kind == kinds.ZERO_VELOCITY) & (run.outputs.event_status == update.ACCEPTED)
    stood = np.count_nonzero(taken) * recording.options.rolling.speed_interval
    assert stood == pytest.approx(standing, abs=2.5)


def test_at_a_stop_the_gyros_are_calibrated() -> None:
    recording = drive(errors=SensorErrors(noise=True, biases=True, scales=False, turn_on_share=1.0))
    # the bias is not taken from the standstill, which is still ahead of the start
    start = replace(recording.start, time=1.0, static_interval=(0.0, 1.0), estimate_gyro_bias=False)
    recording = replace(recording, start=start)
    with_stops = pi.run(recording, "triple-ins")
    without_stops = pi.run(with_rolling(recording, standstill=False), "triple-ins")
    assert np.all(with_stops.imu_error_std[8, :, :3] < 0.75 * without_stops.imu_error_std[8, :, :3])
