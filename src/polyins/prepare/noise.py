"""Which IMU is noisier than the others, by what its figures do not explain.

The noise of an IMU is told from how its rates, less those of the quietest, differ from block to block. Divided by what
its figures say of it, it is the same for all IMUs of an array that is as modelled; vibration raises it for all.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import Finding
from polyins.model.rig import Rig
from polyins.prepare.blocks import Blocks
from polyins.prepare.votes import lasting

Array = NDArray[np.float64]

PART_S = 20.0
"""s in which noise is told"""
NOISY = 4.0
"""times the noise of the quieter quarter"""
DOUBTFUL = 10.0
"""times the noise of the whole array, from which its solution is less sure than stated"""
LEAST_STATED = 1e-9
"""rad/s and m/s^2: of an IMU without noise"""
OF_MEAN = np.sqrt(np.pi / 2.0) / np.sqrt(6.0)
"""std of one value by the mean size of the second difference of three"""
GYRO, ACCEL = slice(0, 3), slice(3, 6)


def noisy(rig: Rig, blocks: Blocks) -> tuple[Finding, ...]:
    """Return which of three IMUs and more are noisy; a rig with wheels has IMUs that turn differently: none."""
    if rig.has_wheels or len(rig.imus) < 3 or len(blocks.time) < 3:
        return ()
    return (*_of_sensor(rig, blocks, GYRO), *_of_sensor(rig, blocks, ACCEL))


def _of_sensor(rig: Rig, blocks: Blocks, sensor: slice) -> Iterator[Finding]:
    parts = blocks.parts(PART_S)
    density = [imu.noise.angle_random_walk if sensor == GYRO else imu.noise.velocity_random_walk for imu in rig.imus]
    stated = np.maximum(np.sqrt(np.mean(np.square(density), axis=1) / blocks.interval), LEAST_STATED)
    shown = np.array([_shown(blocks.rates[part, sensor]) for part in parts])
    shown[np.array([blocks.whole[part].mean(axis=0) for part in parts]) < 0.9] = 0.0
    times = np.array([_over_others(row / stated) for row in shown])
    over = times > NOISY
    doubtful = bool(np.any(np.sqrt(np.mean(np.square(times), axis=1)) > DOUBTFUL))
    for i in np.flatnonzero(lasting(over)):
        rows = np.flatnonzero(over[:, i])
        begin = float(blocks.time[parts[rows[0]]][0])
        end, size = float(blocks.time[parts[rows[-1]]][-1]), float(np.median(times[rows, i]))
        what = "gyro" if sensor == GYRO else "accelerometer"
        yield Finding(
            "noise",
            f"IMU {rig.imus[i].name}: its {what} is {size:.0f} times as noisy as the others from {begin:.0f} to"
            f" {end:.0f} s, by their figures",
            "doubt" if doubtful else "note",
            stream=rig.imus[i].name,
            axis=what,
            from_s=begin,
            to_s=end,
            size=size,
            expected=1.0,
            remedy="leave it out, or state its noise",
        )


def _over_others(ratio: Array) -> Array:
    """Return noise over that of the quieter quarter, (N,), of noise over what figures say; 0: they explain it."""
    known = ratio[ratio > 0.0]
    return np.where(ratio > 1.0, ratio / np.quantile(known, 0.25), 0.0) if known.size else ratio


def _shown(rates: Array) -> Array:
    """Return the std of the noise of each IMU, (N,), of rates (K, 3, N)."""
    bent = np.diff(rates, n=2, axis=0).reshape(-1, rates.shape[2])
    quietest = int(np.argmin(np.abs(bent).mean(axis=0)))
    variance = (OF_MEAN * np.abs(bent - bent[:, quietest, None]).mean(axis=0)) ** 2
    # of the quietest and the next one each has half
    half = 0.5 * np.sort(variance)[1]
    return np.asarray(np.sqrt(np.maximum(variance - half, half)))
