"""Every recording of the quadrotor, against what a first study of these data reached."""

from pathlib import Path

import pytest

from polyins.studies import flights

FIRST_STUDY = {"outage_5s": (0.60, 0.53), "outage_10s": (2.16, 1.86)}
"""rms of the outage maxima, m, single and array: README of the data set"""

OF_SESSIONS = {
    "H 12:49": {"outage_5s": (0.66, 0.55), "outage_10s": (2.34, 1.89)},
    "H 13:52": {"outage_5s": (0.49, 0.45), "outage_10s": (1.85, 1.71)},
}
"""its rows of a single session; the recording RAW_1111, of nine outages, hangs on the draw of the noise by 12 %"""


@pytest.mark.long
def test_the_flights_reach_the_first_study(data_folder: Path) -> None:
    document = flights.reproduce()["polyins"]
    for length, (single, fused) in FIRST_STUDY.items():
        table = document[length]
        assert table["single"] <= 1.05 * single
        assert table["nav-fusion"] <= 1.05 * fused
        assert table["enav-fusion"] == pytest.approx(table["nav-fusion"], rel=0.01)
        assert table["imu-fusion"] < table["single"]
    for session, rows in OF_SESSIONS.items():
        for length, (single, fused) in rows.items():
            table = document["by_session"][session][length]
            assert table["single"] <= 1.05 * single
            assert table["enav-fusion"] <= 1.05 * fused
    assert document["outage_5s"]["count"] >= 200
    by_imus = [document["by_imus"][count] for count in "1234"]
    assert by_imus == sorted(by_imus, reverse=True)
    assert by_imus[3] < by_imus[0]
