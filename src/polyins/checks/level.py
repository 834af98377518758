"""Whether gravity points down: of each IMU on its own, where it stands or moves steadily."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.checks.gravity_turn import gyro_axes
from polyins.checks.sensor_columns import renamed
from polyins.checks.stream_checks import UPRIGHT, steady_force, upright_axes
from polyins.config.imu import FORWARD_RIGHT_DOWN
from polyins.formats.rows import intervals
from polyins.model.axes import axes_matrix
from polyins.model.findings import Finding
from polyins.model.recording import usual_interval


def upside(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say which IMU's axes do not have gravity point down."""
    for one in evidence.body:
        force = steady_force(one.stream.time, one.stream.dtheta, one.stream.dvel)
        if force is None or -force[2] >= UPRIGHT * np.linalg.norm(force):
            continue
        named = one.imu.rotation @ axes_matrix(one.entry.axes).T
        right = upright_axes(one.entry.axes, named.T @ force)
        shown = ", ".join(f"{value:.1f}" for value in force)
        yield Diagnosis(
            Finding(
                "axes",
                f"IMU {one.name}: in steady motion its axes [{', '.join(one.entry.axes)}] feel [{shown}] m/s^2 forward,"
                " right, down; expected about [0, 0, -9.8]",
                "serious",
                stream=one.name,
                size=f"[{', '.join(one.entry.axes)}]",
                expected=f"[{', '.join(right)}]",
                remedy=f"say axes: [{', '.join(right)}]; which of them is forward gravity does not tell",
            ),
            (one.setting("axes", value=list(right)),),
        )


def handedness(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say whose gyro turns otherwise than gravity does in its accelerometer: swapped or mirrored axes, or signs."""
    for one in evidence.body:
        rates = one.rows.dtheta / intervals(one.rows.time)[:, None]
        right = gyro_axes(rates, one.rows.dvel, usual_interval(one.rows.time))
        if right is None or right == FORWARD_RIGHT_DOWN:
            continue
        yield Diagnosis(
            Finding(
                "axes",
                f"IMU {one.name}: gravity turns in its accelerometer as if the axes of its gyro were "
                f"[{', '.join(right)}]",
                "serious",
                stream=one.name,
                axis="gyro",
                size="[x, y, z]",
                expected=f"[{', '.join(right)}]",
                remedy="look at the signs and columns of the gyro in its file",
            ),
            renamed(one, "gyro", axes_matrix(right)),
        )
