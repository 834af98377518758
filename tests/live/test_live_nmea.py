"""NMEA sentences say what the state says, to their last digit."""

from datetime import UTC, datetime
from functools import reduce
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polyins.live import nmea
from polyins.live.snapshot import Snapshot
from polyins.model.attitude import quaternions


def snapshot(
    time: float = 1.7e9, latitude: float = 48.1173, longitude: float = 11.5, dead_reckoning: bool = False
) -> Snapshot:
    values = {
        "time": time,
        "position": np.array([np.radians(latitude), np.radians(longitude), 560.0]),
        "velocity": np.array([3.0, -4.0, 0.0]),
        "attitude": quaternions(np.radians([[1.0, 2.0, 93.456]]))[0],
        "position_std": np.full(3, 0.1),
        "velocity_std": np.full(3, 0.1),
        "phi_covariance": np.zeros(6),
        "status": "tracking",
    }
    return Snapshot(SimpleNamespace(**values), values["position"], True, dead_reckoning)


def fields(sentence: str) -> list[str]:
    assert sentence.startswith("$")
    assert sentence.endswith("\r\n")
    body, check = sentence[1:-2].split("*")
    assert int(check, 16) == reduce(lambda a, b: a ^ ord(b), body, 0)
    assert len(sentence) <= 82
    return body.split(",")


def test_sentences_of_a_known_state():
    at = datetime(2026, 3, 4, 5, 6, 7, 890000, tzinfo=UTC)
    gga, rmc, hdt = map(fields, nmea.sentences(snapshot(at.timestamp()).row, 47.5))
    place = ["4807.038000", "N", "01130.000000", "E"]
    assert gga == ["INGGA", "050607.89", *place, "1", "", "", "512.50", "M", "47.50", "M", "", ""]
    assert rmc == ["INRMC", "050607.89", "A", *place, "9.72", "306.87", "040326", "", "", "A"]
    assert hdt == ["INHDT", "93.46", "T"]


def test_dead_reckoning_shows():
    gga, rmc, _ = map(fields, nmea.sentences(snapshot(dead_reckoning=True).row))
    assert gga[6] == "6"
    assert (rmc[2], rmc[-1]) == ("V", "E")


def test_a_lost_position_shows():
    lost = snapshot().row | {"status": "attitude only"}
    gga, rmc, _ = map(fields, nmea.sentences(lost))
    assert gga[6] == "0"
    assert (rmc[2], rmc[-1]) == ("V", "N")


def test_standard_deviations_are_those_of_north_east_and_up():
    row = snapshot(time=3661.25).row | {"std_north_m": 1.0, "std_east_m": 2.0, "std_down_m": 3.25}
    assert fields(nmea.error_statistics(row)) == ["INGST", "010101.25", "", "", "", "", "1.000", "2.000", "3.250"]


def test_a_height_above_the_sea_needs_no_geoid():
    gga, *_ = map(fields, nmea.sentences(snapshot().row, above_sea=True))
    assert gga[9:13] == ["560.00", "M", "", "M"]


def test_what_is_not_known_is_empty():
    gga, rmc, _ = map(fields, nmea.sentences(snapshot(time=3 * 86400 + 3661.25).row))
    assert gga[1] == "010101.25"
    assert rmc[9] == ""
    assert gga[9:13] == ["", "M", "", "M"]


@given(st.floats(-90.0, 90.0), st.floats(-180.0, 180.0), st.floats(1e9, 4e9))
def test_places_come_back_to_a_millimetre(latitude, longitude, time):
    gga, *_ = map(fields, nmea.sentences(snapshot(time, latitude, longitude).row))
    for text, letter, digits, expected in ((gga[2], gga[3], 2, latitude), (gga[4], gga[5], 3, longitude)):
        assert text[digits + 2] == "."
        degrees, minutes = int(text[:digits]), float(text[digits:])
        assert minutes < 60.0
        back = (degrees + minutes / 60.0) * (-1.0 if letter in "SW" else 1.0)
        assert abs((back - expected + 180.0) % 360.0 - 180.0) < 1e-8
    seconds = int(gga[1][:2]) * 3600 + int(gga[1][2:4]) * 60 + float(gga[1][4:])
    assert abs((seconds - time + 43200.0) % 86400.0 - 43200.0) <= 0.005 + 1e-6


@pytest.mark.parametrize("heading", [-0.001, 359.999, 0.0])
def test_heading_is_below_360(heading):
    one = snapshot()
    one.state.attitude[:] = quaternions(np.radians([[0.0, 0.0, heading]]))[0]
    assert fields(nmea.sentences(one.row)[2])[1] == "0.00"
