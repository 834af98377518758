"""What a live run says of itself at its end: what a run over the same recording says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from driven_vehicle import drive as driven

from polyins import cli
from polyins.evaluation.figures import Figures
from polyins.evaluation.verdict import verdict
from polyins.formats.solution_files import read_solution
from polyins.live.run import Options, run
from polyins.model.recording import GnssStream, Recording
from polyins.navigate import batch
from polyins.reading import loading
from polyins.simulation import files


def paused(recording: Recording, begin: float, end: float) -> Recording:
    streams = []
    for stream in recording.imus:
        kept = (stream.time <= begin) | (stream.time >= end)
        streams.append(replace(stream, time=stream.time[kept], dtheta=stream.dtheta[kept], dvel=stream.dvel[kept]))
    return replace(recording, imus=tuple(streams))


def judged(recording: Recording) -> dict[str, Any]:
    solution = batch.run(recording, "enav-fusion")
    figures = Figures(None, recording.outages, recording.geodetic)
    figures.add(solution)
    return verdict(solution, figures).document()


def by_text(document: dict[str, Any]) -> list[dict[str, Any]]:
    return sorted(document["findings"], key=lambda finding: str(finding["text"]))


def too_sure(recording: Recording) -> Recording:
    """Fixes of a receiver that drifts by metres and claims a millimetre."""
    gnss = recording.gnss
    assert gnss is not None
    drift = np.column_stack([3.0 * np.sin(gnss.time / 3.0) / 6.4e6, np.zeros((len(gnss.time), 2))])
    return replace(recording, gnss=GnssStream(gnss.time, gnss.position + drift, np.full((len(gnss.time), 3), 1e-3)))


@pytest.mark.parametrize(
    ("changed", "kind"),
    [
        (lambda one: one, "coverage"),
        (lambda one: paused(one, 20.0, 20.7), "gap"),
        (lambda one: paused(one, 20.0, 24.0), "restart"),
        (too_sure, "innovations"),
    ],
)
def test_it_is_that_of_a_run(recording: Recording, changed: Any, kind: str, tmp_path: Path) -> None:
    path = files.write(changed(recording), tmp_path / "drive")
    said = run(Options(path, tmp_path / "out", sinks=(), speed=float("inf"), rate_hz=50.0))
    expected = judged(loading.load(path))
    assert said["verdict"]["level"] == expected["level"]
    assert kind in {finding["kind"] for finding in expected["findings"]}
    for live, batched in zip(by_text(said["verdict"]), by_text(expected), strict=True):
        assert live == batched
    assert said["coverage"]["of_recording"] == pytest.approx(1.0, abs=0.2)
    log, whole = read_solution(tmp_path / "out"), batch.run(loading.load(path), "enav-fusion")
    # of the epochs that come together when a pause is over the last one is told
    told = np.searchsorted(whole.time, log.time)
    assert len(told) > len(whole.time) - 10
    np.testing.assert_array_equal(log.time, whole.time[told])
    assert log.status is not None
    assert whole.status is not None
    np.testing.assert_array_equal(log.status, whole.status[told])


@pytest.mark.parametrize("command", [("run", "--no-report"), ("live", "--speed", "max", "--sink", "ndjson:?rate=1")])
def test_what_is_not_to_be_used_ends_with_three(command: tuple[str, ...], tmp_path: Path) -> None:
    """Dead reckoning, and a pause in which the vehicle may have turned anywhere."""
    path = files.write(paused(driven(), 40.0, 50.0), tmp_path / "drive")
    done = CliRunner().invoke(cli.cli, [command[0], str(path), *command[1:], "--out", str(tmp_path / "out")])
    assert done.exit_code == 3, done.output
    assert "the state was found anew" in done.stderr
