"""Faults of every kind that `check` looks for: what is done to a recording, how it is named, and what is right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from polyins.config import ImuEntry
from polyins.model.axes import axes_matrix, right_handed_axes
from polyins.model.recording import Array
from polyins.reading.imu_stream import mount_rotation
from polyins.studies.data_faults.bundle import ACCEL, GYRO, Bundle, Columns, Values, moved

Right = Callable[[Values], bool]
DEG = np.pi / 180.0
G = 9.80665


@dataclass(frozen=True)
class Injected:
    """A recording with a fault in it."""

    bundle: Bundle
    whose: str
    """name of the IMU or of the stream that a finding has to say"""
    right: Right | None = None
    """whether a configuration puts it right; None: none can"""
    size: str = ""


@dataclass(frozen=True)
class Fault:
    """One kind of fault."""

    name: str
    kinds: tuple[str, ...]
    """of the finding that names it"""
    inject: Callable[[Bundle, np.random.Generator], Injected]
    recordings: tuple[str, ...] = field(default=())
    """into which it is put: those whose motion shows it"""


FLYING = ("Horizontal/path_2", "Horizontal/path_9", "Horizontal/path_23", "RAW_1111")
DRIVING = ("kfgins-parity", "whu-array", "start-traffic-light")
ARRAYS = (*FLYING, "whu-array")
MOVING = (*FLYING, *DRIVING)
ROLLING = ("wid 06", "wid 08")
STILL = ("array-binary", "mimu4444")
ANY = (*MOVING, *STILL, "walk", "dataflash/log0036.bin", "rosbag/husky.bag", *ROLLING, "wheelins-parity", "two-grades")


def _one(bundle: Bundle, rng: np.random.Generator) -> int:
    """Draw an IMU on the body."""
    body = [i for i, imu in enumerate(bundle.values["imus"]) if "wheel" not in imu] or list(range(len(bundle.imus)))
    return int(rng.choice(body))


def _name(bundle: Bundle, index: int) -> str:
    return str(bundle.values["imus"][index]["name"])


def _times(columns: Columns, names: list[str], factor: float | Array) -> Columns:
    return {name: columns[name] * factor for name in names}


def _unit(sensor: str, unit: str) -> Callable[[Values, int], bool]:
    return lambda values, index: bool(values["imus"][index]["columns"][sensor]["unit"] == unit)


def degrees_as_radians(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Put deg/s into the file of what is said to be rad/s."""
    index = _one(bundle, rng)
    spoiled = bundle.with_imu(index, **_times(bundle.imus[index], GYRO, 1.0 / DEG))
    return Injected(spoiled, _name(bundle, index), lambda values: _unit("gyro", "deg/s")(values, index), "57")


def radians_as_degrees(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Say deg/s of what is rad/s."""
    index = _one(bundle, rng)
    spoiled = bundle.changed(("imus", index, "columns", "gyro", "unit"), "deg/s")
    return Injected(spoiled, _name(bundle, index), lambda values: _unit("gyro", "rad/s")(values, index), "1/57")


def g_as_m_s2(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Put g into the file of what is said to be m/s^2."""
    index = _one(bundle, rng)
    spoiled = bundle.with_imu(index, **_times(bundle.imus[index], ACCEL, 1.0 / G))
    return Injected(spoiled, _name(bundle, index), lambda values: _unit("accel", "g")(values, index), "9.8")


def rates_as_increments(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Say that rates are increments."""
    index = _one(bundle, rng)
    spoiled = bundle.changed(("imus", index, "columns", "gyro", "unit"), "rad")
    spoiled = spoiled.changed(("imus", index, "columns", "accel", "unit"), "m/s")

    def right(values: Values) -> bool:
        return _unit("gyro", "rad/s")(values, index) and _unit("accel", "m/s^2")(values, index)

    return Injected(spoiled, _name(bundle, index), right)


def increments_as_rates(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Put increments into the file of what is said to be rates."""
    index = _one(bundle, rng)
    step = float(np.median(np.diff(bundle.imus[index]["t"])))
    spoiled = bundle.with_imu(index, **_times(bundle.imus[index], [*GYRO, *ACCEL], step))

    def right(values: Values) -> bool:
        return _unit("gyro", "rad")(values, index) and _unit("accel", "m/s")(values, index)

    return Injected(spoiled, _name(bundle, index), right)


def milliseconds(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Count ms, or us, where the configuration says s."""
    index = _one(bundle, rng)
    unit, factor = [("ms", 1e3), ("us", 1e6)][int(rng.integers(2))]
    spoiled = bundle.with_imu(index, t=bundle.imus[index]["t"] * factor)

    def right(values: Values) -> bool:
        return bool(values["imus"][index]["columns"]["time"].get("unit") == unit)

    return Injected(spoiled, _name(bundle, index), right, unit)


def rotation_of(values: Values, index: int) -> Array:
    """Return C_ab of an IMU, with what its columns make of its axes, of the gyro."""
    entry = ImuEntry.model_validate({**values["imus"][index], "file": "x"})
    assert entry.columns is not None
    return mount_rotation(entry.mount_deg) @ axes_matrix(entry.axes) @ _columns(entry.columns.gyro, GYRO)


def _columns(columns: Any, names: list[str]) -> Array:
    matrix = np.zeros((3, 3))
    for row, (name, scale) in enumerate(zip(columns.names, columns.scale, strict=True)):
        matrix[row, names.index(name)] = scale
    return matrix


def angle_deg(one: Array, other: Array) -> float:
    """Return by how much two rotations differ."""
    return float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(one.T @ other) - 1.0), -1.0, 1.0))))


def upside_down(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Say other axes, of all IMUs on the body, that do not have gravity point down."""
    body = [i for i, imu in enumerate(bundle.values["imus"]) if "wheel" not in imu]
    wrong = [axes for axes in right_handed_axes() if axes_matrix(axes)[2, 2] < 0.5]
    turn = axes_matrix(wrong[int(rng.integers(len(wrong)))])
    spoiled, true = bundle, [rotation_of(bundle.values, i) for i in body]
    for i in body:
        was = axes_matrix(tuple(bundle.values["imus"][i].get("axes", ["x", "y", "z"])))
        axes = _axis_names(turn @ was)
        spoiled = spoiled.changed(("imus", i, "axes"), axes)

    def right(values: Values) -> bool:
        down = [rotation_of(values, i)[2] @ wanted[2] for i, wanted in zip(body, true, strict=True)]
        return bool(min(down) > np.cos(25.0 * DEG))

    return Injected(spoiled, _name(bundle, body[0]), right)


def _axis_names(matrix: Array) -> list[str]:
    return [("-" if row.sum() < 0.0 else "") + "xyz"[int(np.argmax(np.abs(row)))] for row in matrix]


def turned(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Turn one IMU of an array by any angle about any axis."""
    from scipy.spatial.transform import Rotation

    index, angle = _one(bundle, rng), float(np.exp(rng.uniform(np.log(8.0), np.log(175.0))))
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(np.radians(angle) * axis / np.linalg.norm(axis)).as_matrix()
    gyro, accel = bundle.vectors(index, GYRO) @ turn, bundle.vectors(index, ACCEL) @ turn
    spoiled = bundle.with_imu(index, **dict(zip([*GYRO, *ACCEL], np.hstack([gyro, accel]).T, strict=True)))
    true = rotation_of(bundle.values, index) @ turn

    def right(values: Values) -> bool:
        return angle_deg(rotation_of(values, index), true) < 3.0

    return Injected(spoiled, _name(bundle, index), right, f"{angle:.0f} deg")


def gyro_axes(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Swap two axes of a gyro, or reverse one or all."""
    index, kind = _one(bundle, rng), int(rng.integers(3))
    names, signs = list(GYRO), np.ones(3)
    if kind == 0:
        first = int(rng.integers(3))
        second = (first + 1) % 3
        names[first], names[second] = names[second], names[first]
    elif kind == 1:
        signs[int(rng.integers(3))] = -1.0
    else:
        signs[:] = -1.0
    columns = {name: sign * bundle.imus[index][of] for name, of, sign in zip(GYRO, names, signs, strict=True)}
    spoil = np.zeros((3, 3))
    for row, (of, sign) in enumerate(zip(names, signs, strict=True)):
        spoil[row, GYRO.index(of)] = sign
    true = rotation_of(bundle.values, index)

    def right(values: Values) -> bool:
        return bool(np.abs(rotation_of(values, index) @ spoil - true).max() < 0.05)

    size = ("swapped", "one reversed", "all reversed")[kind]
    return Injected(bundle.with_imu(index, **columns), _name(bundle, index), right, size)


def twice(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Name one sensor's file for two."""
    first, second = (int(i) for i in rng.choice(len(bundle.imus), 2, replace=False))
    name = _name(bundle, max(first, second))
    spoiled = bundle.with_imu(second, **bundle.imus[first]).changed(
        ("imus", second, "clock_offset_s"), bundle.values["imus"][first].get("clock_offset_s", 0.0)
    )
    for key in ("axes", "mount_deg"):
        if key in bundle.values["imus"][first]:
            spoiled = spoiled.changed(("imus", second, key), bundle.values["imus"][first][key])
    count = len(bundle.imus) - 1
    return Injected(spoiled, name, lambda values: len(values["imus"]) == count)


def late_imu(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let the clock of one IMU be late."""
    index, late = _one(bundle, rng), float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.08), np.log(1.0))))
    spoiled = bundle.with_imu(index, t=bundle.imus[index]["t"] + late)

    def right(values: Values) -> bool:
        return bool(abs(values["imus"][index].get("clock_offset_s", 0.0) + late) < 0.015)

    return Injected(spoiled, _name(bundle, index), right, f"{late:.2f} s")


def late_fixes(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let the fixes be late."""
    return _late(bundle, float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.4), np.log(3.0)))), 0.1)


def leap_seconds(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let the fixes count UTC, or TAI, and the IMUs GPS's seconds."""
    return _late(bundle, float(rng.choice([-18.0, 18.0, 37.0, -37.0])), 0.1)


def _late(bundle: Bundle, late: float, within: float) -> Injected:
    assert bundle.gnss is not None
    spoiled = Bundle(
        bundle.name, bundle.values, bundle.imus, {**bundle.gnss, "t": bundle.gnss["t"] + late}, bundle.reference
    )

    def right(values: Values) -> bool:
        return bool(abs(values["gnss"].get("clock_offset_s", 0.0) + late) < within)

    return Injected(spoiled, "GNSS", right, f"{late:.2f} s")


def noisy_fixes(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let the fixes scatter by 6 to 30 times what they state."""
    assert bundle.gnss is not None
    times = float(np.exp(rng.uniform(np.log(6.0), np.log(30.0))))
    stated = np.column_stack([bundle.gnss[name] for name in ("sn", "se", "sd")])
    noise = times * stated * rng.normal(size=stated.shape)
    spoiled = moved(bundle, noise * [1.0, 1.0, -1.0])
    true = np.median(stated, axis=0) * np.hypot(times, 1.0)

    def right(values: Values) -> bool:
        given = np.atleast_1d(values["gnss"].get("position_std_m", 0.0)) * np.ones(3)
        return bool(np.all(np.abs(np.log(np.maximum(given, 1e-9) / true)) < np.log(1.6)))

    return Injected(spoiled, "GNSS", right, f"{times:.0f} times")


def sea_level(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let the fixes count heights from the sea, and the reference from the ellipsoid."""
    assert bundle.gnss is not None
    geoid = float(rng.choice([-1.0, 1.0]) * rng.uniform(12.0, 80.0))
    spoiled = moved(bundle, np.tile([0.0, 0.0, -geoid], (len(bundle.gnss["t"]), 1)))

    def right(values: Values) -> bool:
        return abs(float(values["gnss"].get("geoid_height_m") or 0.0) - geoid) < 0.5

    return Injected(spoiled, "GNSS", right, f"{geoid:.0f} m")


def lever_arm(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Say another place of the antenna, or that of the other sign."""
    true = np.array(bundle.values["gnss"].get("antenna_position_m", [0.0, 0.0, 0.0]), dtype=float)
    if np.hypot(*true[:2]) > 0.4 and rng.random() < 0.5:
        said, size = -true, "sign"
    else:
        angle, far = rng.uniform(-np.pi, np.pi), float(rng.uniform(0.8, 2.5))
        said, size = true + far * np.array([np.cos(angle), np.sin(angle), 0.0]), f"{far:.1f} m"
    spoiled = bundle.changed(("gnss", "antenna_position_m"), [round(float(one), 3) for one in said])

    def right(values: Values) -> bool:
        return float(np.hypot(*(np.array(values["gnss"]["antenna_position_m"]) - true)[:2])) < 0.25

    return Injected(spoiled, "GNSS", right, size)


def wrap(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let a gyro's numbers run over their end."""
    index, axis = _one(bundle, rng), GYRO[int(rng.integers(3))]
    values = bundle.imus[index][axis]
    half = float(rng.uniform(0.5, 0.8)) * float(np.quantile(np.abs(values), 0.9995))
    wrapped = (values + half) % (2.0 * half) - half
    return Injected(bundle.with_imu(index, **{axis: wrapped}), _name(bundle, index), None, f"{half / DEG:.0f} deg/s")


def saturation(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let a gyro end before the motion does, in counts of 16 bits."""
    index = _one(bundle, rng)
    rates = bundle.vectors(index, GYRO)
    most = float(rng.uniform(0.4, 0.7)) * float(np.quantile(np.abs(rates).max(axis=1), 0.999))
    count = most / 32767.0
    clipped = np.clip(np.round(rates / count) * count, -most, most)

    def right(values: Values) -> bool:
        return abs(float(values["imus"][index].get("gyro_range_deg_s") or 0.0) / (most / DEG) - 1.0) < 0.01

    spoiled = bundle.with_imu(index, **dict(zip(GYRO, clipped.T, strict=True)))
    return Injected(spoiled, _name(bundle, index), right, f"{most / DEG:.0f} deg/s")


def stuck(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Let an axis stand still, for a while or throughout."""
    index, axis = _one(bundle, rng), [*GYRO, *ACCEL][int(rng.integers(5))]
    values, time = bundle.imus[index][axis].copy(), bundle.imus[index]["t"]
    length = float(rng.choice([3.0, 8.0, np.inf]))
    begin = float(time[0]) if length == np.inf else float(rng.uniform(time[0], time[-1] - length))
    where = (time >= begin) & (time <= begin + length)
    values[where] = 0.0 if length == np.inf else values[int(np.argmax(where))]
    return Injected(bundle.with_imu(index, **{axis: values}), _name(bundle, index), None, f"{axis}, {length:g} s")


def pause(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Leave everything out for a while."""
    begin = float(bundle.imus[0]["t"][0] + rng.uniform(8.0, 14.0))
    length = float(rng.uniform(2.0, 5.0))

    def cut(table: Columns) -> Columns:
        kept = (table["t"] < begin) | (table["t"] > begin + length)
        return {name: values[kept] for name, values in table.items()}

    gnss = None if bundle.gnss is None else cut(bundle.gnss)
    spoiled = Bundle(bundle.name, bundle.values, tuple(map(cut, bundle.imus)), gnss, bundle.reference)
    return Injected(spoiled, "", None, f"{length:.0f} s")


def jitter(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Stamp rows when they are written, up to half an interval and more after they are taken."""
    index = _one(bundle, rng)
    time = bundle.imus[index]["t"]
    step = float(np.median(np.diff(time)))
    even = time[0] + step * np.arange(len(time))
    stamped = even + rng.uniform(0.0, float(rng.uniform(0.6, 0.95)), len(time)) * step

    def right(values: Values) -> bool:
        return abs(float(values["imus"][index].get("rate_hz") or 0.0) * step - 1.0) < 1e-3

    return Injected(bundle.with_imu(index, t=stamped), _name(bundle, index), right)


def undersampled(bundle: Bundle, rng: np.random.Generator) -> Injected:
    """Keep so few samples that the motion is not followed."""
    index = _one(bundle, rng)
    rate = float(rng.uniform(5.5, 8.0))
    table = bundle.imus[index]
    every = max(1, round(1.0 / (rate * float(np.median(np.diff(table["t"]))))))
    kept = {name: values[::every] for name, values in table.items()}
    return Injected(bundle.with_imu(index, **kept), _name(bundle, index), None, f"{rate:.1f} Hz")


BODIES = tuple(name for name in ANY if name not in ("wheelins-parity",))
ONE_WAY_UP = tuple(name for name in BODIES if name not in STILL)
"""not those that lie on every side in turn, of which none is down"""
FAULTS = (
    Fault("deg/s as rad/s", ("units",), degrees_as_radians, (*MOVING, *STILL, "walk")),
    Fault("rad/s as deg/s", ("units",), radians_as_degrees, MOVING),
    Fault("g as m/s^2", ("units",), g_as_m_s2, BODIES),
    Fault("rates as increments", ("units",), rates_as_increments, MOVING),
    Fault("increments as rates", ("units",), increments_as_rates, MOVING),
    Fault("ms or us as s", ("sampling",), milliseconds, ANY),
    Fault("axes upside down", ("axes",), upside_down, ONE_WAY_UP),
    Fault("one IMU turned", ("mount",), turned, (*ARRAYS, "mimu4444")),
    Fault("axes of one gyro", ("mount", "axes"), gyro_axes, (*ARRAYS, "mimu4444")),
    Fault("the same IMU twice", ("twice",), twice, (*ARRAYS, *STILL, "two-grades")),
    Fault("late IMU", ("delay",), late_imu, ARRAYS),
    Fault("late fixes", ("delay",), late_fixes, DRIVING),
    Fault("leap seconds", ("leap seconds",), leap_seconds, DRIVING),
    Fault("noisy fixes", ("noise",), noisy_fixes, (*DRIVING, "RAW_1111", "walk")),
    Fault("heights above the sea", ("height datum",), sea_level, ("RAW_1111", *DRIVING, "walk")),
    Fault("lever arm", ("lever arm",), lever_arm, DRIVING),
    Fault("gyro wraps", ("wrap",), wrap, (*MOVING, "mimu4444")),
    Fault("gyro saturates", ("saturation",), saturation, (*MOVING, "mimu4444")),
    Fault("axis stuck", ("stuck",), stuck, ANY),
    Fault("pause", ("pause",), pause, (*MOVING, "walk", "two-grades")),
    Fault("stamps jitter", ("jitter",), jitter, ANY),
    Fault("too few samples", ("undersampled",), undersampled, FLYING),
)
