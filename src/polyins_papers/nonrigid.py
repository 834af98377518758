"""Paper A's nonrigid array in simulation: six IMUs on three steel rulers across a robot, on a lawn and over books."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import ImuStream, Recording
from polyins.simulation.run import record, true_run
from polyins.simulation.scenario import Scenario
from polyins.studies.rigid_array import rms
from polyins.studies.scenario_files import read

Array = NDArray[np.float64]

FIRST_SEED = 2000
"""those from 1000 on were used while books, tyres, clamps and ground were settled"""
QUICK_S = 330.0

FILES = {"rigid": "lawn", "test A": "lawn", "test B": "books"}
"""The rigid array is that of test A on rulers that do not bend, on the same lawn."""


def scenario_of(test: str, quick: bool) -> Scenario:
    """Return the scenario of a test, of which `quick` takes the first part."""
    scenario = with_rulers(read(Scenario, __package__, FILES[test]), stiff=test == "rigid")
    if not quick:
        return scenario
    outages = tuple(outage for outage in scenario.outage_intervals() if outage[1] <= QUICK_S)
    return scenario.model_copy(update={"duration_s": QUICK_S, "outages": outages})


def with_rulers(scenario: Scenario, **keys: Any) -> Scenario:
    """Return the scenario with other keys of its rulers."""
    assert scenario.rulers is not None
    return scenario.model_copy(update={"rulers": scenario.rulers.model_copy(update=keys)})


def with_road(scenario: Scenario, **keys: Any) -> Scenario:
    """Return the scenario with other keys of its road."""
    assert scenario.road is not None
    return scenario.model_copy(update={"road": scenario.road.model_copy(update=keys)})


def with_roughness(scenario: Scenario, roughness_mm: float) -> Scenario:
    """Return the scenario on ground of another roughness, rms in mm."""
    return with_road(scenario, roughness_mm=roughness_mm)


def with_roughness_of_the_whole(scenario: Scenario) -> Scenario:
    """Return the scenario on ground whose roughness is that of all of it, not that of a median patch."""
    assert scenario.road is not None
    return with_roughness(scenario, scenario.road.roughness_mm * math.exp(-(scenario.road.patch_sigma**2)))


def with_books(scenario: Scenario, thickest_mm: float) -> Scenario:
    """Return the scenario with books of another thickness, all by the same factor."""
    assert scenario.road is not None
    factor = thickest_mm * 1e-3 / max(book.height_m for book in scenario.road.books)
    books = (book.model_copy(update={"height_m": factor * book.height_m}) for book in scenario.road.books)
    return with_road(scenario, books=tuple(books))


def with_books_on_the_left(scenario: Scenario) -> Scenario:
    """Return the scenario with all books under the left wheels."""
    assert scenario.road is not None
    return with_road(scenario, books=tuple(book.model_copy(update={"under": "left"}) for book in scenario.road.books))


def with_books_reversed(scenario: Scenario) -> Scenario:
    """Return the scenario with the first book at the place of the last, and so on."""
    assert scenario.road is not None
    books = scenario.road.books
    places = (book.at_m for book in books)
    return with_road(
        scenario,
        books=tuple(book.model_copy(update={"at_m": at}) for book, at in zip(books[::-1], places, strict=True)),
    )


def with_lengths(scenario: Scenario, length_mm: float) -> Scenario:
    """Return the scenario with books of another length along the way, mm."""
    assert scenario.road is not None
    books = (book.model_copy(update={"length_m": length_mm * 1e-3}) for book in scenario.road.books)
    return with_road(scenario, books=tuple(books))


def with_thickness(scenario: Scenario, thickness_mm: float) -> Scenario:
    """Return the scenario with rulers of another thickness, mm: stiffness grows with its third power."""
    return with_rulers(scenario, thickness_m=thickness_mm * 1e-3)


def recording_of(scenario: Scenario, number: int) -> Recording:
    """Return the recording of the seed of a number, counted from 0: another ground, other rulers, other errors."""
    seed = FIRST_SEED + number
    return (
        record(true_run(scenario.model_copy(update={"seed": seed})), seed=seed).recording.as_published().without_gate()
    )


def with_forces_at_origin(recording: Recording) -> Recording:
    """Return the recording with each IMU's force moved to the array origin by its own rate, paper A (13).

    The method `imu-fusion` takes one rate for all, the mean; of the recording returned it makes the paper's IMU-Fusion.
    The angular acceleration is between the middles of two intervals; the first interval has none.
    """
    pairs = list(zip(recording.imus, recording.rig.imus, strict=True))
    streams = tuple(replace(stream, dvel=_moved(stream, -imu.position)) for stream, imu in pairs)
    imus = tuple(replace(imu, position=np.zeros(3)) for _, imu in pairs)
    return replace(recording, imus=streams, rig=replace(recording.rig, imus=imus))


def _moved(stream: ImuStream, arm: Array) -> Array:
    dt = np.diff(stream.time, prepend=2.0 * stream.time[0] - stream.time[1])[:, None]
    rate = stream.dtheta / dt
    acceleration = np.diff(rate, axis=0, prepend=rate[:1]) / (0.5 * (dt + np.vstack([dt[:1], dt[:-1]])))
    moved = np.cross(rate, np.cross(rate, arm)) + np.cross(acceleration, arm)
    return np.asarray(stream.dvel + moved * dt)


def pooled(maxima: Mapping[str, Iterable[Array]]) -> dict[str, float]:
    """Return the rms over all outages of all seeds, m, by method."""
    return {name: rms(np.concatenate([np.ravel(each) for each in values])) for name, values in maxima.items()}
