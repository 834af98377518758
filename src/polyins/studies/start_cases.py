"""Simulated starts, each drawn by its number: what carries the array, how good IMUs and fixes are, what is given.

Odd numbers are for reports, even ones for setting thresholds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polyins.config import Noise
from polyins.errors import InputError
from polyins.evaluation.summary import summarize
from polyins.model.attitude import rotation_matrices
from polyins.model.recording import Recording, StartOptions
from polyins.model.rig import DEG
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.simulation import motions
from polyins.simulation.drive_scenario import Drive
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.increments import increments
from polyins.simulation.path import Path
from polyins.simulation.run import TrueRun, record, true_run
from polyins.simulation.scenario import Board, Fixes, Scenario
from polyins.simulation.wheel_scenario import WheelModule

Array = NDArray[np.float64]

Motion = Callable[[np.random.Generator, float], Path]

MOTIONS: dict[str, Motion] = {
    "rest": motions.drive_after_rest,
    "lying": motions.lying,
    "drive": motions.drive_under_way,
    "flight": motions.flight,
    "walk": motions.walk,
    "hover": motions.hover,
    "rotors": motions.sideways,
}
KINDS = (*MOTIONS, "wheels")
GIVEN = ("lying", "hover", "rotors")
"""kinds whose heading is given in half of the cases, for the motion may not show it"""
SHOWN = ("rest", "drive", "flight", "walk", "wheels")
"""kinds that have to start"""
DURATION = 75.0  # s
RATES = (50.0, 100.0)
UNLEVELLED = ("wheel-ins", "dual-wheel-ins")
"""methods without an IMU on the body, which tell neither roll nor pitch"""
WHEEL_METHODS = ("wheel-ins", "body-ins", "dual-wheel-ins", "triple-ins", "triple-ins/centralized")
WATCHED = 20.0
"""s after the start in which heading and tilt are looked at"""
HEADING_STD = 1.0 * DEG
"""rad, of one that is given"""
DATASHEET = {
    "grade": "consumer-mems",
    "angle_random_walk_deg_sqrt_h": 0.35,
    "velocity_random_walk_m_s_sqrt_h": 0.15,
}


@dataclass(frozen=True)
class StartCase:
    """One start."""

    number: int
    kind: str
    method: str
    recording: Recording
    truth: Path
    given: bool
    """whether the heading is given"""


def _none() -> Array:
    return np.zeros(0)


@dataclass(frozen=True)
class StartOutcome:
    """What became of a start."""

    case: StartCase
    refused: str = ""
    """why"""
    heading: Array = field(default_factory=_none)
    """error at the first epoch and in the time after it, rad"""
    heading_std: Array = field(default_factory=_none)
    """rad"""
    tilt: Array = field(default_factory=_none)
    """error over std of roll and pitch, the larger one; empty where the method does not tell them"""
    covered: float = 0.0
    """share of the recording that has a solution"""
    level: str = ""
    """of the verdict"""

    def slim(self) -> StartOutcome:
        """Return it without the data of the recording."""
        recording = self.case.recording
        empty = replace(recording, imus=(), gnss=None, reference=None)
        return replace(self, case=replace(self.case, recording=empty))


def case(number: int) -> StartCase:
    """Return the start of that number."""
    rng = np.random.default_rng([number, 15])
    kind = KINDS[number // 2 % len(KINDS)]
    scenario = _scenario(kind, rng, number)
    run = true_run(scenario) if kind == "wheels" else _along(MOTIONS[kind](rng, DURATION), scenario)
    simulation = record(run, seed=number)
    given = kind in GIVEN and bool(rng.random() < 0.5)
    recording = replace(simulation.recording, start=StartOptions())
    if given:
        time = recording.imus[0].time[0]
        true = float(run.path.truth([time]).attitude[0, 2])
        given_heading = true + rng.normal(0.0, HEADING_STD)
        recording = replace(recording, start=StartOptions(heading=given_heading, heading_time=float(time)))
    count = len(recording.imus)
    array = "single" if count == 1 else str(rng.choice(["enav-fusion", "imu-fusion", "nav-fusion"]))
    method = str(rng.choice(WHEEL_METHODS)) if kind == "wheels" else array
    return StartCase(number, kind, method, recording, run.path, given)


def outcome(one: StartCase) -> StartOutcome:
    """Run a start and compare it with the truth."""
    try:
        solution = batch.run(one.recording, one.method)
    except InputError as error:
        return StartOutcome(one, refused=str(error))
    phi, variance = errors(solution, one.truth)
    shown = solution.time <= solution.time[0] + WATCHED
    std = np.sqrt(variance[shown])
    span = one.recording.imus[0].time
    return StartOutcome(
        one,
        heading=np.abs(phi[shown, 2]),
        heading_std=std[:, 2],
        tilt=_none() if one.method in UNLEVELLED else np.max(np.abs(phi[shown, :2]) / std[:, :2], axis=1),
        covered=float((solution.time[-1] - solution.time[0]) / (span[-1] - span[0])),
        level=summarize(solution, None)["verdict"]["level"],
    )


def errors(solution: Solution, truth: Path) -> tuple[Array, Array]:
    """Return the errors phi of the attitude, north, east, down, rad, shape (T, 3), and their stated variances."""
    true = rotation_matrices(truth.truth(solution.time).quaternion)
    turned = rotation_matrices(solution.attitude) @ true.transpose(0, 2, 1)
    return -Rotation.from_matrix(turned).as_rotvec(), solution.phi_covariance[:, [0, 3, 5]]


def _scenario(kind: str, rng: np.random.Generator, number: int) -> Scenario:
    """Draw how good IMUs and fixes are."""
    std = float(np.exp(rng.uniform(np.log(0.02), np.log(5.0))))
    velocity = float(np.exp(rng.uniform(np.log(0.03), np.log(0.3)))) if rng.random() < 0.5 else None
    fixes = Fixes(
        rate_hz=float(rng.choice([1.0, 2.0, 5.0, 10.0])),
        phase_s=float(rng.uniform(0.0, 0.9)),
        position_std_m=(std, std, 2.0 * std),
        velocity_std_m_s=None if velocity is None else (velocity, velocity, velocity),
    )
    # three sigma of the largest are three degrees a second
    turn_on = np.exp(rng.uniform(np.log(0.02), np.log(1.0)))
    sensor_errors = SensorErrors(
        gyro_turn_on_deg_h=float(3600.0 * turn_on),
        accel_turn_on_mgal=float(1e3 * np.exp(rng.uniform(np.log(1.0), np.log(20.0)))),
    )
    common = {
        "name": f"start {number}: {kind}",
        "seed": number,
        "duration_s": DURATION,
        "rate_hz": float(rng.choice(RATES)),
        "noise": Noise.model_validate(DATASHEET),
        "errors": sensor_errors,
        "gnss": fixes,
        "outages": (),
    }
    if kind == "wheels":
        left, right = ((0.0, side, 0.0) for side in (-0.6, 0.6))
        return Scenario(
            **common,
            static_s=float(rng.uniform(4.0, 10.0)),
            drive=Drive(top_speed_m_s=float(rng.uniform(1.5, 4.0)), turn_radius_m=3.0),
            imus=Board(count=int(rng.choice([1, 4])), pitch_m=0.0),
            wheels=tuple(
                WheelModule(name=name, position_m=place, chips=1) for name, place in (("left", left), ("right", right))
            ),
        )
    return Scenario(**common, static_s=0.0, imus=Board(count=int(rng.choice([1, 2, 4, 8, 16]))))


def _along(path: Path, scenario: Scenario) -> TrueRun:
    return TrueRun(scenario, path, increments(path, scenario.rate_hz), (), ())
