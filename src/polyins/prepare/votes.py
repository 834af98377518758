"""Which IMU of an array disagrees with the others: means over windows against their median, and what explains them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import Finding
from polyins.model.rig import DEG, Rig
from polyins.prepare import mounts
from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]

WINDOW = 5.0
"""s over which rates and forces are averaged"""
SIGMAS = 6.0
LASTING = 2
"""windows in a row"""
MISALIGNED = 0.02
"""rad, about a degree: of the rate or force, which an IMU may have too much or too little along another axis"""
LEVER = 0.1
"""m, to which the place of an IMU is known"""
UNEQUAL = 3.0
"""times noisier than another, from which an IMU is named"""
AXES = ("x", "y", "z")
DIFFERS = "disagreement"
"""kind of the finding"""


def disagreements(rig: Rig, aligned: Aligned) -> tuple[Finding, ...]:
    """Return which of three IMUs and more, or which pair, differ in rate or force by more than their figures explain.

    Of each the axis where it is most; `aligned` in array axes. A rig with wheels has IMUs that turn differently: none.
    """
    count = len(rig.imus)
    length = max(2, round(WINDOW * aligned.rate_hz))
    windows = (len(aligned.time) - 1) // length
    if rig.has_wheels or count < 2 or windows < LASTING:
        return ()
    used = slice(1, 1 + windows * length)
    edges = aligned.time[np.arange(windows + 1) * length]
    mean = aligned.increments[used].reshape(windows, length, 6, count).sum(axis=1) / np.diff(edges)[:, None, None]
    whole = ~np.asarray(aligned.missing[used].reshape(windows, length, count).any(axis=1))
    found = _judged(rig, mean, whole, edges)
    if count == 2:
        return found
    return tuple(_mount_of(rig, aligned, one) or one if one.kind == DIFFERS else one for one in found)


class Windows:
    """Sums over windows of epochs as they come, whose means `disagreements` judges."""

    def __init__(self, rig: Rig, rate_hz: float) -> None:
        """`rate_hz`: of the epochs."""
        count = 0 if rig.has_wheels else len(rig.imus)
        self.length = max(2, round(WINDOW * rate_hz)) if count > 1 else 0
        """epochs; 0: nothing is to be judged"""
        self.edges: list[float] = []
        self.means: list[Array] = []
        self.whole: list[NDArray[np.bool_]] = []
        self._sum, self._missing, self._epochs = np.zeros((6, count)), np.zeros(count, dtype=bool), 0

    def add(self, time: float, increments: Array, missing: NDArray[np.bool_]) -> None:
        """Take an epoch, (6, N) and (N,); the first one is the edge of the first window."""
        if not self.length:
            return
        if not self.edges:
            self.edges.append(time)
            return
        self._sum += increments
        self._missing |= missing
        self._epochs += 1
        if self._epochs == self.length:
            self.means.append(self._sum / (time - self.edges[-1]))
            self.whole.append(~self._missing)
            self.edges.append(time)
            self._sum, self._missing, self._epochs = 0.0 * self._sum, self.whole[-1] & False, 0

    def disagreements(self, rig: Rig) -> tuple[Finding, ...]:
        """Return what there is to say of the windows that are full."""
        if len(self.means) < LASTING:
            return ()
        return _judged(rig, np.array(self.means), np.array(self.whole), np.array(self.edges))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all that is needed to go on, for a file."""
        now = np.array([self.length, self._epochs])
        full = {"edges": np.array(self.edges), "means": np.array(self.means), "whole": np.array(self.whole)}
        return {**full, "sum": self._sum, "lacking": self._missing, "window": now}

    @classmethod
    def restored(cls, arrays: dict[str, NDArray[Any]]) -> Windows:
        """Return the windows whose arrays these are."""
        windows = cls.__new__(cls)
        windows.length, windows._epochs = (int(number) for number in arrays["window"])
        windows.edges = [float(edge) for edge in arrays["edges"]]
        windows.means, windows.whole = list(arrays["means"]), list(arrays["whole"])
        windows._sum, windows._missing = arrays["sum"].copy(), arrays["lacking"].copy()
        return windows


def _judged(rig: Rig, mean: Array, whole: NDArray[np.bool_], edges: Array) -> tuple[Finding, ...]:
    """Judge means over windows, (W, 6, N), of which those that are whole count, (W, N); `edges`: (W + 1,), s."""
    mean = mean - np.array([imu.initial_errors.as_array()[:6] for imu in rig.imus]).T
    middle = np.median(mean, axis=2, keepdims=True)
    allowed = SIGMAS * _std(rig, middle[:, :, 0]) + _unmodelled(middle[:, :, 0])[:, :, None]
    over = np.where(whole[:, None, :], np.abs(mean - middle) / allowed, 0.0)
    return (*_unequal(rig), *_found(rig, mean - middle, over, edges))


def _mount_of(rig: Rig, aligned: Aligned, finding: Finding) -> Finding | None:
    """Return the finding that other axes explain why an IMU differs, with the time that it does."""
    index = next(i for i, imu in enumerate(rig.imus) if imu.name == finding.stream)
    length = max(2, round(mounts.WINDOW * aligned.rate_hz))
    used = slice(1, 1 + (len(aligned.time) - 1) // length * length)
    there = np.asarray(~aligned.missing[used].any(axis=1).reshape(-1, length).any(axis=1))
    steps = np.diff(aligned.time[::length][: len(there) + 1])[there, None, None]
    rates = aligned.increments[used].reshape(-1, length, 6, len(rig.imus)).sum(axis=1)[there] / steps
    others = np.median(np.delete(rates, index, axis=2), axis=2)
    named = mounts.mount(rig.imus[index], rates[:, :, index], others) if len(rates) > 1 else None
    return named and replace(named, from_s=finding.from_s, to_s=finding.to_s)


def lasting(over: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which columns of (W, N) are true in `LASTING` rows in a row, or in all if there are fewer."""
    count = min(LASTING, len(over))
    return np.asarray(np.any([over[k : k + count].all(axis=0) for k in range(len(over) - count + 1)], axis=0))


def _std(rig: Rig, middle: Array) -> Array:
    """Return how far each IMU may be from the median by what is known of it, shape (W, 6, N)."""
    known = np.array([imu.start_std() for imu in rig.imus])
    bias, scale = known[:, :6].T, known[:, 6:12].T
    walk = np.array([[*imu.noise.angle_random_walk, *imu.noise.velocity_random_walk] for imu in rig.imus]).T
    own = np.sqrt(bias**2 + (scale * np.abs(middle)[:, :, None]) ** 2 + walk**2 / WINDOW)
    others = np.median(own, axis=2, keepdims=True)
    return np.asarray(np.hypot(own, others))


def _unmodelled(middle: Array) -> Array:
    """Return what mounts and places explain besides, shape (W, 6)."""
    rate, force = np.linalg.norm(middle[:, :3], axis=1), np.linalg.norm(middle[:, 3:], axis=1)
    gyro = MISALIGNED * rate + 0.02 * DEG
    accel = MISALIGNED * force + LEVER * rate**2
    return np.column_stack([np.tile(gyro[:, None], 3), np.tile(accel[:, None], 3)])


def _found(rig: Rig, off: Array, over: Array, edges: Array) -> Iterator[Finding]:
    pair = len(rig.imus) == 2
    for i, imu in enumerate(rig.imus[:1] if pair else rig.imus):
        least = np.min([over[k : len(over) - LASTING + 1 + k, :, i] for k in range(LASTING)], axis=0)
        if not (least > 1.0).any():
            continue
        axis = int(np.argmax(least.max(axis=0)))
        rows = np.flatnonzero(over[:, axis, i] > 1.0)
        size = float(np.median(off[rows, axis, i])) * (2.0 if pair else 1.0)
        gyro = axis < 3
        shown = f"{size / DEG:.3g} deg/s" if gyro else f"{size:.3g} m/s^2"
        what = f"{'gyro' if gyro else 'accelerometer'} {AXES[axis % 3]}"
        begin, end = float(edges[rows[0]]), float(edges[rows[-1] + 1])
        who = f"IMU {imu.name} and IMU {rig.imus[1].name} differ" if pair else f"IMU {imu.name} differs from the others"
        yield Finding(
            DIFFERS,
            f"{who} by {shown} in {what} from {begin:.1f} to {end:.1f} s, more than their noise figures explain",
            "doubt",
            stream=f"{imu.name}, {rig.imus[1].name}" if pair else imu.name,
            axis=what,
            from_s=begin,
            to_s=end,
            size=size / DEG if gyro else size,
            expected=0.0,
            remedy="look at its mount, axes and units, leave it out, or state its initial_std",
        )


def _unequal(rig: Rig) -> Iterator[Finding]:
    """Say which IMU is much worse than the best one by its own figures."""
    noise = np.array([np.mean(imu.noise.angle_random_walk) for imu in rig.imus])
    worst, best = int(np.argmax(noise)), int(np.argmin(noise))
    if noise[worst] > UNEQUAL * noise[best] > 0.0:
        ratio = float(noise[worst] / noise[best])
        yield Finding(
            "unequal",
            f"IMU {rig.imus[worst].name} is {ratio:.0f} times as noisy as IMU {rig.imus[best].name} by its figures; all"
            " weigh the same",
            stream=rig.imus[worst].name,
            size=ratio,
            expected=1.0,
            remedy="compare tells whether the better ones alone are better",
        )
