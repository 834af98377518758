"""Arrays at rest: their heading stands still, and a smooth drive is never taken for rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from array_recordings import Swing, received, sensed, shaken_path, start_at
from test_sensors import GRADE, error_at_reference

from polyins.model.recording import FilterOptions, Recording, Reference, StandstillOptions
from polyins.model.rig import DEG, Imu, Rig
from polyins.navigate import batch
from polyins.simulation.path import Path

STILL = StandstillOptions(rate_std=0.05 * DEG)


def along(truth: Path, duration: float, rate_hz: float, imus: int, seed: int = 3) -> Recording:
    rng = np.random.default_rng(seed)
    rig = Rig(tuple(Imu(f"imu{i + 1}", GRADE, position=rng.uniform(-0.05, 0.05, 3)) for i in range(imus)))
    stamps = np.arange(1.0, duration)
    at = truth.truth(stamps)
    gnss = received(truth, rig.antenna, np.arange(1.03, duration, 1.0), seed)
    return Recording(
        rig,
        sensed(truth, rig, seed, rate_hz),
        gnss=replace(gnss, velocity=None, velocity_std=None),
        reference=Reference(stamps, at.position, at.velocity, at.attitude),
        start=start_at(truth, 1.0 / rate_hz),
        options=FilterOptions(standstill=STILL),
    )


def at_rest(duration: float) -> Recording:
    still = {name: Swing(0.0) for name in ("speed", "roll", "pitch")}
    recording = along(shaken_path(duration, heading=Swing(1.2), **still), duration, 50.0, 16)
    # the velocity and the bias of the gyros as a standstill at the start shows them
    start = replace(recording.start, velocity_std=np.full(3, 0.05), estimate_gyro_bias=True)
    return replace(recording, gnss=None, start=replace(start, static_interval=(0.0, 30.0)))


@pytest.mark.parametrize("method", ["enav-fusion", "nav-fusion"])
def test_the_heading_of_an_array_at_rest_stands_still(method: str) -> None:
    recording = at_rest(600.0).as_published()
    solution = batch.run(recording, method)
    assert solution.measurements["zero rate"].accepted.all()
    assert solution.measurements["zero velocity"].time.size > 590
    _, off = error_at_reference(solution, recording)
    assert np.ptp(off) < 0.1 * DEG
    std = np.sqrt(solution.phi_covariance[-1, 5])
    assert np.abs(off[-1]) < 3.0 * std
    assert np.abs(solution.velocity).max() < 0.05


def test_a_smooth_drive_is_never_taken_for_rest() -> None:
    duration = 3600.0
    truth = shaken_path(
        duration,
        speed=Swing(9.0, 0.0, 7.0, 0.02),
        roll=Swing(0.0),
        pitch=Swing(0.0),
        heading=Swing(0.5, 0.0, 0.3, 0.004),
    )
    recording = along(truth, duration, 10.0, 1)
    solution = batch.run(recording, "single")
    assert "zero velocity" not in solution.measurements
    assert "zero rate" not in solution.measurements
    assert (solution.innovations.accepted).mean() > 0.99
