"""Real flights: four IMUs on a quadrotor through GNSS outages, every array method over all recordings.

Data set `quadrotor`. The flights are short, so there is one outage per run: GNSS at 1 Hz for at least ten seconds, then
an outage that begins just after a fix; runs begin their outages every three seconds (every five on the long recording).
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib import resources
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.config import parse
from polyins.config.yaml_document import Document, read_yaml
from polyins.errors import InputError
from polyins.evaluation.errors import compare_to_reference
from polyins.files import find
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import GnssStream, Recording
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.reading import datasets
from polyins.reading.loading import build

LENGTHS = (5, 10)
"""s, of the outages"""
GNSS_BEFORE = 10.0
"""s, at least"""
NOISE = 0.02
"""m, added to the aircraft's smooth positions"""
METHODS = ("imu-fusion", "nav-fusion", "enav-fusion")
LOG = "AIRDATA.csv"
"""of the autopilot; in the folder of a flight whose data are as recorded"""

Row = dict[str, str]


@dataclass(frozen=True)
class Outage:
    """The maximum horizontal errors of one run, m, by length in s and by method; `single` holds one per IMU."""

    flight: str
    session: str
    maxima: dict[int, dict[str, list[float]]]


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run every method over every flight and return the `flights` document.

    `quick` takes every fourth flight. Raises InputError if the data set's list of flights is missing.
    """
    folder = datasets.fetch("quadrotor")
    rows = list_flights(folder)[:: 4 if quick else 1]
    outages: list[Outage] = []
    for number, row in enumerate(rows):
        outages += fly(flight(folder, row).as_published(), row)
        if progress:
            progress((number + 1) / len(rows))
    return {
        "target": "flights",
        "paper": {},
        "polyins": {
            **by_length(outages),
            "by_session": {name: by_length(group) for name, group in _grouped(outages, "session")},
            "by_flight": {name: by_length(group) for name, group in _grouped(outages, "flight")},
            "by_imus": {str(count): _rms(outages, 10, f"imus-{count}") for count in (1, 2, 3, 4)},
        },
        "settings": {
            "outage_lengths_s": list(LENGTHS),
            "gnss_before_s": GNSS_BEFORE,
            "gnss_noise_m": NOISE,
            "by_imus": "rms over 10 s outages and all subsets of that many IMUs, enav-fusion",
            "flights": len(rows),
        },
    }


def list_flights(folder: Path) -> list[Row]:
    """Return the rows of `flights.csv`."""
    path = folder / "flights.csv"
    if not path.is_file():
        raise InputError(f"{path}: is missing; expected the list of flights with their time lags")
    with path.open() as file:
        return list(csv.DictReader(file))


def flight(folder: Path, row: Row) -> Recording:
    """Return the recording of one row of `flights.csv`, on the clock of IMU 1."""
    described = document(folder, row)
    return build(parse(described), described)


def document(folder: Path, row: Row) -> Document:
    """Return the configuration of one row of `flights.csv`."""
    with resources.as_file(resources.files("polyins.studies") / "flights.yaml") as template:
        values = read_yaml(template).values
    place = folder / row["flight"]
    values["name"] = f"quadrotor {row['flight']}"
    for number, imu in enumerate(values["imus"], 1):
        imu["file"] = str(place / f"IMU_{number}.csv")
        # t_imuk = t_imu1 + lag_k
        imu["clock_offset_s"] = -1e-3 * float(row[f"lag_imu{number}_ms"]) if number > 1 else 0.0
    attitude_lag, position_lag = float(row["lag_gtatt_to_imu1_s"]), float(row["pos_minus_att_lag_s"])
    raw = any(place.glob(f"{LOG}*"))
    if raw:
        # the log's clock against the sensors'
        attitude_lag -= float(row["log_minus_sample_time_s"])
    else:
        values["imu_defaults"]["rate_hz"] = 120
    columns = RAW_COLUMNS if raw else COLUMNS
    file = str(place / (LOG if raw else "GT.csv"))
    values["gnss"] |= {"file": file, "columns": columns, "clock_offset_s": attitude_lag + position_lag}
    values["reference"] |= {
        "file": file,
        "columns": {**columns, "attitude": ATTITUDE},
        "clock_offset_s": attitude_lag,
        "position_lag_s": position_lag,
    }
    for section in ("gnss", "reference") if raw else ():
        values[section] |= {"height": "sea-level", "geoid_height_m": HEIGHT_OF_TAKEOFF}
    return Document(find(file), values)


COLUMNS = {
    "time": {"name": "time", "unit": "s"},
    "position": {"names": ["North", "East", "Down"], "frame": "north-east-down"},
}
RAW_COLUMNS = {
    "time": {"name": "time(millisecond)", "unit": "ms"},
    "position": {"names": ["latitude", "longitude", "height_above_takeoff(meters)"]},
}
ATTITUDE = {"names": ["roll(degrees)", "pitch(degrees)", "compass_heading(degrees)"], "unit": "deg"}
HEIGHT_OF_TAKEOFF = 23.0
"""m above the ellipsoid, roughly: 5.5 m above the sea, which is 17.5 m above the ellipsoid there."""


def fly(recording: Recording, row: Row) -> Iterator[Outage]:
    """Run all methods through each outage of one flight."""
    first, last = span(recording)
    every = 5.0 if recording.geodetic else 3.0  # the flights as recorded are long, and geodetic
    begins = np.arange(first + GNSS_BEFORE, last - LENGTHS[0] + 1e-6, every)
    for begin, generator in zip(begins, np.random.default_rng(1).spawn(len(begins)), strict=True):
        lengths = [length for length in LENGTHS if begin + length <= last + 1e-6]
        end = begin + lengths[-1]
        run = replace(
            recording,
            gnss=noisy(recording, generator),
            outages=((begin + 0.05, end + 0.05),),
            start=replace(recording.start, end_time=end + 0.02),
        )
        yield Outage(row["flight"], row["session"], _maxima(run, begin, lengths))


def noisy(recording: Recording, generator: np.random.Generator) -> GnssStream:
    """Return the fixes of a flight with noise."""
    assert recording.gnss is not None
    metres = metres_per_unit(recording.gnss.position[0], recording.geodetic)
    noise = generator.normal(0.0, NOISE, recording.gnss.position.shape) / metres
    return replace(recording.gnss, position=recording.gnss.position + noise)


def span(recording: Recording) -> tuple[float, float]:
    """Return the time of the first fix that all IMUs see, and the end of what all streams cover."""
    assert recording.gnss is not None
    assert recording.reference is not None
    begin = max([stream.time[0] for stream in recording.imus] + [recording.reference.time[0]])
    end = min([stream.time[-1] for stream in recording.imus] + [recording.reference.time[-1]])
    return float(recording.gnss.time[recording.gnss.time >= begin][0]), float(end)


def _maxima(run: Recording, begin: float, lengths: list[int]) -> dict[int, dict[str, list[float]]]:
    imus = range(len(run.imus))
    solutions: dict[str, list[Solution]] = {name: [batch.run(run, name)] for name in METHODS}
    solutions["single"] = [batch.run(run, "single", imu=i) for i in imus]
    solutions["imus-1"] = solutions["single"]
    for count in (2, 3):
        solutions[f"imus-{count}"] = [batch.run(run.subset(some), "enav-fusion") for some in combinations(imus, count)]
    solutions["imus-4"] = solutions["enav-fusion"]
    return {
        length: {name: [_maximum(run, s, begin, begin + length) for s in some] for name, some in solutions.items()}
        for length in lengths
    }


def _maximum(run: Recording, solution: Solution, begin: float, end: float) -> float:
    assert run.reference is not None
    errors = compare_to_reference(solution, run.reference)
    inside = (errors.time >= begin) & (errors.time <= end + 1e-6)
    return float(errors.horizontal[inside].max())


def by_length(outages: list[Outage]) -> dict[str, dict[str, Any]]:
    """Return the rms of the maxima of each method, m, by the length of the outages."""
    return {
        f"outage_{length}s": {
            "count": sum(length in outage.maxima for outage in outages),
            **{name: _rms(outages, length, name) for name in ("single", *METHODS)},
        }
        for length in LENGTHS
    }


def _rms(outages: list[Outage], length: int, name: str) -> float | None:
    values: NDArray[np.float64] = np.array(
        [value for outage in outages if length in outage.maxima for value in outage.maxima[length][name]]
    )
    return float(np.sqrt(np.mean(values**2))) if values.size else None


def _grouped(outages: list[Outage], key: str) -> Iterator[tuple[str, list[Outage]]]:
    for name in dict.fromkeys(getattr(outage, key) for outage in outages):
        yield name, [outage for outage in outages if getattr(outage, key) == name]
