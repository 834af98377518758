"""NMEA 0183: GGA, RMC, HDT and GST of each row, as `polyins live` sends them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO

from polyins.live.nmea import error_statistics, sentences
from polyins.model.status import STATUSES
from polyins.tools.export.trace import POSITION_STD, Trace

FIGURES = (
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "north_velocity_m_s",
    "east_velocity_m_s",
    "heading_deg",
    *POSITION_STD,
)


def write(file: IO[bytes], trace: Trace) -> None:
    """Write four sentences a row; where the solution's heights are of no known kind GGA has none."""
    file.writelines(line.encode() for line in _lines(trace))


def _lines(trace: Trace) -> Iterator[str]:
    unknown = trace.heights == "unknown"
    geoid, above_sea = None if unknown else trace.geoid_height, trace.heights == "sea-level"
    reckoned = trace.dead_reckoning
    unix = trace.nanoseconds * 1e-9
    for row, figures in enumerate(trace.block(*FIGURES).tolist()):
        values = dict(zip(FIGURES, figures, strict=True)) | {
            "time_s": float(unix[row]),
            "dead_reckoning": bool(reckoned[row]),
            "status": STATUSES[trace.status[row]],
        }
        yield from sentences(values, geoid, above_sea=above_sea)
        yield error_statistics(values)
