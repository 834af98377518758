"""Configurations proposed for recordings that nobody has described."""

from __future__ import annotations

from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest
from written_recordings import as_increments, fixes, still_imu, write_recording, write_rows

from polyins.errors import InputError
from polyins.reading.loading import load, load_settings
from polyins.tools.propose.lines import CHECK
from polyins.tools.propose.proposal import propose, settings_of


def save(folder: Path, text: str) -> Path:
    path = folder / "proposed.yaml"
    path.write_text(text)
    return path


def test_a_proposal_loads_right_away(tmp_path: Path) -> None:
    write_recording(tmp_path)
    text = propose([tmp_path / name for name in ("gnss.txt", "a.txt", "b.csv")]).text
    recording = load(save(tmp_path, text))
    assert [imu.name for imu in recording.rig.imus] == ["imu1", "imu2"]
    assert recording.gnss is not None
    np.testing.assert_allclose(recording.imus[0].dvel, recording.imus[1].dvel, atol=2e-9)
    assert text.count("# CHECK: forward, right, down from the array's origin") == 3


def test_what_files_cannot_tell_is_marked(tmp_path: Path) -> None:
    write_recording(tmp_path)
    imus, gnss = [tmp_path / "a.txt", tmp_path / "b.csv"], tmp_path / "gnss.txt"
    text = propose([*imus, gnss]).text
    assert text.count("mount_deg: [0, 0, 0]  # CHECK:") == 2
    assert text.count("clock_offset_s: 0.0  # CHECK:") == 2  # of all streams but the first, whose clock counts
    assert text.count("heading_from: auto  # CHECK: the course over ground") == 1
    alone = propose(imus).text
    assert "heading_deg: 0.0  # CHECK:" in alone
    assert load(save(tmp_path, alone)).start.heading == 0.0


def test_clocks_that_differ_are_marked(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    later = fixes()
    later[:, 0] += 1000.0
    gnss = write_rows(tmp_path / "gnss.txt", later)
    text = propose([imu, gnss]).text
    assert "clock_offset_s: 0.0  # CHECK: the IMUs' stamps run from 100.000 to 109.980 s" in text
    recording = load(save(tmp_path, text.replace("clock_offset_s: 0.0", "clock_offset_s: -1000.0")))
    assert recording.gnss is not None
    assert recording.gnss.time[0] == pytest.approx(100.5)


def test_a_solution_is_a_reference(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    rows = fixes()
    nav = np.column_stack([0 * rows[:, 0], rows[:, :4], np.zeros((len(rows), 6))])
    recording = load(save(tmp_path, propose([imu, write_rows(tmp_path / "truth.nav", nav)]).text))
    assert recording.gnss is None
    assert recording.reference is not None
    assert recording.reference.attitude is not None


def test_positions_without_std_get_a_marked_one(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    gnss = write_rows(tmp_path / "g.csv", fixes()[:, :4], "time,latitude,longitude,height", ",")
    text = propose([imu, gnss]).text
    assert "position_std_m: [1.5, 1.5, 3.0]  # CHECK" in text
    assert load(save(tmp_path, text)).geodetic


def test_no_imu_data(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gnss\.txt: no IMU data; expected at least one file"):
        propose([write_rows(tmp_path / "gnss.txt", fixes())])


def test_a_real_flight_loads_right_away(data_folder: Path, tmp_path: Path) -> None:
    folder = data_folder / "quadrotor" / "Horizontal" / "path_9"
    text = propose([folder / name for name in ("IMU_1.csv", "IMU_2.csv", "IMU_3.csv", "IMU_4.csv", "GT.csv")]).text
    recording = load(save(tmp_path, text))
    assert len(recording.imus) == 4
    assert recording.gnss is not None
    assert text.count("axes: [x, -y, -z]") == 4


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
    text = propose([tmp_path / "imu.csv", tmp_path / "fixes.nmea"]).text
    sunday = 1707004800.0  # 4 February 2024
    assert f"clock_offset_s: {-(sunday - 18.0)}  # CHECK: by what both files say of UTC" in text
    (tmp_path / "config.yaml").write_text(text)
    gnss = load(tmp_path / "config.yaml").gnss
    assert gnss is not None
    np.testing.assert_allclose(gnss.time, [100.0, 101.0, 102.0, 103.0], atol=1e-6)


def test_what_info_would_refuse_is_not_proposed(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from polyins import cli

    write_rows(tmp_path / "imu.csv", still_imu(60), "t,gx,gy,gz,ax,ay,az", ",")
    done = CliRunner().invoke(cli.cli, ["init", str(tmp_path / "imu.csv"), "--out", str(tmp_path / "made.yaml")])
    assert isinstance(done.exception, InputError)
    assert "cannot be navigated with as they are" in str(done.exception)
    assert not (tmp_path / "made.yaml").exists()


def test_what_would_turn_the_heading_is_a_finding(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    proposal = propose([imu])
    (finding,) = proposal.findings
    assert (finding.kind, finding.severity) == ("mount", "doubt")
    assert finding.text in [one.sentence for one in proposal.assumptions]
    assert f"# CHECK: {finding.text.partition('(')[2].rstrip(')')}" in proposal.text
    recording = load_settings(settings_of([imu]))
    assert recording.findings == proposal.findings
    assert {one.sentence for one in proposal.assumptions} <= set(recording.warnings)


def test_a_guessed_unit_of_a_gyro_in_a_file_of_its_own_is_a_finding(tmp_path: Path) -> None:
    time = np.arange(1, 801) / 40.0
    # as noisy as no gyro in rad/s, and nothing turns: it may be deg/s
    turning = np.column_stack([time, np.random.default_rng(0).normal(0.0, 0.5, (len(time), 3))])
    force = np.column_stack([time + 0.005, np.tile([0.1, 0.2, -9.8], (len(time), 1))])
    files = [
        write_rows(tmp_path / "gyroscope.csv", turning, "t,x,y,z", ","),
        write_rows(tmp_path / "accelerometer.csv", force, "t,x,y,z", ","),
    ]
    kinds = [finding.kind for finding in propose(files).findings]
    assert kinds == ["units", "mount"]
    named = [
        write_rows(tmp_path / "gyroscope.csv", turning, "t (s),x (rad/s),y (rad/s),z (rad/s)", ","),
        write_rows(tmp_path / "accelerometer.csv", force, "t (s),x (m/s^2),y (m/s^2),z (m/s^2)", ","),
    ]
    assert [finding.kind for finding in propose(named).findings] == ["mount"]


def test_assumptions_are_what_is_marked(tmp_path: Path) -> None:
    proposal = propose([write_rows(tmp_path / "imu.txt", as_increments(still_imu()))])
    marked = [line.partition(CHECK) for line in proposal.text.splitlines() if CHECK in line]
    values = [f"assumed {value.strip()} ({why.strip()})" for value, _, why in marked]
    assert values == [one.sentence for one in proposal.assumptions]
