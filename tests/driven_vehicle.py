"""A small car driven for two minutes, and what tests do to its recording."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.simulation.drive_scenario import Drive
from polyins.simulation.run import record, true_run
from polyins.simulation.scenario import Board, Fixes, Scenario, SensorErrors
from polyins.simulation.wheel_scenario import WheelModule

Array = NDArray[np.float64]

DEG = np.pi / 180.0
ANTENNA = (0.2, 0.1, -0.8)
PERFECT = SensorErrors(noise=False, biases=False, scales=False)


def driven(chips: int = 1, gnss: bool = False, errors: SensorErrors = PERFECT) -> Scenario:
    """Two minutes of a small car on a plane, the first ten seconds standing."""
    sides = (("left", -0.4), ("right", 0.4))
    wheel_modules = tuple(
        WheelModule(name=name, position_m=(0.0, y, 0.0), radius_m=0.25, chips=chips, lever_arm_m=(0.0, 0.02, 0.01))
        for name, y in sides
    )
    return Scenario(
        duration_s=120.0,
        static_s=10.0,
        earth="plane",
        drive=Drive(top_speed_m_s=4.0),
        imus=Board(count=1, position_m=(0.3, 0.1, -0.4)),
        wheels=wheel_modules,
        errors=errors,
        gnss=Fixes(antenna_position_m=ANTENNA) if gnss else None,
        outages=(),
    )


@lru_cache(maxsize=8)
def drive(chips: int = 1, gnss: bool = False, errors: SensorErrors = PERFECT, seed: int = 0) -> Recording:
    """Its recording."""
    return record(true_run(driven(chips, gnss, errors)), seed=seed).recording


def with_rolling(recording: Recording, **options: Any) -> Recording:
    rolling = replace(recording.options.rolling, **options)
    return replace(recording, options=replace(recording.options, rolling=rolling))


def changed(recording: Recording, name: str, **wheel: Any) -> Recording:
    """The rig as it is configured with another wheel than it has."""
    imus = [
        replace(imu, wheel=replace(imu.wheel, **wheel)) if imu.wheel and imu.name.startswith(name) else imu
        for imu in recording.rig.imus
    ]
    return replace(recording, rig=replace(recording.rig, imus=tuple(imus)))


def without(recording: Recording, name: str, begin: float, end: float) -> Recording:
    """The recording with a hole in one stream."""
    streams = []
    for stream in recording.imus:
        kept = (stream.time <= begin) | (stream.time > end) | (stream.name != name)
        streams.append(replace(stream, time=stream.time[kept], dtheta=stream.dtheta[kept], dvel=stream.dvel[kept]))
    return replace(recording, imus=tuple(streams))


def off(solution: Solution, recording: Recording) -> Array:
    """Horizontal errors at the reference's epochs, m."""
    reference = recording.reference
    assert reference is not None
    shown = (reference.time >= solution.time[0]) & (reference.time <= solution.time[-1])
    at = [np.interp(reference.time[shown], solution.time, solution.position[:, k]) for k in range(2)]
    return np.hypot(*(np.array(at) - reference.position[shown, :2].T))


def heading(solution: Solution) -> Array:
    return np.asarray(Rotation.from_quat(solution.attitude, scalar_first=True).as_euler("ZYX")[:, 0])
