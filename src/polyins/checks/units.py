"""Whether values have the units that the configuration says: rates or increments, deg or rad, g or m/s^2, ms or s.

A force is gravity's most of the time. What a gyro turns is compared with how gravity, the course over ground and the
other IMUs turn: a wrong unit makes a factor of 57 or of the rate.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.checks.gravity_turn import turn_of_gravity
from polyins.checks.stream_checks import GRAVITY_M_S2, MAX_TURN_RAD, RATES_HZ
from polyins.config.yaml_document import Setting
from polyins.formats.rows import intervals
from polyins.formats.stamps import SECONDS
from polyins.model.findings import Finding
from polyins.model.recording import Array, usual_interval
from polyins.model.rig import DEG, STANDARD_GRAVITY
from polyins.prepare.delays import LEAST_TURNS, turns_of_course
from polyins.prepare.plausible import BODY, WHEEL

FAR = 1.0
"""of the logarithm of a factor, from which the unit is wrong"""
NEAR = 0.5
"""of it, by which the factor of another unit may be off"""
GRAVITY_LIKE = 0.25
"""of the logarithm of a force that is gravity's most of the time"""
AGREES = 0.8
"""correlation of the course, or of other IMUs, with a gyro"""
WINDOW_S = 0.5
LEAST_WINDOWS = 20
LEAST_TURN_RAD_S = 0.03
"""rms, of what others turn"""


def of_time(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say whose stamps are in another unit of time."""
    for one in evidence.imus:
        rate = 1.0 / usual_interval(one.rows.time)
        if RATES_HZ[0] <= rate <= RATES_HZ[1]:
            continue
        columns = one.entry.columns
        now = columns.time.unit if columns and columns.time else "s"
        right = next((unit for unit, of in SECONDS.items() if 10.0 <= rate * SECONDS[now] / of <= 5000.0), None)
        known = right is not None and columns is not None and columns.time is not None
        yield Diagnosis(
            Finding(
                "sampling",
                f"IMU {one.name}: {rate:.4g} rows a second of its stamps; expected {RATES_HZ[0]:g} to {RATES_HZ[1]:g}"
                + (f": they count {right}, not {now}" if right else ""),
                "serious",
                stream=one.name,
                size=rate,
                remedy=f"say unit: {right} of columns.time" if right else "say the unit of time, or give rate_hz",
            ),
            (one.setting("columns", "time", "unit", value=right),) if known else (),
        )


def of_values(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say whose gyro or accelerometer is in another unit."""
    course = _Course.of(evidence)
    for one in evidence.imus:
        if one.rows.units_known or len(one.rows.time) < LEAST_WINDOWS:
            continue
        step = usual_interval(one.rows.time)
        accel = _accel_unit(one, step)
        gyro = _gyro_unit(one, evidence, course, step, accel)
        yield from _told(one, gyro, accel)


def _accel_unit(one: ImuEvidence, step: float) -> str:
    """Return the unit that makes the force gravity's, or the one stated."""
    now, wheel = one.rows.accel_unit, one.entry.wheel
    size = float(np.median(np.linalg.norm(one.rows.dvel, axis=1))) / step
    spin = float(np.median(np.linalg.norm(one.rows.dtheta, axis=1))) / step if wheel else 0.0
    if GRAVITY_M_S2[0] <= size <= GRAVITY_M_S2[1] + (wheel.radius_m * spin**2 if wheel else 0.0):
        return now
    units = {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "m/s": 1.0 / step}
    off = {unit: abs(float(np.log(size * of / units[now] / STANDARD_GRAVITY))) for unit, of in units.items()}
    best = min(off, key=lambda unit: off[unit])
    return best if off[best] < GRAVITY_LIKE else now


def _gyro_unit(one: ImuEvidence, evidence: Evidence, course: _Course | None, step: float, accel: str) -> str:
    """Return the unit that makes the gyro turn as gravity, the course or the others do, or the one stated."""
    now = one.rows.gyro_unit
    units = {"rad/s": 1.0, "deg/s": DEG, "rad": 1.0 / step, "deg": DEG / step}
    rates = one.rows.dtheta / intervals(one.rows.time)[:, None]
    told = [] if one.entry.wheel else [turn_of_gravity(rates, one.rows.dvel, step), _by_others(one, evidence)]
    if course is not None and one.entry.wheel is None:
        told.append(course.ratio(one))
    ratios = [ratio for ratio in told if ratio is not None and ratio > 0.0]
    rms = float(np.sqrt(np.mean(np.sum(rates**2, axis=1))))
    increments = {"rad", "deg"} if accel == "m/s" else {"rad/s", "deg/s"}
    if not ratios:
        limit = WHEEL.rms_rate if one.entry.wheel else BODY.rms_rate
        most = float(np.linalg.norm(one.rows.dtheta, axis=1).max())
        too_fast = rms > limit or (most > MAX_TURN_RAD and not one.entry.wheel)
        fit = [unit for unit in increments if unit != now and rms * units[unit] / units[now] < limit]
        return fit[0] if too_fast and len(fit) == 1 else now
    ratio = float(np.median(ratios))
    if abs(np.log(ratio)) < FAR:
        return now
    off = {unit: abs(float(np.log(ratio * units[now] / of))) for unit, of in units.items()}
    near = [unit for unit in units if off[unit] < NEAR]
    return min(near, key=lambda unit: (unit not in increments, off[unit]), default=now)


class _Course:
    """How the course over ground turns."""

    def __init__(self, evidence: Evidence) -> None:
        assert evidence.recording.gnss is not None
        self._turns = turns_of_course(evidence.recording.gnss, evidence.recording.geodetic)

    @classmethod
    def of(cls, evidence: Evidence) -> _Course | None:
        """Return it of a recording that has fixes."""
        return None if evidence.recording.gnss is None else cls(evidence)

    def ratio(self, one: ImuEvidence) -> float | None:
        """Return how much the course turns for a turn of the gyro about down, where they agree."""
        turns = self._turns
        if len(turns.begin) < LEAST_TURNS:
            return None
        yaw = np.cumsum(one.stream.dtheta[:, 2])
        own = turns.centred(turns.by_gyros(one.stream.time, yaw, np.zeros((1, 1)))[0])
        turned = turns.centred(turns.turned)
        size = float(np.linalg.norm(own) * np.linalg.norm(turned))
        return float(own @ turned / (own @ own)) if size > 0.0 and float(own @ turned) > AGREES * size else None


def _by_others(one: ImuEvidence, evidence: Evidence) -> float | None:
    """Return how much the middle one of the other IMUs turns for a turn of this one, whatever their axes are."""
    others = [other for other in evidence.body if other.index != one.index]
    if len(others) < 2:
        return None
    begin = max(other.stream.time[0] for other in evidence.body)
    end = min(other.stream.time[-1] for other in evidence.body)
    edges = np.arange(begin, end, WINDOW_S)
    if len(edges) <= LEAST_WINDOWS:
        return None
    own, middle = _speeds(one, edges), np.median([_speeds(other, edges) for other in others], axis=0)
    if np.sqrt(np.mean(middle**2)) < LEAST_TURN_RAD_S or np.corrcoef(own, middle)[0, 1] < AGREES:
        return None
    return float(own @ middle / (own @ own))


def _speeds(one: ImuEvidence, edges: Array) -> Array:
    """Return how fast an IMU turns, over windows, rad/s."""
    total = np.cumsum(one.stream.dtheta, axis=0)
    at_edges = np.column_stack([np.interp(edges, one.stream.time, column) for column in total.T])
    return np.asarray(np.linalg.norm(np.diff(at_edges, axis=0), axis=1) / WINDOW_S)


def _told(one: ImuEvidence, gyro: str, accel: str) -> Iterator[Diagnosis]:
    """Say which units are wrong; the settings of both sensors stand together where the file's format says them."""
    stated = {"gyro": one.rows.gyro_unit, "accel": one.rows.accel_unit}
    for sensor, right in (("gyro", gyro), ("accel", accel)):
        now = stated[sensor]
        if right == now:
            continue
        yield Diagnosis(
            Finding(
                "units",
                f"IMU {one.name}: its {'gyro' if sensor == 'gyro' else 'accelerometer'} counts {right}, not {now}",
                "serious",
                stream=one.name,
                axis=sensor,
                size=now,
                expected=right,
                remedy=f"say unit: {right} (format: table, columns)",
            ),
            _settings(one, sensor, gyro, accel),
        )


def _settings(one: ImuEvidence, sensor: str, gyro: str, accel: str) -> tuple[Setting, ...]:
    if one.entry.columns is not None:
        return (one.setting("columns", sensor, "unit", value=gyro if sensor == "gyro" else accel),)
    if one.rows.source.first_line is None or one.entry.stream:
        return ()
    # the seven columns of KF-GINS without a header
    columns: dict[str, Any] = {
        "time": {"name": 1},
        "gyro": {"names": [2, 3, 4], "unit": gyro},
        "accel": {"names": [5, 6, 7], "unit": accel},
    }
    return one.setting("format", value="table"), one.setting("columns", value=columns)
