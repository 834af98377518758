"""What `check` says of made inputs, by the right answers beside them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from polyins.config.yaml_document import read_yaml, write_yaml
from polyins.model.findings import Finding
from polyins.reading.loading import load
from polyins.tools.check import Checked, check, write_fixed


def kinds(checked: Checked, *severities: str) -> list[str]:
    return [one.kind for one in checked.findings if one.severity in (severities or ("doubt", "serious"))]


def only(checked: Checked, kind: str) -> Finding:
    (found,) = (one for one in checked.findings if one.kind == kind)
    return found


@pytest.mark.parametrize("case", ["common", "start-rtk-end", "start-traffic-light", "two-grades", "gap-37"])
def test_nothing_is_said_of_good_drives(case: str, cases: Path) -> None:
    checked = check([cases / case / "config.yaml"])
    assert not checked.refused
    assert kinds(checked) == []
    assert checked.settings == []


def test_a_fast_turn_is_not_refused(cases: Path, expected: dict[str, Any]) -> None:
    wanted = expected["saturated-turn"]
    checked = check([cases / "saturated-turn" / "config.yaml"])
    saturated = only(checked, "saturation")
    assert (saturated.size, saturated.severity) == (wanted["saturated_rows"], "note")
    assert not {"units", "axes", "wrap"} & set(kinds(checked))
    told = [one.text for one in checked.findings if one.kind == "start"]
    assert all("heading" in text for text in told), told


def test_the_end_of_a_range_is_found_from_the_data_alone(cases: Path, expected: dict[str, Any]) -> None:
    checked = check([cases / "saturated-turn" / "imu.csv"])
    assert checked.document is not None
    entry = checked.document.values["imus"][0]
    assert entry["gyro_range_deg_s"] == pytest.approx(expected["saturated-turn"]["full_scale_deg_s"], abs=0.5)
    assert entry["axes"][2].endswith("z")


def test_raw_counts_are_doubted_and_not_refused(cases: Path) -> None:
    checked = check([cases / "raw-counts" / "imu.csv"])
    assert not checked.refused
    assert "raw counts" in only(checked, "units").text
    assert only(checked, "units").severity == "doubt"


@pytest.mark.parametrize("case", ["wide", "interleaved"])
def test_two_imus_of_one_table(case: str, cases: Path, expected: dict[str, Any]) -> None:
    checked = check([cases / case / "imus.csv"])
    assert not checked.refused
    assert checked.document is not None
    assert len(checked.document.values["imus"]) == expected[case]["imus"]
    assert not {"units", "axes", "twice", "delay"} & set(kinds(checked))


@pytest.mark.parametrize("name", ["mt.txt", "dot.csv"])
def test_logs_of_xsens(name: str, cases: Path) -> None:
    checked = check([cases / "xsens-mt" / name])
    assert not checked.refused
    assert not {"units", "sampling", "axes"} & set(kinds(checked))


@pytest.mark.parametrize("name", ["config.yaml", "copy.yaml"])
def test_the_same_imu_twice(name: str, cases: Path, tmp_path: Path) -> None:
    checked = check([cases / "same-imu-twice" / name])
    assert checked.refused
    text = only(checked, "twice").text
    assert "imu1" in text
    assert "imu2" in text
    assert "identical" in text
    write_fixed(checked, tmp_path / "fixed.yaml")
    again = check([tmp_path / "fixed.yaml"])
    assert not again.refused
    assert "twice" not in kinds(again)
    assert len(load(tmp_path / "fixed.yaml").imus) == 1


def test_a_pause_is_noted_with_its_length(cases: Path, expected: dict[str, Any]) -> None:
    wanted = expected["pause-628"]["pause"]
    checked = check([cases / "pause-628" / "config.yaml"])
    pause = only(checked, "pause")
    assert pause.from_s == pytest.approx(wanted["from_s"], abs=0.05)
    assert pause.size == pytest.approx(wanted["length_s"], abs=0.01)
    assert kinds(checked) == []


def test_heights_that_may_be_above_the_sea(cases: Path, tmp_path: Path) -> None:
    folder = cases / "sea-level"
    doubted = check([folder / "imu.csv", folder / "gnss.csv"])
    assert only(doubted, "height datum").axis == "height"
    told = check([folder / "imu.csv", folder / "gnss-separation.csv"])
    assert "height datum" not in [one.kind for one in told.findings]
    # beside a reference above the ellipsoid the geoid is found
    assert doubted.document is not None
    values = doubted.document.values
    values["gnss"]["height"] = "ellipsoidal"
    values["reference"] = {"file": str(folder / "truth.csv")}
    path = tmp_path / "with-reference.yaml"
    path.write_text(write_yaml(values))
    found = check([path])
    assert only(found, "height datum").size == pytest.approx(46.3, abs=0.1)
    write_fixed(found, tmp_path / "fixed.yaml")
    assert read_yaml(tmp_path / "fixed.yaml").values["gnss"]["geoid_height_m"] == pytest.approx(46.3, abs=0.1)


def test_a_clock_that_is_off_is_named(cases: Path, expected: dict[str, Any]) -> None:
    """The offset as well as one for a clock that drifts can be."""
    wanted = expected["clock-drift"]["offset_s"]["at_the_start"]
    late = only(check([cases / "clock-drift" / "config.yaml"]), "delay")
    assert late.severity in ("doubt", "serious")
    assert late.size == pytest.approx(wanted, abs=0.07)


@pytest.mark.parametrize("name", ["log.bin", "ulog.bin", "rosbag.bin"])
def test_unknown_bytes_are_refused(name: str, cases: Path) -> None:
    checked = check([cases / "unknown-binary" / name])
    assert checked.refused
    assert kinds(checked) == ["refused"]
