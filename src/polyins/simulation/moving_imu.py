"""What an error-free IMU puts out that moves about a smooth path.

At a place u(t) in the frame p of the path, turned by C_ps(t), with w = w_ip^p and v = du/dt + w x u,

    w_is^s = C_sp w + w_ps^s,    f^s = C_sp (f(0) + A u + d(v)/dt + w x du/dt),

A = (w x)(w x) - ... as in `increments`, without dw/dt. As d(C_sp)/dt = -w_ps^s x C_sp, integration by parts needs no
second derivative:

    integral C_sp dv/dt = [C_sp v] + integral w_ps^s x (C_sp v).

The integrals are Simpson's over the samples of the motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polyins.kernels.jit import kernel
from polyins.simulation.flexible import FlexibleMount, shape_of, tip_motion
from polyins.simulation.increments import rates
from polyins.simulation.path import Path
from polyins.simulation.shaking import Shaking

Array = NDArray[np.float64]

FINE_STEPS = 10
"""samples of the motion in each interval: 2 kHz for increments at 200 Hz"""
BLOCK = 20_000  # instants worked on at once


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
    return np.array([np.prod([(at - other) / (end - other) for other in ends if other != end], axis=0) for end in ends])


def smooth_rates(path: Path, count: int, interval: float) -> Array:
    """Return w_ip^p, f(0), A of a path at the ends of `count` intervals, and one before and after, (count + 3, 15).

    A path turns and speeds up over seconds: a cubic between these ends is exact to 1e-8 rad/s and 1e-7 m/s^2.
    """
    time = interval * np.arange(-1.0, count + 2.0)
    parts = []
    for first in range(0, time.size, BLOCK):
        rate, force, arm = rates(path, time[first : first + BLOCK])
        parts.append(np.hstack([rate, force, arm.reshape(-1, 9)]))
    return np.vstack(parts)


class _Tip(NamedTuple):
    """How the tip of a mount moves."""

    motion: Array
    """of the body, as in `Shaking`"""
    change: Array
    flexing: Array
    """from `flex`"""
    shape: Array
    """from `shape_of`"""


class _Samples(NamedTuple):
    """What is worked out at the samples of an interval."""

    cubic: Array
    """from `interpolation`"""
    weights: Array
    """from `simpson`"""


def moving_increments(smooth: Array, ruler: FlexibleMount, flexing: Array, shaking: Shaking) -> tuple[Array, Array]:
    """Return (dtheta, dvel), shape (T, 3) each, of an IMU in its own axes.

    `smooth` is from `smooth_rates`, `flexing` from `flex`.
    """
    increments = np.empty((len(smooth) - 3, 6))
    tip = _Tip(shaking.motion, shaking.change, flexing, shape_of(ruler))
    _integrate(smooth, tip, _Samples(interpolation(), simpson(shaking.step)), np.empty(42), increments)
    return increments[:, :3].copy(), increments[:, 3:].copy()


@kernel
def _integrate(smooth: Array, tip: _Tip, samples: _Samples, scratch: Array, increments: Array) -> None:
    """Write dtheta and dvel of each interval."""
    rates_now, moved, seen, felt = scratch[:15], scratch[15:33], scratch[33:36], scratch[36:42]
    motion, change, flexing, shape = tip
    cubic, weights = samples
    for k in range(len(increments)):
        total = increments[k]
        for i in range(6):
            total[i] = 0.0
        for j in range(FINE_STEPS + 1):
            n = k * FINE_STEPS + j
            _interpolate(smooth, k, cubic, j, rates_now)
            tip_motion(motion[n], change[n], flexing[n], shape, moved)
            _felt(rates_now, moved, seen, felt)
            # the rate is nearly the derivative of these angles: only the rest needs quadrature
            felt[0] -= change[n, 2] + shape[3] * flexing[n, 2]
            felt[1] -= change[n, 1] + flexing[n, 3]
            for i in range(6):
                total[i] += weights[j] * felt[i]
            if j == 0 or j == FINE_STEPS:
                sign = 1.0 if j else -1.0
                total[0] += sign * (motion[n, 2] + shape[3] * flexing[n, 0])
                total[1] += sign * (motion[n, 1] + flexing[n, 1])
                for i in range(3):
                    total[3 + i] += sign * seen[i]


@kernel
def _interpolate(smooth: Array, k: int, cubic: Array, j: int, rates_now: Array) -> None:
    """Write the rates of the path at sample j of interval k."""
    for i in range(15):
        rates_now[i] = (
            cubic[0, j] * smooth[k, i]
            + cubic[1, j] * smooth[k + 1, i]
            + cubic[2, j] * smooth[k + 2, i]
            + cubic[3, j] * smooth[k + 3, i]
        )


@kernel
def _felt(path: Array, moved: Array, seen: Array, felt: Array) -> None:
    """Write C_sp v over `seen`, and w_is^s and the part of f^s that needs quadrature over `felt`."""
    w, force, arm = path[:3], path[3:6], path[6:15]
    rate, place, speed = moved[9:12], moved[12:15], moved[15:18]
    _to_module(moved, w[0], w[1], w[2], felt, 0)
    vx = speed[0] + w[1] * place[2] - w[2] * place[1]
    vy = speed[1] + w[2] * place[0] - w[0] * place[2]
    vz = speed[2] + w[0] * place[1] - w[1] * place[0]
    _to_module(moved, vx, vy, vz, seen, 0)
    fx = force[0] + arm[0] * place[0] + arm[1] * place[1] + arm[2] * place[2] + w[1] * speed[2] - w[2] * speed[1]
    fy = force[1] + arm[3] * place[0] + arm[4] * place[1] + arm[5] * place[2] + w[2] * speed[0] - w[0] * speed[2]
    fz = force[2] + arm[6] * place[0] + arm[7] * place[1] + arm[8] * place[2] + w[0] * speed[1] - w[1] * speed[0]
    _to_module(moved, fx, fy, fz, felt, 3)
    felt[0] += rate[0]
    felt[1] += rate[1]
    felt[2] += rate[2]
    felt[3] += rate[1] * seen[2] - rate[2] * seen[1]
    felt[4] += rate[2] * seen[0] - rate[0] * seen[2]
    felt[5] += rate[0] * seen[1] - rate[1] * seen[0]


@kernel
def _to_module(moved: Array, x: float, y: float, z: float, out: Array, to: int) -> None:
    """Write C_sp times a vector; C_ps begins `moved`."""
    for i in range(3):
        out[to + i] = moved[i] * x + moved[3 + i] * y + moved[6 + i] * z
