"""Paper A, Fig. 7: what an IMU on a ruler shows as the robot rolls over a book, in test B.

The paper's text names what stands out: the rate about x, and the force along y and z.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from polyins.model.recording import ImuStream
from polyins.model.rig import DEG
from polyins.studies.pictures import lines, write_figure
from polyins.studies.rigid_array import Array
from polyins_papers import nonrigid

BEFORE, AFTER = 1.0, 4.0
"""s around the instant at which the front wheels reach the first book: it holds the first two books"""
ON_THE_LEFT = 1
"""the IMU on the left end of the longest ruler: most books lie under the left wheels, the first two among them"""
AXES = "xyz"


def reproduce(
    quick: bool = False, progress: Callable[[float], None] | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Return the std of each axis before and after the first book; `quick` changes nothing."""
    scenario = nonrigid.scenario_of("test B", quick=True)
    hit = scenario.outage_intervals()[0][0]
    scenario = scenario.model_copy(update={"duration_s": hit + AFTER + 1.0, "outages": ()})
    stream = nonrigid.recording_of(scenario, 0).imus[ON_THE_LEFT]
    time, rate, force = around(stream, hit)
    if out is not None:
        write_figure(curves(time - hit, rate / DEG, "rate (deg/s)"), out / "afig7-gyro.html")
        write_figure(curves(time - hit, force, "specific force (m/s²)"), out / "afig7-accelerometer.html")
    if progress:
        progress(1.0)
    return {
        "target": "afig7",
        "paper": {},
        "polyins": {
            "gyro_deg_s": shaken(time - hit, rate / DEG),
            "accelerometer_m_s2": shaken(time - hit, force),
        },
        "settings": {
            "imu": stream.name,
            "figures": f"std over {BEFORE:g} s before the first book and {AFTER:g} s from it on, and their ratio",
            "scenario": scenario.model_dump(mode="json"),
        },
    }


def around(stream: ImuStream, hit: float) -> tuple[Array, Array, Array]:
    """Return times, rates, rad/s, and specific forces, m/s^2, around an instant, shapes (T,), (T, 3), (T, 3)."""
    interval = float(np.median(np.diff(stream.time)))
    shown = (stream.time > hit - BEFORE) & (stream.time < hit + AFTER)
    return stream.time[shown], stream.dtheta[shown] / interval, stream.dvel[shown] / interval


def shaken(since: Array, values: Array) -> dict[str, dict[str, float]]:
    """Return how much each axis moves before and after the hit."""
    before, after = values[since < 0.0].std(axis=0), values[since >= 0.0].std(axis=0)
    return {
        axis: {"before": float(calm), "after": float(rough), "times": float(rough / calm)}
        for axis, calm, rough in zip(AXES, before, after, strict=True)
    }


def curves(since: Array, values: Array, title: str) -> Any:
    """Return the picture of three axes over the time since the hit."""
    by_axis = {axis: (since.tolist(), column.tolist()) for axis, column in zip(AXES, values.T, strict=True)}
    return lines(by_axis, "time since the front wheels reach the first book (s)", title, markers=False)
