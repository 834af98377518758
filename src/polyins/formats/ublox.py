"""u-blox UBX, alone or mixed with NMEA and RTCM, its fields by pyubx2: positions, headings, the receiver's own sensors.

Stamps are iTOW, GPS seconds of the week, running on over its end; sensors are brought to them, see `ublox_sensors`.
Heights are above the ellipsoid (`height`, not `hMSL`). The receiver's `hAcc` is taken for each of two axes, `sAcc` for
each of three.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.files import find, read_bytes
from polyins.formats import nmea_log, ublox_sensors
from polyins.formats.library import damage_named, needed
from polyins.formats.log import Log, counted
from polyins.formats.rows import RowSource, SensorRows, Track, rising
from polyins.model.gps_time import GPS_EPOCH, WEEK_S, utc_of_week
from polyins.model.recording import Array
from polyins.model.rig import DEG

FIXES = {0: "none", 1: "dead reckoning", 2: "2D", 3: "3D", 4: "3D with dead reckoning", 5: "time only"}
CARRIER = {1: "float", 2: "fix"}
"""of the carrier phase, of a fix in three dimensions"""
FUSED = 4
THREE_DIMENSIONS = (3, FUSED)
PRECISE, COARSE, FUSION, RAPID = "NAV-HPPOSLLH", "NAV-PVT", "NAV-PVAT", "HNR-PVT"
"""messages of positions, the best first"""
HEADINGS = {
    "NAV-RELPOSNED": ("relPosHeading", "relPosHeadingValid"),
    FUSION: ("vehHeading", "vehHeadingValid"),
    "NAV-ATT": ("heading", ""),
    "HNR-ATT": ("heading", ""),
}
"""the fields of a heading and of whether it is valid; messages, the best first"""
LARGEST_HEADING_STD = 45.0 * DEG
"""of what is a heading at all"""
SYNC = b"\xb5\x62"
FRAME_BYTES = 8
SHORT = 64
"""bytes up to which a checksum is quicker in plain Python"""

Messages = Sequence[Any]
_KEPT = {
    (1, 0x14): PRECISE, (1, 0x07): COARSE, (1, 0x17): FUSION, (0x28, 0x00): RAPID,
    (1, 0x3C): "NAV-RELPOSNED", (1, 0x05): "NAV-ATT", (0x28, 0x01): "HNR-ATT",
}  # fmt: skip
"""class and number of the messages of positions and headings"""
_TIME_AT = {
    **dict.fromkeys(_KEPT, 0), (1, 0x14): 4, (1, 0x3C): 4, (0x10, 0x15): 8,
    **dict.fromkeys([(0x10, 0x10), (1, 0x20), (1, 0x21), (1, 0x03), (1, 0x61)], 0),
}  # fmt: skip
"""where iTOW stands in the messages that are looked at"""
_SENSED = {(0x10, 0x02): "ESF-MEAS", (0x10, 0x03): "ESF-RAW", (0x10, 0x15): "ESF-INS"}


def fits(head: bytes) -> bool:
    """Whether there is a whole message, by its checksum."""
    return next(_frames(head), None) is not None


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError for a damaged file or without pyubx2."""
    found = find(path)
    parse = needed("pyubx2", "ubx", found).UBXReader.parse
    with damage_named(found, "u-blox UBX"):
        content = read_bytes(found)
        messages, times, sensed = _messages(content, parse)
        tracks, headings = _tracks(found, messages, times), _headings(found, messages, times)
        sensors = ublox_sensors.read(found, sensed, tracks.get(COARSE))
        log = Log(
            "gps-week" if times else "boot",
            sensors.imus,
            tracks,
            {**headings, **sensors.others},
            {**sensors.unusable, **_second_best(tracks), **_second_best(headings)},
            utc_of_zero=_utc_of_zero(messages[COARSE], times.get(COARSE, ())),
            notes=(*_fused(tracks, sensors), *sensors.notes),
            clock_offsets=sensors.clock_offsets,
        )
        return _with_nmea(found, log, content)


def _frames(content: bytes) -> Iterator[tuple[tuple[int, int], bytes]]:
    """Give class and number, and the whole of each message with a right checksum, whatever stands between."""
    at = content.find(SYNC)
    while at >= 0:
        end = at + FRAME_BYTES + int.from_bytes(content[at + 4 : at + 6], "little")
        if end <= len(content) and _checksum(content[at + 2 : end - 2]) == content[end - 2 : end]:
            yield (content[at + 2], content[at + 3]), content[at:end]
            at = content.find(SYNC, end)
        else:
            at = content.find(SYNC, at + 2)


def _checksum(body: bytes) -> bytes:
    if len(body) <= SHORT:
        a = b = 0
        for byte in body:
            a += byte
            b += a
    else:
        values = np.frombuffer(body, np.uint8).astype(np.int64)
        a, b = int(values.sum()), int(values @ np.arange(len(values), 0, -1))
    return bytes([a & 0xFF, b & 0xFF])


def _messages(
    content: bytes, parse: Callable[[bytes], Any]
) -> tuple[dict[str, list[Any]], dict[str, list[float]], list[ublox_sensors.Sensed]]:
    """Return messages of positions and headings, their times, s, and what sensors and clocks say, in the file's order.

    Times are those of the bytes: pyubx2 gives iTOW as a time of day in UTC.
    """
    messages: dict[str, list[Any]] = defaultdict(list)
    times: dict[str, list[float]] = defaultdict(list)
    sensed: list[ublox_sensors.Sensed] = []
    last: float | None = None
    for number, frame in _frames(content):
        if number in _TIME_AT:
            at = 6 + _TIME_AT[number]
            stamp = int.from_bytes(frame[at : at + 4], "little") * 1e-3
            last = stamp if last is None else stamp + WEEK_S * round((last - stamp) / WEEK_S)
            # rates of HNR are those of the sample before, and it is sent before the time that it says
            sensed.append((_SENSED.get(number, "" if number[0] != 0x28 else "HNR"), last, frame[6:-2]))
            if number in _KEPT:
                messages[_KEPT[number]].append(parse(frame))
                times[_KEPT[number]].append(last)
        elif number in _SENSED:
            sensed.append((_SENSED[number], np.nan, frame[6:-2]))
    return messages, dict(times), sensed


def _of(messages: Messages, *names: str) -> Array:
    return np.array([[getattr(message, name) for name in names] for message in messages], dtype=float)


def _tracks(path: Path, messages: dict[str, list[Any]], times: dict[str, list[float]]) -> dict[str, Track]:
    """Return what has fixes in three dimensions."""
    found: dict[str, Track] = {}
    for kind, fixed_name in ((COARSE, "gnssFixOk"), (FUSION, "gnssFixOK"), (RAPID, "GPSfixOK")):
        if messages[kind]:
            found[kind] = _track(RowSource(f"{path}, {kind}"), messages[kind], np.array(times[kind]), fixed_name)
    if messages[PRECISE]:
        found[PRECISE] = _precise(path, messages[PRECISE], np.array(times[PRECISE]), found.get(COARSE))
    return {kind: track for kind, track in found.items() if len(track.time)}


def _track(source: RowSource, messages: Messages, time: Array, fixed_name: str) -> Track:
    rapid = hasattr(messages[0], "gpsFix")
    kinds, good = _of(messages, "gpsFix" if rapid else "fixType", fixed_name).T
    carrier = np.zeros(len(kinds)) if rapid else _of(messages, "carrSoln")[:, 0]
    kept = rising(time, np.isin(kinds, THREE_DIMENSIONS) & (good == 1.0))
    horizontal, vertical, speed = _of(messages, "hAcc", "vAcc", "sAcc")[kept].T * 1e-3
    names = [
        CARRIER.get(int(phase), FIXES.get(int(kind), f"type {kind:g}"))
        for kind, phase in zip(kinds, carrier, strict=True)
    ]
    return Track(
        source,
        time[kept],
        _of(messages, "lat", "lon", "height")[kept] * [DEG, DEG, 1e-3],
        position_std=np.column_stack([horizontal, horizontal, vertical]),
        velocity=None if rapid else _of(messages, "velN", "velE", "velD")[kept] * 1e-3,
        velocity_std=None if rapid else np.repeat(speed[:, None], 3, axis=1),
        quality=counted(names, str),
    )


def _precise(path: Path, messages: Messages, time: Array, coarse: Track | None) -> Track:
    """Return the positions with more digits; at the stamps of NAV-PVT, whose velocities go with them, if there is any.

    NAV-PVT also says which are fixes in three dimensions.
    """
    valid = np.array([not getattr(message, "invalidLlh", 0) for message in messages])
    place = {stamp: row for row, stamp in enumerate(time) if valid[row]}
    stamps = np.array(sorted(place)) if coarse is None else coarse.time
    rows = np.array([row for row, stamp in enumerate(stamps) if stamp in place], dtype=int)
    own = np.array([place[stamp] for stamp in stamps[rows]], dtype=int)
    horizontal, vertical = _of(messages, "hAcc", "vAcc")[own].T * 1e-3
    track = Track(
        RowSource(f"{path}, {PRECISE}"),
        time[own],
        _of(messages, "lat", "lon", "height")[own] * [DEG, DEG, 1e-3],
        position_std=np.column_stack([horizontal, horizontal, vertical]),
    )
    if coarse is None or coarse.velocity is None or coarse.velocity_std is None:
        return track
    given = {"velocity": coarse.velocity[rows], "velocity_std": coarse.velocity_std[rows]}
    return replace(track, **given, quality=coarse.quality)


def _headings(path: Path, messages: dict[str, list[Any]], times: dict[str, list[float]]) -> dict[str, SensorRows]:
    """Return the headings that the receiver tells, with their accuracy."""
    found: dict[str, SensorRows] = {}
    for kind, (name, valid_name) in HEADINGS.items():
        if not messages[kind]:
            continue
        time, (heading, std) = np.array(times[kind]), _of(messages[kind], name, "accHeading").T * DEG
        good = (std > 0.0) & (std < LARGEST_HEADING_STD)
        if valid_name:
            good &= _of(messages[kind], valid_name)[:, 0] == 1.0
        kept = rising(time, good)
        if len(kept):
            source = RowSource(f"{path}, {kind}")
            found[kind] = SensorRows(source, "heading", time[kept], heading[kept], std[kept])
    return found


def _second_best(streams: dict[str, Any]) -> dict[str, str]:
    """Say of all but the best why they are not used."""
    best = next((kind for kind in (PRECISE, COARSE, FUSION, RAPID, *HEADINGS) if kind in streams), "")
    return {kind: f"{best} is of the same receiver and is used" for kind in streams if kind != best}


def _fused(tracks: dict[str, Track], sensors: ublox_sensors.Sensors) -> tuple[str, ...]:
    """Say that fixes already hold what the receiver's own IMU measured."""
    used = next((tracks[kind] for kind in (COARSE, FUSION, RAPID) if kind in tracks), None)
    fused = used.quality.get(FIXES[FUSED], 0) if used is not None else 0
    if not fused or not sensors.imus:
        return ()
    return (
        f"{fused} fixes are the receiver's own fusion with its sensors: their errors last longer than those of GNSS",
    )


def _utc_of_zero(messages: Messages, times: Sequence[float]) -> float | None:
    """Return Unix time at the begin of the week in which the log begins, of the first message that knows the date."""
    for message, second in zip(messages, times, strict=True):
        if message.validDate and message.validTime:
            day = np.datetime64(f"{message.year:04d}-{message.month:02d}-{message.day:02d}", "s")
            since = (day - GPS_EPOCH).astype(float) + 3600.0 * message.hour + 60.0 * message.min + message.second
            week = np.round((since - second) / WEEK_S)
            return float(utc_of_week(np.array([week]), np.array([0.0]))[0])
    return None


def _with_nmea(path: Path, log: Log, content: bytes) -> Log:
    """Add the sentences between the messages, on the same clock; alone they have positions if UBX has none."""
    sentences = nmea_log.streams(path, content)
    if not sentences.streams or (log.tracks and log.utc_of_zero is None):
        return log
    if not log.streams:
        return sentences
    if log.utc_of_zero is None:
        return replace(log, notes=(*log.notes, "positions of NMEA are not on the clock of the sensors and are left"))
    moved = sentences.moved(-log.utc_of_zero)
    used = next((name for name in log.tracks if name not in log.unusable), "")
    known = dict.fromkeys(moved.tracks if used else (), f"{used} is of the same receiver and is used")
    heading = any(one.kind == "heading" for one in log.sensors.values())
    known |= {
        name: "another heading is used" for name, one in moved.sensors.items() if heading and one.kind == "heading"
    }
    return replace(
        log,
        tracks={**log.tracks, **moved.tracks},
        sensors={**log.sensors, **moved.sensors},
        unusable={**log.unusable, **moved.unusable, **known},
        notes=(*log.notes, *(() if used else moved.notes)),
    )
