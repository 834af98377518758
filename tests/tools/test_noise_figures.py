"""`polyins allan`, from files to its page."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from polyins.cli import cli
from polyins.config import Noise
from polyins.config.yaml_document import read_yaml
from polyins.errors import InputError

RATE = 50.0
WHITE = np.repeat([np.radians(0.01), 0.004], 3)
"""density, rad/s and m/s^2, per sqrt(Hz)"""


def write(path: Path, seconds: float, seed: int, *, moving: tuple[float, float] = (0.0, 0.0)) -> Path:
    count = round(seconds * RATE)
    time = np.arange(1, count + 1) / RATE
    rates = np.random.default_rng(seed).standard_normal((count, 6)) * WHITE * np.sqrt(RATE) + [0, 0, 0, 0, 0, 9.81]
    swing = np.where((time > moving[0]) & (time < moving[1]), np.sin(9.0 * time), 0.0)[:, None]
    rows = np.column_stack([time, rates + swing * [0.5, 0.4, 0.2, 2.0, 2.0, 2.0]])
    np.savetxt(path, rows, "%.9g", ",", header="time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z", comments="")
    return path


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(cli, ["allan", *map(str, words)])


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("resting")
    return [write(folder / f"{name}.csv", 120.0, seed) for seed, name in enumerate("abcd")]


def test_one_file(files: list[Path]) -> None:
    done = run(files[0], "--json")
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    (imu,) = found["imus"].values()
    assert imu["rate_hz"] == pytest.approx(RATE, rel=1e-6)
    assert imu["rest_s"] == pytest.approx(120.0, abs=2.0)
    for axis in "xyz":
        walk = imu["gyro"][axis]["datasheet"]["angle_random_walk_deg_sqrt_h"]
        assert walk["value"] == pytest.approx(0.6, rel=0.03)
        assert imu["accel"][axis]["velocity_random_walk_m_s_sqrt_s"]["value"] == pytest.approx(0.004, rel=0.03)
    assert found["array"] is None


def test_several_files_are_an_array(files: list[Path], tmp_path: Path) -> None:
    done = run(*files, "--json", "--out", tmp_path / "noise")
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert json.loads((tmp_path / "noise" / "allan.json").read_text()) == found
    assert len(found["imus"]) == 4
    assert found["array"]["sqrt_n"] == 2.0
    for sensor in ("gyro", "accel"):
        gain = found["array"][sensor]
        assert gain["low"] < gain["gain"] < gain["high"]
        assert gain["gain"] == pytest.approx(2.0, abs=0.25)
    page = (tmp_path / "noise" / "allan.html").read_text()
    assert all(f'Plotly.newPlot("plot-{name}"' in page for name in ("allan", "gain"))
    assert "src=" not in page.partition("</style>")[0]
    (tmp_path / "noise.yaml").write_text((tmp_path / "noise" / "noise.yaml").read_text())
    entries = read_yaml(tmp_path / "noise.yaml").values["imus"]
    assert [entry["name"] for entry in entries] == list(found["imus"])
    for entry in entries:
        noise = Noise.model_validate(entry["noise"])
        assert noise.angle_random_walk_deg_sqrt_h[0] == pytest.approx(0.6, rel=0.1)


def test_a_reader_sees_figures_findings_and_lines_to_paste(files: list[Path]) -> None:
    done = run(*files[:2])
    assert done.exit_code == 0
    assert "0.6" in done.stdout
    assert "angle_random_walk_deg_sqrt_h: 0.6" in done.stdout
    assert "the mean of 2 gyros has less noise than one of them" in done.stderr
    assert "do not tell the bias instability" in done.stderr


def test_motion_is_left_out_and_said(tmp_path: Path) -> None:
    done = run(write(tmp_path / "moved.csv", 120.0, 9, moving=(50.0, 60.0)), "--json")
    found = json.loads(done.stdout)
    (imu,) = found["imus"].values()
    assert len(imu["stretches_s"]) == 2
    assert imu["gyro"]["x"]["datasheet"]["angle_random_walk_deg_sqrt_h"]["value"] == pytest.approx(0.6, rel=0.03)
    assert any(one["kind"] == "left out" for one in found["findings"])


def test_one_that_never_rests_is_named_beside_the_others(files: list[Path], tmp_path: Path) -> None:
    never = write(tmp_path / "shaken.csv", 120.0, 10, moving=(0.0, 120.0))
    found = json.loads(run(files[0], files[1], never, "--json").stdout)
    assert len(found["imus"]) == 2
    assert found["array"]["imus"] == 2
    (serious,) = [one for one in found["findings"] if one["severity"] == "serious"]
    assert "never rests for 10 s" in serious["text"]


def test_nothing_at_rest_is_refused(tmp_path: Path) -> None:
    done = run(write(tmp_path / "shaken.csv", 60.0, 11, moving=(0.0, 60.0)), "--json")
    assert isinstance(done.exception, InputError)
    assert "expected it left alone" in str(done.exception)
    assert done.stdout == ""


def test_ones_that_rest_at_different_times_are_no_array(files: list[Path], tmp_path: Path) -> None:
    late = write(tmp_path / "late.csv", 120.0, 12)
    rows = np.loadtxt(late, delimiter=",", skiprows=1)
    rows[:, 0] += 5000.0
    np.savetxt(late, rows, "%.9g", ",", header="time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z", comments="")
    found = json.loads(run(files[0], late, "--json").stdout)
    assert found["array"] is None
    assert len(found["imus"]) == 2
    assert any("what the array gains is not told" in one["text"] for one in found["findings"])


def test_clocks_that_rest_does_not_tell_are_taken_as_they_are(files: list[Path], tmp_path: Path) -> None:
    config = tmp_path / "drive.yaml"
    columns = "{time: {name: time}, gyro: {names: [gyro_x, gyro_y, gyro_z], unit: rad/s}, "
    columns += "accel: {names: [acc_x, acc_y, acc_z], unit: m/s^2}}"
    entries = [f"  - {{file: {file}, columns: {columns}, axes: [x, -y, -z]{more}}}" for file, more in
               ((files[0], ""), (files[1], ", time_offset: estimate"))]  # fmt: skip
    config.write_text("\n".join(["imus:", *entries]) + "\n")
    done = run(config, "--json")
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert len(found["imus"]) == 2
    assert any(one["kind"] == "clock" and "taken as they are" in one["text"] for one in found["findings"])


def test_nothing_is_said_twice(files: list[Path]) -> None:
    said = [line for line in run(files[0]).stderr.splitlines() if line]
    assert any(line.startswith("assumed axes") for line in said)
    assert len(said) == len(set(said))


def test_a_refusal_says_that_the_unit_is_a_guess(files: list[Path], tmp_path: Path) -> None:
    """Of a table in deg/s that may be rad/s as well."""
    rows = np.loadtxt(files[0], delimiter=",", skiprows=1)
    rows[:, 1:4] = np.degrees(rows[:, 1:4]) + np.array([0.5, -0.3, 0.2])
    path = tmp_path / "degrees.csv"
    np.savetxt(path, rows, "%.9g", ",", header="time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z", comments="")
    done = run(path)
    assert isinstance(done.exception, InputError)
    assert "never rests" in str(done.exception)
    assert "rad or deg is a guess" in str(done.exception)
