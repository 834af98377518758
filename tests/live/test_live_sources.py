"""Every source brings what was sent over it, refuses by kind what it should, and stops when told."""

import io
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import reduce
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.live import gpsd
from polyins.live.source import RefusedError, Source
from polyins.live.sources import open_source
from polyins.navigate.samples import GnssFix, Sample

NAMES = ("imu1", "imu2", "imu3")
FAR = 10.0  # s, within which anything happens


def assert_same(received: list[Sample], sent: list[Sample]) -> None:
    assert len(received) == len(sent)
    for one, other in zip(received, sent, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-15) if isinstance(b, np.ndarray) else a == b


@contextmanager
def reading(source: Source) -> Iterator[list[Sample]]:
    """Let a source read in a thread of its own; it has to stop in the end."""
    received: list[Sample] = []
    thread = threading.Thread(target=lambda: [received.extend(chunk) for chunk in source.chunks()])
    thread.start()
    try:
        yield received
    finally:
        source.stop()
        thread.join(FAR)
        assert not thread.is_alive()


def wait_for(done: Callable[[], bool]) -> None:
    until = time.monotonic() + FAR
    while not done():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_udp(samples: list[Sample], datagrams: list[bytes]) -> None:
    source = open_source("udp://127.0.0.1:0", NAMES)
    assert source.socket.getsockname()[0] == "127.0.0.1"
    sent = samples[:300]
    with reading(source) as received, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(source.socket.getsockname())
        for line in datagrams[:150]:
            sender.send(line)
            time.sleep(1e-4)
        sender.send(b"x" * 9000)
        for k in range(150, 300, 30):
            sender.send(b"\n".join(datagrams[k : k + 30]))
        wait_for(lambda: len(received) == 300)
    assert_same(received, sent)
    assert source.counts == {"oversized": 1}


def test_udp_without_a_host_is_for_this_machine_only() -> None:
    source = open_source("udp://:0", NAMES)
    assert source.socket.getsockname()[0] == "127.0.0.1"
    source.socket.close()


def served(parts: list[bytes]) -> tuple[str, threading.Thread]:
    """Serve one connection after the other, each with one part of the data."""
    server = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        for part in parts:
            connection, _ = server.accept()
            with connection:
                connection.sendall(part)
        server.close()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    return f"{server.getsockname()[0]}:{server.getsockname()[1]}", thread


def test_tcp_connects_again(samples: list[Sample], datagrams: list[bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("polyins.live.streams.AGAIN", 0.05)
    text = b"".join(line + b"\r\n" for line in datagrams[:200])
    address, _ = served([text[:7777], text[7777:] + b"y" * 100_000 + b"\n" + datagrams[200]])
    source = open_source(f"tcp://{address}", NAMES)
    with reading(source) as received:
        wait_for(lambda: source.counts["connections lost"] >= 2)
    # the line that the loss cut in two is refused, unless it was cut at an end
    cut = text[:7777].count(b"\n")
    assert_same(received, [*samples[:cut], *samples[cut + 1 : 201]])
    assert source.counts["malformed"] == 2
    assert source.counts["oversized"] == 1


def test_standard_input_ends(datagrams: list[bytes], samples: list[Sample], monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    monkeypatch.setattr(sys, "stdin", io.FileIO(reader))
    source = open_source("-", NAMES)
    os.write(writer, b"\n".join(datagrams[:50]))
    os.close(writer)
    assert_same([sample for chunk in source.chunks() for sample in chunk], samples[:50])


def test_serial_port(datagrams: list[bytes], samples: list[Sample]) -> None:
    pytest.importorskip("serial")
    ours, theirs = os.openpty()
    source = open_source(f"serial://{os.ttyname(theirs)}?baud=460800", NAMES)
    with reading(source) as received:
        time.sleep(0.1)
        for k in range(0, 120, 10):
            os.write(ours, b"".join(line + b"\n" for line in datagrams[k : k + 10]))
        wait_for(lambda: len(received) == 120)
    assert_same(received, samples[:120])
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("carrier-pigeon://", "unknown; expected one of replay:, -, udp://"),
        ("udp://127.0.0.1", "has no port"),
        ("udp://192.0.2.1:5000", "cannot be opened"),
        ("udp://127.0.0.1:99999", "cannot be opened"),
        ("serial:///dev/null?speed=3", "baud="),
    ],
)
def test_a_wrong_url_says_what_was_expected(url: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        open_source(url, NAMES)


# --- gpsd -------------------------------------------------------------------------------------------------------------

REPORT = {
    "class": "TPV", "mode": 3, "time": "2026-03-04T05:06:07.500Z", "lat": 48.5, "lon": -11.25, "altHAE": 520.0,
    "altMSL": 473.0, "epx": 1.96, "epy": 3.92, "epv": 9.8, "track": 90.0, "speed": 5.0, "climb": -0.5, "eps": 0.98,
    "epc": 1.96,
}  # fmt: skip


def report(**changes: object) -> bytes:
    return json.dumps({**REPORT, **changes}).encode()


def test_a_report_of_gpsd() -> None:
    fix = gpsd.parse(report())
    assert fix.time == 1772600767.5
    np.testing.assert_allclose(fix.position, [np.radians(48.5), np.radians(-11.25), 520.0])
    np.testing.assert_allclose(fix.position_std, [2.0, 1.0, 5.0])
    np.testing.assert_allclose(fix.velocity, [0.0, 5.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(fix.velocity_std, [0.5, 0.5, 1.0])
    assert not fix.above_sea
    assert gpsd.parse(report(altHAE=None, velN=1.0, velE=2.0, velD=3.0).replace(b'"altHAE": null, ', b"")).above_sea
    assert gpsd.parse(b'{"class":"VERSION"}') is None
    assert gpsd.parse(report(epx=0.0)).position_std is None
    np.testing.assert_allclose(gpsd.parse(report(epx=0.0, eph=4.9)).position_std, [2.0, 2.0, 5.0])


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        (report(mode=2), "no fix in three dimensions"),
        (b"[]", "malformed"),
        (b"{", "malformed"),
        (report(lat="north"), "malformed"),
        (report(time="now"), "malformed"),
        (report(lat=float("nan")), "non-finite"),
        (report(lat=91.0), "implausible"),
        (b" " * 20000, "oversized"),
    ],
)
def test_what_gpsd_should_not_say(line: bytes, kind: str) -> None:
    with pytest.raises(RefusedError) as refused:
        gpsd.parse(line)
    assert str(refused.value) == kind


def nmea_log(path: Path, seconds: int) -> None:
    """Write the log of a receiver that drives north at 10 m/s."""
    with path.open("w") as file:
        for k in range(seconds):
            minutes = 30.0 + 10.0 * k / 1852.0
            place = f"48{minutes:08.5f},N,01115.00000,W"
            bodies = (
                f"GPGGA,1200{k:02d}.00,{place},1,09,0.9,473.0,M,47.0,M,,",
                "GPGSA,A,3,01,02,03,04,05,06,07,08,09,,,,1.5,0.9,1.2",
                f"GPRMC,1200{k:02d}.00,A,{place},19.44,0.0,040326,,,A",
            )
            for body in bodies:
                file.write(f"${body}*{reduce(lambda a, b: a ^ ord(b), body, 0):02X}\r\n")


@pytest.mark.skipif(
    shutil.which("gpsfake") is None or shutil.which("gpsd") is None, reason="gpsd and gpsfake are not installed"
)
def test_a_running_gpsd(tmp_path: Path) -> None:
    nmea_log(tmp_path / "drive.nmea", 40)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    fake = subprocess.Popen(
        ["gpsfake", "-q", "-c", "0.05", "-P", str(port), str(tmp_path / "drive.nmea")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    source = open_source(f"gpsd://127.0.0.1:{port}", NAMES)
    try:
        with reading(source) as received:
            wait_for(lambda: len(received) >= 5)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(fake.pid, 15)
        fake.wait(FAR)
    for fix in received:
        assert isinstance(fix, GnssFix)
        second = fix.time % 60
        assert np.degrees(fix.position[0]) == pytest.approx(48.5 + 10.0 * second / 1852.0 / 60.0, abs=2e-7)
        assert np.degrees(fix.position[1]) == pytest.approx(-11.25)
        assert fix.position[2] == pytest.approx(520.0, abs=0.5)
        # gpsd's own figures for the dilutions of precision in the log: 0.9 x 19 m, 1.2 x 23 m
        np.testing.assert_allclose(fix.position_std, [17.1 / 2.45, 17.1 / 2.45, 27.6 / 1.96])


# --- MAVLink ----------------------------------------------------------------------------------------------------------


def autopilot() -> tuple[object, Callable[[object], bytes]]:
    common = pytest.importorskip("pymavlink.dialects.v20.common")
    link = common.MAVLink(None, srcSystem=1)
    return common, lambda message: message.pack(link)


def read_mavlink(datagrams: list[bytes], names: tuple[str, ...] = NAMES) -> tuple[list[Sample], Counter[str]]:
    from polyins.live.mavlink import MavlinkReader

    reader, counts = MavlinkReader(names), Counter()
    return [sample for datagram in datagrams for sample in reader(datagram, counts)], counts


def test_imus_of_an_autopilot() -> None:
    common, packed = autopilot()
    messages = []
    for k in range(5):
        ms = 1000 + 20 * k
        messages += [
            common.MAVLink_raw_imu_message(1000 * ms, 100, 0, -1000, 10, 20, 30, 0, 0, 0),
            common.MAVLink_scaled_imu2_message(ms, 200, 0, -1000, 40, 50, 60, 0, 0, 0),
            common.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3),
        ]
    samples, counts = read_mavlink([packed(m) for m in messages])
    assert [e.imu for e in samples] == ["imu1", "imu2"] * 4
    np.testing.assert_allclose([e.time for e in samples[::2]], [1.02, 1.04, 1.06, 1.08])
    np.testing.assert_allclose(samples[0].dtheta, 0.02 * np.array([0.01, 0.02, 0.03]))
    np.testing.assert_allclose(samples[1].dvel, 0.02 * 9.80665 * np.array([0.2, 0.0, -1.0]))
    assert not counts


def test_the_finest_message_of_an_imu_is_followed() -> None:
    common, packed = autopilot()
    fine = [
        common.MAVLink_highres_imu_message(10_000 * k, 0.1, 0.2, -9.8, 0.01, 0.02, 0.03, *[0.0] * 7, 0)
        for k in range(4)
    ]
    coarse = [common.MAVLink_raw_imu_message(10_000 * k, 9, 9, 9, 9, 9, 9, 0, 0, 0) for k in range(4)]
    samples, _ = read_mavlink([packed(m) for pair in zip(coarse, fine, strict=True) for m in pair])
    assert len(samples) == 3
    for sample in samples:
        np.testing.assert_allclose(sample.dvel, 0.01 * np.array([0.1, 0.2, -9.8]), rtol=1e-6)


def test_gnss_of_an_autopilot() -> None:
    common, packed = autopilot()
    raw = common.MAVLink_gps_raw_int_message(
        5_000_000, 3, 485000000, -112500000, 473000, 90, 120, 500, 0, 9, 520000, 1500, 2500, 300, 0
    )
    given = common.MAVLink_gps_input_message(
        6_000_000, 0, 0, 0, 0, 3, 485000000, -112500000, 473.0, 0.9, 1.2, 1.0, 2.0, 3.0, 0.25, 1.5, 2.5, 9
    )
    none = common.MAVLink_gps_raw_int_message(7_000_000, 1, 0, 0, 0, 0, 0, 0, 0, 0)
    (first, second), counts = read_mavlink([packed(raw), packed(given), packed(none)])
    assert first.time == 5.0
    np.testing.assert_allclose(first.position, [np.radians(48.5), np.radians(-11.25), 520.0])
    np.testing.assert_allclose(first.position_std, [1.5, 1.5, 2.5])
    assert (first.above_sea, second.above_sea) == (False, True)
    np.testing.assert_allclose(second.velocity, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(second.velocity_std, [0.25] * 3)
    assert counts == {"no fix in three dimensions": 1}


def test_what_an_autopilot_should_not_send() -> None:
    common, packed = autopilot()

    def imu(ms: int) -> bytes:
        return packed(common.MAVLink_scaled_imu3_message(ms, 0, 0, -1000, 0, 0, 0, 0, 0, 0))

    damaged = bytearray(imu(1100))
    damaged[15] ^= 0xFF
    samples, counts = read_mavlink(
        [imu(1000), imu(1020), imu(1020), imu(1010), b"\xfd\x00", b"junk", bytes(damaged), imu(1040)]
    )
    np.testing.assert_allclose([e.time for e in samples], [1.02, 1.04])
    assert (counts["duplicated"], counts["reordered"]) == (1, 1)
    assert counts["malformed"] > 0
    _, counts = read_mavlink([imu(1000), imu(1020)], NAMES[:2])
    assert counts["unknown IMU"] == 2
