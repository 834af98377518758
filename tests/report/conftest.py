"""Runs to report on, made once."""

from pathlib import Path

import pytest
from synthetic_solutions import drifting, drive, recording, reference

from polyins.evaluation.summary import comparison, summarize
from polyins.model.recording import Recording
from polyins.report import Scene, write_report

OUTAGES = ((1030.0, 1060.0), (1120.0, 1150.0), (1210.0, 1240.0))
METHODS = {"single": (1, 0.02), "imu-fusion": (1, 0.01), "nav-fusion": (6, 0.01), "enav-fusion": (6, 0.009)}
HOSTILE = "</script><script>throw 1</script> & <b>round</b>"


@pytest.fixture(scope="session")
def made_runs() -> dict:
    truth = drive(duration=300.0)
    solutions = {
        name: drifting(truth, name, imus, scale, OUTAGES, seed)
        for seed, (name, (imus, scale)) in enumerate(METHODS.items())
    }
    return {name: (made, summarize(made, reference(truth), OUTAGES)) for name, made in solutions.items()}


@pytest.fixture(scope="session")
def made_recording() -> Recording:
    return recording(drive(duration=300.0), 6, OUTAGES, name=HOSTILE, warnings=("one IMU was late",))


@pytest.fixture(scope="session")
def compared(made_runs: dict) -> dict:
    single = made_runs["single"][1]
    return comparison({name: summary for name, (_, summary) in made_runs.items()}, [single, single])


@pytest.fixture(scope="session")
def report(
    made_runs: dict, made_recording: Recording, compared: dict, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(path, Scene.of(made_runs, made_recording, compared), compared)
    return path
