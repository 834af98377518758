"""Solution files of RTKLIB (`.pos`): latitude, longitude, height by date in GPST, with velocities.

What RTKLIB's quality says of ambiguities a fused solution does not know: 2 (float) stands for `tracking`, 5 (single)
for all else. Covariances between axes are not in a solution's files and are zero.
"""

from __future__ import annotations

from typing import IO

import numpy as np

from polyins.errors import InputError
from polyins.model.gps_time import leap_seconds
from polyins.model.status import TRACKING
from polyins.tools.export.trace import POSITION_STD, VELOCITY, VELOCITY_STD, Trace
from polyins.version import __version__

FLOAT, SINGLE = 2, 5
QUALITIES = "Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites"
COLUMNS = (
    "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)"
    "  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio    vn(m/s)    ve(m/s)    vu(m/s)      sdvn     sdve     sdvu"
    "    sdvne    sdveu    sdvun"
)
ROW = (
    "%s %14.9f %14.9f %10.4f %3d %3d %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f %6.2f %6.1f"
    " %10.5f %10.5f %10.5f %9.5f %8.5f %8.5f %8.5f %8.5f %8.5f\n"
)


def write(file: IO[bytes], trace: Trace) -> None:
    """Write a row for each; raises InputError where nothing tells what heights count from."""
    height, datum = trace.above_ellipsoid, "ellipsoidal"
    if height is None:
        height, datum = trace.above_sea, "geodetic"
    if height is None:
        raise InputError(f"{trace.source}: what heights count from is not known, and .pos has to say it")
    head = f"% program   : polyins {__version__} {trace.method}\n% Q: 2 tracking, 5 else; ns, age and ratio: none\n%\n"
    file.write(f"{head}% (lat/lon/height=WGS84/{datum},{QUALITIES})\n{COLUMNS}\n".encode())
    quality = np.where(trace.status == TRACKING, FLOAT, SINGLE)
    place = np.column_stack([trace.block("latitude_deg", "longitude_deg"), height]).tolist()
    velocity = (trace.block(*VELOCITY) * [1.0, 1.0, -1.0]).tolist()
    std, velocity_std = trace.block(*POSITION_STD).tolist(), trace.block(*VELOCITY_STD).tolist()
    zeros = (0.0, 0.0, 0.0)
    for row, date in enumerate(_dates(trace)):
        figures = (*place[row], quality[row], 0, *std[row], *zeros, 0.0, 0.0)
        file.write((ROW % (date, *figures, *velocity[row], *velocity_std[row], *zeros)).encode())


def _dates(trace: Trace) -> list[str]:
    """Return dates and times of day in GPST, to the microsecond."""
    ahead = leap_seconds(np.asarray(trace.nanoseconds * 1e-9, dtype=float)).astype(np.int64) * 1_000_000
    gps = (np.rint(trace.nanoseconds / 1000.0).astype(np.int64) + ahead).astype("datetime64[us]")
    return [date.replace("-", "/").replace("T", " ") for date in np.datetime_as_string(gps)]
