"""Made recordings that are hard to begin or to go on with, against what is written beside them as right.

Errors are those at the epochs of the reference, which is too slow to be interpolated where somebody walks.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import polyins as pi
from polyins.errors import InputError
from polyins.model.attitude import euler_angles, euler_variance
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording
from polyins.model.solution import Solution

GAIN = {"enav-fusion": 1.1, "nav-fusion": 1.1, "imu-fusion": 1.1}
"""of rms after a gap against that of the better IMU alone"""

pytestmark = pytest.mark.usefixtures("data_folder")


def folder() -> Path:
    return Path(os.environ["POLYINS_DATA"]) / "logs" / "cases"


@cache
def expected(name: str) -> dict:
    return YAML(typ="safe").load(folder() / "expected.yaml")[name]


@cache
def recording(name: str, config: str = "config.yaml") -> Recording:
    return pi.load(folder() / name / config)


@dataclass(frozen=True)
class Errors:
    """At the epochs of the reference that the solution has."""

    time: np.ndarray
    position: np.ndarray
    """m, over std beside it"""
    position_over: np.ndarray
    attitude: np.ndarray
    """deg"""
    attitude_std: np.ndarray

    def rms(self, begin: float, end: float) -> float:
        inside = (self.time >= begin) & (self.time <= end)
        assert inside.any()
        return float(np.sqrt(np.mean(np.sum(self.position[inside, :2] ** 2, axis=1))))


def errors(name: str, solution: Solution, config: str = "config.yaml") -> Errors:
    reference = recording(name, config).reference
    assert reference is not None
    assert reference.attitude is not None
    at = np.searchsorted(solution.time, reference.time)
    at = np.clip(at, 1, len(solution.time) - 1)
    at -= reference.time - solution.time[at - 1] < solution.time[at] - reference.time
    kept = np.abs(solution.time[at] - reference.time) < 0.006
    at = at[kept]
    assert len(at) > 50
    metres = metres_per_unit(reference.position[0], True)
    moved = solution.velocity[at] * [1.0, 1.0, -1.0] * (reference.time[kept] - solution.time[at])[:, None]
    off = (solution.position[at] - reference.position[kept]) * metres + moved
    angles = euler_angles(solution.attitude[at])
    turned = (angles - reference.attitude[kept] + np.pi) % (2 * np.pi) - np.pi
    std = np.sqrt(euler_variance(angles, solution.phi_covariance[at]))
    return Errors(
        reference.time[kept],
        off,
        np.abs(off) / np.sqrt(solution.position_variance[at]),
        np.degrees(np.abs(turned)),
        np.degrees(std),
    )


@pytest.mark.parametrize("name", ["start-rtk-end", "start-traffic-light", "walk"])
def test_who_is_under_way_begins_at_once(name: str) -> None:
    known, solution = expected(name), pi.run(recording(name), "single")
    found = errors(name, solution)
    assert solution.time[0] <= known["start_time_s_at_most"]
    assert solution.time[-1] - solution.time[0] >= known["solution_covers_s_at_least"]
    assert found.rms(solution.time[0], solution.time[-1]) <= known["horizontal_rms_m_at_most"]
    later = found.time > solution.time[0] + 20.0
    bound = known.get("heading_rms_deg_after_20_s_at_most", known.get("heading_rms_deg_after_20_s"))
    assert np.sqrt(np.mean(found.attitude[later, 2] ** 2)) <= bound
    assert found.attitude[0, 2] <= known.get("heading_error_deg_at_the_start_at_most", 12.0)
    assert np.max(found.attitude[:, 2] / found.attitude_std[:, 2]) <= 3.5


def refused(name: str) -> bool:
    try:
        pi.find_start(recording(name))
    except InputError as refusal:
        return "start.heading_deg" in str(refusal)
    return False


NOT_MET = pytest.mark.xfail(strict=True, reason="3.6 standard deviations at 63 s; 3.5 are asked for")


@pytest.mark.parametrize("name", [pytest.param("start-positions-5m", marks=NOT_MET), "start-positions-5m-slow"])
def test_a_course_of_noisy_positions_is_as_sure_as_it_says(name: str) -> None:
    if name == "start-positions-5m-slow" and refused(name):
        return
    solution = pi.run(recording(name), "single")
    found = errors(name, solution)
    assert np.max(found.attitude[:, 2] / found.attitude_std[:, 2]) <= 3.5
    assert not np.any((found.attitude[:, 2] > 90.0) & (found.attitude_std[:, 2] < 25.0))
    bound = expected(name).get("heading_error_deg_at_most_after_80_s")
    if bound is not None:
        assert found.attitude[found.time > 80.0, 2].max() <= bound


def test_steady_acceleration_is_no_standstill() -> None:
    name = "start-accelerating"
    known, solution = expected(name), pi.run(recording(name), "single")
    found = errors(name, solution)
    assert solution.time[0] <= known["start_time_s_at_most"]
    later = found.time > 20.0
    assert found.attitude[later, 0].max() <= known["roll_error_deg_at_most_after_20_s"]
    assert found.attitude[later, 1].max() <= known["pitch_error_deg_at_most_after_20_s"]
    assert found.attitude[found.time > 40.0, 2].max() <= known["heading_error_deg_at_most_after_40_s"]
    assert np.max(found.attitude / found.attitude_std) <= 4.0


def test_after_a_gap_of_everything_the_flight_goes_on() -> None:
    name = "gap-37"
    known = expected(name)
    alone = [errors(name, pi.run(recording(name), "single", imu=i)).rms(79.0, 117.0) for i in range(2)]
    for method, most in GAIN.items():
        solution = pi.run(recording(name), method)
        found = errors(name, solution)
        assert found.rms(79.0, 117.0) <= most * min(alone)
        size, after = np.linalg.norm(found.position[:, :2], axis=1), found.time >= 77.0
        assert size[found.time <= 40.0].max() <= known["horizontal_error_m_at_most"]["40 s"]
        assert size[found.time >= 79.0].max() <= known["horizontal_error_m_at_most"]["79-117 s"]
        assert found.position_over[after].max() <= 3.5
        assert np.max(found.attitude[after] / found.attitude_std[after]) <= 3.5
        assert np.mean(np.sum(found.position_over[after] ** 2, axis=1)) <= known["nees_position_at_most"]


def test_after_a_pause_of_ten_minutes_the_drive_goes_on() -> None:
    name = "pause-628"
    solution = pi.run(recording(name))
    found = errors(name, solution)
    assert any(one.kind == "restart" for one in solution.findings)
    assert found.rms(0.0, 30.0) <= 0.8
    assert found.rms(662.0, 688.0) <= 0.8
    assert found.position_over[found.time >= 658.0].max() <= 3.5


@pytest.mark.parametrize("config", ["config.yaml", "moving.yaml"])
def test_of_two_grades_the_worse_one_is_named(config: str) -> None:
    solution = pi.run(recording("two-grades", config), "enav-fusion")
    verdict = pi.evaluate(solution, recording("two-grades", config).reference)["verdict"]
    assert any("imu2" in one["stream"] or "imu2" in one["text"] for one in verdict["findings"])
