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


def test_days_go_on_without_another_date(tmp_path: Path) -> None:
    hours = [f"{(20 + 5 * k) % 24:02d}0000.00" for k in range(8)]  # 20 h, 1 h, 6 h ... over two midnights
    rmc = RMC.replace("235959.00", hours[0])
    track = read(write(tmp_path / "a.nmea", rmc, *(gga(hour) for hour in hours))).tracks["GGA"]
    begin = datetime(2022, 12, 31, 20, tzinfo=UTC).timestamp()
    np.testing.assert_allclose(track.time, begin + 5 * 3600.0 * np.arange(8))


def test_a_std_that_was_lost_is_that_of_the_nearest(tmp_path: Path) -> None:
    stated = [f"GNGST,00000{k}.00,1.0,,,,0.{k + 1},0.4,0.9" for k in (0, 1, 3)]
    track = read(write(tmp_path / "a.nmea", RMC, *(gga(f"00000{k}.00") for k in range(4)), *stated)).tracks["GGA"]
    np.testing.assert_array_equal(track.position_std[:, 0], [0.1, 0.2, 0.2, 0.4])
    assert "1 of 4 fixes have no std" in track.warnings[0]


def test_speeds_and_headings_are_streams(tmp_path: Path) -> None:
    fixes = [
        body
        for k in range(4)
        for body in (gga(f"00000{k}.00"), "GPHDT,10.0,T", "GPVTG,90.0,T,,M,10.0,N,18.52,K,A", "GPHDT,12.0,T")
    ]
    log = read(write(tmp_path / "a.nmea", RMC, *fixes, "GPTHS,11.5,A", "GPTHS,11.5,V"))
    heading, speed = log.sensors["HDT"], log.sensors["VTG"]
    begin = datetime(2023, 1, 1, tzinfo=UTC).timestamp()
    np.testing.assert_allclose(heading.time - begin, 0.25 + 0.5 * np.arange(8))
    np.testing.assert_allclose(heading.value / DEG, [10.0, 12.0] * 4)
    assert (speed.kind, len(speed.time)) == ("speed", 4)
    np.testing.assert_allclose(speed.value, 10.0 * 1852 / 3600)
    np.testing.assert_allclose(log.sensors["RMC"].value, 1852 / 3600)
    assert len(log.sensors["THS"].time) == 1
    assert log.unusable == {"THS": "HDT is used"}
    assert log.notes == ("GGA: no sentence (GST) tells how good the positions are",)


@pytest.mark.parametrize(
    ("sentence", "variation", "heading"),
    [("HCHDG,10.0,2.0,W,3.0,E", "", 11.0), ("HCHDG,1.0,,,3.0,W", "", 358.0), ("HCHDG,10.0,,,,", "4.0,W", 6.0)],
)
def test_a_magnetic_heading_takes_its_variation(tmp_path: Path, sentence: str, variation: str, heading: float) -> None:
    rmc = RMC.replace("311222,,", f"311222,{variation or ','}")
    log = read(write(tmp_path / "a.nmea", rmc, gga("000000.00"), sentence))
    np.testing.assert_allclose(log.sensors["HDG"].value / DEG, heading)
    assert not log.unusable


def test_a_magnetic_heading_without_variation_is_not_used(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.nmea", RMC, gga("000000.00"), "HCHDG,10.0,,,,"))
    assert "magnetic" in log.unusable["HDG"]


def test_positions_of_gns(tmp_path: Path) -> None:
    gns = "GNGNS,000000.00,4730.00000,N,01115.00000,E,RF,12,0.6,500.0,46.0,,"
    track = read(write(tmp_path / "a.nmea", RMC, gns)).tracks["GNS"]
    np.testing.assert_allclose(track.position[0], [47.5 * DEG, 11.25 * DEG, 546.0])
    assert track.quality == {"float": 1}


def test_a_field_that_is_no_number_costs_its_sentence(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.nmea", RMC, gga("000000.00"), gga("00x001.00"), gga("000002.00")))
    assert len(log.tracks["GGA"].time) == 2
    assert "1 sentences" in log.notes[0]
