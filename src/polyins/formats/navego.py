"""MATLAB files of NaveGo: structs of an IMU (`t`, `fb`, `wb`), a receiver (`t`, `lat`, `lon`, `h`, ...), a reference.

Version 5 is read by SciPy, version 7.3 (HDF5) by h5py. Units are SI, angles radians; axes are forward, right, down, as
NaveGo supposes. What stamps count from and heights are above it does not say.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from polyins.errors import InputError
from polyins.files import find, read_bytes, read_head
from polyins.formats.joined import rates_to_rows
from polyins.formats.library import damage_named, needed
from polyins.formats.log import Log
from polyins.formats.rows import ImuRows, RowSource, Track, rising
from polyins.model.recording import Array

HDF5 = b"MATLAB 7.3"
IMU = ("t", "fb", "wb")
POSITION = ("t", "lat", "lon", "h")
ATTITUDE = ("roll", "pitch", "yaw")

Struct = Mapping[str, Array]


def read(path: str | Path) -> Log:
    """Read the structs; raises InputError for a damaged file, one without any, or for version 7.3 without h5py."""
    found = find(path)
    with damage_named(found, "MATLAB"):
        structs = _hdf5(found) if read_head(found, len(HDF5)) == HDF5 else _version_5(found)
    imus = {name: one for name, one in structs.items() if one.keys() >= set(IMU)}
    places = {name: one for name, one in structs.items() if one.keys() >= set(POSITION) and name not in imus}
    if not imus and not places:
        raise InputError(
            f"{found}: holds no struct of NaveGo; expected an IMU with {', '.join(IMU)} or positions with "
            f"{', '.join(POSITION)}"
        )
    references = frozenset(name for name, one in places.items() if one.keys() >= set(ATTITUDE))
    tracks = {name: _track(found, name, one) for name, one in places.items()}
    receivers = [name for name in places if name not in references]
    return Log(
        "unknown",
        {name: _imu(found, name, one) for name, one in imus.items()},
        tracks,
        {},
        dict.fromkeys(receivers[1:], "only one receiver can aid the filter"),
        upright=True,
        antenna=_antenna(places[receivers[0]]) if receivers else None,
        noise={name: noise for name, one in imus.items() if (noise := _noise(one))},
        references=references,
    )


def _version_5(path: Path) -> dict[str, Struct]:
    from scipy.io import loadmat

    content = loadmat(BytesIO(read_bytes(path)), simplify_cells=True)
    return {name: _numbers(value) for name, value in content.items() if isinstance(value, dict)}


def _hdf5(path: Path) -> dict[str, Struct]:
    """Return structs of version 7.3, whose arrays have their axes the other way round."""
    h5py = needed("h5py", "matlab", path)
    with h5py.File(path, "r") as file:
        groups = {name: group for name, group in file.items() if isinstance(group, h5py.Group) and name[:1] != "#"}
        return {
            name: _numbers({key: value[()].T for key, value in group.items() if isinstance(value, h5py.Dataset)})
            for name, group in groups.items()
        }


def _numbers(struct: Mapping[str, Any]) -> Struct:
    """Return the fields that are numbers, columns as vectors."""
    fields = {name: np.asarray(value) for name, value in struct.items()}
    return {
        name: np.squeeze(value).astype(float)
        for name, value in fields.items()
        if value.dtype.kind in "fiu" and value.size and value.ndim <= 2
    }


def _shaped(path: Path, name: str, struct: Struct, field: str, rows: int, columns: int = 3) -> Array:
    """Return a field with a row for each stamp, shape (T, 3); raises InputError for another shape."""
    value = struct[field]
    if columns == 1 and value.shape == (rows,):
        return value
    if columns == 3 and value.shape == (rows, 3):
        return value
    expected = f"{rows} by {columns}"
    raise InputError(
        f"{path}: {name}.{field} is {' by '.join(map(str, value.shape))}; expected {expected}, as {name}.t"
    )


def _imu(path: Path, name: str, struct: Struct) -> ImuRows:
    time = np.atleast_1d(struct["t"])
    force, rate = (_shaped(path, name, struct, field, len(time)) for field in ("fb", "wb"))
    return rates_to_rows(path, name, time, rate, force)


def _track(path: Path, name: str, struct: Struct) -> Track:
    time = np.atleast_1d(struct["t"])
    place = np.column_stack([_shaped(path, name, struct, field, len(time), 1) for field in POSITION[1:]])
    velocity = _shaped(path, name, struct, "vel", len(time)) if "vel" in struct else None
    attitude = None
    if struct.keys() >= set(ATTITUDE):
        attitude = np.column_stack([_shaped(path, name, struct, field, len(time), 1) for field in ATTITUDE])
    kept = rising(time)
    velocity_std = _std(struct, "stdv", len(time))
    return Track(
        RowSource(f"{path}, {name}"),
        time,
        place,
        datum_known=False,
        position_std=_std(struct, "stdm", len(time)),
        velocity=velocity if velocity_std is not None or attitude is not None else None,
        velocity_std=velocity_std if velocity is not None else None,
        attitude=attitude,
        angle_unit="rad",
    ).at_rows(kept)


def _std(struct: Struct, field: str, rows: int) -> Array | None:
    """Return standard deviations of each row, shape (T, 3), given for each or for all."""
    value = struct.get(field)
    if value is None or value.shape not in ((3,), (rows, 3)) or not (value > 0.0).all():
        return None
    return np.array(np.broadcast_to(value, (rows, 3)))


def _antenna(struct: Struct) -> tuple[float, float, float] | None:
    arm = struct.get("larm")
    if arm is None or arm.shape != (3,):
        return None
    x, y, z = (float(value) for value in arm)
    return x, y, z


def _noise(struct: Struct) -> tuple[float, float] | None:
    """Return the random walks of the worst axis, rad/sqrt(s) and m/s/sqrt(s)."""
    walks = [float(np.max(struct[field])) if field in struct else 0.0 for field in ("arw", "vrw")]
    return (walks[0], walks[1]) if min(walks) > 0.0 else None
