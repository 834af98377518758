"""Which columns of a table are the axes of gyros and accelerometers, and in which units, by their names."""

from __future__ import annotations

from collections.abc import Sequence

from polyins.reading.column_names import SensorAxis, sensor_axis
from polyins.reading.likely_units import Likely

Three = tuple[str, str, str]
Pair = tuple[str, tuple[Three, str], tuple[Three, str], bool]
"""what tells it apart, the names and the unit of gyro and accelerometer, whether they are increments"""


def axes_of(names: Sequence[str]) -> dict[str, SensorAxis]:
    """Return which axes columns are; a linear acceleration beside a plain one is that without gravity."""
    axes = {name: axis for name in names if name and (axis := sensor_axis(name)) is not None}
    forces = [name for name, axis in axes.items() if axis.what == "accel"]
    linear = {name for name in forces if "linear" in name.lower()}
    return {name: axis for name, axis in axes.items() if name not in linear or len(linear) == len(forces)}


def triples(axes: dict[str, SensorAxis], what: str) -> dict[str, tuple[Three, str]]:
    """Return the names of three axes, and their unit, by what tells sensors apart."""
    found: dict[str, dict[int, str]] = {}
    units: dict[str, str] = {}
    for name, axis in axes.items():
        if axis.what == what:
            found.setdefault(axis.of, {}).setdefault(axis.axis, name)
            units.setdefault(axis.of, axis.unit)
    return {of: ((names[0], names[1], names[2]), units[of]) for of, names in found.items() if set(names) == {0, 1, 2}}


def pairs(axes: dict[str, SensorAxis]) -> list[Pair]:
    """Return gyro and accelerometer of each IMU."""
    for gyro, accel in (("gyro", "accel"), ("angle increment", "velocity increment")):
        gyros, accels = triples(axes, gyro), triples(axes, accel)
        common = [of for of in gyros if of in accels]
        if not common and gyros and accels:
            return [("", next(iter(gyros.values())), next(iter(accels.values())), gyro != "gyro")]
        if common:
            plain = [of for of in common if not of.startswith(("uncomp", "raw"))] or common
            return [(of, gyros[of], accels[of], gyro != "gyro") for of in plain]
    return []


def stated(unit: str, units: dict[str, tuple[str, float]]) -> Likely | None:
    """Return the unit that a name states, if it is one of these."""
    return Likely(*units[unit]) if unit in units else None


def scaled(unit: Likely) -> dict[str, float]:
    """Return the key `scale` of columns, where it is needed."""
    return {} if unit.scale == 1.0 else {"scale": unit.scale}
