"""What an error-free IMU puts out that moves about a smooth path.

At a place u(t) in the frame p of the path, turned by C_ps(t), with w = w_ip^p and v = du/dt + w x u,

    w_is^s = C_sp w + w_ps^s,    f^s = C_sp (f(0) + A u + d(v)/dt + w x du/dt),

A = (w x)(w x) - ... as in `increments`, without dw/dt. As d(C_sp)/dt = -w_ps^s x C_sp, integration by parts needs no
second derivative:

    integral C_sp dv/dt = [C_sp v] + integral w_ps^s x (C_sp v).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from polyins.simulation.flexible import TipMotion
from polyins.simulation.increments import rates
from polyins.simulation.path import Path
from polyins.simulation.shaking import to_frame

Array = NDArray[np.float64]

FINE_STEPS = 10
"""samples of the motion in each interval: 2 kHz for increments at 200 Hz"""
BLOCK = 2_000  # intervals worked on at once


def simpson(step: float) -> Array:
    """Return the weights of the samples of one interval, its ends included, s, shape (FINE_STEPS + 1,)."""
    weights = np.full(FINE_STEPS + 1, 2.0)
    weights[1::2], weights[0], weights[-1] = 4.0, 1.0, 1.0
    return weights * step / 3.0


def interpolation() -> Array:
    """Return the cubic that passes through the ends of three intervals, at the samples of the middle one.

    Shape (4, FINE_STEPS + 1): what each end weighs.
    """
    at, ends = np.linspace(0.0, 1.0, FINE_STEPS + 1), (-1.0, 0.0, 1.0, 2.0)
    return np.array(
        [np.prod([(at - other) / (end - other) for other in ends if other != end], axis=0) for end in ends]
    )


def smooth_rates(path: Path, count: int, interval: float) -> Array:
    """Return w_ip^p, f(0), A of a path at the ends of `count` intervals, and one before and after, (count + 3, 15).

    A path turns and speeds up over seconds: a cubic between these ends is exact to 1e-9 rad/s and m/s^2.
    """
    time = interval * np.arange(-1.0, count + 2.0)
    parts = []
    for first in range(0, time.size, 20_000):
        rate, force, arm = rates(path, time[first : first + 20_000])
        parts.append(np.hstack([rate, force, arm.reshape(-1, 9)]))
    return np.vstack(parts)


def moving_increments(
    smooth: Array, motion: Callable[[slice], TipMotion], interval: float
) -> tuple[Array, Array]:
    """Return (dtheta, dvel), shape (T, 3) each, of an IMU in its own axes.

    `smooth` is from `smooth_rates`; `motion` returns a slice of the samples, FINE_STEPS in each interval.
    """
    count = len(smooth) - 3
    dtheta, dvel = np.empty((count, 3)), np.empty((count, 3))
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        moved = motion(slice(first * FINE_STEPS, last * FINE_STEPS + 1))
        dtheta[first:last], dvel[first:last] = _integrate(smooth[first : last + 3], moved, interval)
    return dtheta, dvel


def _integrate(smooth: Array, moved: TipMotion, interval: float) -> tuple[Array, Array]:
    rate, force, arm = np.split(_at_samples(smooth), [3, 6], axis=1)
    step = interval / FINE_STEPS
    turning = to_frame(moved.C_ps, rate) + moved.rate
    v = moved.speed + np.cross(rate, moved.place)
    seen = to_frame(moved.C_ps, v)
    push = force + (arm.reshape(-1, 3, 3) @ moved.place[..., None])[..., 0] + np.cross(rate, moved.speed)
    felt = to_frame(moved.C_ps, push) + np.cross(moved.rate, seen)
    # the rate is nearly the derivative of the angles: only the rest needs quadrature
    rest = turning - moved.angle_rates
    return (
        _integral(rest, step) + np.diff(moved.angles[::FINE_STEPS], axis=0),
        _integral(felt, step) + np.diff(seen[::FINE_STEPS], axis=0),
    )


def _at_samples(smooth: Array) -> Array:
    """Return the rates of the path at all samples, shape (T, 15)."""
    windows = np.lib.stride_tricks.sliding_window_view(smooth, 4, axis=0)
    values = np.swapaxes(windows @ interpolation(), 1, 2)
    return np.vstack([values[:, :-1].reshape(-1, smooth.shape[1]), values[-1, -1:]])


def _integral(values: Array, step: float) -> Array:
    """Return the integrals over the intervals, shape (intervals, 3)."""
    inner = values[:-1].reshape(-1, FINE_STEPS, 3)
    weights = simpson(step)
    return np.asarray(np.einsum("k,tki->ti", weights[:-1], inner) + weights[-1] * values[FINE_STEPS::FINE_STEPS])
