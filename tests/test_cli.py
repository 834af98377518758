"""The commands as a user types them: exit codes, what is printed where, which files are left."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from polyins.simulation import files
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario


def polyins(*arguments: object, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "polyins", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scenario = Scenario(
        duration_s=70.0, static_s=20.0, imus=Board(count=3), outages=((45.3, 60.3),), reference_rate_hz=10.0
    )
    return files.write(simulate(scenario, seed=3), tmp_path_factory.mktemp("recording"))


def test_run_prints_one_document_and_leaves_the_promised_files(config: Path, tmp_path: Path) -> None:
    done = polyins("run", config, "--method", "enav-fusion", "--out", tmp_path / "out", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["method"] == "enav-fusion"
    assert document["imus"] == 3
    assert document["epochs"] > 9000
    assert document["outages"]["count"] == 1
    assert 0.0 < document["outages"]["each_m"][0] < 30.0
    assert document["reference"]["horizontal_rms_m"] < 10.0
    assert 0.0 < document["us_per_epoch"] < 1000.0
    assert json.loads((tmp_path / "out/summary.json").read_text()) == document
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"solution.parquet", "imu_errors.parquet", "summary.json", "report.html", "config.yaml"}
    solution = pq.read_table(tmp_path / "out/solution.parquet")
    assert solution.num_rows == document["epochs"]
    assert {"time_s", "latitude_deg", "heading_deg", "std_phi_down_deg", "north_m"} <= set(solution.column_names)


def test_run_without_json_prints_a_table(config: Path, tmp_path: Path) -> None:
    done = polyins("run", config, "--out", tmp_path, "--no-report")
    assert done.returncode == 0, done.stderr
    assert "enav-fusion" in done.stdout
    assert "heading" in done.stdout
    assert not (tmp_path / "report.html").exists()


def test_the_configuration_in_force_gives_the_same_run(config: Path, tmp_path: Path) -> None:
    first = polyins("run", config, "--out", tmp_path / "a", "--json", "--no-report")
    again = polyins("run", tmp_path / "a/config.yaml", "--out", tmp_path / "b", "--json", "--no-report")
    assert again.returncode == 0, again.stderr
    a, b = json.loads(first.stdout), json.loads(again.stdout)
    assert a["reference"] == b["reference"]
    assert a["outages"] == b["outages"]


def test_compare_sets_every_method_beside_the_single_imus(config: Path, tmp_path: Path) -> None:
    done = polyins("compare", config, "--methods", "single,nav-fusion,enav-fusion", "--out", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert list(document["methods"]) == ["single", "nav-fusion", "enav-fusion"]
    each = [one["outages"]["each_m"][0] for one in document["methods"]["single"]["each"]]
    assert len(each) == 3
    single = document["methods"]["single"]["outages"]["horizontal_max_rms_m"]
    assert single == pytest.approx(np.sqrt(np.mean(np.square(each))))
    fused = document["methods"]["enav-fusion"]["outages"]["horizontal_max_rms_m"]
    assert document["ratio_to_single"]["enav-fusion"] == pytest.approx(single / fused)
    assert document["sqrt_n"] == pytest.approx(np.sqrt(3))
    for folder in ("nav-fusion", "enav-fusion", "single/imu1", "single/imu3"):
        assert (tmp_path / folder / "solution.parquet").is_file()
    assert (tmp_path / "report.html").stat().st_size > 1e6


def test_several_recordings_have_a_folder_each_and_one_document(config: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / config.name
    other.parent.mkdir()
    other.write_text(config.read_text().replace("file: ", f"file: {config.parent}/"))
    out = tmp_path / "out"
    done = polyins("compare", config, other, "--methods", "enav-fusion", "--out", out, "--json", "--no-report")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert json.loads((out / "summary.json").read_text()) == document
    assert list(document["recordings"]) == [f"{path.parent.name}/simulated drive" for path in (config, other)]
    for name, part in document["recordings"].items():
        assert json.loads((out / name / "summary.json").read_text()) == part
        assert (out / name / "enav-fusion/solution.parquet").is_file()
    one, two = (part["methods"]["enav-fusion"]["reference"] for part in document["recordings"].values())
    assert one == two == document["pooled"]["methods"]["enav-fusion"]["reference"]
    again = polyins("compare", config, config, "--out", tmp_path / "twice")
    assert again.returncode == 2
    assert "differ in name" in again.stderr
    assert not (tmp_path / "twice").exists()


def test_evaluate_finds_the_figures_of_the_run(config: Path, tmp_path: Path) -> None:
    run = json.loads(polyins("run", config, "--out", tmp_path, "--json", "--no-report").stdout)
    done = polyins("evaluate", tmp_path, "--reference", config.parent / "reference.parquet", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["reference"]
    assert found == pytest.approx(run["reference"], rel=1e-6)


def test_simulate_writes_a_recording_that_runs(tmp_path: Path) -> None:
    (tmp_path / "scenario.yaml").write_text("duration_s: 30\nstatic_s: 10\nimus: {count: 2}\noutages: []\n")
    made = polyins("simulate", "scenario.yaml", "--out", "made", "--seed", 4, folder=tmp_path)
    assert made.returncode == 0, made.stderr
    assert polyins("run", "made/recording.yaml", "--no-report", folder=tmp_path).returncode == 0
    assert (tmp_path / "polyins-out/solution.parquet").is_file()


def test_simulate_says_what_is_doubtful(tmp_path: Path) -> None:
    (tmp_path / "scenario.yaml").write_text(
        "duration_s: 30\nstatic_s: 10\nimus: {count: 1}\ngnss: {slow_time_s: 9}\nstart_std: {position_m: 1}\n"
        "rolling: {standstill: false}\n"
    )
    made = polyins("simulate", "scenario.yaml", folder=tmp_path)
    assert made.returncode == 0
    for words in (
        "outages: the drive is too short for one",
        "gnss.slow_time_s: has no effect without slow_std_m",
        "start_std: has an effect only with wheels and without gnss",
        "rolling: has no effect without wheels",
    ):
        assert f"warning: {words}" in made.stderr


def test_info_init_and_convert(config: Path, tmp_path: Path) -> None:
    imu = config.parent / "imu1.parquet"
    facts = json.loads(polyins("info", imu, "--json").stdout)
    assert facts["rate_hz"] == pytest.approx(200.0)
    proposed = polyins("init", imu, config.parent / "imu2.parquet", "--out", tmp_path / "new.yaml")
    assert proposed.returncode == 0, proposed.stderr
    assert (tmp_path / "new.yaml").read_text().count("file:") == 2
    assert polyins("init", imu, "--out", tmp_path / "new.yaml").returncode == 2
    assert polyins("convert", imu, tmp_path / "imu.csv").returncode == 0
    assert json.loads(polyins("info", tmp_path / "imu.csv", "--json").stdout)["rows"] == facts["rows"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "nothing.yaml"], ["nothing.yaml", "no such file"]),
        (["run", "CONFIG", "--method", "enav-fussion"], ["enav-fussion", "did you mean 'enav-fusion'"]),
        (["compare", "CONFIG", "--methods", "single,kalman"], ["kalman", "known: single"]),
        (["run", "CONFIG", "--method", "single", "--imu", "imu9"], ["imu9", "imu1, imu2, imu3"]),
        (["run", "CONFIG", "--method", "enav-fusion", "--imu", "imu1"], ["--imu", "single"]),
        (["compare", "CONFIG", "--methods", ""], ["''", "known: single"]),
        (["run", "CONFIG", "--out", "CONFIG"], ["--out"]),
        (["reproduce", "flight"], ["flight", "did you mean 'flights'"]),
        (["datasets", "info", "quadrotr"], ["quadrotr", "did you mean quadrotor"]),
        (["evaluate", "nothing", "--reference", "CONFIG"], ["nothing"]),
        (["simulate", "CONFIG", "--seed", "one"], ["--seed", "one"]),
        (["run"], ["CONFIG"]),
        (["fly"], ["fly"]),
    ],
)
def test_wrong_commands_exit_with_2_and_say_what_was_expected(
    config: Path, tmp_path: Path, arguments: list[str], words: list[str]
) -> None:
    done = polyins(*[str(config) if a == "CONFIG" else a for a in arguments], folder=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_failure_while_running_exits_with_1_and_a_traceback_only_on_request(config: Path, tmp_path: Path) -> None:
    (tmp_path / "out/solution.parquet").mkdir(parents=True)  # a folder where the file should go
    done = polyins("run", config, "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) <= 4
    shown = polyins("run", config, "--out", tmp_path / "out", "--debug")
    assert shown.returncode == 1
    assert "Traceback" in shown.stderr


def test_help_names_every_command() -> None:
    text = polyins("--help").stdout
    for command in ("demo", "run", "compare", "evaluate", "simulate", "reproduce", "bench", "datasets", "info"):
        assert command in text
    assert "convert" in text
    assert polyins("--version").stdout.startswith("polyins, version 0.")


def test_the_command_line_starts_without_the_heavy_libraries() -> None:
    script = "import sys, polyins.cli; print([m for m in ('numba', 'pandas', 'scipy', 'plotly') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
