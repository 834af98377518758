"""A receiver whose clock has an offset and a drift, which the log does not say."""

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from polyins.cli import cli
from polyins.config.yaml_document import Document, read_yaml, write_yaml
from polyins.errors import InputError
from polyins.evaluation.summary import summarize
from polyins.model.recording import Recording
from polyins.model.rig import PPM
from polyins.navigate import batch
from polyins.reading.loading import load, load_document

OFFSET_S, DRIFT = -3.7, 257.0 * PPM
"""of GNSS, at its stamp 3.7 s"""


def recording(logs: Path, section: str, **values: Any) -> Recording:
    document = read_yaml(logs / "cases/clock-drift/config.yaml")
    keys = document.values
    (keys["imus"][0] if section == "imus" else keys["gnss"]).update(values)
    return load_document(Document(document.path, keys))


def test_the_clock_is_found(logs: Path) -> None:
    # the truth is on the clock of GNSS
    found = recording(logs, "imus", time_offset="estimate")
    (offset,) = found.clock_offsets
    assert offset.clock.common(0.0) == pytest.approx(-OFFSET_S, abs=0.01)
    assert offset.drift == pytest.approx(1.0 / (1.0 + DRIFT) - 1.0, abs=30.0 * PPM)
    assert offset.std_s < 0.001
    assert offset.drift_std < 6.0 * PPM
    assert offset.leaps == ()
    solution = batch.run(found, "single")
    assert summarize(solution, found.reference)["reference"]["horizontal_rms_m"] <= 0.03
    assert not [one for one in solution.findings if one.kind == "delay"]
    told = next(one for one in solution.findings if one.kind == "clock found")
    assert "std" in told.text
    assert told.stream == "imu1"


def test_gnss_comes_to_the_clock_of_the_imu(logs: Path) -> None:
    (offset,) = recording(logs, "gnss", time_offset="estimate").clock_offsets
    assert offset.clock.common(3.7) == pytest.approx(3.7 + OFFSET_S, abs=0.01)
    assert offset.drift == pytest.approx(DRIFT, abs=30.0 * PPM)


def test_calibrate_writes_the_clock(logs: Path, tmp_path: Path) -> None:
    known = recording(logs, "imus", time_offset="estimate").clock_offsets[0]
    document = read_yaml(logs / "cases/clock-drift/config.yaml")
    document.values["imus"][0]["time_offset"] = "estimate"
    for section in (document.values["imus"][0], document.values["gnss"], document.values["reference"]):
        section["file"] = str(document.path.parent / f"{section['file']}.gz")
    (tmp_path / "drive.yaml").write_text(write_yaml(document.values))
    out = tmp_path / "elsewhere" / "known.yaml"
    result = CliRunner().invoke(cli, ["calibrate", str(tmp_path / "drive.yaml"), "--out", str(out), "--json"])
    assert result.exit_code == 0, result.exception
    told = json.loads(result.stdout)["clock_offsets"]["imu1"]
    assert told["drift_ppm"] == pytest.approx(known.drift / PPM)
    assert told["drift_std_ppm"] < 6.0
    settled = load(out)
    assert settled.clock_offsets == ()
    reference = recording(logs, "imus", time_offset="estimate")
    assert settled.imus[0].time == pytest.approx(reference.imus[0].time, abs=1e-6)


def test_without_the_key_offset_and_drift_are_named(logs: Path) -> None:
    with pytest.raises(
        InputError, match=r"3\.7 s late .* shrinking by 2\d\d ppm .*clock_offset_s: -3\.6[67]\d, clock_drift_ppm: 2\d\d"
    ):
        batch.run(recording(logs, "gnss"), "single")


def test_the_best_constant_offset_is_no_answer_without_a_word(logs: Path) -> None:
    solution = batch.run(recording(logs, "gnss", clock_offset_s=-3.669), "single")
    told = next(one for one in solution.findings if one.kind == "delay")
    assert "growing by 2" in told.text or "shrinking by 2" in told.text
    assert told.severity == "serious"
