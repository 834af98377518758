"""The IMUs of a table with names: beside each other, in rows of their own, or a sensor to a row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polyins.config import ImuColumns
from polyins.errors import InputError
from polyins.formats import table
from polyins.formats.columns import OpenTable
from polyins.model.recording import Array
from polyins.reading import column_names as said
from polyins.reading import likely_units as likely
from polyins.reading.column_names import first_of_each, named
from polyins.reading.doubts import Doubt, distinct
from polyins.reading.likely_units import Likely
from polyins.reading.sensor_columns import Pair, Three, scaled, stated
from polyins.reading.table_stream import TableStream
from polyins.reading.time_columns import TimeGuess

MOST_SENSORS = 64
FEWEST_OF_EACH = 5
"""rows of an IMU among those of others"""


def imus_of(opened: OpenTable, time: TimeGuess, pairs: Sequence[Pair]) -> list[TableStream]:
    """Return the IMUs of these columns; one whose rows a number tells apart is several."""
    forces = [np.column_stack(opened.numbers(accel[0])) for _, _, accel, _ in pairs]
    apart = _tells_apart(opened, time) if len(pairs) == 1 else None
    found = []
    for (_, gyro, accel, increments), force in zip(pairs, forces, strict=True):
        rates = np.column_stack(opened.numbers(gyro[0]))
        of_each: list[tuple[dict[str, Any] | None, Any]] = [*apart] if apart else [(None, slice(None))]
        for only, rows in of_each:
            others = [force[here] for _, here in apart] if apart else forces
            whole = _Sensors(gyro, accel, rates[rows], force[rows], others, increments)
            found.append(_imu(opened, time.of_rows(rows), whole, only))
    return found


@dataclass(frozen=True)
class _Sensors:
    gyro: tuple[Three, str]
    accel: tuple[Three, str]
    rates: Array
    force: Array
    others: Sequence[Array]
    increments: bool


def _imu(opened: OpenTable, time: TimeGuess, of: _Sensors, only: dict[str, Any] | None) -> TableStream:
    there = np.isfinite(of.rates).all(axis=1), np.isfinite(of.force).all(axis=1)
    split = not (there[0] & there[1]).any() and there[0].any() and there[1].any()
    steps = np.diff(time.seconds[there[0] & np.isfinite(time.seconds)])
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    if not step > 0.0 or not there[1].any():
        raise InputError(
            f"{opened.path}: {len(of.rates)} row(s) without increasing times and values; expected IMU data"
        )
    accel = stated(of.accel[1], said.ACCEL_UNITS) or (
        Likely("m/s") if of.increments else likely.accel_unit(of.force[there[1]], step, of.others)
    )
    if accel is None:
        size = likely.typical_size(of.force)
        raise InputError(
            f"{opened.path}: columns {', '.join(of.accel[0])} are {size:.4g} in the middle, which is 1 g in no unit; "
            "expected specific force (is gravity taken out?), else declare columns with unit and scale"
        )
    if accel.doubt and said.parsed(of.accel[0][0]).plain == "xacc":
        accel, of = replace(accel, unit="g", scale=1e-3), replace(of, gyro=(of.gyro[0], "mrads"))  # as MAVLink has them
    gyro = stated(of.gyro[1], said.GYRO_UNITS) or (
        Likely("rad") if of.increments else likely.gyro_unit(of.rates[there[0]], of.force[there[1]], step, accel)
    )
    declared: dict[str, Any] = {
        "time": time.column,
        "gyro": {"names": of.gyro[0], "unit": gyro.unit} | scaled(gyro),
        "accel": {"names": of.accel[0], "unit": accel.unit} | scaled(accel),
    }
    if split:
        declared["accel"]["time"] = time.column
    if only is not None:
        declared["only"] = only
    return described(opened, declared, [time.doubt, accel.doubt, gyro.doubt])


def described(opened: OpenTable, declared: dict[str, Any], doubts: Sequence[Doubt | None]) -> TableStream:
    """Return the IMU whose columns these are."""
    columns = ImuColumns.model_validate(declared)
    rows = table.imu_of(opened, columns)
    unit = columns.time.unit if columns.time is not None and not columns.time.dates else "dates"
    text = f"taken as time in {unit}, gyro in {columns.gyro.unit}, accel in {columns.accel.unit}"
    return TableStream(rows, columns, text, distinct(doubts))


def _tells_apart(opened: OpenTable, time: TimeGuess) -> list[tuple[dict[str, Any], Any]] | None:
    """Return which rows belong to which IMU, where a column of few values has a name that says so."""
    for name in named(opened.names, said.NUMBER):
        texts = opened.texts(name)
        values, counts = np.unique(texts, return_counts=True)
        if not 2 <= len(values) <= MOST_SENSORS or counts.min() < FEWEST_OF_EACH:
            continue
        groups = [np.flatnonzero(texts == value) for value in values]
        if all(_rises(time.seconds[rows]) for rows in groups):
            order = sorted(range(len(values)), key=lambda n: _as_number(str(values[n])))
            return [({"name": name, "equal": _plain(str(values[n]))}, groups[n]) for n in order]
    return None


def _rises(stamps: Array) -> bool:
    return bool(np.mean(np.diff(stamps) > 0.0) > 0.8)


def _plain(text: str) -> int | float | str:
    if not said_number(text):
        return text
    return int(float(text)) if float(text) % 1.0 == 0.0 else float(text)


def said_number(text: str) -> bool:
    """Whether a text is a number."""
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _as_number(text: str) -> tuple[float, str]:
    return (float(text), "") if said_number(text) else (np.inf, text)


def rows_of_sensors(opened: OpenTable, time: TimeGuess) -> TableStream | None:
    """Return the IMU of a table with rows of a gyro and rows of an accelerometer, which a word tells apart."""
    threes = (("x", "y", "z"), ("v0", "v1", "v2"), ("v1", "v2", "v3"))
    names = next((found for three in threes if (found := first_of_each(opened.names, three))), None)
    if names is None:
        return None
    for name in named(opened.names, said.NUMBER + "|sensor_?(type|name)|source|event"):
        texts = opened.texts(name)
        words = [str(word) for word in np.unique(texts)]
        gyro = [word for word in words if "gyr" in word.lower() and "uncal" not in word.lower()]
        accel = [word for word in words if "acc" in word.lower() and not {"lin", "uncal"} & _starts(word)]
        if len(gyro) == 1 and len(accel) == 1:
            values = np.column_stack(opened.numbers(names))
            here = {"gyro": texts == gyro[0], "accel": texts == accel[0]}
            at = time.seconds[here["gyro"]]
            step = float(np.median(np.diff(at))) if len(at) > 1 else 0.0
            force, rates = values[here["accel"]], values[here["gyro"]]
            unit = likely.accel_unit(force, step)
            if unit is None:
                return None
            turning = likely.gyro_unit(rates, force[: len(rates)], step, unit)
            declared = {
                "time": time.of_rows(here["gyro"]).column,
                "gyro": {"names": names, "unit": turning.unit, "only": {"name": name, "equal": gyro[0]}}
                | scaled(turning),
                "accel": {"names": names, "unit": unit.unit, "only": {"name": name, "equal": accel[0]}} | scaled(unit),
            }
            return described(opened, declared, [time.doubt, unit.doubt, turning.doubt])
    return None


def _starts(word: str) -> set[str]:
    return {part for part in ("lin", "uncal") if part in word.lower()}
