"""Which format a file has, told by its content."""

from __future__ import annotations

from pathlib import Path

from polyins.errors import InputError
from polyins.files import find, read_head
from polyins.formats import kf_gins
from polyins.formats.columns import PARQUET_MAGIC

HEAD_BYTES = 16384


def data_format(path: str | Path) -> str:
    """Return xsens-dot, kf-gins (IMU), kf-gins-gnss, kf-gins-nav, rtklib-pos, table or configuration.

    Raises InputError if it is none of them.
    """
    content = read_head(path, HEAD_BYTES)
    if content[:4] == PARQUET_MAGIC:
        return "table"
    if not kf_gins.is_text(content):
        return "kf-gins"
    lines = content.decode("utf-8-sig", errors="replace").splitlines()
    rows = [line for line in lines if line.strip() and not line.startswith(("%", "#", "sep="))]
    if any("Acc_X" in line and "Gyr_X" in line for line in lines):
        return "xsens-dot"
    if lines[0].startswith("%") and any("latitude" in line for line in lines):
        return "rtklib-pos"
    if any(": " in line or line.endswith(":") for line in rows[:20]):
        return "configuration"
    return _rows_of_numbers(rows) or _table(path, rows)


def imu_format(path: str | Path) -> str:
    """Return the format of a file of IMU data as the configuration names it."""
    return _one_of(path, {"xsens-dot": "xsens-dot", "kf-gins": "kf-gins", "table": "table"}, "IMU data")


def track_format(path: str | Path) -> str:
    """Return the format of a file of positions as the configuration names it."""
    names = {"kf-gins-gnss": "kf-gins", "kf-gins-nav": "kf-gins-nav", "rtklib-pos": "rtklib-pos", "table": "table"}
    return _one_of(path, names, "positions")


def _one_of(path: str | Path, names: dict[str, str], what: str) -> str:
    found = data_format(path)
    if found not in names:
        raise InputError(f"{find(path)}: looks like {found}; expected {what} ({', '.join(names.values())})")
    return names[found]


def _rows_of_numbers(rows: list[str]) -> str | None:
    """Tell the files without header apart by the number of columns and the size of the values."""
    try:
        values = [[float(text) for text in line.replace(",", " ").split()] for line in rows[:2]]
    except ValueError:
        return None
    count = len(values[0]) if values else 0
    if count == 7:
        # A latitude and longitude in degrees, or increments of an IMU: only the former exceed a radian or so.
        return "kf-gins-gnss" if max(abs(value) for value in values[0][1:3]) > 2.0 else "kf-gins"
    return {13: "kf-gins-gnss", 11: "kf-gins-nav"}.get(count)


def _table(path: str | Path, rows: list[str]) -> str:
    fields = rows[0].replace(";", ",").replace("\t", ",").split(",") if rows else []
    if len(fields) < 3:
        raise InputError(f"{find(path)}: is of no known format; expected IMU data, positions or a configuration")
    return "table"
