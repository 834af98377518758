"""Checks of a receiver: clock, whole seconds, noise, heights, lever arm, on a simulated drive."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from turning_board import evidence_of

from polyins.checks import clocks, fix_scatter, heights, trial
from polyins.config.yaml_document import read_yaml
from polyins.simulation.files import write
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario
from polyins.studies.data_faults.bundle import Bundle, bundle_of, moved

ARM = [0.4, -0.2, -0.9]


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    scenario = Scenario(duration_s=130.0, static_s=10.0, rate_hz=25.0, imus=Board(count=1), outages=())
    config = write(simulate(scenario, seed=2), tmp_path_factory.mktemp("drive"))
    return bundle_of("drive", read_yaml(config), 130.0)


def late(bundle: Bundle, by: float) -> Bundle:
    assert bundle.gnss is not None
    return replace(bundle, gnss={**bundle.gnss, "t": bundle.gnss["t"] + by})


def test_a_good_receiver_is_not_doubted(drive: Bundle, tmp_path: Path) -> None:
    evidence = evidence_of(drive, tmp_path)
    found = [one for find in (clocks.find, fix_scatter.find, heights.find, trial.find) for one in find(evidence)]
    assert [one.finding.text for one in found if one.finding.severity != "note"] == []


@pytest.mark.parametrize("by", [0.7, -1.5])
def test_late_fixes_are_named_with_the_offset(by: float, drive: Bundle, tmp_path: Path) -> None:
    evidence = evidence_of(late(drive, by), tmp_path)
    found = [one for find in (clocks.find, trial.find) for one in find(evidence) if one.finding.kind == "delay"]
    (setting,) = found[0].settings
    assert setting.key == "gnss.clock_offset_s"
    assert setting.value == pytest.approx(-by, abs=0.1)


@pytest.mark.parametrize("by", [18.0, -37.0])
def test_whole_seconds_between_clocks_are_named(by: float, drive: Bundle, tmp_path: Path) -> None:
    told = [one for one in clocks.find(evidence_of(late(drive, by), tmp_path)) if one.settings]
    assert [(one.finding.kind, one.finding.size) for one in told] == [("leap seconds", by)]
    assert told[0].settings[0].value == -by


def test_another_place_of_the_antenna_is_named(drive: Bundle, tmp_path: Path) -> None:
    true = np.array(drive.values["gnss"].get("antenna_position_m", [0.0, 0.0, 0.0]))
    said = [float(value) for value in true + np.array([1.2, -0.9, 0.0])]
    (told,) = trial.find(evidence_of(drive.changed(("gnss", "antenna_position_m"), said), tmp_path))
    assert told.finding.kind == "lever arm"
    assert np.hypot(*(np.array(told.settings[0].value) - true)[:2]) < 0.15


def test_heights_from_another_surface(drive: Bundle, tmp_path: Path) -> None:
    assert drive.gnss is not None
    lower = moved(drive, np.tile([0.0, 0.0, -46.3], (len(drive.gnss["t"]), 1)))
    (told,) = heights.find(evidence_of(lower, tmp_path))
    assert told.finding.size == pytest.approx(46.3, abs=0.1)
    assert told.settings[1].value == pytest.approx(46.3, abs=0.1)


def test_fixes_that_scatter_about_their_velocities(drive: Bundle, tmp_path: Path) -> None:
    """Five a second, with the truth for their velocities."""
    assert drive.reference is not None
    rng, table = np.random.default_rng(3), drive.reference
    rows = np.arange(0, len(table["t"]), max(1, round(0.2 / float(np.median(np.diff(table["t"]))))))
    fixes = {name: table[name][rows] for name in ("t", "lat", "lon", "h", "vn", "ve", "vd")}
    for name, std in (("sn", 0.02), ("se", 0.02), ("sd", 0.04), ("svn", 0.02), ("sve", 0.02), ("svd", 0.02)):
        fixes[name] = np.full(len(rows), std)
    columns = {
        **drive.values["gnss"]["columns"],
        "velocity": {"names": ["vn", "ve", "vd"]},
        "velocity_std": {"names": ["svn", "sve", "svd"]},
    }
    good = replace(drive.changed(("gnss", "columns"), columns), gnss=fixes)
    noise = 10.0 * rng.normal(size=(len(rows), 3)) * [0.02, 0.02, 0.04]
    assert list(fix_scatter.find(evidence_of(moved(good, 0.1 * noise), tmp_path / "good"))) == []
    (told,) = fix_scatter.find(evidence_of(moved(good, noise), tmp_path / "noisy"))
    assert np.array(told.settings[0].value) == pytest.approx([0.2, 0.2, 0.4], rel=0.3)
