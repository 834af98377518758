"""GPX 1.1: one track, a segment for each stretch without a pause.

Elevations of GPX are above the sea; where those of the solution are not known to be there are none. The format has no
place for velocities, attitudes and standard deviations.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO
from xml.sax.saxutils import escape

import numpy as np

from polyins.tools.export.trace import Trace
from polyins.version import __version__

PAUSE_S = 1.0
PAUSE_INTERVALS = 5.0
"""a longer step begins a segment, and of usual intervals"""


def write(file: IO[bytes], trace: Trace) -> None:
    """Write one track."""
    file.writelines(line.encode() for line in _lines(trace))


def _lines(trace: Trace) -> Iterator[str]:
    yield (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="polyins {__version__}" '
        'xmlns="http://www.topografix.com/GPX/1/1">\n'
    )
    yield f"<trk>\n<name>{escape(trace.method)}</name>\n<trkseg>\n"
    height = trace.above_sea
    geoid = "" if trace.geoid_height is None else f"<geoidheight>{trace.geoid_height:.3f}</geoidheight>"
    longitude = (trace["longitude_deg"] + 180.0) % 360.0 - 180.0  # 180 itself is not allowed
    steps = np.diff(trace["time_s"], prepend=trace["time_s"][:1])
    begins = steps > max(PAUSE_S, PAUSE_INTERVALS * float(np.median(steps)))
    for row, (latitude, date, begin) in enumerate(zip(trace["latitude_deg"], trace.dates, begins, strict=True)):
        elevation = "" if height is None else f"<ele>{height[row]:.3f}</ele>"
        yield "</trkseg>\n<trkseg>\n" if begin else ""
        yield f'<trkpt lat="{latitude:.9f}" lon="{longitude[row]:.9f}">{elevation}<time>{date}</time>{geoid}</trkpt>\n'
    yield "</trkseg>\n</trk>\n</gpx>\n"
