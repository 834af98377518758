"""DataFlash logs written byte by byte, in the forms of messages that ArduPilot had and has."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from polyins.formats.dataflash import read
from polyins.formats.recognize import data_format
from polyins.model.rig import DEG

PACKED = {
    "B": "B",
    "H": "H",
    "I": "I",
    "Q": "Q",
    "f": "f",
    "c": "h",
    "C": "H",
    "e": "i",
    "L": "i",
    "N": "16s",
    "n": "4s",
}
SCALES = {"c": 100.0, "C": 100.0, "e": 100.0, "L": 1e7}
OLD_IMU = ("QffffffIIf", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,ErrG,ErrA,Temp")
NEW_IMU = ("QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")
OLD_GPS = ("QBIHBcLLefffB", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,U")
NEW_GPS = ("QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U")
OLD_GPA = ("QCCCCBI", "TimeUS,VDop,HAcc,VAcc,SAcc,VV,SMS")
NEW_GPA = ("QBCCCCfBIHf", "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,Und")
ATT = ("QccccCCCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw")
PARM = ("QNf", "TimeUS,Name,Value")
XKF1 = ("QBccCfffffff", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD")
WEEK, SECOND = 2244, 36000.0

Message = tuple[str, tuple[str, str], Sequence[float | bytes]]


def dataflash(path: Path, messages: Sequence[Message]) -> Path:
    """Write messages of a name, format and columns, and values in the units of the columns."""
    content = _format(128, "FMT", ("BBnNZ", "Type,Length,Name,Format,Columns"), 89)
    numbers: dict[str, int] = {}
    for name, form, values in messages:
        if name not in numbers:
            numbers[name] = 129 + len(numbers)
            content += _format(numbers[name], name, form, 3 + struct.calcsize(_code(form)))
        packed = [
            value if isinstance(value, bytes) or kind == "f" else round(value * SCALES.get(kind, 1.0))
            for kind, value in zip(form[0], values, strict=True)
        ]
        content += bytes([0xA3, 0x95, numbers[name]]) + struct.pack(_code(form), *packed)
    path.write_bytes(content)
    return path


def _code(form: tuple[str, str]) -> str:
    return "<" + "".join(PACKED[kind] for kind in form[0])


def _format(number: int, name: str, form: tuple[str, str], length: int) -> bytes:
    texts = (text.encode().ljust(size, b"\0") for text, size in ((name, 4), (form[0], 16), (form[1], 64)))
    return bytes([0xA3, 0x95, 128, number, length]) + b"".join(texts)


def stamps(count: int = 100, step: float = 0.04, begin: float = 10.0) -> np.ndarray:
    return begin + step * np.arange(count)


def new_forms(count: int = 100) -> list[Message]:
    """Two IMUs, the second with a gap, two receivers with accuracies, the attitude, a filter of two cores."""
    found: list[Message] = []
    for k, t in enumerate(stamps(count)):
        us = 1e6 * t
        for number in (0, 1):
            if number == 0 or not 40 <= k < 60:
                rate = [0.1 + number, 0.0, 0.0]
                found.append(("IMU", NEW_IMU, [us, number, *rate, 0.0, 0.0, -9.8, 0, 0, 20.0, 1, 1, 1000, 1000]))
        if k % 5 == 0:
            gms = 1e3 * (SECOND + t - 10.0)
            for number in (0, 1):
                place = [48.0, 11.0, 454.0, 5.0, 90.0, -1.0, 0.0, 1]
                found.append(("GPS", NEW_GPS, [us, number, 3, gms, WEEK, 12, 0.7, *place]))
                found.append(("GPA", NEW_GPA, [us, number, 1.0, 0.5, 0.9, 0.2, 0.0, 1, 1e3 * t, 200, -46.0]))
            found.append(("ATT", ATT, [us, 0, 1.0, 0, 2.0, 0, 123.0, 0, 0]))
            found += [("XKF1", XKF1, [us, core, 1.0, 2.0, 123.0, 1, 2, 3, 0, 4, 5, -6]) for core in (0, 1)]
    return found


def test_new_forms_tell_instances_by_a_number(tmp_path: Path) -> None:
    path = dataflash(tmp_path / "a.bin", new_forms())
    assert data_format(path) == "dataflash"
    log = read(path)
    assert {name: len(rows.time) for name, rows in log.imus.items()} == {"IMU[0]": 100, "IMU[1]": 80}
    np.testing.assert_allclose(log.imus["IMU[1]"].dtheta[:, 0] / 0.04, 1.1, rtol=1e-5)
    np.testing.assert_allclose(log.imus["IMU[0]"].time, stamps(), atol=1e-6)
    assert set(log.unusable) == {"GPS[1]", "XKF1[0]", "XKF1[1]"}
    track = log.tracks["GPS[0]"]
    # GPA.Und: the height above the sea less that above the ellipsoid
    assert not track.above_sea
    np.testing.assert_allclose(track.position[0], [48 * DEG, 11 * DEG, 500.0], rtol=1e-9)
    np.testing.assert_allclose(track.velocity[0], [0.0, 5.0, -1.0], atol=1e-6)
    np.testing.assert_allclose(track.position_std[0], [0.5, 0.5, 0.9])
    np.testing.assert_allclose(log.sensors["ATT"].value, 123.0 * DEG)
    np.testing.assert_allclose(log.tracks["XKF1[1]"].position[0], [4.0, 5.0, 6.0])
    utc = 315964800 + WEEK * 604800 + SECOND - 18  # leap seconds since 2017
    assert log.utc_of_zero == pytest.approx(utc - 10.0, abs=1e-3)


def test_a_week_before_there_is_a_fix_tells_no_utc(tmp_path: Path) -> None:
    place = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1]
    early: Message = ("GPS", NEW_GPS, [9.9e6, 0, 1, 1e3 * SECOND, WEEK + 1024, 0, 99.0, *place])
    with_it = read(dataflash(tmp_path / "a.bin", [early, *new_forms(20)]))
    assert with_it.utc_of_zero == read(dataflash(tmp_path / "b.bin", new_forms(20))).utc_of_zero


def old_forms(begin: float, count: int = 50) -> list[Message]:
    found: list[Message] = []
    for k, t in enumerate(stamps(count, begin=begin)):
        us = 1e6 * t
        found += [(name, OLD_IMU, [us, 0.1, 0, 0, 0, 0, -9.8, 0, 0, 20.0]) for name in ("IMU", "IMU2")]
        if k % 5 == 0:
            found.append(
                ("GPS", OLD_GPS, [us, 3, 1e3 * (SECOND + t), WEEK, 9, 1.0, 48.0, 11.0, 454.0, 5.0, 0.0, 0.0, 1])
            )
            found.append(("GPA", OLD_GPA, [us, 1.0, 0.5, 0.9, 0.2, 1, 1e3 * t]))
    return found


def test_old_forms_and_a_pause(tmp_path: Path) -> None:
    places: list[Message] = [
        ("PARM", PARM, [0, f"{name}_{axis}".encode(), value])
        for name, three in (("GPS_POS1", (0.3, 0.0, -0.2)), ("INS_POS1", (0.1, 0.0, 0.0)))
        for axis, value in zip("XYZ", three, strict=True)
    ]
    log = read(dataflash(tmp_path / "a.bin", [*places, *old_forms(10.0), *old_forms(300.0)]))
    assert list(log.imus) == ["IMU", "IMU2"]
    assert np.diff(log.imus["IMU"].time).max() == pytest.approx(300.0 - 10.0 - 49 * 0.04, abs=1e-6)
    assert log.tracks["GPS"].above_sea
    assert log.antenna == pytest.approx((0.2, 0.0, -0.2))
    assert log.upright


def test_a_torn_end_costs_its_last_message(tmp_path: Path) -> None:
    path = dataflash(tmp_path / "a.bin", old_forms(10.0))
    path.write_bytes(path.read_bytes()[:-60])
    log = read(path)
    assert 48 <= len(log.imus["IMU2"].time) < 50


def test_damage_on_the_way_is_told_and_nothing_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = dataflash(tmp_path / "a.bin", old_forms(10.0, count=400))
    whole = read(path)
    assert whole.notes == ()
    content = bytearray(path.read_bytes())
    content[9000:9700] = b"\x55" * 700
    path.write_bytes(content)
    log = read(path)
    assert 370 < len(log.imus["IMU"].time) < 400
    assert "bytes on the way are no messages" in log.notes[0]
    assert capsys.readouterr().out == ""
