"""Folders as EuRoC has them."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.euroc import read
from polyins.formats.recognize import data_format, read_log
from polyins.tools.propose.proposal import propose

IMU = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
)
TRACKER = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m]\n"
TRUTH = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
    "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1]\n"
)
SENSOR = """#Default imu sensor yaml file
sensor_type: imu
T_BS:
  cols: 4
  rows: 4
  data: [0.0, 0.0, -1.0, 0.1,
         0.0, 1.0, 0.0, 0.2,
         1.0, 0.0, 0.0, 0.3,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 200
gyroscope_noise_density: 1.6968e-02     # [ rad / s / sqrt(Hz) ]   ( gyro "white noise" )
gyroscope_random_walk: 1.9393e-05       # [ rad / s^2 / sqrt(Hz) ]
accelerometer_noise_density: 2.0000e-1  # [ m / s^2 / sqrt(Hz) ]
"""
BEGIN = 1403636579758555392


def folder(tmp_path: Path, *, imus: tuple[str, ...] = ("imu0",), rows: int = 200) -> Path:
    stamps = [BEGIN + 5_000_000 * k for k in range(rows)]
    contents = {name: IMU + "".join(f"{t},0.1,0.2,0.3,9.81,0.0,0.0\n" for t in stamps) for name in imus}
    contents["leica0"] = TRACKER + "".join(f"{t},1,2,3\n" for t in stamps[::40])
    contents["state_groundtruth_estimate0"] = TRUTH + "".join(f"{t},1,2,3,1,0,0,0,4,5,6\n" for t in stamps[::2])
    contents["cam0"] = "#timestamp [ns],filename\n1,1.png\n"
    for name, text in contents.items():
        (tmp_path / "MH" / "mav0" / name).mkdir(parents=True)
        (tmp_path / "MH" / "mav0" / name / "data.csv").write_text(text)
    return tmp_path / "MH"


def test_several_imus_a_tracker_and_a_reference(tmp_path: Path) -> None:
    path = folder(tmp_path, imus=("imu0", "imu1"))
    assert data_format(path) == "euroc"
    log = read_log(path)
    assert set(log.imus) == {"imu0", "imu1"}
    assert log.references == {"state_groundtruth_estimate0"}
    assert (log.clock, log.utc_of_zero) == ("unix", 0.0)
    np.testing.assert_allclose(log.imus["imu1"].time[::100], [BEGIN * 1e-9, BEGIN * 1e-9 + 0.5], atol=1e-6)
    np.testing.assert_allclose(log.imus["imu0"].dtheta[5], np.array([0.1, 0.2, 0.3]) * 0.005, rtol=1e-4)
    np.testing.assert_array_equal(log.tracks["leica0"].position[0], [2, 1, 3])
    np.testing.assert_array_equal(log.tracks["state_groundtruth_estimate0"].velocity[0], [5, 4, -6])


def test_the_calibration_is_the_proposals(tmp_path: Path) -> None:
    path = folder(tmp_path)
    (path / "mav0" / "imu0" / "sensor.yaml").write_text(SENSOR)
    log = read(path)
    assert log.axes == {"imu0": ("-z", "y", "x")}
    assert log.points == {"imu0": (0.1, 0.2, 0.3)}
    assert log.noise == {"imu0": (0.016968, 0.2)}
    text = propose([path]).text
    # the sensor's x is up, so that the body's z, which is along it, is not down
    assert "axes: [-z, -y, -x]" in text
    assert "position_m: [0.1, -0.2, -0.3]" in text
    assert "angle_random_walk_deg_sqrt_h: 58.3, velocity_random_walk_m_s_sqrt_h: 12" in text
    assert text.index("stream: 'leica0'") < text.index("reference:") < text.index("'state_groundtruth_estimate0'")


@pytest.mark.parametrize("part", ["mav0", "mav0/imu0", "mav0/imu0/data.csv"])
def test_parts_of_it(part: str, tmp_path: Path) -> None:
    path = folder(tmp_path)
    plain = path / "mav0" / "imu0" / "data.csv"
    if part != "mav0/imu0/data.csv":
        (plain.parent / "data.csv.gz").write_bytes(gzip.compress(plain.read_bytes()))
        plain.unlink()
    assert data_format(path / part) == "euroc"
    assert "imu0" in read_log(path / part).imus


def test_a_gap_and_an_end_that_is_cut_off(tmp_path: Path) -> None:
    path = folder(tmp_path) / "mav0" / "imu0" / "data.csv"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:50] + lines[80:])[:-20])
    log = read(path)
    assert len(log.imus["imu0"].time) == 200 - 30 - 1
    assert np.diff(log.imus["imu0"].time).max() == pytest.approx(0.155, abs=1e-6)
    assert "line 171: is cut off" in log.notes[0]


def test_other_units_and_nothing_of_use(tmp_path: Path) -> None:
    path = folder(tmp_path)
    data = path / "mav0" / "imu0" / "data.csv"
    data.write_text(data.read_text().replace("[rad s^-1]", "[deg s^-1]"))
    with pytest.raises(InputError, match=r"column w_RS_S_x is in deg s\^-1; expected rad s\^-1"):
        read(data)
    data.write_text(IMU)
    with pytest.raises(InputError, match=r"no data\.csv of an IMU"):
        read(data)
