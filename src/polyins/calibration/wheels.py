"""A wheel seen by an IMU that turns with it: spin axis, spin and yaw, lever arm from centripetal acceleration.

Spin axis and lever arm follow from the geometry of a rolling wheel: the sum of all rotations lies along the axle,
because what the vehicle's yaw adds turns with the wheel and averages out; and off the axle the specific force has a
part -spin^2 r that does not turn with the wheel, as gravity does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.motion import Motion, RunningSums, smoothed
from polyins.calibration.regression import Fit, blocks, fit
from polyins.errors import InputError
from polyins.model.recording import Array
from polyins.model.rig import DEG

LARGEST_BIAS = 10.0 * DEG  # rad/s: a wheel that turns faster rolls
WINDOW = 1.0  # s
QUIET = 3.0  # times the quietest windows
LEAST_QUIET = 0.3 * DEG  # rad/s: what a perfect gyro is allowed to vary at rest
SHORTEST_STANDSTILL = 2.0  # s, altogether
ROLLING = 1.0  # rad/s
LEAST_TURNS = 5.0
GRAVITY_SIGMA = 0.8  # s: gravity in the wheel, its turning taken out, is averaged over about twice this
SPIN_RATE_SIGMA = 0.025  # s


@dataclass(frozen=True)
class SpinAxis:
    """The axle as the IMU sees it."""

    axis: Array
    """unit vector in the stream's axes, shape (3,), with the sense in which the net rotation is positive"""
    std: Array
    """rad, of its two components across, in the stream's axes, shape (3,)"""
    bias: Array
    """of the gyro, from standstills, rad/s, shape (3,)"""


def still(motion: Motion) -> NDArray[np.bool_]:
    """Return where a wheel stands, shape (T,): slower than any bias, and as quiet as it ever gets."""
    from scipy.ndimage import uniform_filter1d

    rows = max(2, round(WINDOW * motion.rate_hz))
    mean = uniform_filter1d(motion.rate, rows, axis=0, mode="nearest")
    square = uniform_filter1d(motion.rate**2, rows, axis=0, mode="nearest")
    spread = np.sqrt(np.maximum(square - mean**2, 0.0).max(axis=1))
    slow = np.linalg.norm(mean, axis=1) < LARGEST_BIAS
    if not slow.any():
        return np.zeros(len(slow), dtype=np.bool_)
    return np.asarray(slow & (spread < max(QUIET * float(np.quantile(spread[slow], 0.1)), LEAST_QUIET)))


def spin_axis(motion: Motion, name: str) -> SpinAxis:
    """Find the axis about which a wheel turns; raise InputError without a standstill or without rolling."""
    stands = still(motion)
    if float(motion.steps[stands].sum()) < SHORTEST_STANDSTILL:
        raise InputError(f"IMU {name}: no standstill of {SHORTEST_STANDSTILL:g} s; expected one, for the gyro's bias")
    bias = np.median(motion.rate[stands], axis=0)
    rate = motion.rate - bias
    strongest = np.linalg.eigh(rate.T @ rate)[1][:, -1]
    spin = rate @ strongest
    rolls = np.abs(spin) > ROLLING
    turns = float(np.sum(np.abs(spin * motion.steps)[rolls])) / (2.0 * np.pi)
    if turns < LEAST_TURNS:
        raise InputError(f"IMU {name}: it turns {turns:.1f} times; expected at least {LEAST_TURNS:g}, on a wheel")
    axis = strongest * np.sign(np.sum((spin * motion.steps)[rolls]))
    across = plane(axis)
    size = np.abs(spin[rolls])
    piece = blocks(int(rolls.sum()))
    # weights of one over the rate: the sum of all rotations, not of their squares
    fits = [fit((rate @ axis)[rolls, None], (rate @ one)[rolls], piece, 1.0 / size) for one in across]
    tilted = axis + fits[0].values[0] * across[0] + fits[1].values[0] * across[1]
    std = np.sqrt((fits[0].std[0] * across[0]) ** 2 + (fits[1].std[0] * across[1]) ** 2)
    return SpinAxis(tilted / np.linalg.norm(tilted), std, bias)


def plane(axis: Array) -> Array:
    """Return two unit vectors that make a right-handed frame with a third one, `axis`; shape (2, 3)."""
    start = np.roll(np.eye(3)[np.argmax(np.abs(axis))], 1)
    one = start - axis * (axis @ start)
    one /= np.linalg.norm(one)
    return np.array([one, np.cross(axis, one)])


def turns(motion: Motion, found: SpinAxis) -> RunningSums:
    """Integrate the spin about the axle and the vehicle's yaw about the vertical (upwards), rad, two columns.

    The yaw is the part of the rate in the wheel that lies along gravity in the wheel, which needs no angle of the
    wheel to be known.
    """
    rate = motion.rate - found.bias
    spin = rate @ found.axis
    one, two = plane(found.axis)
    up, angle = _up_in_wheel(motion, spin, one, two)
    in_wheel = (rate @ one + 1j * (rate @ two)) * np.exp(1j * angle)
    return motion.running(np.column_stack([spin, np.real(in_wheel * np.conj(up))]))


def _up_in_wheel(motion: Motion, spin: Array, one: Array, two: Array) -> tuple[Array, Array]:
    """Return where up is in the wheel as a unit complex number, the spin taken out, and the angle of the spin."""
    angle = np.cumsum(spin * motion.steps) - 0.5 * spin * motion.steps
    force = (motion.force @ one + 1j * (motion.force @ two)) * np.exp(1j * angle)
    rows = GRAVITY_SIGMA * motion.rate_hz
    mean = smoothed(force.real, rows) + 1j * smoothed(force.imag, rows)
    return mean / np.maximum(np.abs(mean), np.finfo(float).tiny), angle


def lever_arm(motion: Motion, found: SpinAxis, across: Array) -> Fit:
    """Find where the IMU sits off the axle: its components along the two unit vectors `across`, m.

    In the wheel the specific force is -spin^2 r + (rate of spin) x r, gravity and the vehicle's acceleration, which
    turn with the wheel, and the accelerometer's bias, which does not. `across`, shape (2, 3), makes a right-handed
    frame with the axis as its third vector.
    """
    spin = (motion.rate - found.bias) @ found.axis
    change = np.gradient(smoothed(spin, SPIN_RATE_SIGMA * motion.rate_hz), motion.edges[1:])
    up, angle = _up_in_wheel(motion, spin, *across)
    gravity = up * np.exp(-1j * angle)
    zero, one = np.zeros(len(spin)), np.ones(len(spin))
    first = np.column_stack([-(spin**2), -change, one, zero, gravity.real, -gravity.imag])
    second = np.column_stack([change, -(spin**2), zero, one, gravity.imag, gravity.real])
    rolls = np.abs(spin) > ROLLING
    piece = blocks(int(rolls.sum()))
    design = np.vstack([first[rolls], second[rolls]])
    observed = np.concatenate([(motion.force @ across[0])[rolls], (motion.force @ across[1])[rolls]])
    whole = fit(design, observed, np.concatenate([piece, piece]))
    return replace(whole, values=whole.values[:2], covariance=whole.covariance[:2, :2])
