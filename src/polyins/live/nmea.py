"""NMEA 0183 sentences of a state: GGA, RMC, HDT, GST, talker IN (integrated navigation)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from polyins.formats.nmea import KNOT, checksum
from polyins.model.gps_time import DAY_S, EARLIEST_UNIX_S
from polyins.model.status import ATTITUDE_ONLY, NOT_TO_BE_USED, STATUSES

INVALID, FIX, ESTIMATED = 0, 1, 6
"""GGA quality"""
LOST = (STATUSES[ATTITUDE_ONLY], STATUSES[NOT_TO_BE_USED])


def sentences(row: Mapping[str, Any], geoid_height: float | None = None, *, above_sea: bool = False) -> list[str]:
    """Return GGA, RMC and HDT with checksums and line ends of a `Snapshot.row`.

    In dead reckoning GGA's quality is 6 and RMC's mode E, its status V; where the position is lost 0 and N. The height
    above the sea is empty unless the height of the geoid above the ellipsoid, m, is known, or heights are `above_sea`.
    """
    time, date = _time_and_date(row["time_s"])
    place = f"{_angle(row['latitude_deg'] or 0.0, 2, 'NS')},{_angle(row['longitude_deg'] or 0.0, 3, 'EW')}"
    quality, mode, status = FIX, "A", "A"
    if row["status"] in LOST:
        quality, mode, status = INVALID, "N", "V"
    elif row["dead_reckoning"]:
        quality, mode, status = ESTIMATED, "E", "V"
    north, east = row["north_velocity_m_s"] or 0.0, row["east_velocity_m_s"] or 0.0
    speed, course = math.hypot(north, east) / KNOT, math.degrees(math.atan2(east, north)) % 360.0
    height = _height(row["height_m"] or 0.0, geoid_height, above_sea)
    return [
        sentence(f"INGGA,{time},{place},{quality},,,{height},,"),
        sentence(f"INRMC,{time},{status},{place},{speed:.2f},{_turned(course)},{date},,,{mode}"),
        sentence(f"INHDT,{_turned(row['heading_deg'] or 0.0)},T"),
    ]


def error_statistics(row: Mapping[str, Any]) -> str:
    """Return GST: the standard deviations of latitude, longitude and height, m."""
    time, _ = _time_and_date(row["time_s"])
    std = ",".join(f"{row[f'std_{axis}_m']:.3f}" for axis in ("north", "east", "down"))
    return sentence(f"INGST,{time},,,,,{std}")


def sentence(body: str) -> str:
    """Return a body with dollar sign, checksum and line end."""
    return f"${body}*{checksum(body.encode()):02X}\r\n"


def _height(height: float, geoid_height: float | None, above_sea: bool) -> str:
    """Return the height above the sea and that of the geoid, as far as they are known."""
    if geoid_height is None:
        return f"{height:.2f},M,,M" if above_sea else ",M,,M"
    return f"{height if above_sea else height - geoid_height:.2f},M,{geoid_height:.2f},M"


def _turned(angle: float) -> str:
    """Return an angle, deg, which rounding does not bring to 360."""
    return f"{round(angle, 2) % 360.0:.2f}"


def _time_and_date(stamp: float) -> tuple[str, str]:
    stamp = round(stamp, 2)
    if stamp >= EARLIEST_UNIX_S:
        at = datetime.fromtimestamp(stamp, UTC)
        return f"{at:%H%M%S}.{at.microsecond // 10000:02d}", f"{at:%d%m%y}"
    hundredths = round(stamp % DAY_S * 100)
    minutes, rest = divmod(hundredths % int(DAY_S * 100), 6000)
    return f"{minutes // 60:02d}{minutes % 60:02d}{rest // 100:02d}.{rest % 100:02d}", ""


def _angle(degrees: float, digits: int, letters: str) -> str:
    """Return degrees and minutes to 1e-6 minutes, which is 2 mm, with the letter of the hemisphere."""
    degrees = (degrees + 180.0) % 360.0 - 180.0
    whole, part = divmod(round(abs(degrees) * 60e6), 60_000_000)
    return f"{whole:0{digits}d}{part // 1_000_000:02d}.{part % 1_000_000:06d},{letters[degrees < 0.0]}"
