"""Ground that does not twist: under a path over it both wheels of an axle stay on the ground without sliding sideways.

A vehicle whose rate about its own x axis is zero moves every point of its axle along x alone, so the nonholonomic
constraint holds at the wheels as it does in the middle. With w_x = droll/dt - dheading/dt sin(pitch) = 0 the roll
follows from pitch and heading.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.simulation.path import Path, Profile, path

Array = NDArray[np.float64]

SLOPE_STEP = 0.1  # s
ROLL_STEP = 0.01  # s


def without_twist(twisting: Path, adapts: float = 20.0) -> Path:
    """Return the path of the same speed and heading over ground that does not twist and has similar slopes.

    The slope adapts to the one that the path had over a way of `adapts`, m.
    """
    from scipy.integrate import solve_ivp
    from scipy.interpolate import CubicSpline

    begin = np.zeros(1)
    tilt = [float(twisting.pitch(begin)[0]), float(twisting.roll(begin)[0])]
    nodes = np.linspace(0.0, twisting.duration, int(np.ceil(twisting.duration / SLOPE_STEP)) + 1)

    def change(time: float, tilt: Array) -> list[float]:
        (pitch, roll), at = tilt, np.array([time])
        turn = float(twisting.heading(at, 1)[0])
        towards = float(twisting.speed(at)[0] * (twisting.pitch(at)[0] - pitch)) / adapts
        return [towards / np.cos(roll) - turn * np.tan(roll) * np.cos(pitch), turn * np.sin(pitch)]

    slopes = solve_ivp(change, (0.0, twisting.duration), tilt, t_eval=nodes, max_step=1.0, rtol=1e-6, atol=1e-9)
    pitch = CubicSpline(nodes, slopes.y[0])
    fine = np.linspace(0.0, twisting.duration, int(np.ceil(twisting.duration / ROLL_STEP)) + 1)
    roll = CubicSpline(fine, twisting.heading(fine, 1) * np.sin(pitch(fine))).antiderivative()
    roll.c[-1] += tilt[1]
    return path(
        Profile(twisting.speed, roll, pitch, twisting.heading),
        duration=twisting.duration,
        static=twisting.static,
        start=twisting.position(begin)[0],
        world=twisting.world,
    )
