"""Tables, CSV or Parquet, whose columns and units the configuration declares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.formats.column_place import Column
from polyins.formats.columns import OpenTable, open_table
from polyins.formats.joined import at_stamps
from polyins.formats.rows import ImuRows, RowSource, Track, intervals, rising
from polyins.formats.stamps import seconds_per_count, stamps
from polyins.formats.written_table import ABOVE_SEA_NAMES, written_columns, written_imu_columns
from polyins.model.recording import Array
from polyins.model.rig import DEG, STANDARD_GRAVITY

if TYPE_CHECKING:
    from polyins.config import AccelColumns, GyroColumns, ImuColumns, RowsOf, TimeColumn, TrackColumns


RADIANS = {"rad/s": 1.0, "rad": 1.0, "deg/s": DEG, "deg": DEG}
METRES = {"m/s^2": 1.0, "m/s": 1.0, "g": STANDARD_GRAVITY}


def read_imu(path: str | Path, columns: ImuColumns | None = None, rate_hz: float | None = None) -> ImuRows:
    """Read the IMU table whose columns are declared, or one that polyins wrote.

    Rates become increments by the length of the interval that ends at the stamp; with `rate_hz` the time is row number
    / rate and the stamps are ignored. Raises InputError for missing columns and cells that are not numbers.
    """
    if columns is None:
        columns = written_imu_columns()
    if columns.time is None and rate_hz is None:
        raise InputError(f"{path}: neither columns.time nor rate_hz is given; expected one of them")
    return imu_of(open_table(path), columns, rate_hz)


def imu_of(table: OpenTable, columns: ImuColumns, rate_hz: float | None = None) -> ImuRows:
    """Return the rows of the IMU whose columns are declared, of a table that is open, as `read_imu` does."""
    if columns.accel.apart and columns.time is not None:
        return _merged(table, columns, columns.time)
    plain = columns.time is None or columns.time.dates
    values = table.numbers(imu_cells(columns, rate_hz)[: 6 if plain else 7])[:6]
    time = None if rate_hz or columns.time is None else stamps(table, columns.time)
    kept = _rows_of(table, columns.only, len(values[0]))
    values = [column[kept] for column in values] if len(kept) < len(values[0]) else values
    source = table.source.at(kept) if columns.only else table.source
    return _imu_rows(source, values, columns, _counted(len(kept), rate_hz) if time is None else time[kept])


def _counted(rows: int, rate_hz: float | None, first_row: int = 0) -> Array:
    return np.arange(first_row, first_row + rows) / (rate_hz or 1.0)


def _rows_of(table: OpenTable, only: RowsOf | None, rows: int) -> NDArray[np.intp]:
    """Return the rows, from 0, in which a column holds what it should; raise InputError if there are none."""
    if only is None:
        return np.arange(rows)
    if any(isinstance(value, str) for value in only.equal):
        there = np.isin(table.texts(only.name), [str(value) for value in only.equal])
    else:
        there = np.isin(table.numbers([only.name])[0], only.equal)
    if not there.any():
        raise InputError(
            f"{table.path}: {only.name} is nowhere {', '.join(map(repr, only.equal))}; expected rows of it"
        )
    return np.flatnonzero(there)


def _merged(table: OpenTable, columns: ImuColumns, time: TimeColumn) -> ImuRows:
    """Return the rows of the gyro, with the force of an accelerometer that stands apart at their stamps.

    Between two samples it is taken to change evenly; gyro rows that no samples are around are left out.
    """
    accel = columns.accel
    other = open_table(accel.file) if accel.file else table
    source, at, rates = _series(table, columns.gyro, time, columns.only)
    _, known, force = _series(other, accel, accel.time or time, None if accel.file else columns.only)
    if len(known) < 2 or len(at) < 2:
        raise InputError(
            f"{other.path}: {len(known)} row(s) of the accelerometer, {len(at)} of the gyro; expected more"
        )
    force, inside = at_stamps(known, force, at)
    if not inside.any():
        raise InputError(
            f"{other.path}: the accelerometer covers {known[0]:.3f} to {known[-1]:.3f} s, the gyro {at[0]:.3f} to "
            f"{at[-1]:.3f} s; expected the same clock"
        )
    kept = np.flatnonzero(inside)
    values = [*rates[kept].T, *force[kept].T]
    plain = columns.model_copy(update={"gyro": _unscaled(columns.gyro), "accel": _unscaled(accel)})
    rows = _imu_rows(source.at(kept), values, plain, at[kept])
    return replace(rows, warnings=tuple(dict.fromkeys((*rows.warnings, *other.source.warnings))))


def _unscaled(columns: Any) -> Any:
    return columns.model_copy(update={"scale": (1.0, 1.0, 1.0)})


def _series(
    table: OpenTable, columns: GyroColumns | AccelColumns, time: TimeColumn, of_imu: RowsOf | None
) -> tuple[RowSource, Array, Array]:
    """Return source, stamps, shape (T,), and values, shape (T, 3), of the rows that have them."""
    values = np.column_stack(table.numbers(columns.names)) * columns.scale
    at = stamps(table, time)
    there = np.isfinite(values).any(axis=1) & np.isfinite(at)
    kept = np.intersect1d(_rows_of(table, columns.only, len(at)), _rows_of(table, of_imu, len(at)))
    kept = kept[there[kept]]
    kept = kept[rising(at[kept])]
    return table.source.at(kept), at[kept], values[kept]


def imu_cells(columns: ImuColumns, rate_hz: float | None = None) -> list[Column]:
    """Return which columns of an IMU table are read: gyro, accelerometer, and the stamps unless `rate_hz` is given."""
    stamp: list[Column] = [] if rate_hz or columns.time is None else [columns.time.name]
    return [*columns.gyro.names, *columns.accel.names, *stamp]


def imu_rows(
    source: RowSource, values: Sequence[Array], columns: ImuColumns, rate_hz: float | None = None, first_row: int = 0
) -> ImuRows:
    """Return rows of an IMU table from the values of `imu_cells`, each of shape (T,); `first_row` counts from 0."""
    if rate_hz or columns.time is None:
        time = _counted(len(values[0]), rate_hz, first_row)
    else:
        time = values[6] * seconds_per_count(columns.time)
    return _imu_rows(source, values, columns, time)


def _imu_rows(source: RowSource, values: Sequence[Array], columns: ImuColumns, time: Array) -> ImuRows:
    gyro, accel = columns.gyro.unit, columns.accel.unit
    rates = _increments(values[:3], RADIANS[gyro], columns.gyro.scale, time if gyro.endswith("/s") else None)
    dvel = _increments(values[3:6], METRES[accel], columns.accel.scale, None if accel == "m/s" else time)
    return ImuRows(source, time, rates, dvel, gyro_unit=gyro, accel_unit=accel, warnings=source.warnings)


def _increments(values: Sequence[Array], unit: float, scale: tuple[float, float, float], time: Array | None) -> Array:
    """Return three columns in SI, shape (T, 3), times the intervals of `time` where they are rates."""
    rows = np.column_stack(values)
    if scale != (1.0, 1.0, 1.0):
        rows *= scale
    if unit != 1.0:
        rows *= unit
    if time is not None:
        rows *= intervals(time)[:, None]
    return rows


def read_track(path: str | Path, columns: TrackColumns | None = None) -> Track:
    """Read positions, and velocity, attitude and standard deviations where declared.

    Without `columns` the table has the names that polyins writes (also those of solution.parquet).
    """
    if columns is None:
        columns = written_columns(path)
    return track_of(open_table(path), columns)


def track_of(table: OpenTable, columns: TrackColumns) -> Track:
    """Return the positions whose columns are declared, of a table that is open, as `read_track` does."""
    groups = {
        "position": columns.position,
        "std": columns.std,
        "velocity": columns.velocity,
        "velocity_std": columns.velocity_std,
        "attitude": columns.attitude,
    }
    given = {name: group for name, group in groups.items() if group is not None}
    wanted: list[Column] = [name for group in given.values() for name in group.names]
    stamped = [columns.time.name] if columns.time is not None and not columns.time.dates else []
    values = table.numbers([*wanted, *stamped])[: len(wanted)]
    found = {name: np.column_stack(values[3 * n : 3 * n + 3]) for n, name in enumerate(given)}
    for name, group in given.items():
        if getattr(group, "variances", False):
            with np.errstate(invalid="ignore"):
                found[name] = np.sqrt(found[name])
        if (scale := getattr(group, "scale", (1.0, 1.0, 1.0))) != (1.0, 1.0, 1.0):
            found[name] = found[name] * scale
    if columns.position.undulation is not None:
        found["position"][:, 2] += table.numbers([columns.position.undulation])[0]
    track = _track(table.source, _stamps(table, columns, len(values[0])), found, columns)
    if columns.heading is not None:
        (heading,) = table.numbers([columns.heading.name])
        unknown = np.full((len(heading), 2), np.nan)
        track = replace(track, attitude=np.column_stack([unknown, heading * RADIANS[columns.heading.unit]]))
    return _used(track, columns, table)


def _stamps(table: OpenTable, columns: TrackColumns, rows: int) -> Array:
    if columns.time is not None:
        return stamps(table, columns.time)
    assert columns.rows is not None
    return _counted(rows, columns.rows.rate_hz)


def _used(track: Track, columns: TrackColumns, table: OpenTable) -> Track:
    """Leave out the rows that are not to be used; the source then names rows instead of lines."""
    kept = np.arange(len(track.time))
    if columns.rows is not None:
        kept = kept[columns.rows.first - 1 :: columns.rows.every]
    if columns.only is not None:
        kept = np.intersect1d(kept, _rows_of(table, columns.only, len(track.time)))
    if columns.changed:
        kept = kept[_changes(track.position[kept])]
    if columns.valid is not None:
        kept = kept[table.numbers([columns.valid])[0][kept] != 0.0]
    return track if len(kept) == len(track.time) else track.at_rows(kept)


def _changes(position: Array) -> NDArray[np.intp]:
    """Return the rows, from 0, of shape (M, 3), that hold a position other than the one before, and not 0, 0."""
    there = np.flatnonzero(np.isfinite(position).all(axis=1) & (position[:, :2] != 0.0).any(axis=1))
    moved = np.any(np.diff(position[there], axis=0, prepend=np.nan) != 0.0, axis=1)
    return there[moved]


def _track(source: RowSource, time: Array, found: dict[str, Array], columns: TrackColumns) -> Track:
    frame = columns.position.frame
    geodetic = frame == "latitude-longitude-height"
    vectors = columns.velocity.frame if columns.velocity else "north-east-down"
    angle_unit = columns.position.unit or "deg"
    scale = [RADIANS[angle_unit], RADIANS[angle_unit], 1.0] if geodetic else 1.0
    up_to_down = [1.0, 1.0, -1.0]
    return Track(
        source,
        time,
        _north_east_up(found["position"], frame) * scale,
        geodetic=geodetic,
        above_sea=columns.position.names[2] == ABOVE_SEA_NAMES[2],
        position_std=_north_east_first(found["std"], frame) if "std" in found else None,
        velocity=_north_east_up(found["velocity"], vectors) * up_to_down if "velocity" in found else None,
        velocity_std=_north_east_first(found["velocity_std"], vectors) if "velocity_std" in found else None,
        attitude=found["attitude"] * RADIANS[columns.attitude.unit] if columns.attitude else None,
        angle_unit=angle_unit,
        warnings=source.warnings,
    )


def _north_east_up(values: Array, frame: str) -> Array:
    """Bring three components given in `frame` into the order north, east, up; geodetic ones are in order."""
    return _north_east_first(values, frame) * [1.0, 1.0, -1.0 if frame == "north-east-down" else 1.0]


def _north_east_first(values: Array, frame: str) -> Array:
    """Bring three magnitudes given in `frame` into the order north, east, vertical."""
    return values[:, [1, 0, 2]] if frame == "east-north-up" else values
