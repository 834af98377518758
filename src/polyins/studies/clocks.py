"""How well clocks are found from motion: simulated drives and flights, each beside its bound, leaps, and real flights.

Simulated recordings are drawn by number: odd ones are reported, even ones were for setting thresholds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polyins.calibration.offsets import imu_offsets
from polyins.calibration.other_clocks import Movers
from polyins.errors import InputError
from polyins.model.clock import Clock
from polyins.model.recording import Offset, Recording
from polyins.model.rig import PPM
from polyins.reading import datasets
from polyins.screen import number, print_table
from polyins.simulation import motions
from polyins.simulation.increments import increments
from polyins.simulation.path import Path
from polyins.simulation.run import TrueRun, record
from polyins.simulation.scenario import Scenario
from polyins.studies.flights import Row, flight, list_flights
from polyins.studies.progress import Steps

LENGTH_S = 180.0
DRIFT_STD = 50.0 * PPM
LARGEST_OFFSET_S = 3.0
LEAPS_S = (0.05, 1.0)
"""size of leaps, of either sign"""
MOTIONS: Mapping[str, Callable[[np.random.Generator, float], Path]] = {
    "drive": motions.drive_under_way,
    "flight of wings": motions.flight,
    "flight of rotors": motions.sideways,
}
IMUS: Mapping[str, Mapping[str, Any]] = {
    "1 consumer-mems": {"noise": "consumer-mems", "imus": {"count": 1}},
    "16 consumer-mems": {"noise": "consumer-mems", "imus": {"count": 16}},
    "1 tactical": {"noise": "tactical", "imus": {"count": 1}},
}
SEEDS, QUICK_SEEDS = 8, 2

Document = dict[str, Any]


@dataclass(frozen=True)
class Errors:
    """Of one clock."""

    offset: float
    """s"""
    drift: float
    """relative"""
    offset_std: float
    """stated"""
    drift_std: float

    @classmethod
    def of(cls, found: Offset, true: Clock) -> Errors:
        """Compare what was found with the truth where the drift adds nothing."""
        at = found.reference_s
        off = float(found.clock.common(at)) - float(true.common(at))
        return cls(off, found.drift - true.drift, found.std_s, found.drift_std)


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> Document:
    """Estimate the clocks of simulated receivers and IMUs, of one that leaps, and of the flights."""
    seeds = range(1, 2 * (QUICK_SEEDS if quick else SEEDS), 2)
    kinds = [(motion, imus) for motion in MOTIONS for imus in IMUS][:: 4 if quick else 1]
    steps = Steps(progress, len(kinds) + 3)
    receivers = {}
    for motion, imus in kinds:
        receivers[f"{motion}, {imus}"] = _figures([receiver_errors(drawn(motion, imus, seed), seed) for seed in seeds])
        steps.next()(1.0)
    pairs = _figures([pair_errors(drawn("drive", "1 consumer-mems", seed, count=2), seed) for seed in seeds])
    steps.next()(1.0)
    leaps = [leap_errors(drawn("drive", "1 consumer-mems", seed), seed) for seed in seeds]
    steps.next()(1.0)
    flown = fly(quick)
    steps.next()(1.0)
    return {
        "target": "clocks",
        "paper": {},
        "polyins": {
            "receivers": receivers,
            "imus": {"two in a drive": pairs},
            "leaps": _leap_figures(leaps),
            "flights": flown,
        },
        "settings": {
            "fixes": "1 Hz, 0.02 m horizontal, 0.04 m vertical, three minutes",
            "clocks": f"offset within {LARGEST_OFFSET_S:g} s, drift of {DRIFT_STD / PPM:g} ppm (1 sigma)",
            "bound": "rms of the stated std, which is the Cramer-Rao bound of the model",
            "seeds": len(seeds),
        },
    }


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print the errors of clocks beside what was stated."""
    columns = ["clock", "offset, ms", "bound, ms", "over std", "drift, ppm", "bound, ppm", "over std"]
    keys = ("offset_ms", "offset_bound_ms", "offset_over_std", "drift_ppm", "drift_bound_ppm", "drift_over_std")
    rows = [
        [name, *(number(one[key], 2) for key in keys)]
        for name, one in {**figures["receivers"], **figures["imus"]}.items()
    ]
    print_table("clocks, rms", columns, rows)
    leaps = figures["leaps"]
    print_table(
        "a receiver that leaps",
        ["leaps", "found", "others", "size, rms ms", "over std", "within, s"],
        [[str(leaps["leaps"]), str(leaps["found"]), str(leaps["others"]),
          *(number(leaps[key], 2) for key in ("size_ms", "size_over_std", "place_s"))]],
    )  # fmt: skip
    if figures["flights"]:
        shown = ("rms_ms", "largest_ms", "over_std")
        rows = [
            [name, str(one["count"]), str(one["refused"]), *(number(one[key], 2) for key in shown)]
            for name, one in figures["flights"].items()
        ]
        print_table("lags of the flights", ["lag", "count", "refused", "rms, ms", "largest, ms", "over std"], rows)


def drawn(motion: str, imus: str, seed: int, count: int | None = None) -> Recording:
    """Return a simulated recording."""
    rng = np.random.default_rng([seed, 17])
    kind = {**IMUS[imus], **({"imus": {"count": count}} if count else {})}
    scenario = Scenario.model_validate({"duration_s": LENGTH_S, "static_s": 0.0, "rate_hz": 100, "outages": [], **kind})
    path = MOTIONS[motion](rng, LENGTH_S)
    run = TrueRun(scenario, path, increments(path, scenario.rate_hz), (), ())
    return record(run, seed=seed).recording


def clock(seed: int, leap: tuple[float, float] | None = None) -> Clock:
    """Draw the true clock of a stream."""
    rng = np.random.default_rng([seed, 18])
    offset, drift = rng.uniform(-LARGEST_OFFSET_S, LARGEST_OFFSET_S), rng.normal(0.0, DRIFT_STD)
    return Clock(float(offset), float(drift), 0.5 * LENGTH_S, () if leap is None else (leap,))


def receiver_errors(recording: Recording, seed: int) -> Errors:
    """Return the errors of a receiver's clock."""
    true = clock(seed)
    return Errors.of(_of_receiver(recording, true), true)


def _of_receiver(recording: Recording, true: Clock) -> Offset:
    assert recording.gnss is not None
    stamped = replace(recording.gnss, time=true.inverse.common(recording.gnss.time))
    movers = Movers(recording.rig.imus, recording.imus, recording.options.gravity)
    return movers.of_positions("GNSS", stamped, recording.geodetic, recording.rig.antenna)


def pair_errors(recording: Recording, seed: int) -> Errors:
    """Return the errors of the second IMU's clock against the first one's."""
    true = clock(seed)
    first, second = recording.imus
    stamped = replace(second, time=true.inverse.common(second.time))
    return Errors.of(imu_offsets(recording.rig.imus, (first, stamped), 0)[1], true)


def leap_errors(recording: Recording, seed: int) -> tuple[int, float, float, float]:
    """Return how many leaps too many were found, and of the true one the error of size, its std, and of place, s.

    What was not found is no number.
    """
    rng = np.random.default_rng([seed, 19])
    size = float(rng.uniform(*LEAPS_S) * rng.choice([-1.0, 1.0]))
    at = float(rng.uniform(0.25, 0.75)) * LENGTH_S
    found = _of_receiver(recording, clock(seed, (at, size)))
    near = [leap for leap in found.leaps if abs(leap[0] - at) < 5.0]
    if not near:
        return len(found.leaps), np.nan, np.nan, np.nan
    stamp, told, std = min(near, key=lambda leap: abs(leap[0] - at))
    return len(found.leaps) - 1, told - size, std, stamp - at


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _figures(errors: Sequence[Errors]) -> dict[str, float]:
    return {
        "offset_ms": 1e3 * _rms([one.offset for one in errors]),
        "offset_bound_ms": 1e3 * _rms([one.offset_std for one in errors]),
        "offset_over_std": _rms([one.offset / one.offset_std for one in errors]),
        "drift_ppm": _rms([one.drift for one in errors]) / PPM,
        "drift_bound_ppm": _rms([one.drift_std for one in errors]) / PPM,
        "drift_over_std": _rms([one.drift / one.drift_std for one in errors]),
    }


def _leap_figures(leaps: Sequence[tuple[int, float, float, float]]) -> dict[str, float | int | None]:
    found = [one for one in leaps if np.isfinite(one[1])]
    return {
        "leaps": len(leaps),
        "found": len(found),
        "others": sum(one[0] for one in leaps),
        "size_ms": 1e3 * _rms([size for _, size, _, _ in found]) if found else None,
        "size_over_std": _rms([size / std for _, size, std, _ in found]) if found else None,
        "place_s": max(abs(place) for *_, place in found) if found else None,
    }


def fly(quick: bool) -> dict[str, dict[str, float | int]] | None:
    """Return how far the lags of the flights are from those of `flights.csv`; None without the data set."""
    try:
        folder = datasets.fetch("quadrotor")
    except InputError:
        return None
    off: dict[str, list[tuple[float, float]]] = {"IMU to IMU 1": [], "attitude": [], "position": []}
    refused = 0
    for row in list_flights(folder)[:: 8 if quick else 1]:
        recording = flight(folder, _without_lags(row))
        attitude, position = float(row["lag_gtatt_to_imu1_s"]), float(row["pos_minus_att_lag_s"])
        clocks = imu_offsets(recording.rig.imus, recording.imus, 0)
        for found in clocks[1:]:
            known = -1e-3 * float(row[f"lag_imu{found.name[-1]}_ms"])
            off["IMU to IMU 1"].append((found.offset_s - known, found.std_s))
        streams = [
            replace(stream, time=found.clock.common(stream.time))
            for stream, found in zip(recording.imus, clocks, strict=True)
        ]
        movers = Movers(recording.rig.imus, streams, recording.options.gravity)
        assert recording.reference is not None
        assert recording.gnss is not None
        found = movers.of_reference(recording.reference, recording.geodetic)
        off["attitude"].append((found.offset_s - attitude, found.std_s))
        try:
            found = movers.of_positions("GNSS", recording.gnss, recording.geodetic, recording.rig.antenna)
        except InputError:
            refused += 1
        else:
            off["position"].append((found.offset_s - attitude - position, found.std_s))
    return {
        name: {
            "count": len(values),
            "rms_ms": 1e3 * _rms([error for error, _ in values]),
            "largest_ms": 1e3 * max(abs(error) for error, _ in values),
            "over_std": _rms([error / std for error, std in values]),
            "refused": refused if name == "position" else 0,
        }
        for name, values in off.items()
    }


def _without_lags(row: Row) -> Row:
    lags = {f"lag_imu{number}_ms": "0" for number in (2, 3, 4)}
    return {**row, **lags, "lag_gtatt_to_imu1_s": "0", "pos_minus_att_lag_s": "0"}
