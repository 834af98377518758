"""NMEA 0183: positions of GGA or GNS, dates of RMC and ZDA, standard deviations of GST; speeds and headings.

Stamps are UTC as Unix time. Heights are above the ellipsoid where each fix has the geoid's separation, else above the
sea. Sentences without a stamp (HDT, HDG, THS, VTG, VHW) are spread over the time from the stamp before them to the
next one. Headings of HDG are magnetic; the variation that it or RMC tells is added.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_bytes
from polyins.formats.library import damage_named
from polyins.formats.log import Log, counted
from polyins.formats.nmea import KNOT, checksum
from polyins.formats.rows import RowSource, SensorRows, Track, rising
from polyins.model.gps_time import DAY_S
from polyins.model.recording import Array
from polyins.model.rig import DEG

SENTENCE = re.compile(rb"\$([A-Z]{2})(GGA|GNS|RMC|ZDA|GST|VTG|VHW|HDT|HDG|THS),([ -~]*)\*([0-9A-Fa-f]{2})")
FIXES = {0: "none", 1: "single", 2: "dgps", 3: "pps", 4: "fix", 5: "float", 6: "estimated", 7: "manual", 8: "simulated"}
MODES = {"N": 0, "A": 1, "D": 2, "P": 3, "R": 4, "F": 5, "E": 6, "M": 7, "S": 8}
"""of GNS, as the numbers of GGA"""
MEASURED = (1, 2, 3, 4, 5)
HEADINGS = ("HDT", "THS", "HDG")
"""the best first"""
MOST = 0.5
"""of the fixes have to have a std for that of a neighbour to stand in"""


@dataclass
class _Stated:
    """What the sentences said, by kind."""

    seconds: list[float] = field(default_factory=list)
    """of the day, of each sentence with a stamp, in the file's order"""
    dates: list[tuple[int, float]] = field(default_factory=list)
    """which of them say that date, as Unix time of its midnight"""
    stamped: dict[str, list[tuple[float, ...]]] = field(default_factory=lambda: defaultdict(list))
    """which of them, and values: of GGA and GNS latitude, longitude, deg, height, separation, m, quality; of GST std
    north, east, up, m; of RMC speed, m/s"""
    unstamped: dict[str, list[tuple[int, float]]] = field(default_factory=lambda: defaultdict(list))
    """how many sentences with a stamp were before, and the value: heading, deg, or speed, m/s"""
    variation: float = np.nan
    """of the magnetic needle, deg, east of north, as RMC said it last"""
    unreadable: int = 0


def fits(head: bytes) -> bool:
    """Whether a line is a sentence."""
    return any(re.fullmatch(rb"\$[A-Z]{4,6},[ -~]*\*[0-9A-F]{2}", line.strip()) for line in head.splitlines())


def read(path: str | Path) -> Log:
    """Read the streams; raises InputError if no sentence tells the date."""
    found = find(path)
    with damage_named(found, "NMEA 0183"):
        log = streams(found, read_bytes(found))
        if log.utc_of_zero is None:
            raise InputError(f"{found}: no sentence tells the date; expected RMC or ZDA beside GGA")
        return log


def streams(path: Path, content: bytes) -> Log:
    """Return the streams of sentences, whatever stands between them; `utc_of_zero` is None if none tells the date."""
    stated = _Stated()
    for kind, fields in _sentences(content):
        try:
            _TAKE[kind](stated, fields)
        except (ValueError, IndexError):
            stated.unreadable += 1
    if not stated.dates:
        return Log("unix", {}, {}, {}, utc_of_zero=None if stated.seconds else 0.0)
    time = _unix_time(stated)
    kind = "GGA" if stated.stamped["GGA"] else "GNS"
    track = _track(path, kind, stated, time) if stated.stamped[kind] else None
    sensors = {**_speeds(path, stated, time), **_headings(path, stated, time)}
    headings = [name for name in HEADINGS if name in sensors]
    others = dict.fromkeys(headings[1:], f"{next(iter(headings), '')} is used")
    others |= {"VHW": "speed through water, not over ground"} if "VHW" in sensors else {}
    if "HDG" in sensors and np.isnan(sensors["HDG"].value).any():
        others["HDG"] = "magnetic, and no sentence tells the variation"
    notes = [f"{stated.unreadable} sentences have fields that are no numbers"] if stated.unreadable else []
    if track is None or not len(track.time):
        notes.append("no GGA or GNS sentence has a position with a height")
    elif track.position_std is None:
        notes.append(f"{kind}: no sentence (GST) tells how good the positions are")
    tracks = {kind: track} if track is not None and len(track.time) else {}
    return Log("unix", {}, tracks, sensors, others, utc_of_zero=0.0, notes=tuple(notes))


def _sentences(content: bytes) -> Iterator[tuple[str, list[str]]]:
    """Give kind and fields of the sentences whose checksum is right."""
    for match in SENTENCE.finditer(content):
        body = match[0][1 : match[0].rindex(b"*")]
        if checksum(body) == int(match[4], 16):
            yield match[2].decode(), match[3].decode().split(",")


def _stamp(stated: _Stated, text: str, date: str = "") -> int:
    """Note a stamp hhmmss.ss, and the date if there is one; returns which stamp it is."""
    stated.seconds.append(3600.0 * int(text[:2]) + 60.0 * int(text[2:4]) + float(text[4:]))
    if date:
        stated.dates.append((len(stated.seconds) - 1, float(np.datetime64(date, "s").astype(float))))
    return len(stated.seconds) - 1


def _take_gga(stated: _Stated, fields: list[str]) -> None:
    if fields[1]:
        _take_fix(stated, "GGA", fields, float(fields[5] or 0), 8)


def _take_gns(stated: _Stated, fields: list[str]) -> None:
    if fields[1]:
        _take_fix(stated, "GNS", fields, max(MODES.get(mode, 0) for mode in fields[5] or "N"), 8)


def _take_fix(stated: _Stated, kind: str, fields: list[str], quality: float, height_at: int) -> None:
    place = _degrees(*fields[1:3]), _degrees(*fields[3:5])
    separation_at = height_at + (2 if kind == "GGA" else 1)
    height, separation = (float(fields[at] or "nan") for at in (height_at, separation_at))
    stated.stamped[kind].append((_stamp(stated, fields[0]), *place, height, separation, quality))


def _take_gst(stated: _Stated, fields: list[str]) -> None:
    if all(fields[5:8]):
        std = tuple(float(value) for value in fields[5:8])
        stated.stamped["GST"].append((_stamp(stated, fields[0]), *std))


def _take_rmc(stated: _Stated, fields: list[str]) -> None:
    if not fields[0] or len(fields[8]) != 6:
        return
    day, month, year = fields[8][:2], fields[8][2:4], fields[8][4:]
    at = _stamp(stated, fields[0], f"20{year}-{month}-{day}")
    if fields[1] == "A" and fields[6]:
        stated.stamped["RMC"].append((at, float(fields[6]) * KNOT))
    if len(fields) > 10 and fields[9]:
        stated.variation = float(fields[9]) * (-1.0 if fields[10] == "W" else 1.0)


def _take_zda(stated: _Stated, fields: list[str]) -> None:
    if all(fields[:4]):
        _stamp(stated, fields[0], f"{fields[3]}-{fields[2]}-{fields[1]}")


def _take_hdg(stated: _Stated, fields: list[str]) -> None:
    heading = float(fields[0])
    if fields[1]:
        heading += float(fields[1]) * (-1.0 if fields[2] == "W" else 1.0)
    told = float(fields[3]) * (-1.0 if fields[4] == "W" else 1.0) if fields[3] else stated.variation
    stated.unstamped["HDG"].append((len(stated.seconds), heading + told))


def _take_ths(stated: _Stated, fields: list[str]) -> None:
    if fields[0] and fields[1] == "A":
        stated.unstamped["THS"].append((len(stated.seconds), float(fields[0])))


def _taken(kind: str, at: int, unit: float) -> Callable[[_Stated, list[str]], None]:
    """Return what takes the value of one field, where it is given."""

    def take(stated: _Stated, fields: list[str]) -> None:
        if fields[at]:
            stated.unstamped[kind].append((len(stated.seconds), float(fields[at]) * unit))

    return take


_TAKE: dict[str, Callable[[_Stated, list[str]], None]] = {
    "GGA": _take_gga,
    "GNS": _take_gns,
    "GST": _take_gst,
    "RMC": _take_rmc,
    "ZDA": _take_zda,
    "HDG": _take_hdg,
    "HDT": _taken("HDT", 0, 1.0),
    "THS": _take_ths,
    "VTG": _taken("VTG", 4, KNOT),
    "VHW": _taken("VHW", 4, KNOT),
}


def _degrees(text: str, side: str) -> float:
    """Return degrees of dddmm.mmmm and N, S, E or W."""
    degrees, minutes = divmod(float(text), 100.0)
    return (degrees + minutes / 60.0) * (-1.0 if side in ("S", "W") else 1.0)


def _unix_time(stated: _Stated) -> Array:
    """Return Unix time of each stamp: from one to the next the day goes on as the time of day does."""
    second = np.array(stated.seconds)
    day = np.concatenate([[0.0], np.cumsum(-np.round(np.diff(second) / DAY_S))])
    at, midnight = (np.array(column) for column in zip(*stated.dates, strict=True))
    first = midnight - day[at] * DAY_S
    last = np.searchsorted(at, np.arange(len(second)), "right") - 1
    return np.asarray(first[np.maximum(last, 0)] + day * DAY_S + second)


def _spread(stated: _Stated, kind: str, time: Array) -> tuple[Array, Array]:
    """Return stamps and values of sentences without a stamp: those after one stamp share the time to the next."""
    before, value = (np.array(column, dtype=float) for column in zip(*stated.unstamped[kind], strict=True))
    latest = np.maximum.accumulate(time)
    epochs = np.unique(latest)
    usual = float(np.median(np.diff(epochs))) if len(epochs) > 1 else 1.0
    known = np.concatenate([[epochs[0] - usual], latest])[before.astype(int)]
    begins, first, count = np.unique(known, return_index=True, return_counts=True)
    ends = np.append(epochs, epochs[-1] + usual)[np.searchsorted(epochs, begins, "right")]
    share = (np.arange(len(known)) - np.repeat(first, count) + 0.5) / np.repeat(count, count)
    return known + share * np.repeat(ends - begins, count), value


def _speeds(path: Path, stated: _Stated, time: Array) -> dict[str, SensorRows]:
    found = {}
    if stated.stamped["RMC"]:
        at, speed = np.array(stated.stamped["RMC"]).T
        stamps = time[at.astype(int)]
        kept = rising(stamps)
        found["RMC"] = SensorRows(RowSource(f"{path}, RMC"), "speed", stamps[kept], speed[kept])
    for kind in ("VTG", "VHW"):
        if stated.unstamped[kind]:
            found[kind] = SensorRows(RowSource(f"{path}, {kind}"), "speed", *_spread(stated, kind, time))
    return found


def _headings(path: Path, stated: _Stated, time: Array) -> dict[str, SensorRows]:
    found = {}
    for kind in HEADINGS:
        if stated.unstamped[kind]:
            stamps, heading = _spread(stated, kind, time)
            found[kind] = SensorRows(RowSource(f"{path}, {kind}"), "heading", stamps, heading % 360.0 * DEG)
    return found


def _track(path: Path, kind: str, stated: _Stated, time: Array) -> Track:
    at, latitude, longitude, height, separation, quality = np.array(stated.stamped[kind]).T
    stamps = time[at.astype(int)]
    kept = rising(stamps, np.isin(quality, MEASURED) & np.isfinite(height))
    above_sea = bool(np.isnan(separation[kept]).any())
    std, warnings = _std(stated, stamps[kept], time)
    return Track(
        RowSource(f"{path}, {kind}"),
        stamps[kept],
        np.column_stack([latitude * DEG, longitude * DEG, height if above_sea else height + separation])[kept],
        above_sea=above_sea,
        position_std=std,
        quality=counted(quality, lambda one: FIXES.get(int(one), f"quality {one:g}")),
        warnings=tuple(f"{path}: {text}" for text in warnings),
    )


def _std(stated: _Stated, stamps: Array, time: Array) -> tuple[Array | None, list[str]]:
    """Return north, east, up, m, at each fix; where the sentence was lost, those of the nearest that has it."""
    if not stated.stamped["GST"] or not len(stamps):
        return None, []
    at, *std = np.array(stated.stamped["GST"]).T
    own, kept = np.unique(time[at.astype(int)], return_index=True)
    lost = ~np.isin(stamps, own)
    if np.mean(~lost) <= MOST:
        return None, [f"{lost.sum()} of {len(stamps)} fixes have no std (GST), so that of the others is not used"]
    nearest = np.searchsorted(0.5 * (own[1:] + own[:-1]), stamps)
    said = (
        [f"{lost.sum()} of {len(stamps)} fixes have no std (GST); that of the nearest is taken"] if lost.any() else []
    )
    return np.column_stack(std)[kept][nearest], said
