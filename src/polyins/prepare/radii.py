"""Which wheels of a vehicle roll as if their radius were another: each one's speed, in the middle, against the others'.

On a curve the outer wheel is faster, by the rate of turn times how far out it is. The wheels tell that rate themselves:
what an IMU in a wheel sees of it turns with the wheel, as gravity does. Turned back by the angle that its gyro counts,
the mean force says which way is up, and the rate along it is the vehicle's. So it does not matter which of the wheels a
method takes: that they disagree is known of the recording.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, Recording, usual_interval
from polyins.model.rig import Imu

Array = NDArray[np.float64]

WINDOW = 5.0
"""s over which speeds are averaged"""
LEAST_WINDOWS = 6
TURNS, RESTS = 5.0, 0.07
"""rad/s: a wheel that spins faster makes turns enough in a window, one that spins slower by bias alone rests"""
WHOLE = 0.98
"""of the samples that a window has"""
LEAST, SIGMAS = 0.01, 3.0
"""share by which the speeds of wheels may differ in any case: tyres, and that a wheel rolls on a road; and times what
is known of the radii and of the gyros, besides"""


def of_radii(recording: Recording) -> tuple[Finding, ...]:
    """Return which of the wheels that do not steer differ in what they say of the speed all along.

    Of two that differ both are named, since it cannot be told which is right. `recording`: with all its wheels,
    whichever a method takes.
    """
    rig, streams = recording.rig, recording.imus
    modules = [of for of in rig.modules().values() if (one := rig.imus[of[0]].wheel) and not one.steering]
    used = [streams[i] for module in modules for i in module]
    if len(modules) < 2 or min(len(stream.time) for stream in used) < 2:
        return ()
    edges = np.arange(max(one.time[0] for one in used), min(one.time[-1] for one in used), WINDOW)
    if len(edges) <= LEAST_WINDOWS:
        return ()
    seen = np.array([np.mean([_seen(rig.imus[i], streams[i], edges) for i in module], axis=0) for module in modules])
    spin, turn = seen[:, 0], seen[:, 1]
    rolls = (np.abs(spin) > TURNS).all(axis=0)
    if rolls.sum() < LEAST_WINDOWS:
        return ()
    firsts = [rig.imus[module[0]] for module in modules]
    bias, bias_std = _at_rest(firsts, spin)
    radius, radius_std = np.array([(imu.wheel.radius, imu.wheel.radius_std) for imu in firsts if imu.wheel]).T
    right = np.array([imu.position[1] for imu in firsts])
    speed = (-radius[:, None] * (spin - bias[:, None]) + np.median(turn, axis=0) * right[:, None])[:, rolls]
    share = np.median(speed / np.median(speed, axis=0) - 1.0, axis=1)
    known = np.hypot(bias_std / np.median(np.abs(spin[:, rolls]), axis=1), radius_std)
    span = edges[np.flatnonzero(rolls)[[0, -1]]] + [0.0, WINDOW]
    return tuple(_differing([imu.name for imu in firsts], share, known, span))


def _seen(imu: Imu, stream: ImuStream, edges: Array) -> Array:
    """Return the mean spin and the mean rate of turn to the right in each window, rad/s, NaN without data, (2, W)."""
    dtheta, dvel = stream.dtheta, stream.dvel
    back = np.exp(1j * (np.cumsum(dtheta[:, 0]) - 0.5 * dtheta[:, 0]))
    across, force = ((one[:, 1] + 1j * one[:, 2]) * back for one in (dtheta, dvel))
    sums = np.cumsum([dtheta[:, 0], across.real, across.imag, force.real, force.imag], axis=1)
    spin, *rest = np.diff([np.interp(edges, stream.time, one) for one in sums], axis=1) / WINDOW
    rate, up = rest[0] + 1j * rest[1], rest[2] + 1j * rest[3]
    turn = -np.real(rate * np.conj(up)) / np.maximum(np.abs(up), np.finfo(float).tiny)
    samples = np.diff(np.searchsorted(stream.time, edges))
    whole = samples > WHOLE * WINDOW / usual_interval(stream.time)
    return np.where(whole, [spin - imu.initial_errors.as_array()[0], turn], np.nan)


def _at_rest(imus: list[Imu], spin: Array) -> tuple[Array, Array]:
    """Return the bias that each gyro shows along the axle while all rest, and the std of it, rad/s, (M,) each."""
    rests = (np.abs(spin) < RESTS).all(axis=0)
    if not rests.any():
        return np.zeros(len(imus)), np.array([imu.start_std()[0] for imu in imus])
    return np.median(spin[:, rests], axis=1), np.zeros(len(imus))


def _differing(names: list[str], share: Array, known: Array, span: Array) -> Iterator[Finding]:
    """Return which wheels are off the middle by a share that is more than is known of them, (M,) each."""
    two = len(names) == 2
    if two:
        share, known = np.array([(1.0 + share[0]) / (1.0 + share[1]) - 1.0]), np.array([np.hypot(*known)])
    for i in np.flatnonzero(np.abs(share) > LEAST + SIGMAS * known):
        whom = f"IMU {names[1]}" if two else "the others"
        percent = 100.0 * float(share[i])
        yield Finding(
            "wheel",
            f"IMU {names[i]} rolls {abs(percent):.2g} % {'farther' if percent > 0.0 else 'less far'} than {whom}",
            "doubt",
            stream=", ".join(names) if two else names[i],
            from_s=float(span[0]),
            to_s=float(span[1]),
            size=percent,
            expected=0.0,
            remedy="measure the radii, or state their radius_std",
        )
