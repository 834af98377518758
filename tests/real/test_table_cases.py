"""Tables as loggers write them: what `init` makes of each file is what the right answers say, and it runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from polyins import cli
from polyins.errors import InputError
from polyins.formats.rows import ImuRows, Track, intervals
from polyins.model.recording import Recording
from polyins.model.rig import DEG, STANDARD_GRAVITY
from polyins.reading.guess import read_table
from polyins.reading.loading import load
from polyins.tools.inspect import inspect
from polyins.tools.propose.proposal import propose

HALF_DIGIT = 1.0 + 1e-6
"""of the last one that a file has"""


@pytest.fixture(scope="module")
def common(cases: Path) -> np.ndarray:
    """Stamps, rates and forces of the drive that the cases tell, forward, right, down."""
    import gzip

    with gzip.open(cases / "common" / "imu.csv.gz", "rt") as file:
        return np.loadtxt(file, delimiter=",", skiprows=1)


def proposed(folder: Path, *files: Path) -> Recording:
    """Load what `init` writes, with the forward axis that the guess has as well."""
    path = folder / "proposed.yaml"
    done = CliRunner().invoke(cli.cli, ["init", *map(str, files), "--out", str(path)])
    assert done.exit_code == 0, done.output
    assert CliRunner().invoke(cli.cli, ["info", str(path)]).exit_code == 0
    return load(path)


def rates(recording: Recording, index: int = 0) -> np.ndarray:
    stream = recording.imus[index]
    return np.column_stack([stream.dtheta, stream.dvel]) / intervals(stream.time)[:, None]


ROWS: dict[str, tuple[str, float, slice, float, float]] = {
    # file; stamps later, s; rows; half of the last digit of rates, rad/s, and forces, m/s^2
    "wide": ("imus.csv", 0.0, slice(None), 5e-7, 5e-5),
    "interleaved": ("imus.csv", 0.0, slice(None), 5e-7, 5e-5),
    "raw-counts": ("imu.csv", 0.0, slice(None), 0.5 / 16.4 * DEG, 0.5 / 2048 * STANDARD_GRAVITY),
    "sec-nanosec": ("imu.csv", 1.7e9, slice(None), 1e-6, 2e-4),
    "preamble": ("imu.csv", 36000.0, slice(None), 5e-7, 1e-5),
    "cut-lines": ("end.csv", 0.0, slice(-1), 5e-7, 5e-5),
    "cut-lines/both": ("both.csv", 0.0, slice(1, -1), 5e-7, 5e-5),
    "numeric-11": ("imu.csv", 0.0, slice(None), 5e-7, 5e-6 * STANDARD_GRAVITY),
}


@pytest.mark.parametrize("case", ROWS)
def test_rows_are_those_of_the_common_drive(case: str, cases: Path, common: np.ndarray, tmp_path: Path) -> None:
    name, later, kept, of_rate, of_force = ROWS[case]
    recording = proposed(tmp_path, cases / case.partition("/")[0] / name)
    wanted = common[kept]
    time = recording.imus[0].time
    np.testing.assert_allclose(time - later, wanted[:, 0], atol=1e-6)
    off = np.abs(rates(recording) - wanted[:, 1:])
    assert off[1:, :3].max() <= of_rate * HALF_DIGIT + 1e-9
    assert off[1:, 3:].max() <= of_force * HALF_DIGIT + 1e-9


def test_stamps_in_two_columns_keep_their_interval(cases: Path, tmp_path: Path) -> None:
    recording = proposed(tmp_path, cases / "sec-nanosec" / "imu.csv")
    np.testing.assert_allclose(np.diff(recording.imus[0].time), 0.025, atol=1e-6)


def test_a_wide_table_has_two_imus(cases: Path, expected: dict[str, Any], tmp_path: Path) -> None:
    recording, wanted = proposed(tmp_path, cases / "wide" / "imus.csv"), expected["wide"]
    assert len(recording.imus) == wanted["imus"]
    mean = rates(recording, 1).mean(axis=0)
    np.testing.assert_allclose(mean[:3], wanted["imu2_mean"]["gyro_rad_s"], atol=1e-6)
    np.testing.assert_allclose(mean[3:], wanted["imu2_mean"]["accel_m_s2"], atol=1e-4)


def test_rows_in_turn_have_two_imus(cases: Path, expected: dict[str, Any]) -> None:
    facts, wanted = inspect(cases / "interleaved" / "imus.csv"), expected["interleaved"]
    assert [stream["rows"] for stream in facts["streams"]] == [wanted["rows"]["1"], wanted["rows"]["2"]]
    gap = facts["streams"][1]["gaps"]
    assert gap["count"] == 1
    assert (gap["at_s"], gap["largest_s"]) == pytest.approx((wanted["imu2"]["gap"]["from_s"], 0.15))
    mean = np.array(facts["streams"][1]["gyro_mean_deg_s"]) * DEG
    np.testing.assert_allclose(mean, wanted["imu2"]["mean_gyro_rad_s"], rtol=0.01, atol=1e-6)


def test_a_table_without_header_whose_stamps_are_last(cases: Path, common: np.ndarray, tmp_path: Path) -> None:
    text = propose([cases / "headerless-7" / "imu.csv"]).text
    assert "kf-gins" not in text
    assert "names: [1, 2, 3], unit: 'g'" in text
    assert "names: [4, 5, 6], unit: 'deg/s'" in text
    assert "8 stamp(s) repeat" in text
    off = rates(proposed(tmp_path, cases / "headerless-7" / "imu.csv")) - common[:, 1:]
    assert np.abs(off[:, :3]).max() <= 1e-4 * DEG
    assert np.abs(off[:, 3:]).max() <= 1e-3


@pytest.mark.parametrize(("name", "lines"), [("end.csv", "line 801 is"), ("both.csv", "lines 1 and 800 are")])
def test_lines_that_are_cut_are_named(name: str, lines: str, cases: Path, tmp_path: Path) -> None:
    recording = proposed(tmp_path, cases / "cut-lines" / name)
    assert any(f"{lines} cut off" in text for text in recording.warnings)


def test_raw_counts_are_a_proposal_to_check(cases: Path) -> None:
    proposal = propose([cases / "raw-counts" / "imu.csv"])
    text = proposal.text
    assert sum("scale is a guess" in one.sentence for one in proposal.assumptions) == 1
    assert sum("scale is a guess" in one.text for one in proposal.findings) == 1
    assert f"scale: [{1 / 2048!r}" in text
    assert f"scale: [{1 / 16.4!r}" in text


def test_gyro_and_accelerometer_in_two_files(
    cases: Path, common: np.ndarray, expected: dict[str, Any], tmp_path: Path
) -> None:
    folder = cases / "split-gyro-accel"
    files = [folder / "Accelerometer.csv", folder / "Gyroscope.csv"]
    recording = proposed(tmp_path, *files, cases / "common" / "gnss.csv")
    assert recording.imus[0].rate_hz == pytest.approx(expected["split-gyro-accel"]["rate_hz"], rel=0.01)
    # means over the interval before the stamp, with a bias, against samples at it without
    middle = common[:, 0] - 0.0125
    at = recording.imus[0].time
    inside = (at > middle[0]) & (at < middle[-1])
    truth = np.column_stack([np.interp(at[inside], middle, column) for column in common[:, 1:].T])
    off = rates(recording)[inside] - truth
    off -= off.mean(axis=0)
    rms = np.sqrt(np.mean(off**2, axis=0))
    assert rms[:3].max() < 0.01
    assert rms[3:].max() < 0.1
    with pytest.raises(InputError, match="no IMU data"):
        propose(files[:1])
    assert inspect(files[0])["kind"] == "accel alone"


def test_whole_numbers_of_ublox(cases: Path, expected: dict[str, Any]) -> None:
    (stream,) = streams(cases / "nav-pvt" / "pvt.csv")
    track, wanted = stream.rows, expected["nav-pvt"]["gnss"]
    assert isinstance(track, Track)
    assert len(track.time) == wanted["rows"]
    first = [track.time[0], *(track.position[0] / [DEG, DEG, 1.0])]
    np.testing.assert_allclose(first, wanted["row_0"], atol=1e-9)
    assert track.velocity is not None
    assert track.velocity_std is not None
    np.testing.assert_allclose(track.velocity[40], wanted["velocity_row_40_m_s"], atol=1e-12)
    np.testing.assert_allclose(track.position_std, np.tile(wanted["std_m"], (80, 1)), atol=1e-12)
    np.testing.assert_allclose(track.velocity_std, wanted["velocity_std_m_s"])


def streams(path: Path) -> Any:
    found = read_table(path)
    assert isinstance(found, list)
    return found


def solved(out: Path, config: Path, reference: Path) -> dict[str, float]:
    done = CliRunner().invoke(cli.cli, ["run", str(config), "--json", "--no-report", "--out", str(out)])
    assert done.exit_code == 0, done.output
    arguments = ["evaluate", str(out / "solution.parquet"), "--reference", str(reference), "--json"]
    judged = CliRunner().invoke(cli.cli, arguments)
    assert judged.exit_code in (0, 3), judged.output
    found: dict[str, float] = json.loads(judged.stdout)["reference"]
    return found


RUNS = {"nav-pvt": ("imu.csv", "pvt.csv", "truth.csv"), "split-gyro-accel": ("Gyroscope.csv", "Accelerometer.csv", "")}


@pytest.mark.parametrize("case", RUNS)
def test_what_is_proposed_runs(case: str, cases: Path, expected: dict[str, Any], tmp_path: Path) -> None:
    one, other, truth = RUNS[case]
    files = [cases / case / one, cases / case / other]
    if case == "split-gyro-accel":
        files.append(cases / "common" / "gnss.csv")
    proposed(tmp_path, *files)
    scores = solved(
        tmp_path / "out", tmp_path / "proposed.yaml", cases / (f"{case}/{truth}" if truth else "common/truth.csv")
    )
    bound = expected[case].get("horizontal_rms_m_at_most", 0.1)
    assert scores["horizontal_rms_m"] < bound


def as_good_as_it_is(text: str) -> str:
    """Say of positions how good they are, which no column does."""
    assert "position_std_m: [1.5, 1.5, 3.0]  # CHECK:" in text
    return text.replace("position_std_m: [1.5, 1.5, 3.0]", "position_std_m: [0.02, 0.02, 0.04]")


def test_heights_above_the_sea(cases: Path, tmp_path: Path) -> None:
    folder = cases / "sea-level"
    text = as_good_as_it_is(propose([folder / "imu.csv", folder / "gnss.csv"]).text)
    (height,) = [line for line in text.splitlines() if line.strip().startswith("height:")]
    assert "# CHECK:" in height
    assert "geoid_height_m" in height
    path = tmp_path / "proposed.yaml"
    path.write_text(text.replace(height, "  height: sea-level\n  geoid_height_m: 46.3"))
    assert solved(tmp_path / "out", path, folder / "truth.csv")["vertical_rms_m"] < 0.1
    with_separation = as_good_as_it_is(propose([folder / "imu.csv", folder / "gnss-separation.csv"]).text)
    assert "undulation: 'undulation'" in with_separation
    path.write_text(with_separation)
    assert solved(tmp_path / "other", path, folder / "truth.csv")["vertical_rms_m"] < 0.1


@pytest.mark.parametrize("scale", [[1e-7, 1e-7, 1.0], [1e-7, 1e-7, 1e-3]])
def test_millimetres_taken_for_metres_are_refused(scale: list[float], cases: Path, tmp_path: Path) -> None:
    path = tmp_path / "drive.yaml"
    text = propose([cases / "nav-pvt" / "imu.csv", cases / "nav-pvt" / "pvt.csv"]).text
    text = text.replace("scale: [1e-07, 1e-07, 0.001]", f"scale: {scale}")
    path.write_text(text.replace(", scale: [0.001, 0.001, 0.001]}", "}"))
    with pytest.raises(InputError, match=r"is it in mm|columns\.velocity\.scale"):
        load(path)


def test_a_turn_at_the_end_of_the_range(cases: Path, expected: dict[str, Any]) -> None:
    wanted = expected["saturated-turn"]
    found = load(cases / "saturated-turn" / "config.yaml")
    assert any(f"in {wanted['saturated_rows']} row(s)" in text for text in found.sentences)
    text = propose([cases / "saturated-turn" / "imu.csv"]).text
    assert f"gyro_range_deg_s: {wanted['full_scale_deg_s']}" in text
    assert "axes: [x, y, z]" in text
    (stream,) = streams(cases / "saturated-turn" / "imu.csv")
    assert isinstance(stream.rows, ImuRows)
    rate = stream.rows.dtheta / intervals(stream.rows.time)[:, None]
    assert np.sqrt(np.mean((rate**2).sum(axis=1))) == pytest.approx(wanted["rms_rate_rad_s"], rel=2e-3)


BINARIES = {"log": "no known", "ulog": "ULog", "dataflash": "DataFlash", "rosbag": "ROS bag", "sqlite": "SQLite",
            "mcap": "bag|MCAP", "matlab": "MATLAB", "ubx": "UBX"}  # fmt: skip


@pytest.mark.parametrize("name", BINARIES)
def test_binaries_of_no_use_are_refused_by_name(name: str, cases: Path) -> None:
    with pytest.raises(InputError, match=BINARIES[name]):
        inspect(cases / "unknown-binary" / f"{name}.bin")


def test_one_broken_row_of_rtklib_is_named(logs: Path) -> None:
    facts = inspect(logs / "rtklib-pos" / "inside_data.pos")
    assert facts["rows"] == 2
    assert (facts["begin_s"], facts["end_s"]) == (36000.0, 50418.0)
    assert any("line 16" in text for text in facts["warnings"])


@pytest.mark.parametrize("name", ["five-imus.txt", "five-imus-short.txt"])
def test_a_board_of_five(name: str, logs: Path) -> None:
    wanted = json.loads((logs / "expected.json").read_text())[f"array-text/{name}"]["imu"]
    found = streams(logs / "array-text" / name)
    assert len(found) == len(wanted)
    for stream, facts in zip(found, wanted.values(), strict=True):
        rows = stream.rows
        assert len(rows.time) == facts["rows"]
        assert (rows.time[0], rows.time[-1]) == pytest.approx((facts["first_s"], facts["last_s"]), abs=1e-6)
        values = np.column_stack([rows.dtheta, rows.dvel]) / intervals(rows.time)[:, None]
        np.testing.assert_allclose(values[:, :3].mean(axis=0), facts["gyro_mean_rad_s"], rtol=1e-6)
        np.testing.assert_allclose(values[:, 3:].mean(axis=0), facts["accel_mean_m_s2"], rtol=1e-6)
        for row, sample in facts["sample"].items():
            np.testing.assert_allclose([rows.time[int(row)], *values[int(row)]], sample, rtol=1e-8, atol=1e-6)


@pytest.mark.parametrize("name", ["kf-gins-13/matlab.txt", "kf-gins-13/velocity-first.txt"])
def test_both_orders_of_kf_gins_stay_what_they_are(name: str, cases: Path) -> None:
    assert inspect(cases / name)["format"] == "kf-gins-gnss"
