"""How an IMU is mounted on a vehicle's body, from what it feels while the vehicle speeds up, turns and climbs.

Forward acceleration is the change of wheel speed, acceleration to the right is speed x yaw rate, and the road's slope
is the change of GNSS height over the way; what remains of the mean specific force is the vehicle's up. Its lean under
acceleration and in turns lies in the sensitivities, not in the mounting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polyins.calibration.motion import Motion, RunningSums
from polyins.calibration.regression import Fit, blocks, fit
from polyins.errors import InputError
from polyins.model.recording import Array
from polyins.model.rig import DEG, STANDARD_GRAVITY

WINDOW = 2.0  # s
STEP = 0.25  # s
SPEED_WINDOW = 0.2  # s
LEAST_SPEED = 1.5  # m/s
LEAST_TIME = 10.0  # s
CROSSFALL_STD = 1.0 * DEG
"""Roads fall to the side, and nothing in a drive tells that from a roll of the mount."""
SLOPE_STD = 2.0 * DEG
"""of the road, where no heights are known"""


@dataclass(frozen=True)
class Mount:
    """Roll, pitch and yaw of an IMU in the vehicle."""

    angles: Array
    """roll, pitch, yaw, rad, shape (3,): C_vb = Rz(yaw) Ry(pitch) Rx(roll)"""
    std: Array
    """rad, shape (3,)"""


def mount(body: Motion, rolled: RunningSums, height: RunningSums | None, name: str) -> Mount:
    """Find what is left of the mounting angles of a body IMU whose stream is nearly forward-right-down.

    `rolled`: way, m, and upward yaw, rad, of the middle of the axle; `height`: of the antenna, m, None: the road is
    taken as level. Raises InputError for less than ten seconds of driving.
    """
    middle = _driving(body, rolled, height)
    if len(middle) * STEP < LEAST_TIME:
        raise InputError(f"IMU {name}: less than {LEAST_TIME:g} s of driving; expected more, for its mounting")
    begin, end = middle - 0.5 * WINDOW, middle + 0.5 * WINDOW
    way, yaw = rolled.between(begin, end).T
    speed = way / WINDOW
    force = body.running(body.force).between(begin, end) / WINDOW
    design = np.column_stack([(_speed(rolled, end) - _speed(rolled, begin)) / WINDOW, -speed * yaw / WINDOW])
    design = np.column_stack([design, np.ones(len(middle))])
    piece, weights = blocks(len(middle)), np.abs(speed)
    slope = np.zeros(len(middle)) if height is None else height.between(begin, end)[:, 0] / way
    forward = np.array([1.0, 0.0, 0.0])
    for _ in range(2):  # gravity along the slope is felt along the forward axis, which is known better the second time
        level = force - STANDARD_GRAVITY * slope[:, None] * forward
        fits = [fit(design, level[:, k], piece, weights) for k in range(3)]
        angles, std = _angles(fits)
        forward = np.array([np.cos(angles[2]), -np.sin(angles[2]), 0.0])
    unknown = [CROSSFALL_STD, SLOPE_STD if height is None else 0.0, 0.0]
    return Mount(angles, np.hypot(std, unknown))


def _driving(body: Motion, rolled: RunningSums, height: RunningSums | None) -> Array:
    """Return the middles of windows in which all is known and the vehicle drives, s."""
    spans = [(float(body.edges[0]), float(body.edges[-1])), rolled.span, *([height.span] if height else [])]
    reach = 0.5 * (WINDOW + SPEED_WINDOW)
    middle = np.arange(max(s[0] for s in spans) + reach, min(s[1] for s in spans) - reach, STEP)
    if not len(middle):
        return middle
    way = rolled.between(middle - 0.5 * WINDOW, middle + 0.5 * WINDOW)[:, 0]
    return np.asarray(middle[np.abs(way) > LEAST_SPEED * WINDOW])


def _speed(rolled: RunningSums, at: Array) -> Array:
    return rolled.between(at - 0.5 * SPEED_WINDOW, at + 0.5 * SPEED_WINDOW)[:, 0] / SPEED_WINDOW


def _angles(fits: list[Fit]) -> tuple[Array, Array]:
    """Return roll, pitch, yaw and their std from what each axis feels of acceleration forward and right, and of up."""
    felt = np.array([one.values for one in fits])  # axes x (forward, right, up)
    std = np.array([one.std for one in fits])
    up = felt[:, 2]
    roll = np.arctan2(-up[1], -up[2])
    pitch = np.arctan2(up[0], np.hypot(up[1], up[2]))
    yaws = np.array([np.arctan2(-felt[1, 0], felt[0, 0]), np.arctan2(felt[0, 1], felt[1, 1])])
    yaw_std = np.array([std[1, 0] / abs(felt[0, 0]), std[0, 1] / abs(felt[1, 1])])
    trust = 1.0 / np.maximum(yaw_std, 1e-6) ** 2
    yaw = float(yaws @ trust / trust.sum())
    # that the two disagree by more than their std counts too
    scatter = abs(yaws[0] - yaws[1]) * np.sqrt(trust.prod()) / trust.sum()
    yaw_spread = np.hypot(trust.sum() ** -0.5, scatter)
    return np.array([roll, pitch, yaw]), np.array([*std[[1, 0], 2] / STANDARD_GRAVITY, yaw_spread])
