"""The positions of a table with names, and what stands beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from polyins.config import TrackColumns
from polyins.formats import table
from polyins.formats.columns import OpenTable
from polyins.formats.stamps import stamps
from polyins.model.geodesy import displacement
from polyins.model.recording import Array
from polyins.model.rig import DEG
from polyins.reading import column_names as said
from polyins.reading import likely_units as likely
from polyins.reading.column_names import first_of_each, named
from polyins.reading.doubts import Doubt, distinct
from polyins.reading.table_stream import TableStream
from polyins.reading.time_columns import TimeGuess

FIX_RATES_HZ = (likely.SLOWEST_FIX_HZ, likely.FASTEST_FIX_HZ)


def positions_of(opened: OpenTable, time: TimeGuess, *, beside: bool) -> TableStream | None:
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
            return _with_the_rest(opened, declared, np.ones(3), whole=False, doubts=[time.doubt])
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
    doubts = [time.doubt]
    if datum != "ellipsoid":
        what = "is above the sea" if datum == "sea" else "may be above the sea or above the ellipsoid"
        doubts.append(Doubt(f"datum of heights: {name} {what}", "heights"))
    declared = {"time": time.column, "position": position, **_fixes_only(opened)}
    if beside:
        declared["changed"] = True
    return _with_the_rest(opened, declared, scaled, whole=whole, doubts=doubts)


def _fixes_only(opened: OpenTable) -> dict[str, Any]:
    """Return which rows are fixes of two or three dimensions, where a column says so of some rows and not of others."""
    for name in named(opened.names, said.FIX_TYPE):
        kinds = np.unique(opened.numbers([name])[0])
        good = [int(kind) for kind in kinds if np.isfinite(kind) and kind >= 2 and kind != 5]
        if good and len(good) < len(kinds):
            return {"only": {"name": name, "equal": good}}
    return {}


def _with_the_rest(
    opened: OpenTable, declared: dict[str, Any], places: Array, *, whole: bool, doubts: list[Doubt | None]
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
            doubts.append(doubt)
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
    text = f"taken as time in {unit}, position as {columns.position.frame}"
    return TableStream(table.track_of(opened, columns), columns, text, distinct(doubts))


def _length(opened: OpenTable, names: Sequence[str], whole: bool) -> dict[str, float]:
    stated = said.LENGTHS.get(said.unit_of(names[0]))
    if stated is None:
        counted = whole and all(likely.are_whole(column) for column in opened.numbers(names))
        stated = 1e-3 if counted else 1.0
    return {} if stated == 1.0 else {"scale": stated}


def _speed(
    opened: OpenTable, names: Sequence[str], declared: dict[str, Any], places: Array, whole: bool
) -> tuple[float, Doubt | None]:
    """Return how many m/s one is, and why to check it."""
    stated = said.SPEEDS.get(said.unit_of(names[0]))
    velocity = np.column_stack(opened.numbers(names))
    if stated is not None:
        return stated, None
    counted = whole and likely.are_whole(velocity)
    if declared["position"].get("frame", "latitude-longitude-height") != "latitude-longitude-height":
        return 1.0, None
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
            return scale, None
    if counted:
        return 1e-3, Doubt("velocities are whole numbers, taken for mm/s: the unit is a guess", "units")
    return 1.0, None
