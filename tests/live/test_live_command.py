"""`polyins live` as a user runs it: what is printed, which files are left, how it stops and goes on."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from pyarrow import parquet

from polyins import cli
from polyins.errors import InputError
from polyins.formats.solution_files import read_solution, write_solution
from polyins.live.run import Options, run
from polyins.model.recording import AidingStream, Recording
from polyins.model.rig import AidingSensor
from polyins.navigate import batch
from polyins.reading import loading
from polyins.simulation import files

FAR = 30.0  # s
PROGRAM = "import conftest, polyins.cli; polyins.cli.main()"


def live(config: Path, out: Path, *more: str) -> list[dict[str, float]]:
    """Run the command in this process and return the states that it printed."""
    done = CliRunner().invoke(cli.cli, ["live", str(config), "--out", str(out), *more], catch_exceptions=False)
    assert done.exit_code == 0
    return [json.loads(line) for line in done.stdout.splitlines()]


def summary(out: Path) -> dict[str, object]:
    return json.loads((out / "summary.json").read_text())


@pytest.fixture(scope="module")
def replayed(drive: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict[str, float]], Path]:
    out = tmp_path_factory.mktemp("replayed")
    return live(drive, out, "--speed", "max"), out


def test_a_replay_prints_states_at_the_rate(replayed: tuple[list[dict[str, float]], Path]) -> None:
    rows, out = replayed
    times = np.array([row["time_s"] for row in rows])
    assert np.all(np.diff(times) > 0.0)
    assert len(times) == pytest.approx(10 * (50.0 - 8.0), abs=6)
    np.testing.assert_allclose(np.diff(times)[1:-1], 0.1, atol=0.021)
    assert times[-1] == pytest.approx(50.0)
    said = summary(out)
    assert said["epochs"] == {f"imu{k}": 50 * (50 - 8 + 2) for k in (1, 2, 3)}
    assert said["stopped_by"] == "end of data"
    assert said["start"]["heading"].startswith("GNSS accelerations")
    flags = {row["time_s"]: row["dead_reckoning"] for row in rows}
    assert {flag for at, flag in flags.items() if 32.5 < at < 35.9} == {True}
    assert {flag for at, flag in flags.items() if at < 30.0 or at > 37.0} == {False}


def assert_logged(table: Any, rows: list[dict[str, Any]]) -> None:
    """The rows, each column in the precision that the file has."""
    assert table.num_rows == len(rows)
    for name in rows[0]:
        kept = table[name].to_numpy()
        np.testing.assert_array_equal(kept, np.array([row[name] for row in rows]).astype(kept.dtype))


def test_the_log_holds_what_was_printed(replayed: tuple[list[dict[str, float]], Path]) -> None:
    rows, out = replayed
    table = parquet.read_table(out / "solution.parquet")
    assert_logged(table, rows)
    solution = read_solution(out)
    assert solution.heights == "ellipsoidal"
    np.testing.assert_allclose(solution.time, [row["time_s"] for row in rows])
    assert {path.name for path in out.iterdir()} >= {"summary.json", "solution.parquet", "checkpoint.npz"}


def test_the_log_of_every_epoch_is_that_of_a_batch_run(recording: Recording, drive: Path, tmp_path: Path) -> None:
    run(Options(drive, tmp_path, sinks=(), speed=float("inf"), rate_hz=50.0))
    live, whole = read_solution(tmp_path), batch.run(recording, "enav-fusion")
    np.testing.assert_array_equal(live.time, whole.time)
    write_solution(whole, tmp_path / "batch")
    written = read_solution(tmp_path / "batch")
    for name in ("position", "velocity", "attitude"):
        np.testing.assert_array_equal(getattr(live, name), getattr(written, name))
    np.testing.assert_allclose(live.phi_covariance, written.phi_covariance, rtol=3e-7)


def test_a_replay_with_heights_is_the_batch_run(recording: Recording, tmp_path: Path) -> None:
    assert recording.reference is not None
    time = np.arange(0.5, 49.0, 0.37)
    height = np.interp(time, recording.reference.time, recording.reference.position[:, 2]) + 2.0
    stream = AidingStream("height", time, height, np.full((len(time), 1), 0.2))
    rig = replace(recording.rig, sensors=(AidingSensor("height", offset_std=5.0),))
    path = files.write(replace(recording, rig=rig, aiding=(stream,)), tmp_path / "heights")
    out = tmp_path / "out"
    run(Options(path, out, sinks=(), speed=float("inf"), rate_hz=50.0))
    live, whole = read_solution(out), batch.run(loading.load(path), "enav-fusion")
    assert json.loads((out / "summary.json").read_text())["epochs"]["height"] > 100
    assert abs(whole.offsets["height_bias"].value[-1] - 2.0) < 0.5
    np.testing.assert_array_equal(live.time, whole.time)
    np.testing.assert_array_equal(live.velocity, whole.velocity.astype(np.float32))


def test_standard_input_gives_what_the_replay_gives(
    replayed: tuple[list[dict[str, float]], Path],
    no_files: Path,
    datagrams: list[bytes],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "lines").write_bytes(b"\n".join(datagrams))
    with (tmp_path / "lines").open("rb") as file:
        monkeypatch.setattr(sys, "stdin", file)
        said = run(Options(no_files, tmp_path, sources=("-",)))
    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == replayed[0]
    assert said["refused"] == summary(replayed[1])["refused"]


def program(drive: Path, out: Path, *more: str) -> subprocess.Popen[bytes]:
    """Start the command as a process of its own, slow enough that a busy machine stops it before the recording ends."""
    command = [sys.executable, "-c", PROGRAM, "live", str(drive), "--out", str(out), "--speed", "4", *more]
    # unbuffered: what readline had read ahead, communicate would not see
    return subprocess.Popen(
        command, bufsize=0, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=Path(__file__).parent
    )


def stopped(process: subprocess.Popen[bytes], number: signal.Signals, out: Path, after: list[bytes]) -> None:
    """Stop the command by a signal: what was printed before and after it is in complete files."""
    process.send_signal(number)
    rest, errors = process.communicate(timeout=FAR)
    assert process.returncode == 0, errors
    printed = [json.loads(line) for line in (*after, *rest.splitlines())]
    assert len(after) <= len(printed) < 400
    assert summary(out)["stopped_by"] == number.name
    assert_logged(parquet.read_table(out / "solution.parquet"), printed)
    assert not list(out.glob(".*"))


def test_sigterm_ends_it_with_complete_files(drive: Path, tmp_path: Path) -> None:
    with program(drive, tmp_path) as process:
        stopped(process, signal.SIGTERM, tmp_path, [process.stdout.readline() for _ in range(30)])


def test_nmea_goes_over_tcp_and_udp_until_sigint(drive: Path, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(FAR)
        sinks = ("ndjson:", f"nmea+tcp://:{port}?rate=4", f"nmea+udp://127.0.0.1:{receiver.getsockname()[1]}?rate=5")
        with program(drive, tmp_path, *(word for url in sinks for word in ("--sink", url))) as process:
            by_udp = receiver.recv(1000).decode()
            with socket.create_connection(("127.0.0.1", port)) as client, client.makefile("r", newline="") as stream:
                by_tcp = [stream.readline() for _ in range(9)]
            stopped(process, signal.SIGINT, tmp_path, [process.stdout.readline() for _ in range(20)])
    assert re.fullmatch(r"\$INGGA,.*\r\n\$INRMC,.*\r\n\$INHDT,.*\r\n", by_udp)
    assert [line[:6] for line in by_tcp] == ["$INGGA", "$INRMC", "$INHDT"] * 3
    seconds = [float(line.split(",")[1][4:]) for line in by_tcp[::3]]
    np.testing.assert_allclose(np.diff(seconds) % 60.0, 0.25, atol=0.021)


def test_nobody_reads(drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as output:
        monkeypatch.setattr(sys, "stdout", output)
        assert run(Options(drive, tmp_path, speed=float("inf")))["stopped_by"] == "end of standard output"
    assert (tmp_path / "solution.parquet").is_file()


def test_killed_and_resumed(replayed: tuple[list[dict[str, float]], Path], drive: Path, tmp_path: Path) -> None:
    with program(drive, tmp_path, "--checkpoint-every", "2") as process:
        for _ in range(100):
            killed_at = json.loads(process.stdout.readline())["time_s"]
        process.kill()
    assert not (tmp_path / "solution.parquet").exists()
    rows = live(drive, tmp_path, "--speed", "max", "--resume")
    assert killed_at - 4.5 < rows[0]["time_s"] <= killed_at + 1.0
    known = {row["time_s"]: row for row in replayed[0]}
    same = [row for row in rows if row["time_s"] in known]
    assert len(same) > 250
    for row in same:
        assert row == known[row["time_s"]]
    again = live(drive, tmp_path, "--speed", "max", "--resume")
    assert len(again) <= 1
    assert (tmp_path / "solution.parquet").is_file()


def test_resume_without_a_checkpoint_starts_anew(
    replayed: tuple[list[dict[str, float]], Path], drive: Path, tmp_path: Path
) -> None:
    assert live(drive, tmp_path, "--speed", "max", "--resume") == replayed[0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--speed", "fast"], "--speed fast: expected a number above 0, or max"),
        (["--source", "pigeon://"], "--source pigeon://: unknown"),
        (["--sink", "printer:"], "--sink printer:: unknown"),
        (["--sink", "nmea+tcp://127.0.0.1:99999"], "--sink nmea"),
        (["--sink", "ndjson:?rate=0"], "rate is 0"),
        (["--method", "enav-fussion"], "did you mean"),
        (["--page", "1", "--bind", "192.0.2.1"], "cannot be served at 192.0.2.1"),
        (["--rate", "0"], "0.0 is not in the range"),
        (["--delay", "-1"], "-1.0 is not in the range"),
    ],
)
def test_a_wrong_command_says_what_was_expected(drive: Path, tmp_path: Path, arguments: list[str], words: str) -> None:
    with pytest.raises((InputError, cli.click.UsageError), match=re.escape(words)):
        cli.cli.main(["live", str(drive), "--out", str(tmp_path / "out"), *arguments], standalone_mode=False)


def test_a_replay_needs_files(no_files: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"imus\[0\]\.file: is missing"):
        run(Options(no_files, tmp_path))


def test_data_that_end_without_a_start(no_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    os.close(writer)
    monkeypatch.setattr(sys, "stdin", os.fdopen(reader, "rb"))
    with pytest.raises(InputError, match="the data ended without a start: no data"):
        run(Options(no_files, tmp_path, sources=("-",)))
    assert summary(tmp_path)["start"] is None


def test_live_data_tell_what_is_not_looked_at(drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    os.close(writer)
    monkeypatch.setattr(sys, "stdin", os.fdopen(reader, "rb"))
    with pytest.raises(InputError, match="without a start"):
        run(Options(drive, tmp_path, sources=("-",)))
    warnings = summary(tmp_path)["warnings"]
    assert [text.split(":")[0] for text in warnings] == ["outages", "reference", "no start was found"]
