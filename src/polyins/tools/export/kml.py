"""KML 2.2: a `gx:Track` with times, heading, and the standard deviations as extended data.

Altitudes of KML are above the sea. Where those of the solution are not known to be, the track lies on the ground, and
the heights stand in the extended data only.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO
from xml.sax.saxutils import escape

import numpy as np

from polyins.tools.export.trace import POSITION_STD, VELOCITY_STD, Trace

HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">\n<Document>\n'
)
FIELDS = ("height_m", "roll_deg", "pitch_deg", *POSITION_STD, *VELOCITY_STD, "std_heading_deg")


def write(file: IO[bytes], trace: Trace) -> None:
    """Write one placemark."""
    file.writelines(line.encode() for line in _lines(trace))


def _lines(trace: Trace) -> Iterator[str]:
    name = escape(trace.method)
    yield f'{HEAD}<name>{name}</name>\n<Schema id="row">\n'
    for field in FIELDS:
        yield f'<gx:SimpleArrayField name="{field}" type="float"><displayName>{field}</displayName>'
        yield "</gx:SimpleArrayField>\n"
    yield f"</Schema>\n<Placemark>\n<name>{name}</name>\n<gx:Track>\n"
    height = trace.above_sea
    yield f"<altitudeMode>{'clampToGround' if height is None else 'absolute'}</altitudeMode>\n"
    yield from (f"<when>{date}</when>\n" for date in trace.dates)
    altitude = np.zeros(len(trace)) if height is None else height
    for longitude, latitude, up in zip(trace["longitude_deg"], trace["latitude_deg"], altitude, strict=True):
        yield f"<gx:coord>{longitude:.9f} {latitude:.9f} {up:.3f}</gx:coord>\n"
    yield from (f"<gx:angles>{heading:.3f} 0 0</gx:angles>\n" for heading in trace["heading_deg"])
    yield '<ExtendedData>\n<SchemaData schemaUrl="#row">\n'
    for field in FIELDS:
        yield f'<gx:SimpleArrayData name="{field}">\n'
        yield from (f"<gx:value>{value:.4f}</gx:value>\n" for value in trace[field])
        yield "</gx:SimpleArrayData>\n"
    yield "</SchemaData>\n</ExtendedData>\n</gx:Track>\n</Placemark>\n</Document>\n</kml>\n"
