"""Clocks as configured: those whose offset is to be estimated are put on the clock of the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from polyins.config import Config, GnssEntry, ImuEntry, ReferenceEntry, SensorEntry
from polyins.config.clock import ClockSettings
from polyins.config.yaml_document import Document, Key
from polyins.formats import rtklib, written_table
from polyins.formats.columns import is_parquet
from polyins.formats.recognize import log_format, read_log
from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, Offset
from polyins.model.rig import PPM, Imu
from polyins.reading.imu_stream import ReadImu, in_array_axes
from polyins.reading.position_stream import ConfiguredGnss, read_gnss, read_reference
from polyins.reading.sensor_stream import entries, read_sensor

if TYPE_CHECKING:
    from polyins.calibration.other_clocks import Movers

Clocked = TypeVar("Clocked", bound=ClockSettings)

CLOCK, LEAP = "clock found", "clock leap"
"""kinds of findings: what was estimated, and that a clock was set anew"""
ALWAYS = (-np.inf, np.inf)
ESTIMATE = "estimate"


class OneClock(NamedTuple):
    """Streams on one clock, and what brought them there."""

    config: Config
    """with what was found in the place of what was to be found"""
    streams: tuple[ImuStream, ...]
    """of the IMUs"""
    offsets: tuple[Offset, ...]


def on_one_clock(config: Config, document: Document, imus: Sequence[ReadImu]) -> OneClock:
    """Estimate the offsets and drifts of all clocks marked `time_offset: estimate`.

    Those not marked share one clock. Raises InputError where the motion does not tell an offset, and where every clock
    is marked.
    """
    streams = tuple(one.stream for one in imus)
    offsets: tuple[Offset, ...] = ()
    if any(entry.time_offset for entry in config.imus):
        offsets = _of_imus(config, document, [one.imu for one in imus], streams)
        entries = tuple(
            _settled(entry, next((one for one in offsets if one.name == entry.name), None)) for entry in config.imus
        )
        config = config.model_copy(update={"imus": entries})
        streams = tuple(in_array_axes(one.rows, entry) for one, entry in zip(imus, entries, strict=True))
    movers = _movers(config, [one.imu for one in imus], streams)
    gnss = None
    for name, entry in _others(config):
        if not entry.time_offset:
            continue
        if gnss is None and config.gnss is not None and not config.gnss.time_offset:
            gnss = read_gnss(config.gnss, document, ALWAYS)
        found = _of_other(name, config, document, movers, gnss)
        offsets = (*offsets, found)
        config = config.model_copy(update={name: _settled(entry, found)})
    return OneClock(config, streams, offsets)


def to_be_found(config: Config) -> list[list[Key]]:
    """Return where it stands that a clock is to be estimated."""
    imus: list[list[Key]] = [["imus", i, "time_offset"] for i, entry in enumerate(config.imus) if entry.time_offset]
    others: list[list[Key]] = [[name, "time_offset"] for name, entry in _others(config) if entry.time_offset]
    return [*imus, *others]


def described(offset: Offset, first: float) -> Finding:
    """Say what was found of a clock; `first`: when the recording begins, s."""
    ppm, std = offset.drift / PPM, offset.drift_std / PPM
    at = offset.clock.common(offset.reference_s)
    return Finding(
        CLOCK,
        f"{offset.name}: clock offset {offset.offset_s:.4f} s (std {offset.std_s:.4f} s) at {at:.0f} s and drift "
        f"{ppm:.1f} ppm (std {std:.1f} ppm) estimated from the motion",
        stream=offset.name,
        from_s=first,
        size=offset.offset_s,
        expected=0.0,
    )


def leaps_of(offset: Offset) -> Iterator[Finding]:
    """Say when the clock leapt."""
    for stamp, size, std in offset.leaps:
        yield Finding(
            LEAP,
            f"{offset.name}: its clock leaps by {-size:.4f} s (std {std:.4f} s) at the stamp {stamp:.3f} s; the parts "
            "before and after have an offset of their own",
            stream=offset.name,
            from_s=offset.clock.common(stamp),
            size=-size,
            expected=0.0,
            remedy="look at what sets the clock",
        )


def _settled(entry: Clocked, found: Offset | None) -> Clocked:
    return entry if found is None else entry.model_copy(update=entry.settled(found.clock))


def _others(config: Config) -> Iterator[tuple[str, GnssEntry | ReferenceEntry | SensorEntry]]:
    """Give the sections that are no IMU's; those come first by which others are judged."""
    if config.gnss is not None:
        yield "gnss", config.gnss
    yield from entries(config)
    if config.reference is not None:
        yield "reference", config.reference


def _movers(config: Config, imus: Sequence[Imu], streams: Sequence[ImuStream]) -> Movers:
    from polyins.calibration.other_clocks import Movers

    return Movers(imus, streams, config.filter.gravity_m_s2)


def _of_other(name: str, config: Config, document: Document, movers: Movers, gnss: ConfiguredGnss | None) -> Offset:
    """Return what brings a stream that is no IMU's to the clock of the IMUs."""
    if name == "gnss":
        return _of_gnss(config, document, movers)
    with document.at([name]):
        if name == "reference":
            assert config.reference is not None
            entry = config.reference.model_copy(update={"position_lag_s": 0.0})
            reference, geodetic, _ = read_reference(entry, document, ALWAYS)
            return movers.of_reference(reference, geodetic)
        sensor = dict(entries(config))[name]
        stream, _ = read_sensor(name, sensor, document, ALWAYS)
        path = None
        if gnss is not None and config.gnss is not None:
            path = movers.path(gnss.stream, gnss.geodetic, np.array(config.gnss.antenna_position_m))
        return movers.of_sensor(stream, np.array(sensor.position_m), path)


def _of_gnss(config: Config, document: Document, movers: Movers) -> Offset:
    assert config.gnss is not None
    fixes = read_gnss(config.gnss, document, ALWAYS)
    with document.at(["gnss"]):
        antenna = np.array(config.gnss.antenna_position_m)
        return movers.of_positions("GNSS", fixes.stream, fixes.geodetic, antenna)


def _of_imus(
    config: Config, document: Document, imus: Sequence[Imu], streams: Sequence[ImuStream]
) -> tuple[Offset, ...]:
    """Return what to add to the clocks of the IMUs that are marked."""
    from polyins.calibration.offsets import chained, reversed_offset

    marked = [bool(entry.time_offset) for entry in config.imus]
    offsets, base = _between_imus(imus, streams, marked)
    if all(marked):
        if config.gnss is None or config.gnss.time_offset:
            raise document.error(["imus"], f"every clock has time_offset: {ESTIMATE}; expected one without, or GNSS")
        late = _of_gnss(config, document, _movers(config, imus, _shifted(streams, offsets)))
        offsets = tuple(chained(one, reversed_offset(late, imus[base].name)) for one in offsets)
    return tuple(one for one, estimated in zip(offsets, marked, strict=True) if estimated)


def _between_imus(
    imus: Sequence[Imu], streams: Sequence[ImuStream], marked: Sequence[bool]
) -> tuple[tuple[Offset, ...], int]:
    """Return what to add to each clock, nothing to those not marked, and the IMU whose clock is then common."""
    from polyins.calibration.offsets import imu_offsets, none

    known = [i for i, mark in enumerate(marked) if not mark] or list(range(len(imus)))
    base = min(known, key=lambda i: 2 if _steered(imus[i]) else 1 if imus[i].wheel is None else 0)
    taken = [i for i, mark in enumerate(marked) if mark or i == base]
    found = imu_offsets([imus[i] for i in taken], [streams[i] for i in taken], taken.index(base))
    by_index = dict(zip(taken, found, strict=True))
    return tuple(by_index.get(i, none(imu.name)) for i, imu in enumerate(imus)), base


def _steered(imu: Imu) -> bool:
    return imu.wheel is not None and imu.wheel.steering


def _shifted(streams: Sequence[ImuStream], offsets: Sequence[Offset]) -> tuple[ImuStream, ...]:
    return tuple(
        replace(stream, time=one.clock.common(stream.time)) for stream, one in zip(streams, offsets, strict=True)
    )


def utc_of_zero(config: Config) -> float | None:
    """Return the Unix time at which the common clock shows zero, s, as the first file has it that tells it.

    Clock offsets are those that are added to the stamps already.
    """
    entries: list[ImuEntry | GnssEntry] = [*config.imus]
    if config.gnss is not None:
        entries.append(config.gnss)
    return next((utc for entry in entries if (utc := _utc_of_zero(entry)) is not None), None)


def _utc_of_zero(entry: ImuEntry | GnssEntry) -> float | None:
    if entry.time_offset == ESTIMATE or entry.columns is not None:
        return None
    if isinstance(entry, ImuEntry) and entry.rate_hz is not None:
        return None  # rows are counted
    is_log = entry.format == "auto" and log_format(entry.file) is not None
    utc = read_log(entry.file).utc_of_zero if is_log else utc_of_file(entry.file)
    return None if utc is None else utc - entry.clock_offset_s


def utc_of_file(path: str | Path) -> float | None:
    """Return the Unix time at which the stamps of a file of one stream are zero, s, if it tells it."""
    return written_table.utc_of_zero(path) if is_parquet(path) else rtklib.utc_of_zero(path)
