"""The outage statistic on made-up errors, and on a published curve whose figure is known."""

import gzip

import numpy as np
import pytest

from polyins.config import OutageSchedule
from polyins.evaluation.errors import Errors
from polyins.evaluation.outages import outage_statistic, partly_covered


def errors_of(time: np.ndarray, north: np.ndarray, east: np.ndarray | float = 0.0) -> Errors:
    position = np.column_stack([north, np.broadcast_to(east, time.shape), np.full_like(time, 99.0)])
    return Errors(time, position, None, None, np.zeros_like(time), np.ones(time.shape, bool))


def test_each_outages_maximum_and_their_rms():
    time = np.arange(0.0, 100.0, 0.5)
    north = np.where((time >= 10.0) & (time <= 20.0), 0.3 * (time - 10.0), 0.0)
    north[np.searchsorted(time, 55.0)] = -4.0
    north[np.searchsorted(time, 80.0)] = 1000.0  # in no outage
    statistic = outage_statistic(errors_of(time, north, 4.0), [(10.0, 20.0), (50.0, 60.0)])
    assert statistic["each_m"] == pytest.approx([5.0, np.sqrt(32.0)])
    assert statistic["horizontal_max_rms_m"] == pytest.approx(np.sqrt((25.0 + 32.0) / 2.0))
    assert statistic["count"] == 2
    assert statistic["length_s"] == 10.0


def test_both_ends_of_an_outage_belong_to_it():
    time = np.arange(0.0, 10.0)
    for peak in (3.0, 6.0):
        north = np.where(time == peak, 7.0, 1.0)
        assert outage_statistic(errors_of(time, north), [(3.0, 6.0)])["each_m"] == [7.0]


def test_an_outage_without_errors_is_unknown_not_zero():
    time = np.arange(0.0, 10.0)
    statistic = outage_statistic(errors_of(time, np.ones(10)), [(2.0, 4.0), (20.0, 23.0)])
    assert statistic["each_m"] == [1.0, None]
    assert statistic["horizontal_max_rms_m"] == 1.0
    assert statistic["length_s"] is None
    assert outage_statistic(None, [(0.0, 1.0)])["each_m"] == [None]
    assert outage_statistic(None, [])["horizontal_max_rms_m"] is None


def test_outages_that_the_errors_cover_in_part_are_named():
    time = np.concatenate([np.arange(0.0, 20.0, 0.1), np.arange(30.0, 50.0, 0.1)])
    errors = errors_of(time, np.ones_like(time))
    assert partly_covered(errors, [(5.0, 10.0), (15.0, 25.0), (31.0, 40.0), (45.0, 60.0)], 0.1) == [
        (15.0, 25.0),
        (45.0, 60.0),
    ]
    assert partly_covered(errors_of(np.zeros(0), np.zeros(0)), [(0.0, 1.0)], 0.1) == [(0.0, 1.0)]


def test_published_curve_of_a_compensated_array_gives_the_published_figure(data_folder):
    file = data_folder / "whu-array" / "array_compensated_outage_errors.txt.gz"
    if not file.is_file():
        pytest.skip(f"no {file}")
    with gzip.open(file, "rt") as lines:
        table = np.loadtxt(lines)
    errors = errors_of(table[:, 0], table[:, 1], table[:, 2])
    schedule = OutageSchedule(length_s=30.0, every_s=90.0, first_after_s=0.0)
    statistic = outage_statistic(errors, schedule.intervals(271130.0, 273690.0))
    assert statistic["count"] == 29
    assert statistic["horizontal_max_rms_m"] == pytest.approx(2.0563, abs=2e-3)
