"""What every reader returns: rows in the sensor's own axes and on its own clock."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.model.recording import USUAL_OF, Array
from polyins.prepare.timesync import GAP


@dataclass(frozen=True)
class RowSource:
    """Where rows came from, so that a message can name the line."""

    path: str
    first_line: int | None = None
    """line of the first row, counted from 1; None: the file has no lines"""
    lines: NDArray[np.intp] | None = field(default=None, compare=False, repr=False)
    """line of each row, where they do not follow each other"""
    warnings: tuple[str, ...] = ()
    """what of the file is no row"""

    def place(self, row: int) -> str:
        """Name a row (counted from 0) as a user finds it: by line in a text file, else by row."""
        if self.first_line is None:
            return f"{self.path}, row {row + 1}"
        return f"{self.path}, line {self.line(row)}"

    def line(self, row: int) -> int:
        """Return the line of a row (counted from 0) of a file that has lines."""
        return (self.first_line or 1) + row if self.lines is None else int(self.lines[row])

    def warned(self, text: str) -> RowSource:
        """Return the source with one more warning."""
        return replace(self, warnings=(*self.warnings, f"{self.path}: {text}"))

    def at(self, rows: NDArray[np.intp]) -> RowSource:
        """Return the source of just those rows."""
        if self.first_line is None:
            return self
        lines = rows + self.first_line if self.lines is None else self.lines[rows]
        return replace(self, lines=lines)


@dataclass(frozen=True)
class ImuRows:
    """Increments over the interval that ends at the stamp, in sensor axes."""

    source: RowSource
    time: Array
    """s, shape (T,)"""
    dtheta: Array
    """rad, shape (T, 3)"""
    dvel: Array
    """m/s, shape (T, 3)"""
    gyro_unit: str = "rad"
    """the unit in the file: rad or deg are increments, rad/s or deg/s rates"""
    accel_unit: str = "m/s"
    """m/s is increments, m/s^2 or g rates"""
    units_known: bool = False
    """they are constants of the format, so that no size of the values speaks against them"""
    gyro_range_deg_s: float | None = None
    """full scale, where the format is that of one sensor"""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Track:
    """Positions, and what else a receiver or a reference system gives."""

    source: RowSource
    time: Array
    """s, shape (M,)"""
    position: Array
    """(latitude rad, longitude rad, height m) or (north m, east m, height m), shape (M, 3)"""
    geodetic: bool = True
    above_sea: bool = False
    """heights are above the sea (geoid), not above the ellipsoid"""
    datum_known: bool = True
    """whether the format says which of the two"""
    position_std: Array | None = None
    """m north, east, down, shape (M, 3)"""
    velocity: Array | None = None
    """m/s north, east, down, shape (M, 3)"""
    velocity_std: Array | None = None
    """m/s, shape (M, 3)"""
    attitude: Array | None = None
    """roll, pitch, heading, rad, shape (M, 3)"""
    angle_unit: str = "deg"
    """the unit of latitude and longitude in the file"""
    quality: dict[str, int] = field(default_factory=dict)
    """how many fixes of each kind the receiver reports"""
    warnings: tuple[str, ...] = ()

    def at_rows(self, rows: NDArray[np.intp]) -> Track:
        """Return the track with just those rows; messages then name rows, not lines."""
        blocks = ("position_std", "velocity", "velocity_std", "attitude")
        given = {name: block[rows] for name in blocks if (block := getattr(self, name)) is not None}
        source = RowSource(self.source.path)
        return replace(self, source=source, time=self.time[rows], position=self.position[rows], **given)


@dataclass(frozen=True)
class SensorRows:
    """What a sensor beside IMUs and GNSS says."""

    source: RowSource
    kind: str
    """height, heading or odometer; speed: over ground, whichever way; ticks: of a wheel"""
    time: Array
    """s, shape (M,)"""
    value: Array
    """height, m; heading, rad, clockwise from true north; (forward) speed, m/s; ticks counted; shape (M,)"""
    std: Array | None = None
    """of the value, shape (M,)"""


LONGEST_BRIDGE = 3
"""Rows in a row that can be left out while the one after them stands for their time as well."""


def without(rows: ImuRows, bad: NDArray[np.bool_]) -> ImuRows:
    """Leave out the rows in `bad`, shape (T,).

    After a hole of up to 3 rows the next row's rates are taken for the whole time since the row before the hole, or as
    often as there are rows where the stamp before it is wrong; longer holes are gaps.
    """
    kept = np.flatnonzero(~bad)
    holes = np.diff(kept, prepend=kept[:1] - 1) - 1
    bridged = (holes > 0) & (holes <= LONGEST_BRIDGE) & (np.arange(len(kept)) > 0)
    own, time = intervals(rows.time)[kept], rows.time[kept]
    with np.errstate(invalid="ignore", over="ignore"):
        known = np.diff(rows.time, prepend=np.nan)[kept] == own
    times = np.where(known, np.diff(time, prepend=time[:1]) / own, holes + 1.0)
    factor = np.where(bridged, times, 1.0)[:, None]
    return replace(rows, time=time, dtheta=rows.dtheta[kept] * factor, dvel=rows.dvel[kept] * factor)


def intervals(time: Array) -> Array:
    """Return the length of the interval that ends at each stamp, s.

    The first is taken to be the usual one, and so is that after a gap or a stamp that is out of order or no number:
    what a rate was in it is not known.
    """
    if len(time) < 2:
        return np.zeros(len(time))
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff(time)
    steps[~np.isfinite(steps)] = 0.0
    known = steps[:USUAL_OF][steps[:USUAL_OF] > 0.0]
    usual = float(np.median(known)) if len(known) else 0.0
    return np.concatenate([[usual], np.where((steps > 0.0) & (steps <= GAP * usual), steps, usual)])


def rising(time: Array, among: ArrayLike | None = None) -> NDArray[np.intp]:
    """Return the rows whose stamp is above all before it, of those for which `among`, shape (T,), is true."""
    rows = np.arange(len(time)) if among is None else np.flatnonzero(among)
    stamps = time[rows]
    before = np.concatenate([[-np.inf], np.maximum.accumulate(stamps)[:-1]])
    return rows[stamps > before]
