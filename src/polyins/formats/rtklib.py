"""Solution files of RTKLIB (`.pos`): positions with quality and standard deviations.

Latitude and longitude in degrees or in degrees, minutes, seconds, or coordinates in ECEF; stamps in GPST, UTC or JST
(UTC + 9 h), by date or by week and second. Times come out as GPS seconds of the week of the first row, running on over
the week's end.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_head, read_text
from polyins.formats.rows import RowSource, Track
from polyins.model.gps_time import GPS_EPOCH, WEEK_S, leap_seconds, utc_of_week
from polyins.model.recording import Array
from polyins.model.rig import DEG

JST_AHEAD_S = 9 * 3600.0
"""of UTC"""
HEAD_BYTES = 16384
ROW = re.compile(r"\d{4}/\d\d/\d\d \d\d:\d\d:\d\d\.\d+(\s+-?[\d.]+){10}")
FIRST_ROWS = 3
"""of which one at least is whole"""
QUALITIES = {1: "fix", 2: "float", 3: "sbas", 4: "dgps", 5: "single", 6: "ppp"}
ORDER = ("latitude", "longitude", "height", "q", "ns", "sdn", "sde", "sdu", "sdne", "sdeu", "sdun", "age", "ratio",
         "vn", "ve", "vu", "sdvn", "sdve", "sdvu")  # fmt: skip


def read_gnss(path: str | Path) -> Track:
    """Read positions; the counts per quality are in `quality`.

    Without a header stamps are taken for GPST, positions for degrees, and a warning says so. Raises InputError for
    baselines and for lines that are not rows of numbers.
    """
    found, lines = find(path), read_text(path).splitlines()
    header = " ".join(line for line in lines if line.startswith("%"))
    if "baseline" in header:
        raise InputError(f"{found}: positions are baselines; expected latitude, longitude and height, or ECEF")
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("%")]
    if not numbered:
        raise InputError(f"{found}: has a header and no rows; expected positions")
    rows, kept, broken = _rows(found, numbered)
    dated = "/" in numbered[kept[0]][1]
    clock = _clock(header)
    time = _seconds_from_date(rows[:, :6], clock) if dated else _seconds_from_week(rows[:, :2])
    values = rows[:, 6 if dated else 2 :]
    if "(d'" in header:
        angles = [_degrees(values[:, first : first + 3]) for first in (0, 3)]
        values = np.column_stack([*angles, values[:, 6:]])
    names = _names(lines, values.shape[1])
    columns = dict(zip(names, values.T, strict=False))
    if "x-ecef" in columns:
        columns |= _local(columns)

    def three(*wanted: str) -> Array | None:
        return np.column_stack([columns[name] for name in wanted]) if set(wanted) <= set(columns) else None

    position, velocity = three("latitude", "longitude", "height"), three("vn", "ve", "vu")
    assert position is not None
    quality = Counter(int(q) for q in values[:, names.index("q")])
    counts = {QUALITIES.get(q, f"Q{q}"): count for q, count in sorted(quality.items())}
    return Track(
        RowSource(str(found), numbered[0][0], lines=np.array([numbered[row][0] for row in kept])),
        time,
        position * [DEG, DEG, 1.0],
        above_sea="/geodetic" in header,
        position_std=three("sdn", "sde", "sdu"),
        velocity=None if velocity is None else velocity * [1.0, 1.0, -1.0],
        velocity_std=three("sdvn", "sdve", "sdvu"),
        quality=counts,
        warnings=(*broken, *_warnings(found, header, counts)),
    )


def utc_of_zero(path: str | Path) -> float | None:
    """Return Unix time at the begin of the week that the stamps count from, s; None of a file that is not RTKLIB's."""
    lines = read_head(path, HEAD_BYTES).decode("utf-8-sig", errors="replace").splitlines()
    header = " ".join(line for line in lines if line.startswith("%"))
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("%")]
    if not is_solution(lines):
        return None
    try:
        rows, kept, _ = _rows(find(path), numbered)
    except InputError:  # which its reader says
        return None
    if "/" not in numbered[kept[0]][1]:
        week, second = rows[0, 0], rows[0, 1]
    else:
        week, second = divmod(float(_since_epoch(rows[:1, :6], _clock(header))[0]), WEEK_S)
    return float(utc_of_week(np.array([week]), np.array([second]))[0]) - float(second)


def _clock(header: str) -> str:
    """Return GPST, UTC or JST, whichever the header names."""
    return next((name for name in ("UTC", "JST") if re.search(rf"%\s+{name}\s+(lat|x-ecef)", header)), "GPST")


def is_solution(lines: Sequence[str]) -> bool:
    """Whether a text that begins with these lines is a solution: by its header, or dates, times of day and numbers."""
    named = any(re.search(r"latitude\(|-ecef\(|-baseline\(", line) for line in lines)
    if named and lines[0].startswith("%"):
        return True
    rows = [line for line in lines if line.strip() and not line.startswith(("%", "#", "sep="))]
    return any(ROW.match(row) for row in rows[:FIRST_ROWS])


def _warnings(path: Path, header: str, counts: dict[str, int]) -> tuple[str, ...]:
    unsaid = () if header else (f"{path}: has no header; stamps are taken for GPST, which UTC would be 18 s behind",)
    return unsaid if set(counts) <= {QUALITIES[1]} else (*unsaid, f"{path}: {_listed(counts)}")


def _degrees(parts: Array) -> Array:
    """Return angles of degrees, minutes and seconds, shape (M, 3), the sign before the degrees, which may be zero."""
    size = np.abs(parts) @ [1.0, 1.0 / 60.0, 1.0 / 3600.0]
    return np.asarray(np.copysign(size, parts[:, 0]))


def _local(columns: dict[str, Array]) -> dict[str, Array]:
    """Return position (deg, m), std and velocity north, east, up of columns in ECEF."""
    from pymap3d import ecef2geodetic

    latitude, longitude, height = ecef2geodetic(*(columns[f"{axis}-ecef"] for axis in "xyz"))
    found = {"latitude": latitude, "longitude": longitude, "height": height}
    turn = _ecef_to_neu(latitude * DEG, longitude * DEG)
    for prefix in ("sd", "sdv"):
        if f"{prefix}zx" in columns:
            covariance = turn @ _covariances(columns, prefix) @ turn.transpose(0, 2, 1)
            std = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0))
            found |= dict(zip((f"{prefix}{axis}" for axis in "neu"), std.T, strict=True))
    if "vx" in columns:
        velocity = np.einsum("tij,tj->ti", turn, np.column_stack([columns[f"v{axis}"] for axis in "xyz"]))
        found |= dict(zip(("vn", "ve", "vu"), velocity.T, strict=True))
    return found


def _covariances(columns: dict[str, Array], prefix: str) -> Array:
    """Return covariances, shape (M, 3, 3), of std and of the roots of covariances that carry their sign."""
    pairs = (("x", "xy", "zx"), ("xy", "y", "yz"), ("zx", "yz", "z"))
    roots = np.array([[columns[prefix + pair] for pair in row] for row in pairs]).transpose(2, 0, 1)
    return np.asarray(roots * np.abs(roots))


def _ecef_to_neu(latitude: Array, longitude: Array) -> Array:
    """Return matrices to north, east, up at places, rad, shape (M, 3, 3)."""
    sin_lat, cos_lat, sin_lon, cos_lon = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    rows = [
        [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
        [-sin_lon, cos_lon, np.zeros_like(sin_lon)],
        [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _rows(path: Path, numbered: list[tuple[int, str]]) -> tuple[Array, list[int], tuple[str, ...]]:
    """Return the rows, which of the lines they are, and warnings of broken ones; most have to be whole."""
    parsed = [_row(line) for _, line in numbered]
    widths = Counter(len(row) for row in parsed if isinstance(row, list))
    width = widths.most_common(1)[0][0] if widths else 0
    wrong = {
        n: row if isinstance(row, str) else f"{len(row)} values; expected {width} as before"
        for n, row in enumerate(parsed)
        if isinstance(row, str) or len(row) != width
    }
    texts = [f"{path}, line {numbered[n][0]}: {text}" for n, text in wrong.items()]
    if 2 * len(wrong) >= len(parsed):
        raise InputError(texts[0])
    if width < 10:
        raise InputError(f"{path}, line {numbered[0][0]}: {width} values; expected time, position, Q, ns, std")
    kept = [n for n in range(len(parsed)) if n not in wrong]
    more = f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""
    said = (f"{texts[0]}{more}; left out",) if texts else ()
    return np.array([parsed[n] for n in kept], dtype=float), kept, said


def _row(line: str) -> list[float] | str:
    """Return the values of a line, or what is wrong with it."""
    try:
        values = [float(text) for text in re.sub(r"[/:,]", " ", line).split()]
    except ValueError as error:
        return f"{error}; expected a row of numbers"
    return values if np.isfinite(values).all() else "a value is not finite; expected a row of numbers"


def _names(lines: list[str], count: int) -> list[str]:
    """Return the names of the columns after the time, from the header or in the usual order."""
    for line in lines:
        first = (
            re.search("latitude|x-ecef", line) if line.startswith("%") and re.search(r"\bns\b.*\bratio", line) else None
        )
        if first:
            names = [re.sub(r"\(.*", "", name).lower() for name in line[first.start() :].split()]
            return names[:count]
    return list(ORDER[:count])


def _seconds_from_week(rows: Array) -> Array:
    return np.asarray(rows[:, 1] + (rows[:, 0] - rows[0, 0]) * WEEK_S)


def _seconds_from_date(rows: Array, clock: str) -> Array:
    since = _since_epoch(rows, clock)
    return np.asarray(since - np.floor(since[0] / WEEK_S) * WEEK_S)


def _since_epoch(rows: Array, clock: str) -> Array:
    """Return GPS seconds since the begin of GPS time of years, months, days, hours, minutes, seconds."""
    year, month, day = rows[:, :3].astype(int).T
    days = (year - 1970).astype("datetime64[Y]").astype("datetime64[M]") + (month - 1)
    midnight = (days.astype("datetime64[D]") + (day - 1)).astype("datetime64[s]")
    since = (midnight - GPS_EPOCH).astype(float) + rows[:, 3:] @ [3600.0, 60.0, 1.0]
    if clock == "JST":
        since = since - JST_AHEAD_S
    return np.asarray(since if clock == "GPST" else since + leap_seconds(since + GPS_EPOCH.astype(float)))


def _listed(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items()) + " positions"
