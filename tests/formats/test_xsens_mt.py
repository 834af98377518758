"""Text of Xsens's MT Manager."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.recognize import data_format, read_log
from polyins.formats.xsens_mt import read
from polyins.model.rig import DEG

COMMENTS = "// General information:\n//  Update Rate: 100.0Hz\n// Coordinate system: {}\n"
NAMES = ["PacketCounter", "SampleTimeFine", "Acc_X", "Acc_Y", "Acc_Z", "Gyr_X", "Gyr_Y", "Gyr_Z"]


def write(path: Path, rows: list[list[object]], names: list[str] | None = None, frame: str = "ENU") -> Path:
    lines = ["\t".join(names or NAMES), *("\t".join(map(str, row)) for row in rows)]
    path.write_text(COMMENTS.format(frame) + "\n".join(lines) + "\n")
    return path


def row(packet: int, ticks: object, *more: object) -> list[object]:
    return [packet % 65536, ticks, 0.1, 0.2, 9.8, 0.01, 0.02, 0.03, *more]


def test_ticks_are_tenths_of_a_millisecond(tmp_path: Path) -> None:
    path = write(tmp_path / "a.txt", [row(k, (2**32 - 300 + 100 * k) % 2**32) for k in range(9)])
    assert data_format(path) == "xsens-mt"
    rows = read_log(path).imus["imu"]
    np.testing.assert_allclose(np.diff(rows.time), 0.01, atol=1e-9)
    np.testing.assert_allclose(rows.dtheta[4], [1e-4, 2e-4, 3e-4])
    np.testing.assert_allclose(rows.dvel[4], [1e-3, 2e-3, 9.8e-2])


def test_packets_stand_for_ticks(tmp_path: Path) -> None:
    path = write(tmp_path / "a.txt", [row(65530 + k, "") for k in range(20) if k not in (7, 8)])
    log = read(path)
    steps = np.diff(log.imus["imu"].time)
    assert steps.max() == pytest.approx(0.03)
    assert np.sum(steps) == pytest.approx(0.19)
    assert "PacketCounter at the header's 100 Hz" in log.notes[0]
    path.write_text(path.read_text().replace("Update Rate", "Rate"))
    with pytest.raises(InputError, match="nor PacketCounter with an update rate"):
        read(path)


def test_another_unit_of_the_ticks_is_said(tmp_path: Path) -> None:
    log = read(write(tmp_path / "a.txt", [row(k, 10_000 * k) for k in range(9)]))
    assert "SampleTimeFine makes 1 Hz, the header says 100 Hz" in log.notes[0]


@pytest.mark.parametrize(("frame", "yaw", "heading"), [("ENU", 30.0, 60.0), ("NED", 30.0, 30.0), ("NWU", 30.0, -30.0)])
def test_heading_of_the_x_axis(frame: str, yaw: float, heading: float, tmp_path: Path) -> None:
    half = 0.5 * yaw * DEG
    quaternion = [np.cos(half), 0.0, 0.0, np.sin(half)]
    names = [*NAMES, *(f"Quat_q{k}" for k in range(4))]
    path = write(tmp_path / "a.txt", [row(k, 100 * k, *quaternion) for k in range(5)], names, frame)
    np.testing.assert_allclose(read(path).sensors["orientation"].value / DEG, heading)
    path = write(tmp_path / "b.txt", [row(k, 100 * k, yaw) for k in range(5)], [*NAMES, "Yaw"], frame)
    np.testing.assert_allclose(read(path).sensors["orientation"].value / DEG, heading)
    column = [np.cos(yaw * DEG), np.sin(yaw * DEG)]
    names = [*NAMES, "Mat[1][1]", "Mat[2][1]"]
    path = write(tmp_path / "c.txt", [row(k, 100 * k, *column) for k in range(5)], names, frame)
    np.testing.assert_allclose(read(path).sensors["orientation"].value / DEG, heading)
    path = write(tmp_path / "d.txt", [row(k, 100 * k, yaw) for k in range(5)], [*NAMES, "Yaw"], "unknown")
    assert read(path).sensors == {}


@pytest.mark.parametrize("parts", [["q0", "q1", "q2", "q3"], ["w", "x", "y", "z"]])
def test_increments_where_there_are_no_rates(parts: list[str], tmp_path: Path) -> None:
    names = ["PacketCounter", "SampleTimeFine", "VelInc_X", "VelInc_Y", "VelInc_Z", *(f"OriInc_{one}" for one in parts)]
    turn = np.array([0.003, -0.004, 0.012])
    half = 0.5 * np.linalg.norm(turn)
    quaternion = [-np.cos(half), *(-turn / np.linalg.norm(turn) * np.sin(half))]  # the same turn as with +
    rows = [[k, 100 * k, 0.001, 0.002, 0.098, *quaternion] for k in range(9)]
    rows[4][5:] = [1.0, 0.0, 0.0, 0.0]
    path = write(tmp_path / "a.txt", rows, names)
    assert data_format(path) == "xsens-mt"
    imu = read(path).imus["imu"]
    np.testing.assert_allclose(imu.dtheta[[3, 4]], [turn, [0, 0, 0]], atol=1e-12)
    np.testing.assert_array_equal(imu.dvel[3], [0.001, 0.002, 0.098])
    assert (imu.gyro_unit, imu.accel_unit) == ("rad", "m/s")


def test_rows_without_rates_and_a_cut_end(tmp_path: Path) -> None:
    rows = [row(k, 100 * k) for k in range(9)]
    rows[4][2:] = [""] * 6
    path = write(tmp_path / "a.txt", rows)
    path.write_text(path.read_text()[:-20])
    log = read(path)
    assert len(log.imus["imu"].time) == 7
    assert "line 13: is cut off" in log.notes[0]


def test_a_dot_is_none(tmp_path: Path) -> None:
    path = tmp_path / "dot.csv"
    path.write_text("DeviceTag:,DOT1\n" + ",".join(NAMES) + "\n" + "1,2,0,0,9.8,1,1,1\n" * 3)
    assert data_format(path) == "xsens-dot"
    path.write_text("DeviceTag:\tDOT1\n" + "\t".join(NAMES) + "\n" + "1\t2\t0\t0\t9.8\t1\t1\t1\n" * 3)
    assert data_format(path) == "xsens-dot"
    path.write_text("\t".join(NAMES) + "\n" + "".join(f"{k}\t{16667 * k}\t0\t0\t9.8\t1\t1\t1\n" for k in range(9)))
    with pytest.raises(InputError, match=r"makes 0\.6 Hz; is it the export of a DOT"):
        read(path)
