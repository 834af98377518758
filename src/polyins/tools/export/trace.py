"""What is exported: rows of a solution by the names of `solution.parquet`, its clock and its datum of heights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.formats.arrow_arrays import to_numpy
from polyins.formats.solution_files import SOLUTION, read_table, trajectory_columns
from polyins.model.attitude import product, quaternions
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, Heights
from polyins.model.rig import DEG
from polyins.model.solution import Solution
from polyins.model.status import COASTING, STATUSES, TRACKING

NED_TO_ENU = np.array([[0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0]])
"""the quaternion that takes vectors from north, east, down to east, north, up"""
FLU_TO_FRD = np.array([[0.0, 1.0, 0.0, 0.0]])
POSITION_STD = ("std_north_m", "std_east_m", "std_down_m")
VELOCITY = ("north_velocity_m_s", "east_velocity_m_s", "down_velocity_m_s")
VELOCITY_STD = tuple(f"std_{name}" for name in VELOCITY)
PHI_STD = ("std_phi_north_deg", "std_phi_east_deg", "std_phi_down_deg")
EULER = ("roll_deg", "pitch_deg", "heading_deg")
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Trace:
    """Rows of a solution."""

    source: str
    """what messages call it"""
    method: str
    values: Mapping[str, Array]
    """columns of numbers, shape (T,) each; NaN where there is none"""
    status: NDArray[np.uint8]
    """what each row is worth, an index into `STATUSES`, shape (T,)"""
    geodetic: bool
    heights: Heights
    aided_by_fixes: bool
    findings: tuple[Mapping[str, Any], ...] = ()
    origin: Array | None = None
    """the first position, see `Solution.position`, from which metres count; None: that of the first row"""
    utc_of_zero: float | None = None
    """Unix time at which `time_s` is zero, s"""
    geoid_height: float | None = None
    """of the geoid above the ellipsoid, m"""

    def __len__(self) -> int:
        return len(self.status)

    def __getitem__(self, name: str) -> Array:
        if name not in self.values:
            raise InputError(f"{self.source}: no column {name}; expected those of {SOLUTION}")
        return self.values[name]

    def block(self, *names: str) -> Array:
        """Return columns side by side, shape (T, len(names)); raises InputError if one is missing."""
        return np.column_stack([self[name] for name in names])

    def at(self, rows: NDArray[Any]) -> Trace:
        """Return some of the rows."""
        return replace(
            self,
            values={name: values[rows] for name, values in self.values.items()},
            status=self.status[rows],
            origin=self._origin(),
        )

    @property
    def position(self) -> Array:
        """See `Solution.position`, shape (T, 3)."""
        if self.geodetic:
            return self.block("latitude_deg", "longitude_deg", "height_m") * [DEG, DEG, 1.0]
        return self.block("north_m", "east_m", "height_m")

    def _origin(self) -> Array:
        return self.position[0] if self.origin is None else self.origin

    @property
    def east_north_up(self) -> Array:
        """Metres east, north and up from the origin, shape (T, 3)."""
        if not self.geodetic:
            return self.block("east_m", "north_m", "down_m") * [1.0, 1.0, -1.0]
        return displacement(self.position, self._origin(), True)[:, [1, 0, 2]] * [1.0, 1.0, -1.0]

    @property
    def attitude(self) -> Array:
        """Quaternions, scalar first, from forward, left, up of the body to east, north, up, shape (T, 4)."""
        q_nb = quaternions(self.block(*EULER) * DEG)
        count = (len(q_nb), 1)
        return product(product(np.tile(NED_TO_ENU, count), q_nb), np.tile(FLU_TO_FRD, count))

    @property
    def above_sea(self) -> Array | None:
        """Heights above the sea, m, shape (T,); None: not known."""
        if self.heights == "ellipsoidal":
            return None if self.geoid_height is None else self["height_m"] - self.geoid_height
        return self["height_m"] if self.heights == "sea-level" else None

    @property
    def above_ellipsoid(self) -> Array | None:
        """Heights above the ellipsoid, m, shape (T,); None: not known."""
        if self.heights == "sea-level":
            return None if self.geoid_height is None else self["height_m"] + self.geoid_height
        return self["height_m"] if self.heights == "ellipsoidal" else None

    @property
    def nanoseconds(self) -> NDArray[np.int64]:
        """Unix time, ns, shape (T,), or the recording's own stamps where UTC is not known."""
        own = sum(_nanoseconds(part) for part in (self["time_s"], np.array(self.utc_of_zero or 0.0)))
        return np.asarray(own, dtype=np.int64)

    @property
    def dates(self) -> list[str]:
        """UTC as ISO 8601 has it, to the microsecond."""
        rounded = np.rint(self.nanoseconds / 1000.0).astype("datetime64[us]")
        return [f"{date}Z" for date in np.datetime_as_string(rounded)]

    @property
    def dead_reckoning(self) -> NDArray[np.bool_]:
        """Which rows no fix supports, shape (T,)."""
        return (self.status == COASTING) if self.aided_by_fixes else np.ones(len(self), dtype=bool)


def _nanoseconds(seconds: Array) -> NDArray[np.int64]:
    """Return seconds as whole nanoseconds; seconds since 1970 times 1e9 would be rounded to 256 ns."""
    whole = np.floor(seconds)
    return whole.astype(np.int64) * NANOSECONDS + np.rint((seconds - whole) * NANOSECONDS).astype(np.int64)


def trace_of(solution: Solution) -> Trace:
    """Return the rows of a solution in memory."""
    columns = trajectory_columns(solution.trajectory, solution.position[0], solution.geodetic)
    return Trace(
        solution.method,
        solution.method,
        {name: values for name, values in columns.items() if values is not None},
        np.full(len(solution.time), TRACKING, dtype=np.uint8) if solution.status is None else solution.status,
        solution.geodetic,
        solution.heights,
        "GNSS position" in solution.measurements,
        tuple(finding.document() for finding in solution.findings),
        solution.position[0],
        solution.utc_of_zero,
    )


def read_trace(path: Path, method: str | None = None) -> Trace:
    """Read the rows of a solution from a run's folder or its `solution.parquet`.

    `method`: which of several methods below the folder, as `enav-fusion` or `single/imu1`. Raises InputError if it is
    not told apart, there is none, or columns are missing.
    """
    file = _file(path, method)
    table, metadata = read_table(file)
    words = table.column("status").to_pylist() if "status" in table.column_names else []
    numbers = {name: to_numpy(table.column(name)) for name in table.column_names if name != "status"}
    local = "latitude_deg" not in numbers or bool(np.isnan(numbers["latitude_deg"]).all())
    origin = metadata.get("origin")
    trace = Trace(
        str(file),
        metadata.get("method", file.stem),
        {name: values for name, values in numbers.items() if not (local and name in ("latitude_deg", "longitude_deg"))},
        np.array([STATUSES.index(word) for word in words] or [TRACKING] * table.num_rows, dtype=np.uint8),
        not local,
        metadata.get("heights", "unknown"),
        "GNSS position" in metadata.get("measurements", ["GNSS position"]),
        tuple(metadata.get("findings", ())),
        None if origin is None else np.array(origin),
        metadata.get("utc_of_zero_s"),
    )
    if not len(trace):
        raise InputError(f"{file}: holds no row; expected a solution")
    return trace


def _file(path: Path, method: str | None) -> Path:
    """Return the file of a method; raises InputError if it is not there, or there are several and none is named."""
    if not path.is_dir():
        if method is not None:
            raise InputError(f"--method {method}: {path} holds one solution; expected the folder of a comparison")
        return path
    found = {file.parent.relative_to(path).as_posix(): file for file in sorted(path.rglob(SOLUTION))}
    if method is not None:
        if method not in found:
            raise InputError(f"--method {method}: is not in {path}; expected one of {', '.join(found) or 'none'}")
        return found[method]
    if "." in found:
        return found["."]
    if len(found) == 1:
        return next(iter(found.values()))
    if not found:
        raise InputError(f"{path}: holds no {SOLUTION}; expected the folder of a run")
    raise InputError(f"{path}: holds {', '.join(found)}; expected --method with one of them")
