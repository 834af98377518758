"""The data sets that are known: where they are, with checksums.

A data set is a row in `DATASETS`; its files and their SHA-256 stand in `registries/<name>.txt`.
"""

from __future__ import annotations

import difflib
import os
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from polyins.errors import InputError


@dataclass(frozen=True)
class Dataset:
    """What is known of one data set."""

    summary: str
    licence: str
    source: str
    """where it is described"""
    address: str | None = None
    """where its files are; None: only in POLYINS_DATA"""


DATASETS = {
    "quadrotor": Dataset(
        summary="4 Xsens DOT on a quadrotor, 120 Hz, and its RTK position, 10 Hz; 30 flights of 14 to 55 s",
        licence="CC BY 4.0",
        source="https://github.com/ansfl/Quadrotor-Dead-Reckoning-with-Multiple-Inertial-Sensors",
        address="https://raw.githubusercontent.com/ansfl/Quadrotor-Dead-Reckoning-with-Multiple-Inertial-Sensors/"
        "328f0540648fe4705bbd75fd1c7284ed5c0aec17/",
    ),
    "kfgins-parity": Dataset(
        summary="a simulated drive of 300 s in KF-GINS's formats, its truth, and what KF-GINS computes from it",
        licence="made for polyins",
        source="POLYINS_DATA",
    ),
    "mimu4444": Dataset(
        summary="a board of eight MPU-9150 in 20 poses at rest of 25 s, then turned fast by hand, 62.5 Hz",
        licence="MIT",
        source="https://github.com/hcarlsso/Self-Calibration-Inertial-Sensor-Arrays-BCD.jl",
    ),
    "logs": Dataset(
        summary="logs of autopilots, receivers and arrays in their own formats",
        licence="see its README",
        source="POLYINS_DATA",
    ),
    "wid": Dataset(
        summary="a car with Xsens DOT on its four wheels and its body, 120 Hz, and its RTK position, 5 Hz",
        licence="see the source",
        source="https://github.com/ansfl/WID (figshare 10.6084/m9.figshare.27129999)",
    ),
    "whu-robot": Dataset(
        summary="the track, 1 Hz, and odometer speed, 2 Hz, of a robot that drove 1.28 km with IMUs on wheels and body",
        licence="see the source",
        source="https://github.com/i2Nav-WHU/Wheel-INS",
    ),
    "whu-array": Dataset(
        summary="a car's RTK track, 1 Hz, 23 km, and the calibrations and error curves of the 16 ICM-20602 on it",
        licence="see the source",
        source="https://github.com/i2Nav-WHU/IMU-Array",
    ),
    "whu-car": Dataset(
        summary="the track, 1 Hz, and odometer speed, 2 Hz, of a car that drove 12.2 km with an IMU on a wheel",
        licence="see the source",
        source="https://github.com/i2Nav-WHU/Wheel-INS",
    ),
    "wheelins-parity": Dataset(
        summary="a simulated wheel IMU of 300 s in Wheel-INS's formats, its truth, and what Wheel-INS computes from it",
        licence="made for polyins",
        source="POLYINS_DATA",
    ),
}


RETRIES = 2


def names() -> list[str]:
    """Return the names of the data sets that are known."""
    return list(DATASETS)


def info(name: str) -> dict[str, object]:
    """Return what is known of a data set: summary, licence, source, number of files, the folder if it is here."""
    dataset = find(name)
    local = _given_folder(name) or (_cache_folder(name) if _complete(name) else None)
    return {
        "name": name,
        "summary": dataset.summary,
        "licence": dataset.licence,
        "source": dataset.source,
        "downloadable": dataset.address is not None,
        "files": len(_registry(name)) or None,
        "folder": str(local) if local else None,
    }


def fetch(name: str) -> Path:
    """Return the folder of a data set: POLYINS_DATA/<name> if there, else downloaded into the user's cache.

    Raises InputError for an unknown name, or one that cannot be downloaded and is not in POLYINS_DATA.
    """
    dataset = find(name)
    given = _given_folder(name)
    if given:
        return given
    if dataset.address is None:
        public = f"is not fetched by polyins, see {dataset.source}" if "://" in dataset.source else "is not public"
        raise InputError(f"data set {name}: {public}; expected it as {name} in the folder that POLYINS_DATA names")
    return _download(name, dataset.address)


def find(name: str) -> Dataset:
    """Return what is known of a data set; raise InputError with the nearest known one for an unknown name."""
    if name not in DATASETS:
        similar = difflib.get_close_matches(name, DATASETS, n=1)
        hint = f"did you mean {similar[0]}?" if similar else f"expected one of {', '.join(DATASETS)}"
        raise InputError(f"data set {name!r}: is unknown; {hint}")
    return DATASETS[name]


def _given_folder(name: str) -> Path | None:
    root = os.environ.get("POLYINS_DATA")
    folder = Path(root) / name if root else None
    return folder.resolve() if folder and folder.is_dir() else None


def _cache_folder(name: str) -> Path:
    from pooch import os_cache

    return Path(os_cache("polyins")) / name


def _registry(name: str) -> dict[str, str]:
    """Return the SHA-256 of each file, by its path."""
    listing = resources.files("polyins.reading") / "registries" / f"{name}.txt"
    if not listing.is_file():
        return {}
    return dict(line.split() for line in listing.read_text().splitlines())


def _complete(name: str) -> bool:
    registry = _registry(name)
    return bool(registry) and all((_cache_folder(name) / path).is_file() for path in registry)


def _download(name: str, address: str) -> Path:
    import pooch

    folder = _cache_folder(name)
    pooch.get_logger().setLevel("ERROR")
    store = pooch.create(folder, address, registry=_registry(name), retry_if_failed=RETRIES)
    for path in store.registry:
        try:
            store.fetch(path)
        except (OSError, ValueError) as error:
            reason = str(error).splitlines()[0][:60]
            raise InputError(
                f"data set {name}: {address}{path} cannot be had ({reason}); expected it there, or the data set as "
                f"{name} in the folder that POLYINS_DATA names"
            ) from error
    return folder
