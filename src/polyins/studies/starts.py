"""Can a start be trusted: simulated starts of every kind, and real flights with ever less that is typed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.evaluation.errors import compare_to_reference
from polyins.evaluation.summary import summarize
from polyins.model.recording import Recording, StartOptions
from polyins.model.rig import DEG, ImuErrors
from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.reading import datasets
from polyins.screen import number, print_table
from polyins.studies import flights
from polyins.studies.progress import Steps
from polyins.studies.start_cases import KINDS, StartOutcome, case, outcome
from polyins.tools.parallel import Progress, run_all

Array = NDArray[np.float64]

CASES = 400
QUICK_CASES = 40
INSIDE = 3.0
"""std within which a heading has to be"""
OFF = 10.0 * DEG
SURE = 3.0 * DEG
"""a heading that claims to be so sure and is farther off than OFF is wrong"""
LEVELS = ("trust", "doubt", "do-not-use")
UNTYPED_STD = ImuErrors(
    gyro_bias=np.full(3, 1.5 * DEG),
    accel_bias=np.full(3, 0.3),
    gyro_scale=np.full(3, 2e-3),
    accel_scale=np.full(3, 5e-3),
)
"""of a chip whose biases nobody typed"""
WAYS = ("specified", "heading alone", "nothing")
"""what is typed: heading by the reference, and biases; the heading at the first instant alone; nothing"""

Row = dict[str, Any]


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run the starts of odd numbers, in full also the flights, and return the `starts` document."""
    count = QUICK_CASES if quick else CASES
    steps = Steps(progress, 1.0 if quick else 1.2)
    outcomes = outcomes_of(range(1, 2 * count, 2), steps.next())
    document: dict[str, Any] = {
        "target": "starts",
        "paper": {},
        "polyins": {"simulated": table(outcomes)},
        "settings": {
            "cases": count,
            "numbers": (
                "odd; thresholds were set on even ones, but the std of a start in motion was widened, and a looser"
                " limit of rest taken back, after odd ones had been seen"
            ),
            "inside": f"at the start within {INSIDE:g} std; throughout: at every epoch of 20 s as well",
            "wrong": "heading more than 10 deg off where its std is under 3 deg",
        },
    }
    if not quick:
        document["polyins"]["flights"], document["settings"]["flights"] = _flights(steps.next(0.2))
    return document


def outcomes_of(numbers: Sequence[int], progress: Progress | None = None) -> list[StartOutcome]:
    """Run starts by number, on all cores."""
    return run_all([partial(_outcome, each) for each in numbers], progress=progress)


def _outcome(each: int, progress: Progress) -> StartOutcome:
    found = outcome(case(each))
    progress(1.0)
    # the recordings of hundreds of cases fill the memory
    return found.slim()


def table(outcomes: Sequence[StartOutcome]) -> dict[str, Row]:
    """Return the figures of each kind, and of all."""
    groups = {kind: [one for one in outcomes if one.case.kind == kind] for kind in KINDS}
    return {name: _row(group) for name, group in {**groups, "all": list(outcomes)}.items() if group}


def is_wrong(heading: Array, std: Array) -> bool:
    """Whether a heading that claims to be sure is far off, at any epoch."""
    return bool(np.any((heading > OFF) & (std < SURE)))


def _row(outcomes: Sequence[StartOutcome]) -> Row:
    started = [one for one in outcomes if not one.refused]
    ratios = [one.heading / one.heading_std for one in started]
    levelled = [one.tilt for one in started if len(one.tilt)]
    return {
        "cases": len(outcomes),
        "started": len(started),
        "refused": len(outcomes) - len(started),
        "heading_inside": _share([bool(ratio[0] <= INSIDE) for ratio in ratios]),
        "heading_inside_throughout": _share([bool(ratio.max() <= INSIDE) for ratio in ratios]),
        "wrong": sum(is_wrong(one.heading, one.heading_std) for one in started),
        "heading_std_deg": _median([float(one.heading_std[0]) / DEG for one in started]),
        "tilt_over_std_rms": _rms([float(tilt[0]) for tilt in levelled]),
        "tilt_over_std_worst": max((float(tilt.max()) for tilt in levelled), default=None),
        "coverage": _median([one.covered for one in started]),
        **{level: sum(one.level == level for one in started) for level in LEVELS},
    }


def _share(values: Sequence[bool]) -> float | None:
    return float(np.mean(values)) if values else None


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _rms(values: Sequence[float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values else None


# --- flights ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Flown:
    """One flight, started in one way."""

    time: Array
    """s, shape (T,)"""
    heading: Array
    """error, rad, shape (T,)"""
    heading_std: Array
    """rad, shape (T,)"""
    tilt: Array
    """the larger error of roll and pitch, rad, shape (T,)"""
    horizontal: Array
    """m, shape (T,)"""
    level: str
    """of the verdict"""


def _flights(progress: Progress) -> tuple[dict[str, Row] | None, str]:
    """Return the figures of each way to start, and what they are of; None: the data set is not there."""
    try:
        folder = datasets.fetch("quadrotor")
        rows = flights.list_flights(folder)
    except InputError as error:
        return None, str(error)
    flown = run_all([partial(_fly, folder, row) for row in rows], progress=progress)
    found = {way: _flight_row(flown, way) for way in WAYS}
    return found, "against the aircraft's own attitude, which is good to some degrees"


def _fly(folder: Path, row: flights.Row, progress: Progress) -> dict[str, Flown]:
    recording = flights.flight(folder, row)
    recording = replace(recording, gnss=flights.noisy(recording, np.random.default_rng(1)))
    found: dict[str, Flown] = {}
    for done, way in enumerate(WAYS, 1):
        run = started_by(recording, way)
        try:
            solution = batch.run(run, "enav-fusion")
        except InputError:
            continue
        finally:
            progress(done / len(WAYS))
        found[way] = _flown(run, solution)
    return found


def started_by(recording: Recording, way: str) -> Recording:
    """Return a flight with what one of `WAYS` leaves typed."""
    first, last = flights.span(recording)
    if way == "specified":
        return replace(recording, start=replace(recording.start, end_time=last))
    imus = tuple(replace(imu, initial_errors=ImuErrors(), initial_std=UNTYPED_STD) for imu in recording.rig.imus)
    start = StartOptions(end_time=last)
    reference = recording.reference
    if way == "heading alone" and reference is not None and reference.attitude is not None:
        heading = np.interp(first, reference.time, np.unwrap(reference.attitude[:, 2]))
        start = replace(start, heading=float(heading), heading_time=first)
    return replace(recording, rig=replace(recording.rig, imus=imus), start=start)


def _flown(run: Recording, solution: Solution) -> Flown:
    assert run.reference is not None
    errors = compare_to_reference(solution, run.reference)
    assert errors.attitude is not None
    return Flown(
        time=errors.time,
        heading=np.abs(errors.attitude[:, 2]),
        heading_std=np.sqrt(solution.phi_covariance[errors.covered, 5]),
        tilt=np.abs(errors.attitude[:, :2]).max(axis=1),
        horizontal=errors.horizontal,
        level=str(summarize(solution, None)["verdict"]["level"]),
    )


def _flight_row(flown: Sequence[Mapping[str, Flown]], way: str) -> Row:
    """Return the figures of one way, beside those of the specified start of the same flights at the same epochs."""
    found = [(one[way], one["specified"]) for one in flown if way in one]
    pairs = [(here, there, there.time >= here.time[0]) for here, there in found]
    wrong = [is_wrong(here.heading, here.heading_std) for here, _ in found]

    def rms(name: str, specified: bool) -> float | None:
        values = [getattr(there, name)[same] if specified else getattr(here, name) for here, there, same in pairs]
        return _rms(np.concatenate(values).tolist()) if values else None

    def degrees(value: float | None) -> float | None:
        return None if value is None else value / DEG

    return {
        "flights": len(flown),
        "started": len(found),
        "heading_rms_deg": degrees(rms("heading", False)),
        "heading_rms_specified_deg": degrees(rms("heading", True)),
        "heading_worst_deg": max((float(here.heading.max()) / DEG for here, _ in found), default=None),
        "tilt_rms_deg": degrees(rms("tilt", False)),
        "tilt_rms_specified_deg": degrees(rms("tilt", True)),
        "horizontal_rms_m": rms("horizontal", False),
        "horizontal_rms_specified_m": rms("horizontal", True),
        "wrong": sum(wrong),
        "wrong_in_silence": sum(off and here.level == "trust" for off, (here, _) in zip(wrong, found, strict=True)),
        **{level: sum(here.level == level for here, _ in found) for level in LEVELS},
    }


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print a table of the simulated starts by kind, and one of the flights by what is typed."""
    for title, rows in (("simulated", figures["simulated"]), ("real flights", figures.get("flights"))):
        if not rows:
            continue
        columns = list(next(iter(rows.values())))
        shown = [[name, *(_cell(row[key]) for key in columns)] for name, row in rows.items()]
        print_table(f"starts: {title}", ["", *(key.replace("_", "\n", 1).replace("_", " ") for key in columns)], shown)


def _cell(value: float | None) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else number(value)
