"""NMEA, read by pynmeagps."""

from pathlib import Path
from typing import Any

import numpy as np
import pynmeagps
from exported import exported, known
from synthetic_solutions import Drive

from polyins.formats.nmea_log import read
from polyins.model.solution import NO_INNOVATIONS as NONE
from polyins.model.solution import Innovations
from polyins.tools.export.writing import ExportOptions, export

BY_FIXES: dict[str, Innovations] = {"GNSS position": NONE}


def messages(path: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        for _, message in pynmeagps.NMEAReader(file, validate=pynmeagps.VALCKSUM, quitonerror=pynmeagps.ERR_RAISE):
            found.setdefault(message.msgID, []).append(message)
    return found


def test_four_sentences_a_row(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "nmea", ExportOptions(geoid_height_m=-12.0), measurements=BY_FIXES)
    found = messages(path)
    assert {name: len(some) for name, some in found.items()} == dict.fromkeys(
        ("GGA", "RMC", "HDT", "GST"), truth.time.size
    )
    gga, rmc, hdt, gst = (found[name][1] for name in ("GGA", "RMC", "HDT", "GST"))
    np.testing.assert_allclose([gga.lat, gga.lon], np.degrees(truth.geodetic[1, :2]), atol=2e-8)
    assert (gga.alt, gga.sep, gga.quality) == (32.0, -12.0, 1)
    assert (str(rmc.date), str(rmc.time), rmc.status) == ("2024-05-01", "12:00:00.050000", "A")
    np.testing.assert_allclose(rmc.spd, 8.0 / 1852.0 * 3600.0, atol=0.01)
    np.testing.assert_allclose(hdt.headingT, np.degrees(truth.euler[1, 2]), atol=0.01)
    assert (gst.stdLat, gst.stdLong, gst.stdAlt) == (0.1, 0.2, 0.3)


def test_coasting_is_dead_reckoning_and_so_is_all_without_fixes(tmp_path: Path) -> None:
    path, _ = exported(tmp_path, "nmea", measurements=BY_FIXES)
    assert [message.quality for message in messages(path)["GGA"]] == [1] * 101 + [6] * 100
    _, made = known()
    export(made, tmp_path / "wheels.nmea", "nmea")
    assert {message.quality for message in messages(tmp_path / "wheels.nmea")["GGA"]} == {6}


def test_polyins_reads_it_back(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "nmea", ExportOptions(rate_hz=1.0, geoid_height_m=-12.0), measurements=BY_FIXES)
    track = read(path).tracks["GGA"]
    _compare(track.position, truth)
    assert track.time[0] == 1714564800.0


def _compare(position: np.ndarray, truth: Drive) -> None:
    np.testing.assert_allclose(position[:, :2], truth.geodetic[: len(position) * 20 : 20, :2], atol=1e-9)
    np.testing.assert_allclose(position[:, 2], 20.0, atol=0.011)
