"""GNSS and reference."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from polyins.config.clock import ClockSettings
from polyins.config.columns import TrackColumns
from polyins.config.fields import ORIGIN, Number, Positive, Section, Spread, Triple, number


class GeodeticPoint(Section):
    """A point on Earth."""

    latitude_deg: Annotated[float, BeforeValidator(number), Field(ge=-90.0, le=90.0)]
    """deg"""
    longitude_deg: Annotated[float, BeforeValidator(number), Field(ge=-360.0, le=360.0)]
    """deg"""
    height_m: Number = 0.0
    """m above the ellipsoid"""


class GnssEntry(ClockSettings):
    """The positions that aid the filter."""

    file: str = ""
    """where the data are; `polyins live` needs it for a replay only, all else always"""
    stream: str = ""
    """which stream of a log; may be left out where there is only one of the kind"""
    format: Literal["auto", "kf-gins", "rtklib-pos", "table"] = "auto"
    """of the file; auto: found from its content"""
    columns: TrackColumns | None = None
    """of a table; without it the table has the columns that polyins writes"""
    antenna_position_m: Triple = ORIGIN
    """of the antenna from the array's origin: forward, right, down, m"""
    position_std_m: Spread | None = None
    """north, east, down, m; takes the place of what the file says; the larger, the less fixes weigh"""
    rate_hz: Positive | None = None
    """thin the fixes to this rate; the larger, the more of them are used"""
    height: Literal["ellipsoidal", "sea-level", "as-given"] = "ellipsoidal"
    """what heights count from; as-given: whatever it is, and so do those of the solution"""
    geoid_height_m: Number | None = None
    """height of the geoid above the ellipsoid, m; of sea-level heights, which without it take that of a grid"""
    plane_origin: GeodeticPoint | None = None
    """turn latitude and longitude into metres on the local plane that touches here"""


class ReferenceEntry(ClockSettings):
    """What the solution is judged by."""

    file: str
    """where the data are"""
    stream: str = ""
    """which stream of a log; may be left out where there is only one of the kind"""
    format: Literal["auto", "kf-gins-nav", "kf-gins", "rtklib-pos", "table"] = "auto"
    """of the file; auto: found from its content"""
    columns: TrackColumns | None = None
    """of a table; without it the table has the columns that polyins writes"""
    position_lag_s: Number = 0.0
    """position and velocity belong to an instant that much later than the attitude of the same row, s"""
    point_m: Triple = ORIGIN
    """the point that the positions describe, from the array's origin: forward, right, down, m"""
    height: Literal["ellipsoidal", "sea-level", "as-given"] = "ellipsoidal"
    """what heights count from; as-given: whatever it is, and so do those of the solution"""
    geoid_height_m: Number | None = None
    """height of the geoid above the ellipsoid, m; of sea-level heights, which without it take that of a grid"""
