"""The table of figures on the screen has the columns that the runs have figures for."""

import pytest
from synthetic_solutions import drifting, drive, reference

from polyins.evaluation.summary import comparison, summarize
from polyins.tools.summary_table import print_summaries

TRUTH = drive(duration=60.0)


def summary(method: str) -> dict:
    return summarize(drifting(TRUTH, method, 2, 0.05, (), 1), reference(TRUTH))


def test_a_vehicle_shows_drift_and_an_array_does_not(capsys: pytest.CaptureFixture[str]) -> None:
    of_vehicle, of_array = summary("wheel-ins/imu1"), summary("enav-fusion")
    print_summaries("vehicle", {"wheel-ins/imu1": of_vehicle}, {})
    shown = capsys.readouterr().out
    assert "drift" in shown
    assert f"{of_vehicle['drift']['rate_percent']:.2f}" in shown
    assert "outages" not in shown
    print_summaries("array", {"enav-fusion": of_array}, {})
    assert "drift" not in capsys.readouterr().out


def test_the_yardstick_of_a_vehicle_is_a_single_wheel(capsys: pytest.CaptureFixture[str]) -> None:
    single, triple = summary("wheel-ins"), summary("triple-ins")
    document = comparison({"wheel-ins": single, "triple-ins": triple}, [single, single], "wheel-ins")
    print_summaries("vehicle", document["methods"], document["ratio_to_single"])
    lines = capsys.readouterr().out.splitlines()
    assert any("ratio to" in line for line in lines)
    (row,) = [line for line in lines if line.startswith("│ wheel-ins")]
    assert row.split("│")[-2].strip() == "1"
