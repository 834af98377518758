"""Solution files of RTKLIB (`.pos`): latitude, longitude, height with quality and standard deviations.

Times come out as GPS seconds of the week of the first row, running on over the week's end.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_text
from polyins.formats.rows import RowSource, Track
from polyins.model.recording import Array
from polyins.model.rig import DEG

WEEK_S = 604800.0
GPS_EPOCH = np.datetime64("1980-01-06T00:00:00", "s")
QUALITIES = {1: "fix", 2: "float", 3: "sbas", 4: "dgps", 5: "single", 6: "ppp"}
ORDER = ("latitude", "longitude", "height", "q", "ns", "sdn", "sde", "sdu", "sdne", "sdeu", "sdun", "age", "ratio",
         "vn", "ve", "vu", "sdvn", "sdve", "sdvu")  # fmt: skip
LEAP_DAYS = np.array(
    ["1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01", "1988-01-01", "1990-01-01", "1991-01-01", "1992-07-01",
     "1993-07-01", "1994-07-01", "1996-01-01", "1997-07-01", "1999-01-01", "2006-01-01", "2009-01-01", "2012-07-01",
     "2015-07-01", "2017-01-01"],
    dtype="datetime64[s]",
)  # fmt: skip
"""From each of these days on GPS time is one second more ahead of UTC (IERS Bulletin C)."""


def read_gnss(path: str | Path) -> Track:
    """Read positions in degrees; the counts per quality are in `quality`.

    Raises InputError for positions in another form (degrees and minutes, ECEF, baselines) and for lines that are not
    rows of numbers.
    """
    found, lines = find(path), read_text(path).splitlines()
    header = " ".join(line for line in lines if line.startswith("%"))
    _refuse_other_forms(found, header)
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("%")]
    if not numbered:
        raise InputError(f"{found}: has a header and no rows; expected positions")
    dated = "/" in numbered[0][1]
    rows = _rows(found, numbered)
    utc = re.search(r"%\s+UTC\s+lat", header) is not None
    time = _seconds_from_date(rows[:, :6], utc) if dated else _seconds_from_week(rows[:, :2])
    values = rows[:, 6 if dated else 2 :]
    names = _names(lines, values.shape[1])

    def three(*wanted: str) -> Array | None:
        return values[:, [names.index(name) for name in wanted]] if set(wanted) <= set(names) else None

    velocity = three("vn", "ve", "vu")
    quality = Counter(int(q) for q in values[:, names.index("q")])
    counts = {QUALITIES.get(q, f"Q{q}"): count for q, count in sorted(quality.items())}
    return Track(
        RowSource(str(found), numbered[0][0]),
        time,
        values[:, :3] * [DEG, DEG, 1.0],
        above_sea="/geodetic" in header,
        position_std=three("sdn", "sde", "sdu"),
        velocity=None if velocity is None else velocity * [1.0, 1.0, -1.0],
        velocity_std=three("sdvn", "sdve", "sdvu"),
        quality=counts,
        warnings=() if set(quality) <= {1} else (f"{found}: {_listed(counts)}",),
    )


def _refuse_other_forms(path: Path, header: str) -> None:
    for mark, form in (("ecef", "ECEF coordinates"), ("baseline", "baselines"), ("(d'", "degrees and minutes")):
        if mark in header:
            raise InputError(f"{path}: positions are {form}; expected latitude, longitude (deg) and height (m)")


def _rows(path: Path, numbered: list[tuple[int, str]]) -> Array:
    rows = []
    for number, line in numbered:
        try:
            rows.append([float(text) for text in re.sub(r"[/:,]", " ", line).split()])
        except ValueError as error:
            raise InputError(f"{path}, line {number}: {error}; expected a row of numbers") from error
        if not np.isfinite(rows[-1]).all():
            raise InputError(f"{path}, line {number}: a value is not finite; expected a row of numbers")
        if len(rows[-1]) != len(rows[0]):
            raise InputError(f"{path}, line {number}: {len(rows[-1])} values; expected {len(rows[0])} as before")
    if len(rows[0]) < 10:
        raise InputError(f"{path}, line {numbered[0][0]}: {len(rows[0])} values; expected time, position, Q, ns, std")
    return np.array(rows)


def _names(lines: list[str], count: int) -> list[str]:
    """Return the names of the columns after the time, from the header or in the usual order."""
    for line in lines:
        if line.startswith("%") and "sdn" in line:
            names = [re.sub(r"\(.*", "", name).lower() for name in line[line.index("latitude") :].split()]
            return names[:count]
    return list(ORDER[:count])


def _seconds_from_week(rows: Array) -> Array:
    return np.asarray(rows[:, 1] + (rows[:, 0] - rows[0, 0]) * WEEK_S)


def _seconds_from_date(rows: Array, utc: bool) -> Array:
    year, month, day = rows[:, :3].astype(int).T
    days = (year - 1970).astype("datetime64[Y]").astype("datetime64[M]") + (month - 1)
    midnight = (days.astype("datetime64[D]") + (day - 1)).astype("datetime64[s]")
    since = (midnight - GPS_EPOCH).astype(float) + rows[:, 3:] @ [3600.0, 60.0, 1.0]
    if utc:
        since = since + np.searchsorted(LEAP_DAYS, midnight, side="right")
    return np.asarray(since - np.floor(since[0] / WEEK_S) * WEEK_S)


def _listed(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items()) + " positions"
