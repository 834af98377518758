"""u-blox UBX, alone or mixed with NMEA and RTCM, by pyubx2: positions of NAV-PVT and NAV-HPPOSLLH.

Stamps are iTOW, GPS seconds of the week, running on over its end. Heights are above the ellipsoid (`height`, not
`hMSL`). The receiver's `hAcc` is taken for each of two axes, `sAcc` for each of three. Sensor data (ESF) are left
aside.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polyins.files import find, read_bytes
from polyins.formats.gps_time import GPS_EPOCH, WEEK_S, utc_of_week
from polyins.formats.log import Log, counted, damage_named, needed, rising
from polyins.formats.rows import RowSource, Track
from polyins.model.recording import Array
from polyins.model.rig import DEG

FIXES = {0: "none", 1: "dead reckoning", 2: "2D", 3: "3D", 4: "3D with dead reckoning", 5: "time only"}
CARRIER = {1: "float", 2: "fix"}
"""of the carrier phase, of a fix in three dimensions"""
THREE_DIMENSIONS = (3, 4)
PVT, PRECISE = "NAV-PVT", "NAV-HPPOSLLH"
UBX_ONLY = 2

Messages = Sequence[Any]


def read(path: str | Path) -> Log:
    """Read the positions; raises InputError for a damaged file or without pyubx2."""
    found = find(path)
    library = needed("pyubx2", "ubx", found)
    with damage_named(found, "u-blox UBX"):
        messages: dict[str, list[Any]] = {PVT: [], PRECISE: []}
        others: set[str] = set()
        for _, message in library.UBXReader(_stream(found), protfilter=UBX_ONLY, quitonerror=0):
            kind = getattr(message, "identity", "")
            others.add(kind)
            if kind in messages:
                messages[kind].append(message)
        tracks = _tracks(found, messages)
        sensors = sorted(others & {"ESF-MEAS", "ESF-RAW"})
        return Log(
            "gps-week",
            {},
            tracks,
            {},
            {PVT: f"{PRECISE} has the same positions with more digits"} if PRECISE in tracks else {},
            utc_of_zero=_utc_of_zero(messages[PVT]),
            notes=tuple(f"{kind} holds data of the receiver's own sensors, which are not read" for kind in sensors),
        )


def _tracks(path: Path, messages: dict[str, list[Any]]) -> dict[str, Track]:
    """Return what has fixes in three dimensions."""
    coarse = _track(path, messages[PVT]) if messages[PVT] else None
    if coarse is None or not len(coarse.time):
        return {}
    precise = _precise(path, messages[PRECISE], coarse) if messages[PRECISE] else None
    return {PVT: coarse} | ({PRECISE: precise} if precise is not None and len(precise.time) else {})


def _stream(path: Path) -> Any:
    from io import BytesIO

    return BytesIO(read_bytes(path))


def _of(messages: Messages, *names: str) -> Array:
    return np.array([[getattr(message, name) for name in names] for message in messages], dtype=float)


def _time(messages: Messages) -> Array:
    """Return seconds of the week, from the bytes: pyubx2 gives iTOW as a time of day in UTC."""
    at = 0 if messages[0].identity == PVT else 4
    stamps = np.array([int.from_bytes(message.payload[at : at + 4], "little") for message in messages]) * 1e-3
    weeks = np.concatenate([[0], np.cumsum(np.diff(stamps) < -0.5 * WEEK_S)])
    return np.asarray(stamps + weeks * WEEK_S)


def _track(path: Path, messages: Messages) -> Track:
    time = _time(messages)
    kinds, good, carrier = _of(messages, "fixType", "gnssFixOk", "carrSoln").T
    fixed = np.flatnonzero(np.isin(kinds, THREE_DIMENSIONS) & (good == 1.0))
    kept = fixed[rising(time[fixed])]
    horizontal, vertical, speed = _of(messages, "hAcc", "vAcc", "sAcc")[kept].T * 1e-3
    names = [
        CARRIER.get(int(phase), FIXES.get(int(kind), f"type {kind:g}"))
        for kind, phase in zip(kinds, carrier, strict=True)
    ]
    return Track(
        RowSource(f"{path}, {PVT}"),
        time[kept],
        _of(messages, "lat", "lon", "height")[kept] * [DEG, DEG, 1e-3],
        position_std=np.column_stack([horizontal, horizontal, vertical]),
        velocity=_of(messages, "velN", "velE", "velD")[kept] * 1e-3,
        velocity_std=np.repeat(speed[:, None], 3, axis=1),
        quality=counted(names, str),
    )


def _precise(path: Path, messages: Messages, coarse: Track) -> Track:
    """Return the positions with more digits at the stamps of NAV-PVT, whose velocities go with them."""
    time = _time(messages)
    valid = np.array([not getattr(message, "invalidLlh", 0) for message in messages])
    place = {stamp: row for row, stamp in enumerate(time) if valid[row]}
    rows = np.array([row for row, stamp in enumerate(coarse.time) if stamp in place], dtype=int)
    own = np.array([place[stamp] for stamp in coarse.time[rows]], dtype=int)
    horizontal, vertical = _of(messages, "hAcc", "vAcc")[own].T * 1e-3
    assert coarse.velocity is not None
    assert coarse.velocity_std is not None
    return Track(
        RowSource(f"{path}, {PRECISE}"),
        time[own],
        _of(messages, "lat", "lon", "height")[own] * [DEG, DEG, 1e-3],
        position_std=np.column_stack([horizontal, horizontal, vertical]),
        velocity=coarse.velocity[rows],
        velocity_std=coarse.velocity_std[rows],
        quality=coarse.quality,
    )


def _utc_of_zero(messages: Messages) -> float | None:
    """Return Unix time at the begin of the week in which the log begins, of the first message that knows the date."""
    for message, second in zip(messages, _time(messages) if messages else (), strict=True):
        if message.validDate and message.validTime:
            day = np.datetime64(f"{message.year:04d}-{message.month:02d}-{message.day:02d}", "s")
            since = (day - GPS_EPOCH).astype(float) + 3600.0 * message.hour + 60.0 * message.min + message.second
            week = np.round((since - second) / WEEK_S)
            return float(utc_of_week(np.array([week]), np.array([0.0]))[0])
    return None
