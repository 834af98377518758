"""Which IMU of a vehicle turns otherwise than the others: rates about the vertical, and what is constant in a wheel.

An IMU on a wheel sees the vehicle's rate of turn in its two axes in the wheel, turned by the wheel's angle. Turned back
by the angle that its own gyro counts, the mean is that rate, in a direction that is unknown; its size is compared. Not
turned back, the mean is what is constant in the wheel: biases, and the spin as far as the axle is tilted.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polyins.model.findings import Finding
from polyins.model.rig import DEG, Rig
from polyins.prepare.timesync import Aligned
from polyins.prepare.votes import DIFFERS, LASTING, SIGMAS, lasting

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

WINDOW = 10.0
"""s over which rates are averaged"""
LEAST, SHARE = 0.4 * DEG, 0.05
"""rad/s, and of the rate: by how much rates of turn may differ whatever the noise"""
LEAST_CHANGE = 2.0 * DEG
"""rad/s: what is constant in wheels on roads differs by half of that from window to window"""
TURNS, RESTS = 5.0, 0.05
"""rad/s: a wheel that spins faster makes turns enough in a window, one that spins slower rests"""
CLOSE, ROUNDS = 0.1 * DEG, 20
"""rad/s: windows that fit better count as that; and how often weights are found anew"""


def of_turning(rig: Rig, aligned: Aligned) -> tuple[Finding, ...]:
    """Return which IMUs of a rig with wheels differ from the others in what they say of the rate of turn.

    Of two that differ both are named, since it cannot be told which is right.
    """
    length = round(WINDOW * aligned.rate_hz)
    windows = (len(aligned.time) - 1) // length
    if not rig.has_wheels or windows < LASTING:
        return ()
    edges = aligned.time[np.arange(windows + 1) * length]
    used, seconds = slice(1, 1 + windows * length), np.diff(edges)[:, None]
    gyro = aligned.increments[used, :3].reshape(windows, length, 3, -1)
    whole = ~np.asarray(aligned.missing[used].reshape(windows, length, -1).any(axis=1))
    known = np.array([imu.initial_errors.as_array()[:3] for imu in rig.imus]).T
    spin, across = gyro[:, :, 0], gyro[:, :, 1] + 1j * gyro[:, :, 2]
    on_wheel = np.array([imu.wheel is not None for imu in rig.imus])
    steered = np.array([imu.wheel is not None and imu.wheel.steering for imu in rig.imus])
    mean_spin, mean_across = spin.sum(axis=1) / seconds, across.sum(axis=1) / seconds
    rests, turns = np.abs(mean_spin) < RESTS, np.abs(mean_spin) > TURNS
    usable = whole & (rests | turns | ~on_wheel)
    bias, tilt = _constant(mean_across, mean_spin, usable)
    angle = np.cumsum(aligned.increments[used, 0], axis=0).reshape(windows, length, -1)
    step = seconds[:, :, None] / length
    turned = ((across - bias * step - tilt * spin) * np.exp(1j * angle)).sum(axis=1) / seconds
    down = mean_across.imag - known[2]
    stands = (rests | ~on_wheel).all(axis=1)
    if stands.any():
        down = mean_across.imag - mean_across.imag[np.argmax(stands)]
    turn = np.where(usable & ~steered, np.where(on_wheel, np.abs(turned), np.abs(down)), np.nan)
    change = np.where(usable & on_wheel, np.abs(mean_across - bias - tilt * mean_spin), 0.0)
    return (*_differing(rig, turn, edges), *_changing(rig, change, edges))


def _constant(across: Complex, spin: Array, usable: NDArray[np.bool_]) -> tuple[Complex, Complex]:
    """Return b and m of across = b + m spin for each IMU, (N,), by the least sum of sizes of what is left, (W, N)."""
    weight = usable.astype(float)
    for _ in range(ROUNDS):
        total = np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
        x, y = (weight * spin).sum(axis=0) / total, (weight * across).sum(axis=0) / total
        spread = (weight * (spin - x) ** 2).sum(axis=0)
        tilt = (weight * (spin - x) * (across - y)).sum(axis=0) / np.where(spread > 0.0, spread, np.inf)
        bias = y - tilt * x
        weight = usable / np.maximum(np.abs(across - bias - tilt * spin), CLOSE)
    return bias, tilt


def _differing(rig: Rig, turn: Array, edges: Array) -> Iterator[Finding]:
    """Return which of the IMUs turn by a rate, (W, N) or NaN, that is not that of most of them."""
    known = np.isfinite(turn)
    if not known.all(axis=1).any() or (known.any(axis=0)).sum() < 2:
        return
    middle = np.array(
        [np.median(row[there]) if there.sum() > 1 else np.nan for row, there in zip(turn, known, strict=True)]
    )
    walk = np.array([np.max(imu.noise.angle_random_walk) for imu in rig.imus])
    allowed = LEAST + SHARE * np.abs(middle)[:, None] + SIGMAS * walk / np.sqrt(WINDOW)
    two = known.any(axis=0).sum() == 2
    over = np.abs(turn - middle[:, None]) * (2.0 if two else 1.0) > allowed
    for i in np.flatnonzero(lasting(over)):
        rows, size = np.flatnonzero(over[:, i]), turn - middle[:, None]
        others = [imu.name for k, imu in enumerate(rig.imus) if known[:, k].any() and k != i]
        named = [rig.imus[i].name, *others] if two else [rig.imus[i].name]
        largest = float(size[rows, i][np.argmax(np.abs(size[rows, i]))]) / DEG * (2.0 if two else 1.0)
        who = f"IMU {named[0]} and IMU {named[1]} differ" if two else f"IMU {named[0]} differs from the others"
        yield _finding(
            named,
            f"{who} by {abs(largest):.2g} deg/s in the rate of turn",
            (edges[rows[0]], edges[rows[-1] + 1]),
            largest,
        )
        if two:
            return


def _changing(rig: Rig, change: Array, edges: Array) -> Iterator[Finding]:
    """Return in which wheels what is constant is by so much, (W, N), not what it is most of the time."""
    over = change > LEAST_CHANGE
    for i in np.flatnonzero(lasting(over)):
        rows, name = np.flatnonzero(over[:, i]), rig.imus[i].name
        size = float(np.median(change[rows, i])) / DEG
        text = f"IMU {name}: what its gyro shows across the axle changes by {size:.2g} deg/s"
        yield _finding([name], text, (edges[rows[0]], edges[rows[-1] + 1]), size)


def _finding(names: list[str], text: str, when: tuple[float, float], size: float) -> Finding:
    return Finding(
        DIFFERS,
        f"{text} from {when[0]:.1f} to {when[1]:.1f} s",
        "doubt",
        stream=", ".join(names),
        axis="gyro",
        from_s=float(when[0]),
        to_s=float(when[1]),
        size=size,
        expected=0.0,
        remedy="look at its mount, its clock and its gyro, or leave it out",
    )
