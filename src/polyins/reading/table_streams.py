"""The streams of a table that nobody has described: IMUs and positions, by the names of columns and size of values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polyins.config import ImuColumns, TrackColumns
from polyins.errors import InputError
from polyins.formats import table
from polyins.formats.columns import OpenTable
from polyins.formats.rows import ImuRows, RowSource, Track
from polyins.formats.stamps import stamps
from polyins.model.geodesy import displacement
from polyins.model.recording import Array
from polyins.model.rig import DEG
from polyins.reading import column_names as said
from polyins.reading import likely_units as likely
from polyins.reading.column_names import SensorAxis, first_of_each, named, sensor_axis
from polyins.reading.likely_units import Likely
from polyins.reading.time_columns import TimeGuess, time_column

MOST_SENSORS = 64
FEWEST_OF_EACH = 5
"""rows of an IMU among those of others"""
FIX_RATES_HZ = (likely.SLOWEST_FIX_HZ, likely.FASTEST_FIX_HZ)


@dataclass(frozen=True)
class TableStream:
    """One stream of a table, how it is read, and what to check."""

    rows: ImuRows | Track
    columns: ImuColumns | TrackColumns | None
    """None: those that polyins writes"""
    guesses: tuple[str, ...]
    checks: tuple[str, ...] = ()
    """what values leave open"""


def stream_name(streams: Sequence[TableStream], index: int) -> str:
    """Return how a stream of a table is called: imu1, imu2, ... or positions."""
    if isinstance(streams[index].rows, Track):
        return "positions"
    return f"imu{1 + sum(isinstance(one.rows, ImuRows) for one in streams[:index])}"


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


def streams_of(opened: OpenTable) -> list[TableStream] | HalfImu:
    """Return the streams of a table with names; raise InputError if the names say nothing."""
    time = time_column(opened)
    axes = _axes(opened.names)
    pairs = _pairs(axes)
    found: list[TableStream] = []
    if time is not None and pairs:
        found += _imus(opened, time, pairs)
    elif time is not None and (rows := _rows_of_sensors(opened, time)) is not None:
        found.append(rows)
    elif time is not None and (half := _half(opened, time, axes)) is not None:
        return half
    if time is not None and (track := _track(opened, time, beside=bool(found))) is not None:
        found.append(track)
    if not found:
        raise InputError(
            f"{opened.path}: columns {', '.join(name for name in opened.names if name) or '(no header)'} are of no "
            "known meaning; expected names such as time, gyro_x, acc_x or time, latitude, longitude, height (else "
            "declare them as columns)"
        )
    return found


def _axes(names: Sequence[str]) -> dict[str, SensorAxis]:
    """Return which axes columns are; a linear acceleration beside a plain one is that without gravity."""
    axes = {name: axis for name in names if name and (axis := sensor_axis(name)) is not None}
    forces = [name for name, axis in axes.items() if axis.what == "accel"]
    linear = {name for name in forces if "linear" in name.lower()}
    return {name: axis for name, axis in axes.items() if name not in linear or len(linear) == len(forces)}


Three = tuple[str, str, str]


def _triples(axes: dict[str, SensorAxis], what: str) -> dict[str, tuple[Three, str]]:
    """Return the names of three axes, and their unit, by what tells sensors apart."""
    found: dict[str, dict[int, str]] = {}
    units: dict[str, str] = {}
    for name, axis in axes.items():
        if axis.what == what:
            found.setdefault(axis.of, {}).setdefault(axis.axis, name)
            units.setdefault(axis.of, axis.unit)
    return {of: ((names[0], names[1], names[2]), units[of]) for of, names in found.items() if set(names) == {0, 1, 2}}


def _pairs(axes: dict[str, SensorAxis]) -> list[tuple[str, tuple[Three, str], tuple[Three, str], bool]]:
    """Return gyro and accelerometer of each IMU, and whether they are increments."""
    for gyro, accel in (("gyro", "accel"), ("angle increment", "velocity increment")):
        gyros, accels = _triples(axes, gyro), _triples(axes, accel)
        common = [of for of in gyros if of in accels]
        if not common and gyros and accels:
            return [("", next(iter(gyros.values())), next(iter(accels.values())), gyro != "gyro")]
        if common:
            plain = [of for of in common if not of.startswith(("uncomp", "raw"))] or common
            return [(of, gyros[of], accels[of], gyro != "gyro") for of in plain]
    return []


def _imus(
    opened: OpenTable, time: TimeGuess, pairs: Sequence[tuple[str, tuple[Three, str], tuple[Three, str], bool]]
) -> list[TableStream]:
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
    accel = _stated(of.accel[1], said.ACCEL_UNITS) or (
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
    gyro = _stated(of.gyro[1], said.GYRO_UNITS) or (
        Likely("rad") if of.increments else likely.gyro_unit(of.rates[there[0]], of.force[there[1]], step, accel)
    )
    declared: dict[str, Any] = {
        "time": time.column,
        "gyro": {"names": of.gyro[0], "unit": gyro.unit} | _scaled(gyro),
        "accel": {"names": of.accel[0], "unit": accel.unit} | _scaled(accel),
    }
    if split:
        declared["accel"]["time"] = time.column
    if only is not None:
        declared["only"] = only
    return described(opened, declared, [time.doubt, accel.doubt, gyro.doubt])


def described(opened: OpenTable, declared: dict[str, Any], doubts: Sequence[str]) -> TableStream:
    """Return the IMU whose columns these are."""
    columns = ImuColumns.model_validate(declared)
    rows = table.imu_of(opened, columns)
    unit = columns.time.unit if columns.time is not None and not columns.time.dates else "dates"
    text = f"{opened.path}: taken as time in {unit}, gyro in {columns.gyro.unit}, accel in {columns.accel.unit}"
    checks = tuple(dict.fromkeys(doubt for doubt in doubts if doubt))
    return TableStream(rows, columns, (text, *(f"{opened.path}: {check}" for check in checks)), checks)


def _stated(unit: str, units: dict[str, tuple[str, float]]) -> Likely | None:
    return Likely(*units[unit]) if unit in units else None


def _scaled(unit: Likely) -> dict[str, float]:
    return {} if unit.scale == 1.0 else {"scale": unit.scale}


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


def _rows_of_sensors(opened: OpenTable, time: TimeGuess) -> TableStream | None:
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
                | _scaled(turning),
                "accel": {"names": names, "unit": unit.unit, "only": {"name": name, "equal": accel[0]}} | _scaled(unit),
            }
            return described(opened, declared, [time.doubt, unit.doubt, turning.doubt])
    return None


def _starts(word: str) -> set[str]:
    return {part for part in ("lin", "uncal") if part in word.lower()}


def _half(opened: OpenTable, time: TimeGuess, axes: dict[str, SensorAxis]) -> HalfImu | None:
    """Return the gyro or accelerometer that a table holds alone; units or the file's name tell which."""
    for what in ("gyro", "accel"):
        triples = _triples(axes, what)
        if triples:
            return _half_of(opened, time, what, *next(iter(triples.values())))
    names = first_of_each(opened.names, ("x", "y", "z"))
    if names is None:
        return None
    unit = said.parsed(names[0]).unit
    stem = opened.path.name.lower()
    gyro = unit in said.GYRO_UNITS or (not unit and "gyr" in stem)
    accel = unit in said.ACCEL_UNITS or (not unit and "acc" in stem)
    if gyro == accel or "linear" in stem:
        return None
    return _half_of(opened, time, "gyro" if gyro else "accel", (names[0], names[1], names[2]), unit)


def _half_of(opened: OpenTable, time: TimeGuess, what: str, names: Three, unit: str) -> HalfImu:
    values = np.column_stack(opened.numbers(names))
    known = _stated(unit, said.GYRO_UNITS if what == "gyro" else said.ACCEL_UNITS)
    columns: dict[str, Any] = {"names": names}
    if known is not None:
        columns |= {"unit": known.unit} | _scaled(known)
    return HalfImu(what, opened.source, columns, time.column, time.seconds, values)


def joined(gyro: HalfImu, accel: HalfImu) -> dict[str, Any]:
    """Return the columns of the IMU that two files make, the gyro's being the one that is named."""
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
        force |= {"unit": unit.unit} | _scaled(unit)
    if "unit" not in rates:
        whole = Likely(force["unit"], force.get("scale", 1.0))
        turning = likely.gyro_unit(gyro.values, accel.values[: len(gyro.values)], step, whole)
        rates |= {"unit": turning.unit} | _scaled(turning)
    return {
        "time": gyro.time_column,
        "gyro": rates,
        "accel": force | {"file": accel.source.path, "time": accel.time_column},
    }


def _track(opened: OpenTable, time: TimeGuess, *, beside: bool) -> TableStream | None:
    """Return the positions of a table, with the velocity, attitude and standard deviations that stand beside them.

    `beside`: the rows are those of an IMU, and most repeat the position of the one before, or have none.
    """
    time = time if beside else time.at_rates(FIX_RATES_HZ)
    latitude, longitude = (named(opened.names, one, "deg|rad|1e7|e7") for one in (said.LATITUDE, said.LONGITUDE))
    if latitude and longitude:
        return _geodetic(opened, time, latitude[0], longitude[0], beside=beside)
    if beside:
        return None
    for frame, patterns in said.LOCAL.items():
        names = first_of_each(opened.names, patterns, "m")
        if names is not None:
            declared = {"time": time.column, "position": {"names": names, "frame": frame}}
            return _with_the_rest(opened, declared, np.ones(3), whole=False, checks=[time.doubt])
    return None


def height_column(names: Sequence[str]) -> tuple[str, str] | None:
    """Return the column of heights, and whether they are above the ellipsoid, the sea, or one does not know what."""
    for kind, pattern in (
        ("ellipsoid", said.ELLIPSOIDAL),
        ("sea", said.SEA_LEVEL),
        ("unknown", said.AMBIGUOUS),
    ):
        found = named(names, pattern, "m|mm|cm")
        if found:
            return found[0], kind
    return None


def _geodetic(opened: OpenTable, time: TimeGuess, latitude: str, longitude: str, *, beside: bool) -> TableStream | None:
    height = height_column(opened.names)
    if height is None:
        return None
    name, datum = height
    places = opened.numbers([latitude, longitude, name])
    radians = said.unit_of(latitude) == "rad"
    angle = 1.0 if radians else likely.angle_scale(places[0], places[1])
    whole = angle != 1.0 and likely.are_whole(places[2])
    length = said.LENGTHS.get(said.unit_of(name), 1e-3 if whole else 1.0)
    position: dict[str, Any] = {"names": [latitude, longitude, name]}
    if radians:
        position["unit"] = "rad"
    if (angle, length) != (1.0, 1.0):
        position["scale"] = [angle, angle, length]
    if first_of_each(opened.names, said.VARIANCES):
        datum = "ellipsoid"  # by the definition of NavSatFix
    undulation = named(opened.names, said.UNDULATION, "m")
    if undulation and datum != "ellipsoid":
        position["undulation"] = undulation[0]
        datum = "ellipsoid"
    degree = 1.0 if radians else DEG
    scaled = np.column_stack(places) * [angle * degree, angle * degree, length]
    checks = [time.doubt]
    if datum != "ellipsoid":
        what = "is above the sea" if datum == "sea" else "may be above the sea or above the ellipsoid"
        checks.append(f"{DATUM}: {name} {what}")
    declared = {"time": time.column, "position": position, **_fixes_only(opened)}
    if beside:
        declared["changed"] = True
    return _with_the_rest(opened, declared, scaled, whole=whole, checks=checks)


DATUM = "datum of heights"
"""begins what is said of heights that need not be above the ellipsoid"""


def _fixes_only(opened: OpenTable) -> dict[str, Any]:
    """Return which rows are fixes of two or three dimensions, where a column says so of some rows and not of others."""
    for name in named(opened.names, said.FIX_TYPE):
        kinds = np.unique(opened.numbers([name])[0])
        good = [int(kind) for kind in kinds if np.isfinite(kind) and kind >= 2 and kind != 5]
        if good and len(good) < len(kinds):
            return {"only": {"name": name, "equal": good}}
    return {}


def _with_the_rest(
    opened: OpenTable, declared: dict[str, Any], places: Array, *, whole: bool, checks: list[str]
) -> TableStream:
    names = opened.names
    std = first_of_each(names, said.STD, "m|mm|cm")
    horizontal, vertical = (named(names, one, "m|mm|cm") for one in (said.HORIZONTAL_STD, said.VERTICAL_STD))
    if std is None and horizontal and vertical:
        std = [horizontal[0], horizontal[0], vertical[0]]
    variances = first_of_each(names, said.VARIANCES)
    if std is not None:
        declared["std"] = {"names": std} | _length(opened, std, whole)
    elif variances is not None:
        declared["std"] = {"names": variances, "variances": True}
    for frame, patterns in said.VELOCITY.items():
        velocity = first_of_each(names, patterns, "m_s|cm_s|mm_s|km_h")
        if velocity is not None:
            scale, doubt = _speed(opened, velocity, declared, places, whole)
            checks.append(doubt)
            factor = {} if scale == 1.0 else {"scale": scale}
            declared["velocity"] = {"names": velocity, "frame": frame} | factor
            of_velocity = first_of_each(names, said.VELOCITY_STD, "m_s|cm_s|mm_s")
            speed = named(names, said.SPEED_STD, "m_s|cm_s|mm_s")
            of_velocity = of_velocity or (speed[:1] * 3 if speed else None)
            if of_velocity is not None:
                own = said.SPEEDS.get(said.unit_of(of_velocity[0]))
                factor = factor if own is None else {} if own == 1.0 else {"scale": own}
                declared["velocity_std"] = {"names": of_velocity} | factor
            break
    if attitude := first_of_each(names, said.ATTITUDE, "deg|rad"):
        angles = opened.numbers(attitude)
        stated, _ = said.ANGLES.get(said.unit_of(attitude[0]), ("", 1.0))
        degrees = max(float(np.nanmax(np.abs(angle), initial=0.0)) for angle in angles) > 2 * np.pi
        declared["attitude"] = {"names": attitude, "unit": stated or ("deg" if degrees else "rad")}
    columns = TrackColumns.model_validate(declared)
    unit = "dates" if columns.time is None or columns.time.dates else columns.time.unit
    found = tuple(dict.fromkeys(check for check in checks if check))
    text = f"{opened.path}: taken as time in {unit}, position as {columns.position.frame}"
    rows = table.track_of(opened, columns)
    return TableStream(rows, columns, (text, *(f"{opened.path}: {check}" for check in found)), found)


def _length(opened: OpenTable, names: Sequence[str], whole: bool) -> dict[str, float]:
    stated = said.LENGTHS.get(said.unit_of(names[0]))
    if stated is None:
        counted = whole and all(likely.are_whole(column) for column in opened.numbers(names))
        stated = 1e-3 if counted else 1.0
    return {} if stated == 1.0 else {"scale": stated}


def _speed(
    opened: OpenTable, names: Sequence[str], declared: dict[str, Any], places: Array, whole: bool
) -> tuple[float, str]:
    """Return how many m/s one is, and why to check it."""
    stated = said.SPEEDS.get(said.unit_of(names[0]))
    velocity = np.column_stack(opened.numbers(names))
    if stated is not None:
        return stated, ""
    counted = whole and likely.are_whole(velocity)
    if declared["position"].get("frame", "latitude-longitude-height") != "latitude-longitude-height":
        return 1.0, ""
    good = np.isfinite(places).all(axis=1)
    time = TrackColumns.model_validate(declared).time
    assert time is not None
    at = stamps(opened, time)
    good &= np.isfinite(at)
    if good.sum() > 2:
        moved = displacement(places[good], places[good][0], True)
        with np.errstate(divide="ignore", invalid="ignore"):
            rates = np.diff(moved, axis=0) / np.diff(at[good])[:, None]
        rates[~np.isfinite(rates).all(axis=1)] = np.nan
        scale, clear = likely.speed_scale(velocity[good][1:, :2], rates[:, :2])
        if clear:
            return scale, ""
    if counted:
        return 1e-3, "velocities are whole numbers, taken for mm/s: the unit is a guess"
    return 1.0, ""
