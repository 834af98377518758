"""Clocks of IMUs on one body: drift and leaps by their rates."""

from dataclasses import replace

import numpy as np
import pytest
from simulated_drive import GRADE, body_stream, drive

from polyins.calibration.offsets import imu_offsets
from polyins.model.clock import Clock
from polyins.model.recording import ImuStream
from polyins.model.rig import Imu

TRIP = drive()
FIRST, SECOND = body_stream(TRIP, "first", np.eye(3)), body_stream(TRIP, "second", np.eye(3)[[2, 0, 1]])
IMUS = [Imu("first", GRADE), Imu("second", GRADE)]


def noisy(stream: ImuStream, seed: int) -> ImuStream:
    noise = np.random.default_rng(seed).normal(0.0, 2e-6, stream.dtheta.shape)
    return replace(stream, dtheta=stream.dtheta + noise)


@pytest.mark.parametrize("drift", [0.0, 150e-6, -900e-6])
def test_offset_and_drift(drift: float) -> None:
    true = Clock(33.3, drift, 50.0)
    stamped = replace(noisy(SECOND, 1), time=true.inverse.common(SECOND.time))
    none, found = imu_offsets(IMUS, [noisy(FIRST, 2), stamped], 0)
    assert none.clock == Clock()
    assert found.clock.common(50.0) == pytest.approx(true.common(50.0), abs=min(1e-3, 5.0 * found.std_s + 2e-4))
    assert found.drift == pytest.approx(drift, abs=5.0 * found.drift_std + 2e-6)
    assert found.drift_std < 20e-6
    assert found.leaps == ()


def test_a_leap() -> None:
    true = Clock(-2.0, 60e-6, 50.0, ((61.0, -0.03),))
    stamped = replace(noisy(SECOND, 1), time=true.inverse.common(SECOND.time))
    found = imu_offsets(IMUS, [noisy(FIRST, 2), stamped], 0)[1]
    ((stamp, size, std),) = found.leaps
    assert stamp == pytest.approx(61.0, abs=0.5)
    assert size == pytest.approx(-0.03, abs=5.0 * std + 5e-4)
    assert found.clock.common(30.0) == pytest.approx(true.common(30.0), abs=1e-3)
    assert found.clock.common(90.0) == pytest.approx(true.common(90.0), abs=1e-3)


def test_uncertainties_are_right() -> None:
    over = []
    for seed in range(8):
        stamped = replace(noisy(SECOND, 2 * seed), time=SECOND.time - 7.0)
        found = imu_offsets(IMUS, [noisy(FIRST, 2 * seed + 1), stamped], 0)[1]
        over.append([(found.clock.common(found.reference_s) - found.reference_s - 7.0) / found.std_s,
                     found.drift / found.drift_std])  # fmt: skip
    assert (np.sqrt(np.mean(np.square(over), axis=0)) < 2.0).all()
