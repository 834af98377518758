"""Positions of NMEA sentences."""

from __future__ import annotations

from datetime import UTC, datetime
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.nmea_log import read
from polyins.formats.recognize import data_format
from polyins.model.rig import DEG


def write(path: Path, *bodies: str) -> Path:
    lines = [f"${body}*{reduce(xor, body.encode()):02X}" for body in bodies]
    path.write_text("# a comment\r\n" + "\r\n".join(lines) + "\r\n")
    return path


def gga(time: str, quality: int = 4, separation: str = "46.0") -> str:
    return f"GNGGA,{time},4730.00000,S,01115.00000,W,{quality},12,0.6,500.0,M,{separation},M,,"


RMC = "GNRMC,235959.00,A,4730.00000,S,01115.00000,W,1.0,90.0,311222,,,A,V"


def test_dates_go_on_over_midnight(tmp_path: Path) -> None:
    path = write(tmp_path / "a.nmea", gga("235958.50"), RMC, gga("235959.50"), gga("000000.50"))
    assert data_format(path) == "nmea"
    track = read(path).tracks["GGA"]
    last = datetime(2023, 1, 1, tzinfo=UTC).timestamp() + 0.5
    np.testing.assert_allclose(track.time, [last - 2.0, last - 1.0, last])
    np.testing.assert_allclose(track.position[0], [-47.5 * DEG, -11.25 * DEG, 546.0])
    assert not track.above_sea
    assert track.position_std is None


def test_std_counts_only_where_every_fix_has_it(tmp_path: Path) -> None:
    gst = "GNGST,235959.50,1.0,,,,0.3,0.4,0.9"
    one = read(write(tmp_path / "a.nmea", RMC, gga("235959.50"), gst)).tracks["GGA"]
    np.testing.assert_array_equal(one.position_std, [[0.3, 0.4, 0.9]])
    two = read(write(tmp_path / "b.nmea", RMC, gga("235959.50"), gst, gga("000000.50"))).tracks["GGA"]
    assert two.position_std is None


def test_heights_without_separation_are_above_the_sea(tmp_path: Path) -> None:
    track = read(write(tmp_path / "a.nmea", RMC, gga("235959.50", separation=""))).tracks["GGA"]
    assert track.above_sea
    assert track.position[0, 2] == 500.0


def test_what_is_not_measured_or_damaged_is_left_out(tmp_path: Path) -> None:
    path = write(tmp_path / "a.nmea", RMC, gga("235959.50"), gga("000000.50", quality=6), gga("000001.50"))
    text = path.read_text()
    path.write_text(text.replace("000001.50", "000002.50"))  # its checksum no longer fits
    track = read(path).tracks["GGA"]
    assert len(track.time) == 1
    assert track.quality == {"fix": 1, "estimated": 1}


def test_without_a_date_it_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no sentence tells the date; expected RMC or ZDA"):
        read(write(tmp_path / "a.nmea", gga("235959.50")))
