"""The page on live data says what is so: its commands start, its script is heard, what it lists is all there is."""

import contextlib
import re
import shlex
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
import test_documentation

from polyins import cli
from polyins.live import run as live_run
from polyins.live import sources
from polyins.live.run import Options
from polyins.navigate import refusals

PAGE = test_documentation.REPOSITORY / "docs" / "live.md"
BLOCKS = test_documentation.blocks(PAGE)
COMMANDS = [" ".join(words[1:]) for block in BLOCKS for words in block.commands]


@pytest.fixture
def desk(tmp_path: Path, drive: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for block in BLOCKS:
        if block.name:
            (tmp_path / block.name).write_text(block.text)
    (tmp_path / "drive.yaml").symlink_to(drive)
    for file in drive.parent.glob("*.parquet"):
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "lines.txt").write_text("")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@contextlib.contextmanager
def stopped_at_once() -> Iterator[list[str]]:
    yield ["SIGINT"]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_starts_and_stops(command: str, desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_run, "_stop_signals", stopped_at_once)
    monkeypatch.setattr(live_run, "preload", lambda *arguments: None)
    # any free port, and a folder of this test
    words = shlex.split(
        re.sub(r":(?:5555|10110|14550)\b|(?<=--page )8080", lambda m: m[0][:1].strip("8") + "0", command)
    )
    words = [word.replace("/tmp/rover", str(desk / "rover")) for word in words]
    if "<" in words:
        monkeypatch.setattr("sys.stdin", (desk / words[words.index("<") + 1]).open())
        words = words[: words.index("<")]
    cli.cli.main(words, prog_name="polyins", standalone_mode=False)


def test_the_script_is_heard(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sensors' program of the page, with a clock that runs faster."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    clock, ends = [1.7e9], 1.7e9 + 75.0
    received: list[str] = []

    def sleep(seconds: float) -> None:
        clock[0] += seconds
        time.sleep(0.0005)
        if clock[0] > ends:
            raise KeyboardInterrupt

    def send() -> None:
        fake = SimpleNamespace(time=lambda: clock[0], sleep=sleep)
        script = (desk / "send.py").read_text().replace("5555", str(port)).replace("import time\n", "")
        wait_until_heard(port)
        with contextlib.suppress(KeyboardInterrupt):
            exec(compile(script, "send.py", "exec"), {"time": fake})
        time.sleep(0.5)
        received.append("SIGINT")

    @contextlib.contextmanager
    def stopped_when_sent() -> Iterator[list[str]]:
        yield received

    monkeypatch.setattr(live_run, "_stop_signals", stopped_when_sent)
    sender = threading.Thread(target=send)
    sender.start()
    out = desk / "out"
    said = live_run.run(Options(desk / "rover.yaml", out, sources=(f"udp://127.0.0.1:{port}",), sinks=()))
    sender.join()
    assert said["start"]["standstill"].startswith("found")
    assert said["start"]["heading"] == "given"
    assert said["epochs"]["left"] == said["epochs"]["right"] > 500
    assert said["end_s"] > ends - 0.1
    assert said["fixes"] >= 3  # those before the start are in it
    assert said["status"] == "navigating"


def wait_until_heard(port: int) -> None:
    """Wait until somebody listens at a UDP port."""
    until = time.monotonic() + 60.0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("127.0.0.1", port))
        while time.monotonic() < until:
            try:
                probe.send(b"?")
                time.sleep(0.05)
                probe.send(b"?")
                return
            except ConnectionRefusedError:
                time.sleep(0.05)
    raise AssertionError(f"nobody listens at {port}")


def test_every_kind_of_refusal_is_listed() -> None:
    text = PAGE.read_text().replace("\n", " ")
    folder = Path(sources.__file__).parent
    found: set[str] = set()
    for file in folder.glob("*.py"):
        code = file.read_text()
        found |= set(re.findall(r'RefusedError\("([^"]+)"\)', code)) | set(re.findall(r'counts\["([^"]+)"\]', code))
    assert len(found) > 12
    found |= set(refusals.WHY)
    assert len(found) > 17
    assert not [kind for kind in found if f"`{kind}`" not in text]


def test_every_source_and_sink_is_listed() -> None:
    text = test_documentation.section("### polyins live")
    for scheme in sources._OPENERS:
        assert f"`{scheme}://" in text or scheme == "stdin"
