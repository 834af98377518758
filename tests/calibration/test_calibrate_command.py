"""`polyins calibrate` and `time_offset: estimate`, from files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from pymap3d import ned2geodetic
from simulated_drive import body_stream, drive, fixes, wheel_stream

from polyins.calibration.configuration import calibrated
from polyins.calibration.estimates import Calibration, Estimate
from polyins.cli import cli
from polyins.config import parse
from polyins.config.yaml_document import Document, read_yaml, write_yaml
from polyins.errors import InputError
from polyins.reading.loading import load
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.files import write as write_files
from polyins.studies.calibration import by_hand
from polyins.studies.chips import draw_chips

RADIUS = 0.29
PLACE = np.array([0.0, 0.006, -0.05])
LATE = {"right": 0.0, "left": 132.7, "body": -40.0, "GNSS": 3.3}
"""what the clocks show less what they should"""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Rows of three IMUs, whose wheels' x points to the left, and of GNSS; each on a clock of its own."""
    folder, trip = tmp_path_factory.mktemp("drive"), drive(seconds=80.0)
    left_pointing, bias = np.diag([-1.0, 1.0, -1.0]), np.radians([1.0, -2.0, 0.5])
    streams = [
        wheel_stream(trip, "right", 0.7, RADIUS, PLACE, left_pointing, bias),
        wheel_stream(trip, "left", -0.7, RADIUS, PLACE, left_pointing, bias),
        body_stream(trip, "body", np.eye(3)),
    ]
    for stream in streams:
        rows = np.column_stack([stream.time + LATE[stream.name], stream.dtheta, stream.dvel])
        np.savetxt(folder / f"{stream.name}.txt", rows, "%.10g")
    gnss = fixes(trip, 0.2)
    place = ned2geodetic(*(gnss.position * [1.0, 1.0, -1.0]).T, 48.0, 11.0, 500.0)
    rows = np.column_stack([gnss.time + LATE["GNSS"], *place, gnss.position_std])
    np.savetxt(folder / "gnss.txt", rows, "%.12g")
    return folder


def settings(marked: set[str]) -> dict[str, Any]:
    """A configuration in which the clocks not `marked` are known and those marked are to be estimated."""

    def clock(name: str) -> dict[str, Any]:
        return {"time_offset": "estimate"} if name in marked else {"clock_offset_s": -LATE[name]}

    wheels = [
        {
            "name": name,
            "file": f"{name}.txt",
            "wheel": {"radius_m": 0.3, "spin_axis": "x"},
            "position_m": [0.0, right, 0.0],
            **clock(name),
        }
        for name, right in (("right", 0.7), ("left", -0.7))
    ]
    body = {"name": "body", "file": "body.txt", "mount_deg": [0.0, 4.0, 0.0], **clock("body")}
    gnss = {"file": "gnss.txt", "antenna_position_m": [0.0, 0.2, 0.0], **clock("GNSS")}
    return {"imus": [*wheels, body], "gnss": gnss}


def write(files: Path, name: str, values: dict[str, Any]) -> Path:
    path = files / name
    path.write_text(write_yaml(values))
    return path


def command(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["calibrate", *map(str, arguments)])


def reported(result: Result) -> dict[str, Any]:
    assert result.exit_code == 0, result.exception
    return json.loads(result.stdout)


def test_writes_a_configuration_that_loads_with_what_was_estimated(files: Path) -> None:
    config = write(files, "drive.yaml", settings({"left", "body", "GNSS"}))
    before = config.read_bytes()
    document = reported(command(config, "--json"))
    assert config.read_bytes() == before
    assert document["imus"]["right"]["wheel.radius_m"]["value"] == pytest.approx(RADIUS, rel=1e-3)
    assert document["imus"]["right"]["wheel.spin_axis"] == {"value": "-x", "std": None, "configured": "x"}
    assert document["imus"]["body"]["mount_deg"]["value"][1] == pytest.approx(0.0, abs=0.2)
    assert document["clock_offsets"]["left"]["offset_s"] == pytest.approx(-LATE["left"], abs=5e-3)

    recording = load(files / "drive-calibrated.yaml")  # with all the checks that wheels turn as declared
    right, _, body = recording.rig.imus
    assert right.wheel is not None
    assert right.wheel.radius == pytest.approx(RADIUS, rel=1e-3)
    assert np.linalg.norm(right.wheel.lever_arm) == pytest.approx(np.linalg.norm(PLACE), abs=1e-3)
    assert body.rotation == pytest.approx(np.eye(3), abs=np.radians(0.3))
    assert recording.clock_offsets == ()
    again = reported(command(files / "drive-calibrated.yaml", "--json"))
    for name in ("right", "left"):
        found = again["imus"][name]["wheel.lever_arm_m"]
        assert found["value"] == pytest.approx(found["configured"], abs=1e-4)
    assert again["warnings"] == []


def test_known_clocks_and_estimated_ones_give_the_same_streams(files: Path) -> None:
    known = load(write(files, "known.yaml", reversed_axes(settings(set()))))
    for marked in ({"left"}, {"right", "left"}, {"GNSS"}, {"right", "left", "body"}):
        found = load(write(files, "found.yaml", reversed_axes(settings(marked))))
        assert {one.name for one in found.clock_offsets} == marked
        for one, other in zip(found.imus, known.imus, strict=True):
            assert one.time[0] == pytest.approx(other.time[0], abs=8e-3)
        assert found.gnss is not None
        assert known.gnss is not None
        assert found.gnss.time[-1] == pytest.approx(known.gnss.time[-1], abs=8e-3)
        assert sum("estimated from the motion" in text for text in found.sentences) == len(marked)


def reversed_axes(values: dict[str, Any]) -> dict[str, Any]:
    for imu in values["imus"][:2]:
        imu["wheel"]["spin_axis"] = "-x"
    return values


def test_every_clock_estimated_is_an_error(files: Path) -> None:
    config = write(files, "all.yaml", settings(set(LATE)))
    with pytest.raises(InputError, match="expected one without"):
        load(config)


def test_out_in_another_folder_finds_the_data(files: Path, tmp_path: Path) -> None:
    config = write(files, "drive.yaml", settings(set()))
    target = tmp_path / "new" / "mine.yaml"
    result = command(config, "--out", target)
    assert result.exit_code == 0, result.exception
    assert "wheel.radius_m" in result.stdout
    assert load(target).rig.imus[0].wheel is not None
    assert read_yaml(target).values["imus"][0]["file"] == str(files / "right.txt")


def test_defaults_for_all_imus_are_overridden(files: Path) -> None:
    values = settings({"left", "body", "right"})
    for imu in values["imus"]:
        del imu["time_offset"]
    values["imu_defaults"] = {"time_offset": "estimate"}
    result = command(write(files, "defaults.yaml", values), "--out", files / "settled.yaml")
    assert result.exit_code == 0, result.exception
    settled = load(files / "settled.yaml")
    assert settled.clock_offsets == ()
    assert settled.imus[1].time[0] == pytest.approx(0.01, abs=8e-3)


def test_a_recording_without_wheels_is_refused(files: Path) -> None:
    values = settings(set())
    values["imus"] = values["imus"][2:]
    result = command(write(files, "body.yaml", values))
    assert isinstance(result.exception, InputError)
    assert not (files / "body-calibrated.yaml").exists()


def test_an_array_that_was_turned_by_hand(tmp_path: Path) -> None:
    """What is written is what the recording is corrected by when it is read again: nothing is left to calibrate."""
    chips = draw_chips(3, np.random.default_rng(5))
    simulation = by_hand(5, SensorErrors(scales=False, chips=chips), count=3)
    values = read_yaml(write_files(simulation.recording, tmp_path)).values
    del values["reference"], values["outages"]
    values["filter"] = {"gravity_m_s2": simulation.recording.options.gravity}
    config = write(tmp_path, "hand.yaml", values)
    first = reported(command(config, "--json"))
    assert first["forward_from"] is None
    assert first["poses"] == 26
    written = read_yaml(tmp_path / "hand-calibrated.yaml").values["imus"][0]
    assert np.shape(written["gyro_matrix"]) == (3, 3)
    assert set(written["initial_std"]) == {"gyro_bias_deg_s", "accel_bias_m_s2", "gyro_scale_ppm", "accel_scale_ppm"}
    again = reported(command(tmp_path / "hand-calibrated.yaml", "--json"))
    assert again["agreement"]["configured"]["gyro_deg_s"] == pytest.approx(
        first["agreement"]["calibrated"]["gyro_deg_s"], rel=0.01
    )
    for name in ("imu1", "imu2", "imu3"):
        for key, close in (("gyro_matrix", 2e-5), ("accel_matrix", 2e-5), ("mount_deg", 1e-3), ("position_m", 1e-5)):
            one = again["imus"][name][key]
            np.testing.assert_allclose(one["value"], one["configured"], atol=close)
        bias = again["imus"][name]["initial_errors.accel_bias_m_s2"]
        np.testing.assert_allclose(bias["value"], bias["configured"], atol=1e-4)


def test_its_table_has_matrices_row_by_row(tmp_path: Path) -> None:
    chips = draw_chips(2, np.random.default_rng(5))
    simulation = by_hand(5, SensorErrors(scales=False, chips=chips), count=2)
    result = command(write_files(simulation.recording, tmp_path))
    assert result.exit_code == 0, result.exception
    assert "imu1  accel_matrix z" in result.stdout
    assert "the IMUs differ by" in result.stderr


def test_what_the_drive_hardly_tells_stays_as_configured() -> None:
    """The body's yaw on a robot that hardly accelerates, say."""
    estimate = Estimate("mount_deg", (1.0, 2.0, 7.0), (0.5, 0.2, 17.0), (0.0, 0.1, 0.2))
    calibration = Calibration({"body": (estimate,)}, (), ())
    values = {"imus": [{"name": "body", "file": "body.csv", "mount_deg": [0.0, 0.1, 0.2]}]}
    text = calibrated(values, parse(Document(Path("drive.yaml"), values)), calibration)
    assert "mount_deg: [1.0, 2.0, 0.2]" in text
