"""Units by the size of values: what a gyro, an accelerometer, stamps and positions can mean at all.

What values leave open is said as a reason to check; nothing here is certain but what physics rules out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polyins.checks.gravity_turn import turn_of_gravity
from polyins.formats.stamps import SECONDS
from polyins.model.recording import Array
from polyins.model.rig import DEG, STANDARD_GRAVITY
from polyins.reading.doubts import Doubt

LIKELY_RATES_HZ = (10.0, 5000.0)
SLOWEST_FIX_HZ = 0.02
FASTEST_FIX_HZ = 500.0
FAST = 10.0
"""vehicles seldom turn at so many rad/s, and often at so many deg/s"""
QUIET = 0.012
"""noise of a row: less than that of a cheap gyro in deg/s, more than it in rad/s"""
COUNTS = 200.0
"""a force of whole numbers above this is counted in no unit"""
COUNTS_OF_G = {
    16384.0: 131.0,
    8192.0: 65.5,
    4096.0: 32.8,
    2048.0: 16.4,
    STANDARD_GRAVITY * 1000.0: 131.0,
    1000.0: 16.4,
    1024.0: 16.4,
    256.0: 14.375,
}
"""usual counts per g, and counts per deg/s of the gyro that is likely beside that range"""
GRAVITY_LIKE = 0.5
"""of the logarithm that a force at rest may be off"""
AGREES = 0.7
"""correlation from which velocities are those of positions"""


@dataclass(frozen=True)
class Likely:
    """A unit, how much of it one count is, and why to check it."""

    unit: str
    scale: float = 1.0
    doubt: Doubt | None = None


def time_unit(stamps: Array, rates: tuple[float, float] = LIKELY_RATES_HZ) -> str | None:
    """Return the first unit that makes the rate a likely one, or None."""
    steps = np.diff(stamps)
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    step = float(np.median(steps)) if len(steps) else 0.0
    for unit, length in SECONDS.items():
        if step > 0 and rates[0] <= 1.0 / (step * length) <= rates[1]:
            return unit
    return None


def accel_unit(force: Array, step: float, forces: Sequence[Array] = ()) -> Likely | None:
    """Return the unit of forces, shape (T, 3), of which most are about 1 g; None if no unit makes them that.

    `step`: s; `forces`: those of other IMUs of the same kind, which tell as well.
    """
    size = typical_size(force)
    if not np.isfinite(size) or size <= 0.0:
        return None
    if size > COUNTS and bool((force[np.isfinite(force)] % 1.0 == 0.0).all()):
        return _counted([size, *(typical_size(one) for one in forces)])
    units = {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "m/s": 1.0 / step if step > 0.0 else np.nan}
    off = {unit: abs(np.log(size * times / STANDARD_GRAVITY)) for unit, times in units.items()}
    best = min(off, key=lambda unit: off[unit])
    return Likely(best) if off[best] < GRAVITY_LIKE else None


def typical_size(force: Array) -> float:
    """Return the median length of vectors, shape (T, 3)."""
    sizes = np.linalg.norm(force, axis=1)
    known = sizes[np.isfinite(sizes)]
    return float(np.median(known)) if len(known) else np.nan


def _counted(sizes: Sequence[float]) -> Likely:
    size = float(np.nanmedian(sizes))
    per_g = min(COUNTS_OF_G, key=lambda count: abs(np.log(size / count)))
    unit, scale = ("g", 1.0 / per_g) if per_g != STANDARD_GRAVITY * 1000.0 else ("m/s^2", 1e-3)
    return Likely(
        unit, scale, Doubt(f"raw counts, {size:.0f} in the middle: the scale is a guess, see the data sheet", "units")
    )


def gyro_unit(rates: Array, force: Array, step: float, accel: Likely) -> Likely:
    """Return the unit of turn rates, or increments where the force is one, beside forces, both of shape (T, 3)."""
    if accel.doubt:
        per_g = min(COUNTS_OF_G, key=lambda count: abs(np.log(count * accel.scale * _g(accel.unit))))
        per_deg_s = COUNTS_OF_G[per_g]
        untold = Doubt("raw counts: the scale is a guess, which values do not tell", "units")
        return Likely("deg/s", 1.0 / per_deg_s, untold)
    increments = accel.unit == "m/s"
    ending = "" if increments else "/s"
    values = rates / step if increments and step > 0.0 else rates
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if largest > FAST:
        return Likely("deg" + ending)
    if quietest(values, step) < QUIET:
        return Likely("rad" + ending)
    ratio = turn_of_gravity(values, force, step)
    if ratio is None:
        return Likely("rad" + ending, doubt=Doubt("whether it is rad or deg is a guess: the unit is a guess", "units"))
    return Likely(("deg" if ratio < np.sqrt(DEG) else "rad") + ending)


def _g(unit: str) -> float:
    return 1.0 if unit == "g" else 1.0 / STANDARD_GRAVITY


def quietest(values: Array, step: float) -> float:
    """Return the noise of a row, in the unit of the values, shape (T, 3), in the quietest tenth of the seconds."""
    rows = max(round(1.0 / step) if step > 0.0 else 1, 8)
    count = len(values) // rows
    if not count:
        return 0.0
    changes = np.diff(values[: count * rows].reshape(count, rows, 3), 2, axis=1)
    return float(np.nanquantile(np.nanstd(changes, axis=1).max(axis=1), 0.1) / np.sqrt(6.0))


def angle_scale(latitude: Array, longitude: Array) -> float:
    """Return how many degrees one is, of the powers of ten that receivers use."""
    largest = max(float(np.nanmax(np.abs(latitude), initial=0.0)), float(np.nanmax(np.abs(longitude), initial=0.0)) / 4)
    return 1.0 if largest <= 90.0 else 1e-7 if largest <= 90e7 else 1e-9


def are_whole(values: Array) -> bool:
    """Whether all values are whole numbers."""
    return bool((values[np.isfinite(values)] % 1.0 == 0.0).all())


def speed_scale(velocity: Array, moved: Array) -> tuple[float, bool]:
    """Return the power of ten that makes velocities agree with those of the positions, (M, 3) each, and if it is clear.

    Positions that do not move tell nothing.
    """
    size = float(np.nansum(moved * moved))
    both = float(np.nansum(velocity * moved))
    if not size > 0.0 or both < AGREES * np.sqrt(size * float(np.nansum(velocity * velocity))):
        return 1.0, False
    ratio = both / size
    off = {scale: abs(float(np.log(ratio * scale))) for scale in (1.0, 1e-1, 1e-2, 1e-3)}
    return min(off, key=lambda scale: off[scale]), True
