"""How a vehicle rolls is told by its IMUs alone, at any instant of a drive."""

from __future__ import annotations

import numpy as np
import pytest
from driven_vehicle import drive, without

from polyins.errors import InputError
from polyins.prepare.alignment import level
from polyins.prepare.rolling_start import RollingMotion, rolling_motion
from polyins.prepare.timesync import align

TIMES = (30.0, 47.3, 61.9, 88.8)
RECORDING = drive()


def told(time: float, only_wheels: bool = False) -> RollingMotion:
    kept = [i for i, imu in enumerate(RECORDING.rig.imus) if imu.wheel is not None or not only_wheels]
    known = RECORDING.subset(kept)
    return rolling_motion(known.rig, align(known.imus, bridge=False), np.zeros((len(kept), 12)), time)


@pytest.mark.parametrize("time", TIMES)
@pytest.mark.parametrize("only_wheels", [False, True])
def test_speed_is_that_of_the_reference(time: float, only_wheels: bool) -> None:
    reference = RECORDING.reference
    assert reference is not None
    assert reference.velocity is not None
    speed = np.linalg.norm(reference.velocity[np.searchsorted(reference.time, time)])
    assert told(time, only_wheels).speed == pytest.approx(speed, abs=0.05)


@pytest.mark.parametrize("time", TIMES)
def test_body_and_axles_lean_as_the_vehicle_does(time: float) -> None:
    motion, reference = told(time), RECORDING.reference
    assert reference is not None
    assert reference.attitude is not None
    truth = reference.attitude[np.searchsorted(reference.time, time)]
    for force, imu in zip(motion.forces, RECORDING.rig.imus, strict=True):
        roll, pitch = level(force, motion.acceleration, 0.0 if imu.wheel is None else np.pi / 2.0)
        if imu.wheel is None:
            np.testing.assert_allclose((roll, pitch), truth[:2], atol=np.radians(0.3))
        else:
            assert -pitch == pytest.approx(truth[0], abs=np.radians(0.3))


def test_an_imu_without_data_is_named() -> None:
    recording = without(RECORDING, "left1", 40.0, 41.0)
    with pytest.raises(InputError, match=r"left1 has no data around 40\.5"):
        rolling_motion(recording.rig, align(recording.imus, bridge=False), np.zeros((3, 12)), 40.5)
