"""Which of the axes of an IMU point forward, right and down."""

from __future__ import annotations

from typing import Any

import numpy as np

from polyins.checks.stream_checks import Axes, upright_axes
from polyins.formats.log import Log
from polyins.formats.rows import ImuRows, SensorRows, intervals
from polyins.model.axes import axes_matrix, composed, right_handed_axes
from polyins.tools.propose.lines import TURNED, Line
from polyins.tools.propose.sources import FoundStream

SENSOR_AXES: Axes = ("x", "y", "z")
STILL_RAD_S = 0.1
FAST_RAD_S = 1.0
"""of the mean rate, above which the force tells what is down at rest only"""
FEWEST_AT_REST = 100
"""rows that hardly turn"""
SLOWEST_RAD_S = 0.1
"""less than that hardly turns: biases of cheap gyros are as large"""
FORWARD_IS_A_GUESS = "forward is a guess"
LEAST_SIGMAS = 4.0
"""of what chance makes, by which a horizontal axis agrees with the acceleration of the speed if it is forward"""
FEWEST_MEANS = 20
"""of a second, to tell which axis points forward"""
MOUNT = Line("    mount_deg: [0, 0, 0]", "roll, pitch, yaw that the axes are off by, deg")


def axes_lines(imu: FoundStream, facts: dict[str, Any], speed: FoundStream | None) -> list[Line]:
    """Return which axes point forward, right, down: by the format, by gravity, or by what a speed changes."""
    if imu.log is not None and imu.log.upright:
        own = imu.log.axes.get(imu.stream, SENSOR_AXES)
        return [Line(f"    axes: [{', '.join(own)}]  # forward, right, down, as the format has them")]
    if imu.log is not None and (imu.log.axes or imu.stream in imu.log.points):
        axes = composed(shared_axes(imu.log), imu.log.axes.get(imu.stream, SENSOR_AXES))
        why = f"as the log has them to each other, turned upright; {FORWARD_IS_A_GUESS}"
        return [Line(f"    axes: [{', '.join(axes)}]", why, TURNED), MOUNT]
    force = np.array(facts["accel_mean_m_s2"] or [0.0, 0.0, -9.8], dtype=float)
    if isinstance(imu.rows, ImuRows) and (still := resting_force(imu.rows)) is not None:
        force = still
    axes, forward = upright_axes(SENSOR_AXES, force), ""
    if speed is not None and isinstance(imu.rows, ImuRows) and isinstance(speed.rows, SensorRows):
        axes, correlation, sigmas = forward_axes(axes, imu.rows, speed.rows)
        if sigmas > LEAST_SIGMAS:
            forward = f"forward feels what {speed.stream} accelerates, correlation {correlation:.2f}"
    mean = ", ".join(f"{value:.1f}" for value in force)
    why = f"sensor axes that point forward, right, down; {forward or FORWARD_IS_A_GUESS}"
    return [
        Line(f"    # at rest or on average the sensor feels [{mean}] m/s^2, so down is known"),
        Line(f"    axes: [{', '.join(axes)}]", why, None if forward else TURNED),
        MOUNT,
    ]


def resting_force(rows: ImuRows) -> np.ndarray | None:
    """Return the mean specific force, m/s^2, of the rows that hardly turn, if the others turn fast; else None."""
    steps = intervals(rows.time)[:, None]
    rate = np.linalg.norm(rows.dtheta / steps, axis=1)
    still = rate < STILL_RAD_S
    if not still.sum() >= FEWEST_AT_REST or float(np.nanmean(rate)) < FAST_RAD_S:
        return None
    force: np.ndarray = np.asarray(np.nanmean((rows.dvel / steps)[still], axis=0))
    return force


def shared_axes(log: Log) -> Axes:
    """Return which of the axes that a log's IMUs share point forward, right, down, by their force while they rest."""
    forces = [axes_matrix(log.axes.get(name, SENSOR_AXES)) @ _force_at_rest(rows) for name, rows in log.imus.items()]
    force = np.mean(forces, axis=0)
    return SENSOR_AXES if log.upright or not force.any() else upright_axes(SENSOR_AXES, force)


def _force_at_rest(rows: ImuRows) -> np.ndarray:
    """Return the mean specific force, shape (3,), of the rows that hardly turn; of all if these are few."""
    steps = intervals(rows.time)
    resting = np.linalg.norm(rows.dtheta, axis=1) < SLOWEST_RAD_S * steps
    chosen = resting if resting.sum() >= FEWEST_AT_REST else steps > 0.0
    return np.asarray(rows.dvel[chosen].sum(axis=0) / max(float(steps[chosen].sum()), 1e-9))


def forward_axes(axes: Axes, rows: ImuRows, speed: SensorRows) -> tuple[Axes, float, float]:
    """Return the axes of the same down whose forward force goes best with the acceleration of the speed.

    Returns their correlation as well, and how many times it is what chance makes of so many means. Both are means over
    a second, in which tilt and vibration count little.
    """
    ends = np.arange(max(rows.time[0], speed.time[0]) + 1.0, min(rows.time[-1], speed.time[-1]), 1.0)
    if len(ends) < FEWEST_MEANS:
        return axes, 0.0, 0.0
    gained = np.diff(np.interp(ends, speed.time, speed.value))
    sums = np.column_stack([np.interp(ends, rows.time, total) for total in np.nancumsum(rows.dvel, axis=0).T])
    felt = np.diff(sums, axis=0)
    felt = felt - felt.mean(axis=0)
    gained = gained - gained.mean()
    size = np.linalg.norm(felt, axis=0) * np.linalg.norm(gained)
    agreement = (felt * gained[:, None]).sum(axis=0) / np.where(size > 0.0, size, np.inf)
    candidates = [one for one in right_handed_axes() if one[2] == axes[2]]
    best = max(candidates, key=lambda one: float(axes_matrix(one)[0] @ agreement))
    correlation = float(axes_matrix(best)[0] @ agreement)
    return best, correlation, correlation * float(np.sqrt(len(gained)))
