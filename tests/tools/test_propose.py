"""Configurations proposed for recordings that nobody has described."""

from __future__ import annotations

from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest
from written_recordings import as_increments, fixes, still_imu, write_recording, write_rows

from polyins.errors import InputError
from polyins.formats.rows import ImuRows, RowSource, SensorRows
from polyins.reading.loading import load
from polyins.tools.propose import forward_axes, propose, shaking


def save(folder: Path, text: str) -> Path:
    path = folder / "proposed.yaml"
    path.write_text(text)
    return path


def test_a_proposal_loads_right_away(tmp_path: Path) -> None:
    write_recording(tmp_path)
    text = propose([tmp_path / name for name in ("gnss.txt", "a.txt", "b.csv")])
    recording = load(save(tmp_path, text))
    assert [imu.name for imu in recording.rig.imus] == ["imu1", "imu2"]
    assert recording.gnss is not None
    np.testing.assert_allclose(recording.imus[0].dvel, recording.imus[1].dvel, atol=2e-9)
    assert text.count("# CHECK: forward, right, down from the array's origin") == 3


def test_what_files_cannot_tell_is_marked(tmp_path: Path) -> None:
    write_recording(tmp_path)
    imus, gnss = [tmp_path / "a.txt", tmp_path / "b.csv"], tmp_path / "gnss.txt"
    text = propose([*imus, gnss])
    assert text.count("mount_deg: [0, 0, 0]  # CHECK:") == 2
    assert text.count("clock_offset_s: 0.0  # CHECK:") == 2  # of all streams but the first, whose clock counts
    assert text.count("heading_from: auto  # CHECK: the course over ground") == 1
    alone = propose(imus)
    assert "heading_deg: 0.0  # CHECK:" in alone
    assert load(save(tmp_path, alone)).start.heading == 0.0


@pytest.mark.parametrize("order", [[1, 2, 3], [2, -1, 3], [3, 1, 2], [-3, 2, 1], [1, -2, -3]])
def test_gravity_tells_what_is_down(order: list[int], tmp_path: Path) -> None:
    rows = as_increments(still_imu())
    turned = rows.copy()
    for group in (1, 4):
        for axis, source in enumerate(order):
            turned[:, group + axis] = np.sign(source) * rows[:, group + abs(source) - 1]
    text = propose([write_rows(tmp_path / "imu.txt", turned)])
    mean = load(save(tmp_path, text)).imus[0].dvel.mean(axis=0)
    assert mean[2] == pytest.approx(-9.80665 / 50)


def test_repeated_stamps_are_counted_instead(tmp_path: Path) -> None:
    rows = as_increments(still_imu())
    rows[7, 0] = rows[6, 0]
    text = propose([write_rows(tmp_path / "imu.txt", rows)])
    assert "rate_hz: 50  # CHECK: 1 stamp(s) repeat" in text
    assert load(save(tmp_path, text)).imus[0].rate_hz == pytest.approx(50.0)


def test_clocks_that_differ_are_marked(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    later = fixes()
    later[:, 0] += 1000.0
    gnss = write_rows(tmp_path / "gnss.txt", later)
    text = propose([imu, gnss])
    assert "clock_offset_s: 0.0  # CHECK: the IMUs' stamps run from 100.000 to 109.980 s" in text
    recording = load(save(tmp_path, text.replace("clock_offset_s: 0.0", "clock_offset_s: -1000.0")))
    assert recording.gnss is not None
    assert recording.gnss.time[0] == pytest.approx(100.5)


def test_a_solution_is_a_reference(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    rows = fixes()
    nav = np.column_stack([0 * rows[:, 0], rows[:, :4], np.zeros((len(rows), 6))])
    recording = load(save(tmp_path, propose([imu, write_rows(tmp_path / "truth.nav", nav)])))
    assert recording.gnss is None
    assert recording.reference is not None
    assert recording.reference.attitude is not None


def test_positions_without_std_get_a_marked_one(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    gnss = write_rows(tmp_path / "g.csv", fixes()[:, :4], "time,latitude,longitude,height", ",")
    text = propose([imu, gnss])
    assert "position_std_m: [1.5, 1.5, 3.0]  # CHECK" in text
    assert load(save(tmp_path, text)).geodetic


def test_no_imu_data(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gnss\.txt: no IMU data; expected at least one file"):
        propose([write_rows(tmp_path / "gnss.txt", fixes())])


def test_a_real_flight_loads_right_away(data_folder: Path, tmp_path: Path) -> None:
    folder = data_folder / "quadrotor" / "Horizontal" / "path_9"
    text = propose([folder / name for name in ("IMU_1.csv", "IMU_2.csv", "IMU_3.csv", "IMU_4.csv", "GT.csv")])
    recording = load(save(tmp_path, text))
    assert len(recording.imus) == 4
    assert recording.gnss is not None
    assert text.count("axes: [x, -y, -z]") == 4


def test_what_shakes_is_the_random_walk() -> None:
    rng = np.random.default_rng(6)
    time, walks = np.arange(4000) / 100.0, (2e-3, 0.05)
    swing = 0.05 * np.sin(time)[:, None] * [1.0, 0.5, 0.2]  # of a vehicle that turns and accelerates
    angle, velocity = (swing * 0.01 + walk * 0.1 * rng.normal(size=(4000, 3)) for walk in walks)
    rows = ImuRows(RowSource("a"), time, angle, velocity)
    assert shaking(rows) == pytest.approx(walks, rel=0.1)
    still = ImuRows(RowSource("a"), time, swing * 0.01, swing * 0.01)
    assert max(shaking(still)) < 1e-6


def logged(time: np.ndarray, force: np.ndarray) -> ImuRows:
    return ImuRows(RowSource("log"), time, np.zeros_like(force), np.diff(time, prepend=-0.02)[:, None] * force)


def test_the_axis_that_goes_with_the_speed_is_forward() -> None:
    time = np.arange(3000) / 50.0
    speed = SensorRows(RowSource("log"), "odometer", time[::5], 3.0 * np.sin(0.3 * time[::5]))
    ahead = 0.9 * np.cos(0.3 * time)
    force = np.column_stack([0.3 * np.sin(time), np.full(3000, 9.8), -ahead])
    axes, agreement, sigmas = forward_axes(("x", "z", "-y"), logged(time, force), speed)
    assert axes == ("-z", "x", "-y")
    assert agreement > 0.9
    assert sigmas > 4.0


def test_logs_on_two_clocks_are_brought_together_by_utc(tmp_path: Path) -> None:
    names = ["GpsTow [s]", "Time::GpsWeek"]
    names += [f"IMU::{kind}::{axis}" for kind in ("AngularRate", "Accel") for axis in "XYZ"]
    rows = [f"{100.0 + 0.01 * k:.2f},2300,0,0,0,0,0,-9.8" for k in range(500)]
    (tmp_path / "imu.csv").write_text("\n".join([",".join(names), *rows]) + "\n")
    # 18 s of GPS are ahead of UTC, so that the week began at 23:59:42 on the day before
    bodies = ["GPRMC,000122.00,A,4800.0000,N,01100.0000,E,0.0,,040224,,,A"]
    bodies += [f"GPGGA,00012{second}.00,4800.0000,N,01100.0000,E,4,12,0.6,500.0,M,46.0,M,," for second in range(2, 6)]
    lines = [f"${body}*{reduce(xor, body.encode()):02X}" for body in bodies]
    (tmp_path / "fixes.nmea").write_text("\n".join(lines) + "\n")
    text = propose([tmp_path / "imu.csv", tmp_path / "fixes.nmea"])
    sunday = 1707004800.0  # 4 February 2024
    assert f"clock_offset_s: {-(sunday - 18.0)}  # CHECK: by what both files say of UTC" in text
    (tmp_path / "config.yaml").write_text(text)
    gnss = load(tmp_path / "config.yaml").gnss
    assert gnss is not None
    np.testing.assert_allclose(gnss.time, [100.0, 101.0, 102.0, 103.0], atol=1e-6)


def turned_fast(scale_deg_s: float) -> np.ndarray:
    """Rest, then turns beyond the end of the range: t, gyro deg/s, force g."""
    time = np.arange(1, 1001) / 50.0
    rate = np.where(time[:, None] > 8.0, 1.3 * scale_deg_s * np.sin(np.outer(time, [3.0, 2.1, 1.7])), 0.3)
    noise = np.random.default_rng(2).normal(0.0, 0.1, rate.shape)
    force = np.tile([0.0, 0.0, -1.0], (len(time), 1))
    force[time > 8.0] += [1.5, 0.0, 0.2]
    return np.column_stack([time, np.clip(rate + noise, -scale_deg_s, scale_deg_s), force + 1e-3 * noise])


@pytest.mark.parametrize("scale", [500.0, 1997.99])
def test_the_end_of_the_gyros_range_and_what_is_down_at_rest(scale: float, tmp_path: Path) -> None:
    path = write_rows(tmp_path / "imu.csv", turned_fast(scale), "t,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g", ",")
    text = propose([path])
    assert f"gyro_range_deg_s: {scale:g}" in text
    assert "axes: [x, y, z]" in text


def test_what_info_would_refuse_is_not_proposed(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from polyins import cli

    write_rows(tmp_path / "imu.csv", still_imu(60), "t,gx,gy,gz,ax,ay,az", ",")
    done = CliRunner().invoke(cli.cli, ["init", str(tmp_path / "imu.csv"), "--out", str(tmp_path / "made.yaml")])
    assert isinstance(done.exception, InputError)
    assert "cannot be navigated with as they are" in str(done.exception)
    assert not (tmp_path / "made.yaml").exists()
