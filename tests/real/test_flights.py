"""Real flights of four IMUs through GNSS outages; the whole table is `polyins reproduce flights`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.studies import flights
from polyins.studies.flights import Outage, Row

CHOSEN = ("Horizontal/path_5", "Horizontal/path_22", "Vertical/path_8")
"""one of three sessions each"""


@pytest.fixture(scope="module")
def folder(data_folder: Path) -> Path:
    folder = data_folder / "quadrotor"
    if not folder.is_dir():
        pytest.skip(f"no data set: {folder}")
    return folder


@pytest.fixture(scope="module")
def recordings(folder: Path) -> list[tuple[Row, Recording]]:
    rows = {row["flight"]: row for row in flights.list_flights(folder)}
    return [(rows[name], flights.flight(folder, rows[name])) for name in CHOSEN]


@pytest.fixture(scope="module")
def outages(recordings: list[tuple[Row, Recording]]) -> list[Outage]:
    return [outage for row, recording in recordings for outage in flights.fly(recording.as_published(), row)]


def rms(outages: list[Outage], method: str, length: int = 10) -> float:
    maxima = [value for outage in outages if length in outage.maxima for value in outage.maxima[length][method]]
    assert len(maxima) >= 10
    return float(np.sqrt(np.mean(np.square(maxima))))


def test_nothing_diverges_in_ten_seconds_without_gnss(outages: list[Outage]) -> None:
    maxima = {
        (outage.flight, method): max(values)
        for outage in outages
        for methods in outage.maxima.values()
        for method, values in methods.items()
    }
    assert {flight for flight, _ in maxima} == set(CHOSEN)
    assert all(np.isfinite(value) for value in maxima.values())
    assert max(maxima.values()) < 10.0


@pytest.mark.parametrize("length", [5, 10])
def test_nav_fusion_and_enav_fusion_agree_within_one_percent(outages: list[Outage], length: int) -> None:
    assert rms(outages, "nav-fusion", length) == pytest.approx(rms(outages, "enav-fusion", length), rel=0.01)


@pytest.mark.parametrize("length", [5, 10])
def test_four_imus_are_better_than_one(outages: list[Outage], length: int) -> None:
    single = rms(outages, "single", length)
    for method in flights.METHODS:
        assert rms(outages, method, length) < single
    # the gain is limited by the errors that all four have in common
    assert single < 2.0 * rms(outages, "enav-fusion", length)


def test_each_further_imu_helps(outages: list[Outage]) -> None:
    by_count = [rms(outages, f"imus-{count}") for count in (1, 2, 3, 4)]
    assert by_count == sorted(by_count, reverse=True)


@pytest.mark.parametrize("method", ["single", "imu-fusion", "nav-fusion", "enav-fusion"])
def test_with_gnss_a_whole_flight_stays_within_its_noise(recordings: list[tuple[Row, Recording]], method: str) -> None:
    for _, recording in recordings:
        solution = batch.run(replace(recording, outages=()), method)
        for name in ("position", "velocity", "attitude", "position_variance", "velocity_variance", "imu_errors"):
            assert np.isfinite(getattr(solution, name)).all()
        assert solution.innovations.accepted.all()
        assert np.sqrt((solution.innovations.residual[:, :2] ** 2).sum(axis=1).mean()) < 0.5
