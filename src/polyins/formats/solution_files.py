"""Solutions in Parquet files: the trajectory and the IMU errors, written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import whole
from polyins.formats.arrow_arrays import texts_to_arrow, to_arrow, to_numpy
from polyins.formats.documents import plain
from polyins.model.attitude import euler_angles, euler_variance, quaternions
from polyins.model.findings import Finding, notes
from polyins.model.geodesy import displacement
from polyins.model.recording import usual_interval
from polyins.model.solution import Solution, Trajectory
from polyins.model.status import STATUSES
from polyins.version import __version__

if TYPE_CHECKING:
    import pyarrow as pa

Array = NDArray[np.float64]

SOLUTION = "solution.parquet"
IMU_ERRORS = "imu_errors.parquet"
METADATA = b"polyins"
DOUBLES = ("time_s", "latitude_deg", "longitude_deg", "height_m")
"""what single precision would round to more than its std; all else is written in it"""
IMU_ERROR_COLUMNS = (
    *(f"gyro_bias_{axis}_rad_s" for axis in "xyz"),
    *(f"accel_bias_{axis}_m_s2" for axis in "xyz"),
    *(f"gyro_scale_{axis}" for axis in "xyz"),
    *(f"accel_scale_{axis}" for axis in "xyz"),
)
_AXES = ("north", "east", "down")
_LOCAL = tuple(f"{axis}_m" for axis in _AXES)
_VELOCITY = tuple(f"{axis}_velocity_m_s" for axis in _AXES)
_EULER = ("roll_deg", "pitch_deg", "heading_deg")
_POSITION_STD = tuple(f"std_{name}" for name in _LOCAL)
_VELOCITY_STD = tuple(f"std_{name}" for name in _VELOCITY)
_PHI_STD = tuple(f"std_phi_{axis}_deg" for axis in _AXES)


def write_solution(solution: Solution, folder: Path, rate_hz: float | None = None) -> None:
    """Write `solution.parquet` and `imu_errors.parquet` into `folder`, which is made if there is none.

    `rate_hz`: how many rows a second are written of the trajectory; None: every epoch.
    """
    with SolutionWriter(folder, rate_hz) as writer:
        writer.add(solution)
        writer.finish(solution)


class SolutionWriter:
    """The two files of a solution, written part by part; they take their names when the block ends without an error."""

    def __init__(self, folder: Path, rate_hz: float | None = None) -> None:
        """`rate_hz`: how many rows a second are written of the trajectory; None: every epoch."""
        folder.mkdir(parents=True, exist_ok=True)
        self._rate = rate_hz
        self._period = -1.0
        """the last of which a row is written, counted from the first epoch"""
        self._begin = np.nan
        self._stack = ExitStack()
        self._files = [_Table(self._stack, folder / SOLUTION), _Table(self._stack, folder / IMU_ERRORS)]
        self._origin: Array | None = None

    def __enter__(self) -> SolutionWriter:
        return self

    def __exit__(self, *raised: Any) -> None:
        self._stack.__exit__(*raised)

    def add(self, part: Solution) -> None:
        """Write the epochs of a part, which follows the one before."""
        if self._origin is None:
            self._origin, self._begin = part.position[0], part.time[0]
        trajectory, errors = self._files
        rows = self._rows(part.time)
        shown = part if rows is None else part.at(rows, np.arange(0))
        columns: dict[str, Any] = trajectory_columns(shown.trajectory, self._origin, part.geodetic)
        if shown.status is not None:
            columns["status"] = status_to_arrow(shown.status)
        trajectory.add(columns)
        errors.add(_imu_error_columns(part))

    def _rows(self, time: Array) -> NDArray[np.intp] | None:
        """Return the first epoch in each period of 1 / rate; None: all."""
        if self._rate is None:
            return None
        slack = 0.1 * usual_interval(time) if len(time) > 1 else 0.0
        period = np.floor((time - self._begin + slack) * self._rate)
        rows = np.flatnonzero(np.diff(period, prepend=self._period) > 0.0)
        self._period = float(period[-1])
        return rows

    def finish(self, solution: Solution) -> None:
        """Write what is known of the whole solution: of it only what has no row per epoch is looked at."""
        assert self._origin is not None
        trajectory, errors = self._files
        trajectory.finish(_metadata(solution, self._origin))
        errors.finish({"polyins": __version__})


def read_solution(path: Path) -> Solution:
    """Read a solution from its folder or its `solution.parquet`, with the IMU errors if their file lies beside.

    The covariance of the attitude error is known by its diagonal only, and there are no innovations. A file of another
    program serves if it has the columns; its point is then taken for the array origin, with a warning.

    Raises InputError if there is no such file or it lacks a column.
    """
    file = path / SOLUTION if path.is_dir() else path
    columns, metadata = read_table(file)
    time = _column(columns, "time_s", file)
    geodetic = not np.all(np.isnan(_column(columns, "latitude_deg", file)))
    names, error_time, errors = _read_imu_errors(file.with_name(IMU_ERRORS), tuple(metadata.get("imu_names", ())))
    findings = tuple(Finding(**one) for one in metadata.get("findings", ()))
    if "point" not in metadata:
        findings += notes([f"{file}: does not say which point it describes; the array origin is assumed"], "point")
    phi_variance = np.radians(_table(columns, _PHI_STD, file)) ** 2
    return Solution(
        method=metadata.get("method", file.stem),
        geodetic=geodetic,
        time=time,
        position=_position(columns, geodetic, metadata, file),
        velocity=_table(columns, _VELOCITY, file),
        attitude=quaternions(np.radians(_table(columns, _EULER, file))),
        position_variance=_table(columns, _POSITION_STD, file) ** 2,
        velocity_variance=_table(columns, _VELOCITY_STD, file) ** 2,
        phi_covariance=np.insert(phi_variance, [1, 1, 2], 0.0, axis=1),
        point=np.array(metadata.get("point", [0.0, 0.0, 0.0])),
        imus=metadata.get("imus", len(names)),
        imu_names=names,
        imu_error_time=error_time,
        imu_errors=errors,
        imu_error_std=np.full_like(errors, np.nan),
        start=metadata.get("start", {}),
        filter_s=metadata.get("filter_s", 0.0),
        first_call_s=metadata.get("first_call_s", 0.0),
        status=_statuses(columns),
        recording_span=None if metadata.get("recording_span") is None else tuple(metadata["recording_span"]),
        findings=findings,
        heights=metadata.get("heights", "unknown"),
        utc_of_zero=metadata.get("utc_of_zero_s"),
    )


def read_table(path: Path) -> tuple[pa.Table, dict[str, Any]]:
    """Return the columns of a Parquet file and what polyins says of it; raises InputError if there is none."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.is_file():
        raise InputError(f"{path}: no such file; expected a Parquet file or a folder with {SOLUTION}")
    try:
        table, metadata = pq.read_table(path), pq.read_metadata(path).metadata
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"{path}: not readable as Parquet ({error})") from None
    return table, json.loads((metadata or {}).get(METADATA, b"{}"))


def trajectory_columns(of: Trajectory, origin: Array, geodetic: bool) -> dict[str, Array | None]:
    """Return the columns of `solution.parquet`; None: not known on a local plane. `origin`: metres count from there."""
    euler = euler_angles(of.attitude)
    euler_std = np.degrees(np.sqrt(euler_variance(euler, of.phi_covariance)))
    degrees = np.degrees(euler)
    degrees[:, 2] %= 360.0
    latitude, longitude = np.degrees(of.position[:, :2]).T if geodetic else (None, None)
    return {
        "time_s": of.time,
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "height_m": of.position[:, 2],
        **_named(_VELOCITY, of.velocity),
        **_named(_EULER, degrees),
        **_named(_POSITION_STD, np.sqrt(of.position_variance)),
        **_named(_VELOCITY_STD, np.sqrt(of.velocity_variance)),
        **_named(tuple(f"std_{name}" for name in _EULER), euler_std),
        **_named(_PHI_STD, np.degrees(np.sqrt(of.phi_covariance[:, [0, 3, 5]]))),
        **_named(_LOCAL, displacement(of.position, origin, geodetic)),
    }


def arrow_columns(columns: Mapping[str, Any]) -> dict[str, pa.Array]:
    """Return columns as they are written: in single precision but for what that would round too much."""
    rows = len(columns["time_s"])
    return {name: _arrow(name, values, rows) for name, values in columns.items()}


def status_to_arrow(status: NDArray[np.uint8]) -> pa.Array:
    """Return what states are worth as words."""
    import pyarrow as pa

    return pa.DictionaryArray.from_arrays(to_arrow(status.astype(np.int32)), texts_to_arrow(STATUSES))


def _named(names: tuple[str, ...], values: Array) -> dict[str, Array]:
    return dict(zip(names, values.T, strict=True))


def _imu_error_columns(solution: Solution) -> dict[str, Any]:
    import pyarrow as pa

    epochs, imus, _ = solution.imu_errors.shape
    index = to_arrow(np.tile(np.arange(imus, dtype=np.int32), epochs))
    return {
        "time_s": np.repeat(solution.imu_error_time, imus),
        "imu": pa.DictionaryArray.from_arrays(index, texts_to_arrow(solution.imu_names)),
        **_named(IMU_ERROR_COLUMNS, solution.imu_errors.reshape(-1, 12)),
    }


def _metadata(solution: Solution, origin: Array) -> dict[str, object]:
    return {
        "polyins": __version__,
        "method": solution.method,
        "point": solution.point,
        "origin": origin,
        "imus": solution.imus,
        "imu_names": solution.imu_names,
        "start": solution.start,
        "filter_s": solution.filter_s,
        "first_call_s": solution.first_call_s,
        "recording_span": solution.recording_span,
        "findings": [finding.document() for finding in solution.findings],
        "measurements": list(solution.measurements),
        "heights": solution.heights,
        "utc_of_zero_s": solution.utc_of_zero,
    }


class _Table:
    """A Parquet file that grows by row groups."""

    def __init__(self, stack: ExitStack, path: Path) -> None:
        self._stack = stack
        self._beside = stack.enter_context(whole(path))
        self._writer: Any = None

    def add(self, columns: Mapping[str, Any]) -> None:
        import pyarrow as pa

        table = pa.table(arrow_columns(columns))
        if self._writer is None:
            self._writer = self._stack.enter_context(_parquet_writer(self._beside, table.schema))
        self._writer.write_table(table)

    def finish(self, metadata: Mapping[str, object]) -> None:
        self._writer.add_key_value_metadata({METADATA: json.dumps(plain(metadata))})


def _parquet_writer(path: Path, schema: pa.Schema) -> Any:
    import pyarrow.parquet as pq

    # Numbers that never repeat gain nothing from a dictionary, but from keeping their like bytes together.
    words = [name for name in schema.names if name in ("imu", "status")]
    numbers = [name for name in schema.names if name not in words]
    return pq.ParquetWriter(
        path,
        schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=words,
        use_byte_stream_split=numbers,
    )


def _arrow(name: str, values: Any, rows: int) -> pa.Array:
    import pyarrow as pa

    if values is None:
        return pa.nulls(rows, pa.float64())
    if isinstance(values, pa.Array):
        return values
    return to_arrow(values if name in DOUBLES else np.asarray(values, dtype=np.float32))


def _column(table: pa.Table, name: str, path: Path) -> Array:
    if name not in table.column_names:
        raise InputError(f"{path}: no column {name}; expected the columns of polyins's {path.name}")
    return to_numpy(table.column(name))


def _table(table: pa.Table, names: tuple[str, ...], path: Path) -> Array:
    return np.column_stack([_column(table, name, path) for name in names])


def _position(table: pa.Table, geodetic: bool, metadata: Mapping[str, Any], path: Path) -> Array:
    height = _column(table, "height_m", path)
    if geodetic:
        degrees = _table(table, ("latitude_deg", "longitude_deg"), path)
        return np.column_stack([np.radians(degrees), height])
    origin = np.array(metadata.get("origin", [0.0, 0.0, 0.0]))
    return np.column_stack([_table(table, _LOCAL[:2], path) + origin[:2], height])


def _statuses(table: pa.Table) -> NDArray[np.uint8] | None:
    if "status" not in table.column_names:
        return None
    return np.array([STATUSES.index(word) for word in table.column("status").to_pylist()], dtype=np.uint8)


def _read_imu_errors(path: Path, names: tuple[str, ...]) -> tuple[tuple[str, ...], Array, Array]:
    if not path.is_file():
        return names, np.zeros(0), np.zeros((0, len(names), 12))
    table, _ = read_table(path)
    time = _column(table, "time_s", path)
    present = tuple(dict.fromkeys(table.column("imu").to_pylist()))
    if not present or time.size % len(present):
        raise InputError(f"{path}: {time.size} rows of {len(present)} IMUs; expected one row of each IMU per time")
    errors = _table(table, IMU_ERROR_COLUMNS, path).reshape(-1, len(present), 12)
    return present, time[:: len(present)], errors
