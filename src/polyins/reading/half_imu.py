"""A gyro and an accelerometer in files of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.formats.columns import OpenTable
from polyins.formats.rows import RowSource
from polyins.model.recording import Array
from polyins.reading import column_names as said
from polyins.reading import likely_units as likely
from polyins.reading.column_names import SensorAxis, first_of_each
from polyins.reading.doubts import Doubt, distinct
from polyins.reading.likely_units import Likely
from polyins.reading.sensor_columns import Three, scaled, stated, triples
from polyins.reading.time_columns import TimeGuess


@dataclass(frozen=True)
class HalfImu:
    """A gyro or an accelerometer alone, whose other half is in another file."""

    what: str
    """gyro or accel"""
    source: RowSource
    columns: dict[str, Any]
    """of the section gyro or accel"""
    time_column: dict[str, Any]
    time: Array
    values: Array
    """in the unit of the columns, shape (T, 3)"""
    doubt: Doubt | None = None
    """of its stamps"""


def half_of(opened: OpenTable, time: TimeGuess, axes: dict[str, SensorAxis]) -> HalfImu | None:
    """Return the gyro or accelerometer that a table holds alone; units or the file's name tell which."""
    for what in ("gyro", "accel"):
        known = triples(axes, what)
        if known:
            return _taken_as(opened, time, what, *next(iter(known.values())))
    names = first_of_each(opened.names, ("x", "y", "z"))
    if names is None:
        return None
    unit = said.parsed(names[0]).unit
    stem = opened.path.name.lower()
    gyro = unit in said.GYRO_UNITS or (not unit and "gyr" in stem)
    accel = unit in said.ACCEL_UNITS or (not unit and "acc" in stem)
    if gyro == accel or "linear" in stem:
        return None
    return _taken_as(opened, time, "gyro" if gyro else "accel", (names[0], names[1], names[2]), unit)


def _taken_as(opened: OpenTable, time: TimeGuess, what: str, names: Three, unit: str) -> HalfImu:
    values = np.column_stack(opened.numbers(names))
    known = stated(unit, said.GYRO_UNITS if what == "gyro" else said.ACCEL_UNITS)
    columns: dict[str, Any] = {"names": names}
    if known is not None:
        columns |= {"unit": known.unit} | scaled(known)
    return HalfImu(what, opened.source, columns, time.column, time.seconds, values, time.doubt)


def joined_columns(gyro: HalfImu, accel: HalfImu) -> tuple[dict[str, Any], tuple[Doubt, ...]]:
    """Return the columns of the IMU that two files make, the gyro's being the one that is named, and what is open."""
    doubts = [gyro.doubt, accel.doubt]
    at = gyro.time[np.isfinite(gyro.time)]
    step = float(np.median(np.diff(at))) if len(at) > 1 else 0.0
    force, rates = dict(accel.columns), dict(gyro.columns)
    if "unit" not in force:
        unit = likely.accel_unit(accel.values, step)
        if unit is None:
            raise InputError(
                f"{accel.source.path}: values are 1 g in no unit; expected specific force (is gravity taken out?), "
                "else declare columns with unit and scale"
            )
        force |= {"unit": unit.unit} | scaled(unit)
        doubts.append(unit.doubt)
    if "unit" not in rates:
        whole = Likely(force["unit"], force.get("scale", 1.0))
        turning = likely.gyro_unit(gyro.values, accel.values[: len(gyro.values)], step, whole)
        rates |= {"unit": turning.unit} | scaled(turning)
        doubts.append(turning.doubt)
    columns = {
        "time": gyro.time_column,
        "gyro": rates,
        "accel": force | {"file": accel.source.path, "time": accel.time_column},
    }
    return columns, distinct(doubts)
