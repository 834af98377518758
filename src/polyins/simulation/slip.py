"""Slip of a wheel: by which share it turns more than it rolls, all the time and for short periods."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from polyins.simulation.path import smooth_steps

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

LEAST_GAP = 1e-3  # s: knots of a spline must not coincide


def slip_periods(
    duration: float, rng: np.random.Generator, *, constant: float, size: float, length: float, every: float
) -> PPoly:
    """Return a slip that is constant but for periods in which it is greater by up to `size`, drawn evenly.

    A period lasts `length`; from the end of one to the next it takes `every` in the mean, drawn exponentially; all
    in s. Each rises and falls smoothly.
    """
    knots = [(0.0, constant)]
    while knots[-1][0] < duration:
        begin = knots[-1][0] + max(rng.exponential(every), LEAST_GAP)
        top = constant + size * rng.random()
        knots += [(begin, constant), (begin + length / 2.0, top), (begin + length, constant)]
    return smooth_steps(*np.array(knots).T)
