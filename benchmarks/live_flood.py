"""Ten thousand bad datagrams a second for half a minute, in the midst of good ones.

    python benchmarks/live_flood.py [SECONDS]

Sends a simulated drive over UDP to `polyins live`, first alone, then among malformed, duplicated, reordered,
future-stamped and oversized datagrams, and prints one JSON document: what was refused, how much memory was taken
after two fifths of the time and at the end, CPU time, and whether the states are the same to the bit. Exit code 0: they
are, and memory did not grow.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from itertools import islice
from pathlib import Path
from typing import Any

from polyins.live.events import Epoch
from pyarrow import parquet

from polyins.config.yaml_document import read_yaml, write_yaml
from polyins.live import lines
from polyins.live.replay import Replay
from polyins.reading import loading
from polyins.simulation import files
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "live"))
from flooding import flood

JUNK_HZ = 10_000
SLICE = 0.002
"""s between two bursts"""
MOST = 100
"""bad datagrams in a burst: where the machine stops the sender, it does not make up for it at once"""
GROWTH_MB = 10.0
"""that is still noise of the allocator"""
BEFORE = 3.0
"""s of good data before the junk, in which the kernels are loaded too"""


def main(seconds: float) -> int:
    """Run both, compare, print; returns the exit code."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config, stream = drive(folder, seconds + BEFORE)
        alone, _ = received(config, folder / "alone", stream, 0.0)
        flooded, figures = received(config, folder / "flooded", stream, JUNK_HZ)
    compared = set(alone) & set(flooded)
    document = {
        "seconds": seconds,
        **figures,
        "states": len(flooded),
        "compared": len(compared),
        "same": sum(alone[at] == flooded[at] for at in compared),
    }
    print(json.dumps(document, indent=2))
    good = document["same"] == len(compared) > 0.9 * len(alone) and document["growth_mb"] < GROWTH_MB
    return 0 if good and document["exit_code"] == 0 else 1


def drive(folder: Path, seconds: float) -> tuple[Path, list[tuple[float, bytes]]]:
    """Write a configuration without files; returns it and stamps and lines."""
    scenario = Scenario(duration_s=seconds, static_s=5.0, rate_hz=100.0, imus=Board(count=4), outages=())
    recording = loading.load(files.write(simulate(scenario, seed=1), folder / "drive"))
    values = read_yaml(folder / "drive" / files.CONFIG).values
    del values["reference"], values["outages"]
    for entry in (*values["imus"], values["gnss"]):
        del entry["file"]
    config = folder / "live.yaml"
    config.write_text(write_yaml(values))
    epochs: list[Epoch] = [epoch for chunk in Replay(recording).chunks() for epoch in chunk]
    return config, [(epoch.time, lines.write(epoch).encode()) for epoch in epochs]


def received(
    config: Path, out: Path, stream: list[tuple[float, bytes]], junk_hz: float
) -> tuple[dict[float, dict[str, Any]], dict[str, Any]]:
    """Run the command, send to it, stop it; returns its states by time and figures."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        address = free.getsockname()
    command = [sys.executable, "-m", "polyins", "live", str(config), "--out", str(out), "--sink", "nmea+udp://:9"]
    process = subprocess.Popen([*command, "--source", f"udp://127.0.0.1:{address[1]}"])
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        wait_until_bound(address[1])
        sent, memory, late = send(address, stream, junk_hz, process.pid)
        time.sleep(1.0)
    finally:
        process.send_signal(signal.SIGINT)
        code = process.wait(60.0)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    summary = json.loads((out / "summary.json").read_text())
    rows = parquet.read_table(out / "solution.parquet").to_pylist()
    figures = {
        "exit_code": code,
        "sent": dict(sent),
        "bad_per_second": (sent.total() - sent["good"]) / (stream[-1][0] - BEFORE),
        "longest_pause_of_the_sender_s": late,
        "refused": summary["refused"],
        "memory_mb": memory,
        "growth_mb": memory[-1] - memory[0],
        "cpu_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
    }
    return {row["time_s"]: row for row in rows}, figures


def wait_until_bound(port: int) -> None:
    """Wait until somebody listens at a UDP port (Linux)."""
    until = time.monotonic() + 120.0
    while f":{port:04X} " not in Path("/proc/net/udp").read_text():
        if time.monotonic() > until:
            raise TimeoutError(f"nobody listens at {port}")
        time.sleep(0.1)


def send(
    address: tuple[str, int], stream: list[tuple[float, bytes]], junk_hz: float, pid: int
) -> tuple[Counter[str], list[float], float]:
    """Send the stream at its own speed, with junk from BEFORE on; returns what was sent, memory, the longest pause."""
    good: list[bytes] = []
    junk, sent, memory = flood(good, seed=1), Counter[str](), []
    begin = last = time.monotonic()
    late, k, duration = 0.0, 0, stream[-1][0]
    looks = [BEFORE + share * (duration - BEFORE) for share in (0.4, 0.6, 0.8, 0.99)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(address)
        while k < len(stream):
            now = time.monotonic()
            late, last, at = max(late, now - last), now, now - begin
            while k < len(stream) and stream[k][0] <= at:
                good.append(stream[k][1])
                sender.send(stream[k][1])
                sent["good"] += 1
                k += 1
            wanted = int(max(0.0, at - BEFORE) * junk_hz) - (sent.total() - sent["good"])
            for kind, datagram in islice(junk, min(max(0, wanted), MOST)):
                sender.send(datagram)
                sent[kind] += 1
            if looks and at >= looks[0]:
                looks.pop(0)
                memory.append(resident_mb(pid))
            time.sleep(SLICE)
    return sent, memory, late


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process, MB (Linux)."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 30.0))
