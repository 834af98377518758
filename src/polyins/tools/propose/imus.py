"""The lines of an IMU: its file, its clock, its axes and its noise."""

from __future__ import annotations

import numpy as np

from polyins.config import NOISE_GRADES
from polyins.config.yaml_document import quoted
from polyins.formats.rows import ImuRows, intervals
from polyins.model.recording import usual_interval
from polyins.model.rig import DEG, HOUR
from polyins.tools.inspect import describe
from polyins.tools.propose.axes import axes_lines
from polyins.tools.propose.lines import Line
from polyins.tools.propose.places import BY_UTC, TO_ONE_CLOCK, format_lines, point_line
from polyins.tools.propose.sources import FoundStream, Roles

GRADE = "consumer-mems"
FULL_SCALES_DEG_S = (125.0, 250.0, 300.0, 400.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0)
NEAR_FULL_SCALE = 0.0025
FEWEST_AT_FULL_SCALE = 5
FEWEST_SHAKEN = 100
"""rows that tell how much they shake"""
MEDIAN_TO_STD = 1.4826


def imu_lines(number: int, imu: FoundStream, of: Roles) -> list[Line]:
    """Return the entry of an IMU in the list of them."""
    assert isinstance(imu.rows, ImuRows)
    facts = describe(imu.rows)
    lines = [Line(f"  - name: imu{number}"), Line(f"    file: {quoted(imu.path)}"), *format_lines(imu, "    ")]
    lines.append(Line(f"    # {facts['rows']} rows, {facts['duration_s']:.1f} s at {facts['rate_hz'] or 0.0:.2f} Hz"))
    if facts["repeated_stamps"] and facts["duration_s"] > 0.0:
        rate = (facts["rows"] - 1) / facts["duration_s"]
        lines.append(
            Line(f"    rate_hz: {rate:.6g}", f"{facts['repeated_stamps']} stamp(s) repeat, so rows are counted")
        )
    shift = imu.shift_to(of.imus[0])
    if shift:
        lines.append(Line(f"    clock_offset_s: {shift!r}", BY_UTC))
    elif number > 1 and imu.log is None and imu.path != of.imus[0].path:
        lines.append(Line("    clock_offset_s: 0.0", TO_ONE_CLOCK))
    full = full_scale(imu.rows)
    if full is not None:
        lines.append(
            Line(f"    gyro_range_deg_s: {full:.6g}", "where the values of the gyro end, so rows there are left out")
        )
    return [
        *lines,
        *axes_lines(imu, facts, of.odometer),
        point_line("    position_m", imu),
        _noise_line(imu.rows, imu.log.noise.get(imu.stream) if imu.log else None),
    ]


def full_scale(rows: ImuRows) -> float | None:
    """Return the full scale of a gyro, deg/s, whose largest value is one that is usual and often there; else None."""
    if rows.gyro_range_deg_s is not None or len(rows.time) < FEWEST_SHAKEN:
        return None
    rates = np.abs(rows.dtheta / intervals(rows.time)[:, None]) / DEG
    largest = float(np.nanmax(rates))
    usual = any(abs(largest / scale - 1.0) < NEAR_FULL_SCALE for scale in FULL_SCALES_DEG_S)
    return largest if usual and int((rates > largest * (1.0 - 1e-6)).sum()) >= FEWEST_AT_FULL_SCALE else None


def _noise_line(rows: ImuRows, stated: tuple[float, float] | None = None) -> Line:
    """Return a grade, or where the rows shake more than that, or than the log states, the random walks of this."""
    angle, velocity = shaking(rows)
    usual = NOISE_GRADES[GRADE]
    if stated is not None:
        angle, velocity = max(angle, stated[0]) / DEG * np.sqrt(HOUR), max(velocity, stated[1]) * np.sqrt(HOUR)
        given = f"angle_random_walk_deg_sqrt_h: {angle:.3g}, velocity_random_walk_m_s_sqrt_h: {velocity:.3g}"
        return Line(f"    noise: {{grade: {GRADE}, {given}}}", "what the log states, or shakes from row to row if more")
    grades = f"a grade ({', '.join(NOISE_GRADES)}), a common IMU by name, or figures"
    walks = {
        "angle_random_walk_deg_sqrt_h": angle / DEG * np.sqrt(HOUR),
        "velocity_random_walk_m_s_sqrt_h": velocity * np.sqrt(HOUR),
    }
    if not any(walk > usual[key] for key, walk in walks.items()):
        return Line(f"    noise: {GRADE}", grades)
    given = ", ".join(f"{key}: {max(walk, usual[key]):.3g}" for key, walk in walks.items())
    why = f"{grades}; what shakes from row to row is taken for noise"
    return Line(f"    noise: {{grade: {GRADE}, {given}}}", why)


def shaking(rows: ImuRows) -> tuple[float, float]:
    """Return the random walks, rad/sqrt(s) and m/s/sqrt(s), that vibration makes, of the worst axis.

    What changes from row to row is taken for white: of second differences a steady motion is no part, and their
    variance is six times that of what is white. Their median size is not moved by shocks.
    """
    if len(rows.time) < FEWEST_SHAKEN:
        return 0.0, 0.0
    step = usual_interval(rows.time)
    sizes = []
    for increments in (rows.dtheta, rows.dvel):
        changes = np.abs(np.diff(increments, 2, axis=0))
        white = float(np.nanmedian(changes, axis=0).max()) * MEDIAN_TO_STD / np.sqrt(6.0)
        sizes.append(white / np.sqrt(step) if step > 0.0 else 0.0)
    return sizes[0], sizes[1]
