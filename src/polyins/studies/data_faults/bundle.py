"""A recording as files that a fault can be put into: tables of numbers, and the configuration that names them."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.config import Config
from polyins.config.yaml_document import Document, Setting, write_yaml
from polyins.files import write_bytes
from polyins.formats.rows import intervals
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, GnssStream, Reference
from polyins.reading.loading import gather, located

Values = dict[str, Any]
Columns = dict[str, Array]
GYRO, ACCEL = ["gx", "gy", "gz"], ["ax", "ay", "az"]
IMU_COLUMNS: Values = {
    "time": {"name": "t"},
    "gyro": {"names": GYRO, "unit": "rad/s"},
    "accel": {"names": ACCEL, "unit": "m/s^2"},
}
OF_FILES = ("file", "format", "columns", "stream", "rate_hz", "clock_offset_s", "time_offset")
"""keys of an entry that say how its file is read"""
SECTIONS = ("dataset", "gnss", "reference", "outages")
"""of a configuration, that are written anew or left out"""
OF_HEIGHTS = ("height", "geoid_height_m", "plane_origin", "position_lag_s", "position_std_m")


@dataclass(frozen=True)
class Bundle:
    """A recording."""

    name: str
    values: Values
    """the configuration, without the names of files"""
    imus: tuple[Columns, ...]
    """`t`, rates and forces in sensor axes, rad/s and m/s^2"""
    gnss: Columns | None = None
    reference: Columns | None = None

    def write(self, folder: Path) -> Path:
        """Write all files and return the configuration."""
        folder.mkdir(parents=True, exist_ok=True)
        values = deepcopy(self.values)
        for number, (entry, columns) in enumerate(zip(values["imus"], self.imus, strict=True), 1):
            entry["file"] = _written(columns, folder / f"imu{number}.parquet")
        for section, table in (("gnss", self.gnss), ("reference", self.reference)):
            if table is not None:
                values[section]["file"] = _written(table, folder / f"{section}.parquet")
        path = folder / "recording.yaml"
        write_bytes(path, write_yaml(values).encode())
        return path

    def with_imu(self, index: int, **columns: Array) -> Bundle:
        """Return the recording with other columns of one IMU."""
        imus = list(self.imus)
        imus[index] = {**imus[index], **columns}
        return replace(self, imus=tuple(imus))

    def vectors(self, index: int, names: list[str]) -> Array:
        """Return rates or forces of an IMU, (T, 3)."""
        return np.column_stack([self.imus[index][name] for name in names])

    def changed(self, keys: tuple[str | int, ...], value: Any) -> Bundle:
        """Return the recording with another configuration."""
        document = Document(Path("recording.yaml"), deepcopy(self.values))
        return replace(self, values=document.changed([Setting(keys, value)]).values)

    @property
    def has_wheels(self) -> bool:
        """Whether an IMU turns with a wheel."""
        return any("wheel" in imu for imu in self.values["imus"])


def _written(columns: Mapping[str, Array], path: Path) -> str:
    from pyarrow import parquet, table

    parquet.write_table(table(dict(columns)), path)
    return path.name


def bundle_of(name: str, document: Document, length_s: float, begin_s: float = 0.0) -> Bundle:
    """Return a part of what a configuration describes, `begin_s` after it begins."""
    config = located(document)
    evidence = gather(config, document)
    first = max(float(one.stream.time[0]) for one in evidence.imus) + begin_s
    span = (first, first + length_s)
    values = _values(document.values, evidence.config)
    imus = tuple(_imu(one, span) for one in evidence.imus)
    gnss, reference = evidence.recording.gnss, evidence.recording.reference
    return Bundle(
        name,
        {**values, **_sections(evidence)},
        imus,
        None if gnss is None else _fixes(gnss, evidence.recording.geodetic, span),
        None if reference is None else _track(reference, evidence.recording.geodetic, span),
    )


def _values(values: Values, config: Config) -> Values:
    """Return a configuration whose IMUs are tables on one clock."""
    kept = {key: deepcopy(value) for key, value in values.items() if key not in SECTIONS}
    defaults = kept.pop("imu_defaults", {})
    imus = []
    for entry, read in zip(kept["imus"], config.imus, strict=True):
        both = {key: value for key, value in {**defaults, **entry}.items() if key not in OF_FILES}
        imus.append({**both, "name": read.name, "columns": deepcopy(IMU_COLUMNS)})
    start = {key: value for key, value in (kept.get("start") or {}).items() if key != "end_time_s"}
    return {**kept, "imus": imus, "start": start}


def _imu(one: ImuEvidence, span: tuple[float, float]) -> Columns:
    steps, time = intervals(one.rows.time)[:, None], one.stream.time
    inside = (time >= span[0]) & (time <= span[1])
    values = np.hstack([one.rows.dtheta / steps, one.rows.dvel / steps])[inside]
    return {"t": time[inside], **dict(zip([*GYRO, *ACCEL], np.ascontiguousarray(values.T), strict=True))}


def _sections(evidence: Evidence) -> Values:
    """Return what is said of the tables of positions."""
    config, recording = evidence.config, evidence.recording
    found: Values = {}
    position: Values = {"names": ["lat", "lon", "h"]}
    if not recording.geodetic:
        position = {"names": ["n", "e", "u"], "frame": "north-east-up"}
    time = {"name": "t"}
    datum = {} if recording.heights == "ellipsoidal" or not recording.geodetic else {"height": "as-given"}
    if config.gnss is not None and recording.gnss is not None:
        kept = config.gnss.model_dump(mode="json", exclude_defaults=True)
        columns: Values = {"time": time, "position": position, "std": {"names": ["sn", "se", "sd"]}}
        if recording.gnss.velocity is not None:
            columns |= {"velocity": {"names": ["vn", "ve", "vd"]}, "velocity_std": {"names": ["svn", "sve", "svd"]}}
        found["gnss"] = {**_without_files(kept), **datum, "columns": columns}
    if config.reference is not None and recording.reference is not None:
        kept = config.reference.model_dump(mode="json", exclude_defaults=True)
        columns = {"time": time, "position": position}
        if recording.reference.attitude is not None:
            columns["attitude"] = {"names": ["roll", "pitch", "heading"]}
        if recording.reference.velocity is not None:
            columns["velocity"] = {"names": ["vn", "ve", "vd"]}
        found["reference"] = {**_without_files(kept), **datum, "columns": columns}
    return found


def _without_files(entry: Values) -> Values:
    return {key: value for key, value in entry.items() if key not in (*OF_FILES, *OF_HEIGHTS)}


def _fixes(gnss: GnssStream, geodetic: bool, span: tuple[float, float]) -> Columns:
    inside = (gnss.time >= span[0]) & (gnss.time <= span[1])
    found = {"t": gnss.time[inside], **_places(gnss.position[inside], geodetic)}
    found |= dict(zip(("sn", "se", "sd"), gnss.position_std[inside].T, strict=True))
    if gnss.velocity is not None and gnss.velocity_std is not None:
        found |= dict(zip(("vn", "ve", "vd"), gnss.velocity[inside].T, strict=True))
        found |= dict(zip(("svn", "sve", "svd"), gnss.velocity_std[inside].T, strict=True))
    return _plain(found)


def _track(reference: Reference, geodetic: bool, span: tuple[float, float]) -> Columns:
    inside = (reference.time >= span[0]) & (reference.time <= span[1])
    found = {"t": reference.time[inside], **_places(reference.position[inside], geodetic)}
    if reference.attitude is not None:
        found |= dict(zip(("roll", "pitch", "heading"), np.degrees(reference.attitude[inside]).T, strict=True))
    if reference.velocity is not None:
        found |= dict(zip(("vn", "ve", "vd"), reference.velocity[inside].T, strict=True))
    return _plain(found)


def _places(position: Array, geodetic: bool) -> Columns:
    if geodetic:
        return {"lat": np.degrees(position[:, 0]), "lon": np.degrees(position[:, 1]), "h": position[:, 2]}
    return dict(zip(("n", "e", "u"), position.T, strict=True))


def _plain(columns: Columns) -> Columns:
    return {name: np.ascontiguousarray(values) for name, values in columns.items()}


def moved(bundle: Bundle, metres: Array) -> Bundle:
    """Return the recording with its fixes moved, m north, east, up, (M, 3)."""
    assert bundle.gnss is not None
    table = dict(bundle.gnss)
    if "n" in table:
        for name, off in zip(("n", "e", "u"), metres.T, strict=True):
            table[name] = table[name] + off
        return replace(bundle, gnss=table)
    point = np.array([np.radians(table["lat"][0]), np.radians(table["lon"][0]), table["h"][0]])
    one = displacement(point + np.array([1e-6, 1e-6, 0.0])[None, :], point, True)[0, :2]
    for name, off, scale in zip(("lat", "lon"), metres.T, 1e-6 / one, strict=False):
        table[name] = table[name] + np.degrees(off * scale)
    table["h"] = table["h"] + metres[:, 2]
    return replace(bundle, gnss=table)
