"""Messages of types that nobody told of, by the names of their fields.

A message is an IMU's if it has three axes each of rates and forces under names that such fields have, and positions if
it has latitude, longitude and a height. Units are told by the size of the values: a vehicle at rest feels 9.8 m/s^2 or
1 g, and seldom turns at 10 rad/s.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from polyins.model.recording import Array
from polyins.model.rig import DEG, STANDARD_GRAVITY

GYRO = re.compile(r"(.*[._])?(angular_?(velocity|rate)|ang_?vel|gyro(scope)?s?|gyr|omega|rates?|w)(_rads?|_rad_s)?")
ACCEL = re.compile(r"(.*[._])?(linear_?acceleration|acc(el(eration|erometer)?)?s?|specific_?force|f)(_m_?s2)?")
PLACE = (
    re.compile(r"(.*[._])?(lat|latitude)(_deg)?"),
    re.compile(r"(.*[._])?(lon|lng|long|longitude)(_deg)?"),
    re.compile(r"(.*[._])?(alt|altitude|height)(_m|_ellipsoid|_hae)?"),
)
AXIS = re.compile(r"(?P<name>.*?)[._]?(?P<axis>[xyz]|\[[012]\])")
DEEPEST = 4
FASTEST_RAD_S = 10.0
LEAST_FORCE_M_S2 = 5.0
"""median size below which forces are in g"""
DEGREES_1E7 = 181.0
"""above which a latitude or longitude is an integer of 1e-7 deg"""

Path = tuple[str, ...]


def numbers(message: Any, path: Path = ()) -> dict[str, float]:
    """Return every number in a message by its dotted name; of arrays of three each element, other arrays are left."""
    found: dict[str, float] = {}
    for one in fields(message) if is_dataclass(message) and len(path) < DEEPEST else ():
        value = getattr(message, one.name)
        name = ".".join((*path, one.name))
        if is_dataclass(value):
            found |= numbers(value, (*path, one.name))
        elif isinstance(value, int | float | np.number):
            found[name] = float(value)
        elif isinstance(value, np.ndarray | Sequence) and not isinstance(value, str) and len(value) == 3:
            found |= {
                f"{name}[{k}]": float(value[k]) for k in range(3) if isinstance(value[k], int | float | np.number)
            }
    return found


def imu_names(known: Mapping[str, float]) -> tuple[str, ...] | None:
    """Return the names of gyro x, y, z and accelerometer x, y, z, or None."""
    triples: dict[str, dict[str, str]] = {}
    for name in known:
        match = AXIS.fullmatch(name)
        if match:
            axis = match["axis"].strip("[]").translate(str.maketrans("012", "xyz"))
            triples.setdefault(match["name"], {})[axis] = name
    whole = {name: axes for name, axes in triples.items() if len(axes) == 3}
    chosen = [next((axes for name, axes in whole.items() if kind.fullmatch(name)), None) for kind in (GYRO, ACCEL)]
    if None in chosen:
        return None
    return tuple(axes[axis] for axes in chosen if axes is not None for axis in "xyz")


def place_names(known: Mapping[str, float]) -> tuple[str, ...] | None:
    """Return the names of latitude, longitude and height, or None."""
    found = [next((name for name in known if kind.fullmatch(name)), None) for kind in PLACE]
    return None if None in found else tuple(name for name in found if name is not None)


def in_si(values: Array) -> tuple[Array, str]:
    """Return rates, rad/s, and forces, m/s^2, shape (T, 6), and the units that were taken."""
    rate = float(np.sqrt(np.mean(np.sum(values[:, :3] ** 2, axis=1))))
    force = float(np.median(np.linalg.norm(values[:, 3:], axis=1)))
    degrees, gravities = rate > FASTEST_RAD_S, force < LEAST_FORCE_M_S2
    units = [DEG if degrees else 1.0] * 3 + [STANDARD_GRAVITY if gravities else 1.0] * 3
    return values * units, f"{'deg/s' if degrees else 'rad/s'} and {'g' if gravities else 'm/s^2'}"


def in_radians(places: Array) -> tuple[Array, str]:
    """Return latitude, longitude, rad, and height, m, shape (M, 3), and the units that were taken."""
    whole = bool((np.abs(places[:, :2]) > DEGREES_1E7).any())
    unit = [1e-7 * DEG, 1e-7 * DEG, 1e-3] if whole else [DEG, DEG, 1.0]
    return places * unit, "1e-7 deg and mm" if whole else "deg and m"
