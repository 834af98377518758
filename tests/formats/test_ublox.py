"""Messages of u-blox receivers, written by pyubx2: its sensors come out on the clock of GNSS."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyubx2 import GET, UBXMessage

from polyins.formats.recognize import data_format
from polyins.formats.ublox import read
from polyins.model.rig import DEG

OFFSET = 172800.0 - 55.5
"""GPS time less the sensors' time, s"""


def bits(value: float, unit: float) -> int:
    return round(value / unit) & 0xFFFFFF


def meas(tag_s: float, data: Sequence[tuple[int, int]]) -> bytes:
    words = [value | kind << 24 for kind, value in data]
    payload = struct.pack(f"<IHH{len(data)}I", round(tag_s * 1e3), len(data) << 11, 0, *words)
    return UBXMessage("ESF", "ESF-MEAS", GET, payload=payload).serialize()


def gyro(tag_s: float, rates_deg_s: Sequence[float]) -> bytes:
    return meas(tag_s, [(kind, bits(rate, 1 / 4096)) for kind, rate in zip((14, 13, 5), rates_deg_s, strict=True)])


def accel(tag_s: float, force: Sequence[float]) -> bytes:
    return meas(tag_s, [(kind, bits(one, 1 / 1024)) for kind, one in zip((16, 17, 18), force, strict=True)])


def pvt(gps_s: float, north: float = 0.0, kind: str = "NAV-PVT", **more: Any) -> bytes:
    known = {"iTOW": round(gps_s % 604800.0 * 1e3), "fixType": 3, "numSV": 12}
    date = {"year": 2024, "month": 1, "day": 30, "hour": 0, "min": 0, "validDate": 1, "validTime": 1}
    date |= {"second": 0} if kind == "NAV-PVT" else {"sec": 0}
    good = {"gnssFixOk": 1} if kind == "NAV-PVT" else {"gnssFixOK": 1}
    place = {"lat": 48.0, "lon": 11.0, "height": 500000, "hMSL": 454000, "hAcc": 800, "vAcc": 1200}
    values = known | date | good | place | {"velN": round(north * 1e3), "sAcc": 100} | more
    return UBXMessage("NAV", kind, GET, **values).serialize()


def ins(gps_s: float, rates_deg_s: Sequence[float]) -> bytes:
    rates = [round(rate * 1e3) for rate in rates_deg_s]
    payload = struct.pack("<IIIiiiiii", 0x3F01, 0, round(gps_s * 1e3), *rates, 0, 0, 981)
    return UBXMessage("ESF", "ESF-INS", GET, payload=payload).serialize()


def drive(seconds: int = 40, latency: float = 0.3, told: bool = False) -> bytes:
    """Rates at 10 Hz, forces 5 ms later, fixes at 1 Hz that come after `latency`; `told`: and the rates used."""
    sent: list[tuple[float, bytes]] = []
    for k in range(10 * seconds):
        tag = 60.0 + 0.1 * k
        rate = [0.0, 0.0, 30.0 * np.sin(0.7 * tag) + 15.0 * np.sin(2.0 * tag)]
        sent.append((tag + 0.02, accel(tag + 0.005, [0.0, 1.0, 9.8])))
        sent.append((tag + 0.021, gyro(tag, rate)))
    for k in range(1, seconds):
        tag = 60.0 + k
        rate = [0.0, 0.0, 30.0 * np.sin(0.7 * tag) + 15.0 * np.sin(2.0 * tag)]
        sent.append((tag + latency, pvt(tag + OFFSET, 10.0)))
        sent += [(tag + latency + 0.001, ins(tag + OFFSET, rate))] if told else []
    return b"".join(message for _, message in sorted(sent, key=lambda one: one[0]))


def write(path: Path, content: bytes) -> Path:
    path.write_bytes(b"# a comment\n" + content)
    return path


def test_gyro_and_accelerometer_are_one_imu_on_the_clock_of_gnss(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.ubx", drive(told=True)))
    rows = log.imus["ESF-MEAS"]
    assert (log.clock, len(rows.time)) == ("gps-week", 400)
    np.testing.assert_allclose(rows.time, 60.0 + 0.1 * np.arange(400) + OFFSET, atol=3e-3)
    np.testing.assert_allclose(rows.dvel / 0.1, np.tile([0.0, 1.0, 9.8], (400, 1)), atol=1e-3)
    tag = 60.0 + 0.1 * np.arange(400)
    turned = (30.0 * np.sin(0.7 * tag) + 15.0 * np.sin(2.0 * tag)) * DEG
    np.testing.assert_allclose(rows.dtheta[:, 2] / 0.1, turned, atol=1e-5)
    assert log.clock_offsets["ESF-MEAS"] == pytest.approx(OFFSET, abs=3e-3)
    assert "agree with ESF-INS" in log.notes[0]


def test_without_rates_that_tell_the_order_of_messages_bounds_the_clock_and_that_is_said(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.ubx", drive(latency=0.3)))
    # a solution comes later than what it was made of, and nothing says by how much
    assert OFFSET - 0.4 < log.clock_offsets["ESF-MEAS"] < OFFSET
    assert "by the order of the messages alone" in log.notes[0]


def test_a_sensor_without_solutions_keeps_its_own_time(tmp_path: Path) -> None:
    content = b"".join(gyro(1.0 + 0.1 * k, [1, 2, 3]) + accel(1.0 + 0.1 * k, [0, 0, 9.8]) for k in range(30))
    log = read(write(tmp_path / "a.ubx", content))
    assert (log.clock, log.utc_of_zero) == ("boot", None)
    assert log.imus["ESF-MEAS"].time[0] == 1.0
    assert "no message tells GPS time" in log.notes[0]


def raw(tick: int, samples: int) -> bytes:
    values = [(14, 4096), (13, 0), (5, -4096), (16, 0), (17, 0), (18, 1024)]
    words = [
        struct.pack("<II", value & 0xFFFFFF | kind << 24, (tick + 256 * k) % (1 << 24))
        for k in range(samples)
        for kind, value in values
    ]
    return UBXMessage("ESF", "ESF-RAW", GET, payload=b"\0\0\0\0" + b"".join(words)).serialize()


def test_raw_data_hold_several_samples_and_their_counter_wraps(tmp_path: Path) -> None:
    begin = (1 << 24) - 256 * 35
    content = b"".join(raw((begin + 2560 * k) % (1 << 24), 10) + pvt(100000.0 + 0.1 * k) for k in range(8))
    rows = read(write(tmp_path / "a.ubx", content)).imus["ESF-RAW"]
    assert len(rows.time) == 80
    np.testing.assert_allclose(np.diff(rows.time), 0.01, atol=1e-9)
    np.testing.assert_allclose(rows.dtheta / 0.01, np.tile([DEG, 0, -DEG], (80, 1)), atol=1e-12)
    np.testing.assert_allclose(rows.dvel[:, 2] / 0.01, 1.0)


def ticking(kinds: Sequence[int], per_second: int, wrapped_from: int = 0, backward: int = 0) -> bytes:
    content = b""
    for k in range(400):
        tag = 60.0 + 0.1 * k
        count = (wrapped_from + per_second * k // 10) % (1 << 23) | backward << 23
        content += meas(tag, [(kind, count) for kind in kinds])
        content += pvt(tag + OFFSET, 10.0) if k % 10 == 9 else b""
    return content


def test_ticks_of_a_wheel_are_a_speed_where_fixes_tell_how_long_one_is(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.ubx", ticking([8, 7], 500, wrapped_from=(1 << 23) - 1000)))
    ticks, speed = log.sensors["ESF-MEAS rear-left"], log.sensors["ESF-MEAS rear-left speed"]
    assert (ticks.kind, speed.kind) == ("ticks", "odometer")
    np.testing.assert_allclose(ticks.value, 50.0 * np.arange(400))
    np.testing.assert_allclose(speed.value, 10.0)
    assert "0.02 m a tick" in log.unusable["ESF-MEAS rear-left"]
    assert "only one odometer" in log.unusable["ESF-MEAS front-right speed"]
    assert "ESF-MEAS rear-left speed" not in log.unusable


def test_a_wheel_goes_backward_by_its_bit(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.ubx", ticking([10], 100, backward=1)))
    np.testing.assert_allclose(log.sensors["ESF-MEAS single tick"].value, -10.0 * np.arange(400))


def test_an_open_pin_is_said(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.ubx", ticking([10], 0)))
    assert "its pin is open" in log.unusable["ESF-MEAS single tick"]
    assert not any(one.kind == "odometer" for one in log.sensors.values())


def test_positions_of_a_receiver_that_fuses_and_its_heading(tmp_path: Path) -> None:
    heading = {"vehHeading": 123.25, "vehHeadingValid": 1, "accHeading": 1.5}
    content = b"".join(pvt(100000.0 + k, 3.0, "NAV-PVAT", **heading) for k in range(5))
    log = read(write(tmp_path / "a.ubx", content))
    track, shown = log.tracks["NAV-PVAT"], log.sensors["NAV-PVAT"]
    np.testing.assert_allclose(track.position[0], [48.0 * DEG, 11.0 * DEG, 500.0])
    np.testing.assert_allclose(track.position_std[0], [0.8, 0.8, 1.2])
    np.testing.assert_allclose(track.velocity[0], [3.0, 0.0, 0.0])
    np.testing.assert_allclose(track.velocity_std[0], 0.1)
    np.testing.assert_allclose(shown.value, 123.25 * DEG)
    np.testing.assert_allclose(shown.std, 1.5 * DEG)


def test_stamps_run_on_over_the_week_and_leap_seconds_are_those_of_the_day(tmp_path: Path) -> None:
    times = 604800.0 + np.arange(-3.0, 4.0)
    late = {"year": 2016, "month": 12, "day": 31, "hour": 23, "min": 59, "second": 40}  # 17 s ahead of UTC until then
    content = b"".join(pvt(time, **late) for time in times)
    log = read(write(tmp_path / "a.ubx", content))
    np.testing.assert_allclose(log.tracks["NAV-PVT"].time, times)
    assert log.utc_of_zero == np.datetime64("2016-12-25T00:00:00", "s").astype(float) - 17.0


def gga(second: int) -> bytes:
    body = f"GNGGA,0000{second:02d}.00,4800.00000,N,01100.00000,E,4,12,0.6,454.0,M,46.0,M,,"
    return f"${body}*{reduce(xor, body.encode()):02X}\r\n".encode()


RTCM = bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")


def test_between_nmea_and_rtcm_and_damage_no_message_is_lost(tmp_path: Path) -> None:
    # a length that damage made too large must not swallow what comes after it
    torn = pvt(99999.0)[:4] + b"\xff\x0f" + pvt(99999.0)[6:40]
    content = torn + b"".join(gga(k) + RTCM + pvt(172818.0 + k) for k in range(6)) + pvt(172900.0)[:50]
    path = write(tmp_path / "a.ubx", content)
    assert data_format(path) == "ubx"
    log = read(path)
    np.testing.assert_allclose(log.tracks["NAV-PVT"].time, 172818.0 + np.arange(6))
    np.testing.assert_allclose(log.tracks["NAV-PVT"].position[0, 2], 500.0)


def test_sentences_come_out_on_the_clock_of_the_messages(tmp_path: Path) -> None:
    zda = b"$GNZDA,000000.00,30,01,2024,00,00*7E\r\n"
    content = zda + b"".join(gga(k) + pvt(172818.0 + k) for k in range(6))
    log = read(write(tmp_path / "a.ubx", content))
    np.testing.assert_allclose(log.tracks["GGA"].time, 172818.0 + np.arange(6))
    assert "NAV-PVT is of the same receiver" in log.unusable["GGA"]
    alone = read(write(tmp_path / "b.ubx", zda + b"".join(gga(k) for k in range(6)) + ins(1.0, [0, 0, 0])))
    assert (alone.clock, len(alone.tracks["GGA"].time)) == ("unix", 6)


def test_a_time_that_the_receiver_had_not_yet_does_not_count(tmp_path: Path) -> None:
    early = b"".join(pvt(500.0 + k, fixType=0, gnssFixOk=0) for k in range(3))
    right = read(write(tmp_path / "a.ubx", drive()))
    wrong = read(write(tmp_path / "b.ubx", early + drive()))
    assert wrong.clock_offsets["ESF-MEAS"] == pytest.approx(right.clock_offsets["ESF-MEAS"], abs=0.05)


def test_a_sensor_whose_clock_begins_anew_is_named(tmp_path: Path) -> None:
    again = b"".join(gyro(1.0 + 0.1 * k, [1, 2, 3]) + accel(1.0 + 0.1 * k, [0, 0, 9.8]) for k in range(30))
    log = read(write(tmp_path / "a.ubx", drive() + again))
    assert len(log.imus["ESF-MEAS"].time) == 400
    assert any("began anew" in text for text in log.notes)
