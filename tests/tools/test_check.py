import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from turning_board import board

from polyins import cli
from polyins.config.yaml_document import read_yaml
from polyins.errors import InputError
from polyins.reading.loading import load
from polyins.studies.data_faults.bundle import GYRO


def said(*arguments: Any) -> tuple[int, dict[str, Any]]:
    done = CliRunner().invoke(cli.cli, ["check", *map(str, arguments), "--json"])
    return done.exit_code, json.loads(done.stdout)


def test_good_data_pass(tmp_path: Path) -> None:
    code, document = said(board(2).write(tmp_path))
    assert code == 0
    assert {one["severity"] for one in document["findings"]} <= {"note"}
    assert document["settings"] == []


def test_what_a_run_refuses_is_a_finding_and_is_put_right(tmp_path: Path) -> None:
    """In deg/s and upside down, which is told only when the unit is right."""
    bundle = board().changed(("imus", 0, "axes"), ["x", "-y", "-z"])
    spoiled = bundle.with_imu(0, **{name: 1500.0 * bundle.imus[0][name] for name in GYRO})
    spoiled = spoiled.changed(("imus", 0, "columns", "gyro", "scale"), [57.29578 / 1500.0] * 3)
    path, fixed = spoiled.write(tmp_path), tmp_path / "fixed.yaml"
    with pytest.raises(InputError):
        load(path)
    code, document = said(path, "--fix", fixed)
    assert code == 2
    assert document["refused"] is True
    assert [one["kind"] for one in document["findings"] if one["severity"] == "serious"] == ["units", "axes"]
    assert said(fixed)[0] == 0
    assert load(fixed).imus


def test_comments_stay_and_the_fixed_configuration_passes(tmp_path: Path) -> None:
    path = board(3).changed(("imus", 1, "axes"), ["x", "-y", "-z"]).write(tmp_path / "data")
    path.write_text("# a comment that stays\n" + path.read_text())
    fixed = tmp_path / "elsewhere.yaml"
    code, document = said(path, "--fix", fixed)
    assert code == 0
    assert [one["kind"] for one in document["findings"] if one["severity"] == "serious"] == ["axes"]
    assert fixed.read_text().startswith("# a comment that stays")
    assert read_yaml(fixed).values["imus"][1]["axes"][2] == "z"
    code, document = said(fixed)
    assert code == 0
    assert "axes" not in {one["kind"] for one in document["findings"]}
    assert CliRunner().invoke(cli.cli, ["check", str(path), "--fix", str(fixed)]).exit_code == 1


def test_a_judgement_can_be_overruled(tmp_path: Path) -> None:
    path = board().changed(("imus", 0, "axes"), ["x", "-y", "-z"]).write(tmp_path)
    assert said(path)[0] == 2
    text = path.read_text()
    path.write_text(text + "checks: {accept: [axes]}\n")
    code, document = said(path)
    assert code == 0
    assert {one["severity"] for one in document["findings"] if one["kind"] == "axes"} <= {"note"}
    assert load(path).imus


def test_what_cannot_be_read_is_a_finding_too(tmp_path: Path) -> None:
    path = tmp_path / "no.yaml"
    path.write_text("imus: [{file: missing.csv}]\n")
    code, document = said(path)
    assert code == 2
    assert [one["kind"] for one in document["findings"]] == ["refused"]
