"""Text files of SBG's sbgBasicLogger."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.recognize import data_format, read_log
from polyins.formats.sbg import read

IMU = (
    "timestamp\tstatus\taccelX\taccelY\taccelZ\tgyroX\tgyroY\tgyroZ\ttemperature\n"
    "(us)\t(na)\t(m.s^-2)\t(m.s^-2)\t(m.s^-2)\t(deg.s^-1)\t(deg.s^-1)\t(deg.s^-1)\t(degC)\n"
)
POS = (
    "timestamp\tstatus\tstatusExt\tgpsTow\tlatitude\tlongitude\taltitude\tundulation\tlatitudeStd\tlongitudeStd\t"
    "altitudeStd\tnumSvTracked\n(us)\t(na)\t(na)\t(ms)\t(deg)\t(deg)\t(m)\t(m)\t(m)\t(m)\t(m)\t(na)\n"
)
VEL = (
    "timestamp\tstatus\tgpsTow\tvelN\tvelE\tvelD\tvelStdN\tvelStdE\tvelStdD\ttrack\ttrackStd\n"
    "(us)\t(na)\t(ms)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t(deg)\t(deg)\n"
)


def folder(tmp_path: Path, *, begin: int = 1_000_000, rows: int = 100) -> Path:
    path = tmp_path / "log"
    path.mkdir()
    stamps = [(begin + 5000 * k) % 2**32 for k in range(rows)]
    for name in ("imuData", "imuShort"):
        lines = [f"{t:10}\t0x0000007F\t0.1\t0.2\t-9.8\t1.0\t2.0\t3.0\t25.0\n" for t in stamps]
        (path / f"{name}.txt").write_text(IMU + "".join(lines))
    fixes = [(stamps[k], 200 * k, 48.0 + 1e-6 * k, 11.0) for k in range(0, rows, 20)]
    fixes[0] = (*fixes[0][:2], 0.0, 0.0)
    lines = [f"{t:10}\t1\t0\t{tow}\t{lat}\t{lon}\t450.0\t47.5\t1.0\t1.5\t2.0\t12\n" for t, tow, lat, lon in fixes]
    (path / "gnss1Pos.txt").write_text(POS + "".join(lines))
    lines = [f"{t:10}\t1\t{tow}\t1.0\t2.0\t3.0\t0.1\t0.2\t0.3\t0\t0\n" for t, tow, *_ in fixes]
    (path / "gnss1Vel.txt").write_text(VEL + "".join(lines))
    return path


def test_imu_and_receiver(tmp_path: Path) -> None:
    path = folder(tmp_path)
    assert data_format(path) == "sbg"
    log = read_log(path)
    assert (list(log.imus), log.unusable) == (["imuShort", "imuData"], {"imuData": "is the same IMU"})
    rows, track = log.imus["imuShort"], log.tracks["gnss1Pos"]
    np.testing.assert_allclose(rows.time, 1.0 + 0.005 * np.arange(100))
    np.testing.assert_allclose(rows.dtheta[3], np.radians([1, 2, 3]) * 0.005)
    np.testing.assert_allclose(rows.dvel[3], np.array([0.1, 0.2, -9.8]) * 0.005)
    assert len(track.time) == 4
    np.testing.assert_allclose(track.position[0], [np.radians(48.00002), np.radians(11), 497.5])
    np.testing.assert_array_equal(track.position_std[0], [1.0, 1.5, 2.0])
    np.testing.assert_array_equal(track.velocity[0], [1, 2, 3])
    np.testing.assert_array_equal(track.velocity_std[0], [0.1, 0.2, 0.3])
    assert not track.above_sea


EULER = (
    "timestamp\tstatus\troll\tpitch\tyaw\trollStd\tpitchStd\tyawStd\n"
    "(us)\t(na)\t(deg)\t(deg)\t(deg)\t(deg)\t(deg)\t(deg)\n"
)
NAV = (
    "timestamp\tstatus\tvelN\tvelE\tvelD\tvelStdN\tvelStdE\tvelStdD\tlatitude\tlongitude\taltitude\tlatitudeStd\t"
    "longitudeStd\taltitudeStd\tundulation\n(us)\t(na)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t(m.s^-1)\t"
    "(deg)\t(deg)\t(m)\t(m)\t(m)\t(m)\t(m)\n"
)


@pytest.mark.parametrize("std", [2.0, 60.0])
def test_its_own_filter_is_a_reference_and_a_heading(std: float, tmp_path: Path) -> None:
    path = folder(tmp_path)
    stamps = [1_000_000 + 20_000 * k for k in range(25)]
    (path / "euler.txt").write_text(EULER + "".join(f"{t}\t7\t1.0\t2.0\t90.0\t0.1\t0.1\t{std}\n" for t in stamps))
    row = "{}\t7\t1\t2\t3\t0.1\t0.1\t0.1\t48.0\t11.0\t450.0\t1.0\t1.0\t1.0\t47.5\n"
    (path / "nav.txt").write_text(NAV + "".join(row.format(t) for t in stamps))
    log = read(path)
    assert log.references == {"nav"}
    track, heading = log.tracks["nav"], log.sensors["euler"]
    assert track.position[0, 2] == 497.5
    np.testing.assert_array_equal(track.velocity[3], [1, 2, 3])
    np.testing.assert_allclose(track.attitude[3], np.radians([1, 2, 90]))
    np.testing.assert_allclose((heading.value[3], heading.std[3]), np.radians([90, std]))
    assert ("euler" in log.unusable) == (std > 10.0)
    assert "nav" not in log.unusable


def test_without_undulation_heights_are_above_the_sea(tmp_path: Path) -> None:
    path = folder(tmp_path)
    text = (path / "gnss1Pos.txt").read_text().replace("undulation", "else").replace("\t47.5\t", "\t\t")
    (path / "gnss1Pos.txt").write_text(text)
    (path / "gnss1Vel.txt").unlink()
    track = read(path).tracks["gnss1Pos"]
    assert track.above_sea
    assert track.position[0, 2] == 450.0
    assert track.velocity is None


def test_the_counter_wraps_and_a_file_alone_is_enough(tmp_path: Path) -> None:
    path = folder(tmp_path, begin=2**32 - 100_000) / "imuData.txt"
    assert data_format(path) == "sbg"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:50] + lines[60:])[:-20])
    log = read(path)
    steps = np.diff(log.imus["imuData"].time)
    assert (steps.min(), steps.max()) == (pytest.approx(0.005), pytest.approx(0.055))
    assert "line 92: is cut off" in log.notes[0]


def test_dates_and_other_units_are_refused(tmp_path: Path) -> None:
    path = folder(tmp_path) / "imuData.txt"
    text = path.read_text()
    path.write_text(text.replace("timestamp", "iso8601Time", 1))
    with pytest.raises(InputError, match="stamps are dates; expected timestamp"):
        read(path)
    path.write_text(text.replace("(deg.s^-1)", "(rad.s^-1)"))
    with pytest.raises(InputError, match=r"gyroX is in \(rad\.s\^-1\); expected \(deg\.s\^-1\)"):
        read(path)
