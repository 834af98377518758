"""What the turn of gravity says of a gyro: in the axes of an IMU that turns, the force at constant speed turns back.

du/dt = -w x u of its direction u, whatever the axes are called, as long as they are right-handed and those of both
sensors. Turns about the vertical are not seen.
"""

from __future__ import annotations

import numpy as np

from polyins.model.recording import Array
from polyins.prepare.mounts import NAMES, TURNS, UNCHANGED

WINDOW_S = 0.5
LEAST_WINDOWS = 20
AGREES = 0.7
"""correlation from which the turn of gravity tells"""
EXPLAINED = 0.25
"""of the squares, that other axes may leave, of which those stated explain `NOTHING`"""
NOTHING = 0.9
MANY_WINDOWS = 60
"""that tell of 48 kinds of axes which they are"""
ALIKE = 1.2
"""times the least squares: axes that fit as well"""


def turn_of_gravity(rates: Array, force: Array, step: float) -> float | None:
    """Return how much the force turns for a turn of the gyro, both of shape (T, 3), where they agree; else None."""
    found = _turns(rates, force, step)
    if found is None:
        return None
    turned, turn, up = found
    wanted = -np.cross(turn, up).ravel()
    turned = turned.ravel()
    size = float(np.linalg.norm(turned) * np.linalg.norm(wanted))
    if not size > 0.0 or float(turned @ wanted) < AGREES * size:
        return None
    return float(turned @ wanted) / float(wanted @ wanted)


def gyro_axes(rates: Array, force: Array, step: float) -> tuple[str, str, str] | None:
    """Return the axes of the gyro that make the force turn as it does, if those stated do not; rates in rad/s."""
    found = _turns(rates, force, step)
    if found is None or len(found[0]) < MANY_WINDOWS:
        return None
    turned, turn, up = found
    cost = np.array([float(np.sum((turned + np.cross(turn @ axes.T, up)) ** 2)) for axes in TURNS])
    power, stated = float(np.sum(turned**2)), float(cost[np.argmax(UNCHANGED)])
    if cost.min() > EXPLAINED * power or stated < NOTHING * power:
        return None
    best = int(np.argmax(np.where(cost <= ALIKE * cost.min(), UNCHANGED, -np.inf)))
    return NAMES[best]


def _turns(rates: Array, force: Array, step: float) -> tuple[Array, Array, Array] | None:
    """Return by how much the force's direction turned from window to window, the turn, and the direction between."""
    rows = max(round(WINDOW_S / step) if step > 0.0 else 1, 1)
    count = len(rates) // rows
    if count < LEAST_WINDOWS:
        return None
    turn = rates[: count * rows].reshape(count, rows, 3).sum(axis=1) * step
    means = force[: count * rows].reshape(count, rows, 3).mean(axis=1)
    up = means / np.linalg.norm(means, axis=1)[:, None]
    return np.diff(up, axis=0), 0.5 * (turn[1:] + turn[:-1]), 0.5 * (up[1:] + up[:-1])
