"""Heights, headings and speeds as configured: tables read, checked, in SI, on the recording's clock."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polyins.checks import stream_checks
from polyins.config import Config, OdometerEntry, SensorColumns, SensorEntry
from polyins.config.units import in_si, key_of, read
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.files import find_named
from polyins.formats.columns import column_names, open_table
from polyins.formats.rows import SensorRows
from polyins.formats.stamps import stamps
from polyins.formats.written_table import SENSOR_NAMES
from polyins.model.recording import AidingStream, Array, NonholonomicOptions
from polyins.model.rig import DEG, AidingSensor
from polyins.reading.log_streams import is_log, sensor_of
from polyins.reading.position_stream import thinned

Span = tuple[float, float]

UNITS = {
    "height": {"m": 1.0},
    "heading": {"deg": DEG, "rad": 1.0},
    "odometer": {"m/s": 1.0, "km/h": 1.0 / 3.6},
}
"""SI per unit, of each kind; the usual unit first"""


def entries(config: Config) -> Iterator[tuple[str, SensorEntry]]:
    """Give the kind and section of each sensor that is configured."""
    for kind in SENSOR_NAMES:
        entry: SensorEntry | None = getattr(config, kind)
        if entry is not None:
            yield kind, entry


def sensors_of(config: Config, document: Document) -> tuple[AidingSensor, ...]:
    """Return the sensors as parts of the rig; raises InputError for one that is farther away than any rig is long."""
    found = []
    for kind, entry in entries(config):
        with document.at([kind, "position_m"]):
            found.append(read(entry, AidingSensor, kind=kind))
    return tuple(found)


def constraint_of(config: Config) -> NonholonomicOptions | None:
    """Return how the filter is told that the vehicle does not slip, beside what the odometer says."""
    entry = config.odometer
    if entry is None or entry.constraint_interval_s is None:
        return None
    return NonholonomicOptions(entry.constraint_interval_s, np.array([entry.right_std_m_s, entry.down_std_m_s]))


def read_sensors(config: Config, document: Document, span: Span) -> tuple[tuple[AidingStream, ...], list[str]]:
    """Read all of them; returns streams and warnings. `span`: of the IMUs, s.

    Raises InputError for data and settings that cannot be right.
    """
    streams, warnings = [], []
    for kind, entry in entries(config):
        if not entry.file and kind == "odometer" and constraint_of(config) is not None:
            continue
        stream, texts = read_sensor(kind, entry, document, span)
        streams.append(stream)
        warnings += texts
    return tuple(streams), warnings


def read_sensor(kind: str, entry: SensorEntry, document: Document, span: Span) -> tuple[AidingStream, list[str]]:
    """Read one, as `read_sensors` does."""
    with document.at([kind, "file"]):
        find_named(entry.file)
    rows = _rows(kind, entry, document)
    source, time = rows.source, entry.clock.common(rows.time)
    if not len(time):
        raise InputError(f"{source.path}: no rows; expected those of {kind}")
    stream_checks.check_finite(source, {"time": time, kind: rows.value})
    stream_checks.check_order(source, time)
    warnings = stream_checks.check_within(source, kind, time, span)
    given = std_of(entry)
    if given is None and rows.std is None:
        raise document.error([kind], f"{source.path} has no std; expected a column std or {key_of(type(entry), 'std')}")
    stds = np.full(len(time), given) if rows.std is None or given is not None else rows.std
    stream_checks.check_finite(source, {"std": stds})
    for row in np.flatnonzero(stds <= 0.0)[:1]:
        raise InputError(f"{source.place(int(row))}: std of {kind} is {stds[row]:g}; expected a number above zero")
    kept = thinned(time, entry.rate_hz) if entry.rate_hz else np.arange(len(time))
    return AidingStream(kind, time[kept], rows.value[kept], with_constraint(entry, stds[kept])), list(warnings)


def _rows(kind: str, entry: SensorEntry, document: Document) -> SensorRows:
    if entry.columns is None and is_log(entry.file, entry.stream):
        return sensor_of(entry.file, entry.stream, kind)
    columns, unit = _columns(kind, entry, document)
    table = open_table(entry.file)
    value, *std = table.numbers([columns.value, *([] if columns.std is None else [columns.std])])
    time = stamps(table, columns.time)
    return SensorRows(table.source, kind, time, value * unit, std[0] * unit if std else None)


def _columns(kind: str, entry: SensorEntry, document: Document) -> tuple[SensorColumns, float]:
    """Return the columns and SI per unit of the value."""
    columns = entry.columns
    if columns is None:
        std = f"std_{SENSOR_NAMES[kind]}"
        known = {"std": std} if std in column_names(entry.file) else {}
        columns = SensorColumns.model_validate({"time": {"name": "time_s"}, "value": SENSOR_NAMES[kind], **known})
    units = UNITS[kind]
    unit: str = columns.unit or next(iter(units))
    if unit not in units:
        raise document.error([kind, "columns", "unit"], f"is {unit} for {kind}; expected {' or '.join(units)}")
    return columns, units[unit]


def std_of(entry: SensorEntry) -> float | None:
    """Return the std of the value that takes the place of what a sensor says, SI."""
    std: float | None = in_si(entry, key_of(type(entry), "std"))
    return std


def with_constraint(entry: SensorEntry, std: Array) -> Array:
    """Return the std of all components that are measured: of an odometer also right and down."""
    if not isinstance(entry, OdometerEntry):
        return std[:, None]
    others = np.broadcast_to([entry.right_std_m_s, entry.down_std_m_s], (len(std), 2))
    return np.column_stack([std, others])
