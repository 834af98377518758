"""A short drive of three IMUs, as a recording, as files and as datagrams."""

from pathlib import Path

import pytest

from polyins.config.yaml_document import read_yaml, write_yaml
from polyins.live import lines
from polyins.live.replay import Replay
from polyins.model.recording import Recording
from polyins.navigate.samples import Sample
from polyins.reading import loading
from polyins.simulation import files
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario


@pytest.fixture(scope="session")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The configuration of a drive of 50 s, 8 of them at rest, with an outage."""
    scenario = Scenario(duration_s=50.0, static_s=8.0, rate_hz=50.0, imus=Board(count=3), outages=((30.0, 36.0),))
    return files.write(simulate(scenario, seed=5), tmp_path_factory.mktemp("drive"))


@pytest.fixture(scope="session")
def recording(drive: Path) -> Recording:
    return loading.load(drive)


@pytest.fixture(scope="session")
def samples(recording: Recording) -> list[Sample]:
    """All samples in the order of their stamps, fixes in the outage withheld."""
    return [sample for chunk in Replay(recording).chunks() for sample in chunk]


@pytest.fixture(scope="session")
def datagrams(samples: list[Sample]) -> list[bytes]:
    return [lines.write(sample).encode() for sample in samples]


@pytest.fixture(scope="session")
def no_files(drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same configuration without the files, for data that come otherwise."""
    values = read_yaml(drive).values
    for key in ("reference", "outages"):
        values.pop(key)
    for entry in (*values["imus"], values["gnss"]):
        entry.pop("file")
    path = tmp_path_factory.mktemp("no-files") / "live.yaml"
    path.write_text(write_yaml(values))
    return path
