"""NMEA 0183: positions of GGA, dates of RMC and ZDA, standard deviations of GST.

Stamps are UTC as Unix time. Heights are above the ellipsoid where each GGA has the geoid's separation, else above the
sea. Speed and course of RMC are left aside: the sentences do not say how good they are, nor how fast it climbs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_bytes
from polyins.formats.log import Log, counted, damage_named, rising
from polyins.formats.rows import RowSource, Track
from polyins.model.rig import DEG

SENTENCE = re.compile(rb"\$([A-Z]{2})(GGA|RMC|ZDA|GST),([ -~]*)\*([0-9A-Fa-f]{2})")
FIXES = {0: "none", 1: "single", 2: "dgps", 3: "pps", 4: "fix", 5: "float", 6: "estimated", 7: "manual", 8: "simulated"}
MEASURED = (1, 2, 3, 4, 5)
DAY = 86400.0


@dataclass
class _Fixes:
    """What the sentences said so far."""

    rows: list[tuple[float, ...]] = field(default_factory=list)
    """of GGA: s of the day, latitude, longitude, deg, height above the sea, separation, quality"""
    known: list[float] = field(default_factory=list)
    """Unix time of the last date before each of them, NaN before the first"""
    std: dict[float, tuple[float, ...]] = field(default_factory=dict)
    """north, east, up, m, by s of the day"""
    date: float = np.nan
    first_date: float = np.nan


def read(path: str | Path) -> Log:
    """Read the positions; raises InputError if no sentence tells the date."""
    found = find(path)
    fixes = _Fixes()
    with damage_named(found, "NMEA 0183"):
        for kind, fields in _sentences(read_bytes(found)):
            _take(fixes, kind, fields)
        if not fixes.rows:
            return Log("unix", {}, {}, {}, notes=("no GGA sentence has a position",))
        if np.isnan(fixes.first_date):
            raise InputError(f"{found}: no sentence tells the date; expected RMC or ZDA beside GGA")
        track = _track(found, fixes)
    return Log("unix", {}, {"GGA": track} if len(track.time) else {}, {}, utc_of_zero=0.0)


def _sentences(content: bytes) -> Iterator[tuple[str, list[str]]]:
    """Give kind and fields of the sentences whose checksum is right."""
    for match in SENTENCE.finditer(content):
        body = match[0][1 : match[0].rindex(b"*")]
        if reduce(xor, body) == int(match[4], 16):
            yield match[2].decode(), match[3].decode().split(",")


def _take(fixes: _Fixes, kind: str, fields: list[str]) -> None:
    if kind == "GGA" and fields[1]:
        height, separation = (float(fields[at] or "nan") for at in (8, 10))
        place = _degrees(*fields[1:3]), _degrees(*fields[3:5])
        fixes.rows.append((_second(fields[0]), *place, height, separation, float(fields[5] or 0)))
        fixes.known.append(fixes.date)
    elif kind == "GST" and all(fields[5:8]):
        fixes.std[_second(fields[0])] = tuple(float(value) for value in fields[5:8])
    elif kind == "RMC" and fields[0] and len(fields[8]) == 6:
        day, month, year = fields[8][:2], fields[8][2:4], fields[8][4:]
        _set_date(fixes, f"20{year}-{month}-{day}", fields[0])
    elif kind == "ZDA" and all(fields[:4]):
        _set_date(fixes, f"{fields[3]}-{fields[2]}-{fields[1]}", fields[0])


def _set_date(fixes: _Fixes, date: str, time: str) -> None:
    fixes.date = float(np.datetime64(date, "s").astype(float)) + _second(time)
    if np.isnan(fixes.first_date):
        fixes.first_date = fixes.date


def _second(text: str) -> float:
    """Return seconds of the day of hhmmss.ss."""
    return 3600.0 * int(text[:2]) + 60.0 * int(text[2:4]) + float(text[4:])


def _degrees(text: str, side: str) -> float:
    """Return degrees of dddmm.mmmm and N, S, E or W."""
    degrees, minutes = divmod(float(text), 100.0)
    return (degrees + minutes / 60.0) * (-1.0 if side in ("S", "W") else 1.0)


def _track(path: Path, fixes: _Fixes) -> Track:
    second, latitude, longitude, height, separation, quality = np.array(fixes.rows).T
    known = np.array(fixes.known)
    near = np.where(np.isnan(known), fixes.first_date, known)
    time = near + (second - near + 0.5 * DAY) % DAY - 0.5 * DAY  # the nearest instant with that time of day
    fixed = np.flatnonzero(np.isin(quality, MEASURED) & np.isfinite(height))
    kept = fixed[rising(time[fixed])]
    above_sea = bool(np.isnan(separation[kept]).any())
    std = [fixes.std.get(one) for one in second[kept]]
    stated = [one for one in std if one is not None]
    return Track(
        RowSource(f"{path}, GGA"),
        time[kept],
        np.column_stack([latitude * DEG, longitude * DEG, height if above_sea else height + separation])[kept],
        above_sea=above_sea,
        position_std=np.array(stated) if stated and len(stated) == len(std) else None,
        quality=counted(quality, lambda kind: FIXES.get(int(kind), f"quality {kind:g}")),
    )
