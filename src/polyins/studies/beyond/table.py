"""All of it as one document, and as tables on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from polyins.errors import InputError
from polyins.reading import datasets
from polyins.screen import number, print_table
from polyins.studies import flights
from polyins.studies.beyond.consistency import consistency
from polyins.studies.beyond.drives import gains, left_out
from polyins.studies.beyond.faults import COMPARED_EVERY, faults

GAINS: dict[str, tuple[str, float | None]] = {
    "as_modelled": ("as modelled", None),
    "fixes_0.5m": ("as modelled", 0.5),
    "fixes_2m": ("as modelled", 2.0),
    "chips": ("chips", None),
    "chips_0.5m": ("chips", 0.5),
}
FIRST, SEEDS, QUICK_SEEDS = 101, 10, 1
"""thresholds were set on seeds below 10"""
NEES_SEEDS, QUICK_NEES_SEEDS = 30, 2


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Return the `beyond` document; in its quick form one seed at 50 Hz, two for NEES."""
    seeds = range(FIRST, FIRST + (QUICK_SEEDS if quick else SEEDS))
    many = range(FIRST, FIRST + (QUICK_NEES_SEEDS if quick else NEES_SEEDS))
    steps: dict[str, Callable[[], Any]] = {
        **{key: partial(gains, name, fix_std, seeds, quick) for key, (name, fix_std) in GAINS.items()},
        "nees/4": lambda: consistency("as modelled", 4, many, quick),
        "nees/16": lambda: consistency("as modelled", 16, many, quick),
        "nees/chips": lambda: consistency("chips", 16, seeds, quick),
        "flights": lambda: _flights(quick),
        "faults": lambda: faults(4, FIRST, quick),
        "wrong_exclusions": lambda: _left_out(seeds, quick),
    }
    done: dict[str, Any] = {}
    for n, (key, step) in enumerate(steps.items(), 1):
        done[key] = step()
        if progress:
            progress(n / len(steps))
    document = {key: value for key, value in done.items() if "/" not in key}
    document["nees"] = {key.removeprefix("nees/"): value for key, value in done.items() if "/" in key}
    return {
        "target": "beyond",
        "paper": {},
        "polyins": document,
        "settings": {
            "first_seed": FIRST,
            "seeds": len(seeds),
            "nees_seeds": len(many),
            "rate_hz": 50.0 if quick else 200.0,
            "faults_compared_every_s": COMPARED_EVERY,
        },
    }


def _flights(quick: bool) -> dict[str, dict[str, float]] | None:
    """Return the ratio of one IMU to the array on the real flights, or None where they are not at hand."""
    try:
        folder = datasets.fetch("quadrotor")
    except InputError:
        return None
    rows = flights.list_flights(folder)[:: 4 if quick else 1]
    table = flights.by_length([one for row in rows for one in flights.fly(flights.flight(folder, row), row)])
    return {
        f"{length}s": {
            "ratio": table[f"outage_{length}s"]["single"] / table[f"outage_{length}s"]["enav-fusion"],
            "single": table[f"outage_{length}s"]["single"],
            "enav-fusion": table[f"outage_{length}s"]["enav-fusion"],
        }
        for length in flights.LENGTHS
    }


def _left_out(seeds: range, quick: bool) -> dict[str, float]:
    modelled, hours = left_out("as modelled", 4, seeds, quick)
    chips, chip_hours = left_out("chips", 4, seeds, quick)
    return {"as_modelled": modelled, "chips": chips, "hours": hours, "chip_hours": chip_hours}


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print a table of gains, one of NEES and one of faults."""
    columns = ["single", "paper", "enav-fusion", "ratio", "paper_ratio", "over_paper"]
    shown = [[name, *(number(figures[name][key]) for key in columns)] for name in GAINS]
    flown = figures["flights"] or {}
    shown += [
        [f"flights, {name}", number(of["single"]), "-", number(of["enav-fusion"]), number(of["ratio"]), "-", "-"]
        for name, of in flown.items()
    ]
    print_table("rms of outage maxima, m", ["", *(key.replace("_", " ") for key in columns)], shown)
    rows = [[name, *(number(value) for value in of.values())] for name, of in figures["nees"].items()]
    print_table("NEES of nine states", ["IMUs", "mean", "inside 95 %, %", "in outages"], rows)
    found = [
        [name, "-" if one["found_s"] is None else number(one["found_s"]), number(one["error_over_rest"])]
        for name, one in figures["faults"].items()
    ]
    print_table("one faulty IMU of four", ["fault", "left out after, s", "error over the healthy rest"], found)
