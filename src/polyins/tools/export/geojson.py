"""GeoJSON (RFC 7946): one feature, a line whose properties hold a list of each figure, one value per position.

The third coordinate is the height above the ellipsoid, as the RFC has it; it is left out where the solution's is not
known to be, and `height_m` says it with `heights`.
"""

from __future__ import annotations

import json
from typing import IO, Any

import numpy as np

from polyins.errors import InputError
from polyins.formats.documents import plain
from polyins.model.recording import Array
from polyins.model.status import STATUSES
from polyins.tools.export.trace import EULER, POSITION_STD, VELOCITY, VELOCITY_STD, Trace
from polyins.version import __version__

FIGURES = ("height_m", *VELOCITY, *EULER, *POSITION_STD, *VELOCITY_STD, *(f"std_{name}" for name in EULER))


def write(file: IO[bytes], trace: Trace) -> None:
    """Write one feature; raises InputError for a single row, which is no line."""
    if len(trace) < 2:
        raise InputError(f"{trace.source}: {len(trace)} row; expected at least two, which make a line")
    coordinates = [_rounded(trace["longitude_deg"], 9), _rounded(trace["latitude_deg"], 9)]
    if (height := trace.above_ellipsoid) is not None:
        coordinates.append(_rounded(height, 4))
    properties: dict[str, Any] = {
        "program": f"polyins {__version__}",
        "method": trace.method,
        "heights": trace.heights,
        "time_s": _rounded(trace["time_s"], 6),
        "status": [STATUSES[index] for index in trace.status],
        **{name: _rounded(trace[name], 4) for name in FIGURES},
    }
    if trace.utc_of_zero is not None:
        properties["coordTimes"] = trace.dates
    feature = {
        "type": "Feature",
        "geometry": {"type": "LineString", "coordinates": np.column_stack(coordinates)},
        "properties": properties,
    }
    file.write(json.dumps(plain(feature), allow_nan=False).encode() + b"\n")


def _rounded(values: Array, digits: int) -> Array:
    return np.round(values, digits)
