"""Clocks as configured: those whose offset is to be estimated are put on the clock of the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from polyins.config import Config, GnssEntry, ImuEntry
from polyins.config.yaml_document import Document
from polyins.formats import rtklib, written_table
from polyins.formats.columns import is_parquet
from polyins.formats.recognize import log_format, read_log
from polyins.model.recording import ImuStream, Offset
from polyins.model.rig import Imu
from polyins.reading.position_stream import read_gnss

ALWAYS = (-np.inf, np.inf)
ESTIMATE = "estimate"


def on_one_clock(
    config: Config, document: Document, imus: Sequence[Imu], streams: Sequence[ImuStream]
) -> tuple[Config, tuple[ImuStream, ...], tuple[Offset, ...]]:
    """Estimate the offsets of all clocks marked `time_offset: estimate`.

    Those not marked share one clock. Returns the configuration with GNSS's offset in its `clock_offset_s`, the streams
    on the common clock, and the offsets. Raises InputError where the motion does not tell an offset, and where every
    clock is marked.
    """
    marked = [entry.time_offset == ESTIMATE for entry in config.imus]
    gnss = config.gnss if config.gnss is not None and config.gnss.time_offset == ESTIMATE else None
    offsets: tuple[Offset, ...] = ()
    if any(marked):
        from polyins.calibration.offsets import chained, reversed_offset

        offsets, base = _between_imus(imus, streams, marked)
        if all(marked):
            late = _late(config, document, imus, _shifted(streams, offsets))
            offsets = tuple(chained(one, reversed_offset(late, imus[base].name)) for one in offsets)
        streams = _shifted(streams, offsets)
        offsets = tuple(one for one, estimated in zip(offsets, marked, strict=True) if estimated)
    if gnss is not None:
        found = _gnss_offset(gnss, document, imus, streams)
        settled = {"clock_offset_s": gnss.clock_offset_s + found.offset_s, "time_offset": None}
        config = config.model_copy(update={"gnss": gnss.model_copy(update=settled)})
        offsets = (*offsets, found)
    return config, tuple(streams), offsets


def described(offset: Offset) -> str:
    """Say what was found."""
    return f"{offset.name}: clock offset {offset.offset_s:.4f} s (std {offset.std_s:.4f} s) estimated from the motion"


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
        stream if one.offset_s == 0.0 else replace(stream, time=stream.time + one.offset_s)
        for stream, one in zip(streams, offsets, strict=True)
    )


def _late(config: Config, document: Document, imus: Sequence[Imu], streams: Sequence[ImuStream]) -> Offset:
    """Return what to add to the clock of GNSS to put it on that of the IMUs, where only GNSS is not marked."""
    if config.gnss is None or config.gnss.time_offset == ESTIMATE:
        raise document.error(["imus"], f"every clock has time_offset: {ESTIMATE}; expected one without, or GNSS")
    return _gnss_offset(config.gnss, document, imus, streams)


def _gnss_offset(entry: GnssEntry, document: Document, imus: Sequence[Imu], streams: Sequence[ImuStream]) -> Offset:
    from polyins.calibration.offsets import gnss_offset

    fixes = read_gnss(entry, document, ALWAYS)
    with document.at(["gnss"]):
        return gnss_offset(imus, streams, fixes.stream, fixes.geodetic)


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
