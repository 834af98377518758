"""From a configuration to a recording."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from written_recordings import (
    BEGIN,
    RATE_HZ,
    TABLE_COLUMNS,
    fixes,
    still_imu,
    write_config,
    write_recording,
    write_rows,
)

from polyins.config import parse
from polyins.config.yaml_document import read_yaml
from polyins.errors import InputError
from polyins.formats import geoid
from polyins.model.rig import DEG, HOUR
from polyins.reading.imu_stream import mount_rotation
from polyins.reading.loading import load
from polyins.reading.position_stream import thinned

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def loaded(folder: Path, **changes: Any) -> Any:
    values = write_recording(folder)
    for key, change in changes.items():
        values[key] = {**values.get(key, {}), **change} if isinstance(change, dict) else change
    return load(write_config(folder, values))


def test_increments_and_rates_of_one_motion_agree(tmp_path: Path) -> None:
    a, b = loaded(tmp_path).imus
    np.testing.assert_allclose(a.time, b.time, atol=1e-9)
    np.testing.assert_allclose(a.dtheta, b.dtheta, atol=2e-9)
    np.testing.assert_allclose(a.dvel, b.dvel, atol=2e-9)
    assert a.rate_hz == pytest.approx(RATE_HZ)


def test_gnss_is_in_radians_with_its_antenna(tmp_path: Path) -> None:
    recording = loaded(tmp_path)
    np.testing.assert_allclose(recording.gnss.position[0], [30.5 * DEG, 114.4 * DEG, 20.0])
    np.testing.assert_allclose(recording.gnss.position_std[0], [0.02, 0.02, 0.04])
    np.testing.assert_allclose(recording.rig.antenna, [0.1, 0.0, -0.5])
    assert recording.geodetic


def test_axes_and_mount_turn_sensor_vectors_into_array_axes(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    mount = [2.0, -3.0, 40.0]
    true = Rotation.from_euler("ZYX", mount[::-1], degrees=True).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    rows = still_imu()
    sensor = rows.copy()
    sensor[:, 1:4], sensor[:, 4:7] = rows[:, 1:4] @ true, rows[:, 4:7] @ true
    write_rows(tmp_path / "b.csv", sensor, "t,gx,gy,gz,ax,ay,az", ",")
    values["imus"][1] |= {"axes": ["x", "-y", "-z"], "mount_deg": mount}
    recording = load(write_config(tmp_path, values))
    np.testing.assert_allclose(recording.imus[1].dvel, recording.imus[0].dvel, atol=1e-9)
    np.testing.assert_allclose(recording.imus[1].dtheta, recording.imus[0].dtheta, atol=1e-9)
    np.testing.assert_allclose(recording.rig.imus[1].rotation, true, atol=1e-12)


@given(st.tuples(*[st.floats(-180, 180)] * 3))
def test_mount_is_yaw_after_pitch_after_roll(mount: tuple[float, float, float]) -> None:
    expected = Rotation.from_euler("ZYX", mount[::-1], degrees=True).as_matrix()
    np.testing.assert_allclose(mount_rotation(mount), expected, atol=1e-12)


def test_clock_offsets_are_added(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    values["imus"][1]["clock_offset_s"] = 0.25
    values["gnss"]["clock_offset_s"] = -0.125
    recording = load(write_config(tmp_path, values))
    assert recording.imus[1].time[0] == pytest.approx(BEGIN + 0.25)
    assert recording.gnss.time[0] == pytest.approx(BEGIN + 0.5 - 0.125)


def test_clocks_that_drift_and_leap(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    known = load(write_config(tmp_path, values))
    drifts = {"clock_drift_ppm": 500.0, "clock_reference_s": BEGIN}
    values["imus"][1] |= {"clock_offset_s": 0.25, **drifts}
    leap = known.gnss.time[3]
    values["gnss"] |= {"clock_offset_s": -0.125, **drifts, "clock_leaps_s": [[float(leap), -0.25]]}
    recording = load(write_config(tmp_path, values))
    stamps = known.imus[1].time
    np.testing.assert_allclose(recording.imus[1].time, stamps + 0.25 + 500e-6 * (stamps - BEGIN), atol=1e-9)
    # a gyro shows rates: over longer intervals it turned more
    np.testing.assert_allclose(recording.imus[1].dvel, 1.0005 * known.imus[1].dvel, atol=1e-12)
    stamps = known.gnss.time
    expected = stamps - 0.125 + 500e-6 * (stamps - BEGIN) - 0.25 * (stamps >= leap)
    np.testing.assert_allclose(recording.gnss.time, expected, atol=1e-9)


def test_with_a_rate_the_stamps_do_not_matter(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    rows = still_imu()
    rows[7, 0] = rows[6, 0]
    write_rows(tmp_path / "b.csv", rows, "t,gx,gy,gz,ax,ay,az", ",")
    values["imus"][1] |= {"rate_hz": RATE_HZ, "clock_offset_s": BEGIN}
    recording = load(write_config(tmp_path, values))
    np.testing.assert_allclose(recording.imus[1].time, recording.imus[0].time, atol=1e-9)
    np.testing.assert_allclose(recording.imus[1].dvel, recording.imus[0].dvel, atol=2e-9)


def test_noise_and_initial_std_are_si(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    values["imus"][0] |= {
        "noise": {"gyro_bias_deg_h": 36, "accel_bias_mgal": 100, "angle_random_walk_deg_sqrt_h": 0.6},
        "initial_std": {"gyro_bias_deg_s": 0.1},
        "initial_errors": {"gyro_bias_deg_s": [1, 2, 3], "accel_scale_ppm": 500},
    }
    imu = load(write_config(tmp_path, values)).rig.imus[0]
    np.testing.assert_allclose(imu.noise.gyro_bias_std, 0.01 * DEG)
    np.testing.assert_allclose(imu.noise.accel_bias_std, 1e-3)
    np.testing.assert_allclose(imu.noise.angle_random_walk, 0.01 * DEG)
    assert imu.noise.correlation_time == HOUR
    np.testing.assert_allclose(imu.start_std()[:6], [0.1 * DEG] * 3 + [1e-3] * 3)
    np.testing.assert_allclose(imu.initial_errors.gyro_bias, np.array([1, 2, 3]) * DEG)
    np.testing.assert_allclose(imu.initial_errors.accel_scale, 5e-4)


def test_fixes_are_thinned_to_a_rate() -> None:
    time = 0.459 + np.cumsum(np.full(100, 0.1)) - 1e-9 * np.arange(100) % 3
    kept = time[thinned(time, 1.0)]
    np.testing.assert_allclose(np.diff(kept), 1.0, atol=1e-6)
    assert kept[0] == time[0]


@given(st.lists(st.floats(0.01, 3.0), min_size=1, max_size=60), st.floats(0.2, 5.0))
def test_thinned_fixes_are_never_denser_than_the_rate(steps: list[float], rate: float) -> None:
    time = np.cumsum(steps)
    kept = thinned(time, rate)
    slack = 0.1 * float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    periods = np.floor((time[kept] - time[0] + slack) * rate)
    assert kept[0] == 0
    assert len(set(periods)) == len(periods)


def test_a_schedule_expands_to_whole_outages(tmp_path: Path) -> None:
    recording = loaded(tmp_path, outages={"length_s": 2, "every_s": 3})
    np.testing.assert_allclose(recording.outages, [[101.5, 103.5], [104.5, 106.5]])


def test_a_schedule_counts_from_a_given_start(tmp_path: Path) -> None:
    recording = loaded(tmp_path, outages={"length_s": 1, "every_s": 3, "first_after_s": 0.5}, start={"time_s": 102.0})
    np.testing.assert_allclose(recording.outages, [[102.5, 103.5], [105.5, 106.5]])


def test_listed_outages_come_out_in_order(tmp_path: Path) -> None:
    assert loaded(tmp_path, outages=[[106, 107], [102, 103.5]]).outages == ((102.0, 103.5), (106.0, 107.0))


def test_sea_level_heights_are_raised_by_the_geoid(tmp_path: Path) -> None:
    recording = loaded(tmp_path, gnss={"height": "sea-level", "geoid_height_m": -13.5})
    np.testing.assert_allclose(recording.gnss.position[:, 2], 6.5)


def test_sea_level_heights_are_raised_by_a_grid_if_there_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(geoid, "heights", lambda position: 40.0 + 0.1 * np.arange(len(position)))
    recording = loaded(tmp_path, gnss={"height": "sea-level"})
    np.testing.assert_allclose(recording.gnss.position[:, 2], 60.0 + 0.1 * np.arange(10))
    assert recording.heights == "ellipsoidal"
    assert any("brought above the ellipsoid by EGM96, 40.5 m there" in text for text in recording.warnings)
    own = loaded(tmp_path, gnss={"height": "sea-level", "geoid_height_m": -13.5})
    np.testing.assert_allclose(own.gnss.position[:, 2], 6.5)
    assert not any("EGM96" in text for text in own.warnings)


def test_heights_that_stay_as_they_are_are_not_compared_with_others(tmp_path: Path) -> None:
    recording = loaded(tmp_path, gnss={"height": "as-given"})
    assert recording.heights == "unknown"
    assert any("above what those of the file are above" in text for text in recording.warnings)
    values = write_recording(tmp_path)
    values["reference"] = {"file": "gnss.txt"}
    values["gnss"]["height"] = "as-given"
    with pytest.raises(InputError, match="as-given for one of gnss and reference"):
        load(write_config(tmp_path, values))
    values["reference"]["height"] = "as-given"
    assert load(write_config(tmp_path, values)).heights == "unknown"


def test_a_given_std_takes_the_place_of_the_file(tmp_path: Path) -> None:
    recording = loaded(tmp_path, gnss={"position_std_m": [1, 2, 3]})
    np.testing.assert_array_equal(recording.gnss.position_std, np.tile([1.0, 2.0, 3.0], (10, 1)))


def test_without_positions_the_recording_is_on_a_local_plane(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    del values["gnss"]
    assert not load(write_config(tmp_path, values)).geodetic


def test_fixes_outside_the_imus_are_counted_in_a_warning(tmp_path: Path) -> None:
    recording = loaded(tmp_path, gnss={"clock_offset_s": -2.0})
    assert len(recording.warnings) == 1
    assert "2 of 10 GNSS rows lie outside" in recording.warnings[0]


def test_a_gap_and_jitter_are_warned_of(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    rows = still_imu()
    shaken = rows.copy()
    shaken[1::2, 0] += 0.006
    write_rows(tmp_path / "b.csv", shaken, "t,gx,gy,gz,ax,ay,az", ",")
    rows[:, 1:] /= RATE_HZ
    write_rows(tmp_path / "a.txt", np.delete(rows, slice(100, 130), axis=0))
    gap, jitter = load(write_config(tmp_path, values)).warnings
    assert "a.txt: 1 gap(s) in the stamps, the largest 0.62 s at 101.980 s" in gap
    assert "b.csv: intervals vary by" in jitter


def test_an_end_after_the_data_is_warned_of(tmp_path: Path) -> None:
    assert "the data end at 109.980 s" in loaded(tmp_path, start={"end_time_s": 500.0}).warnings[0]


def test_packed_files_are_found_under_the_plain_name(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    plain = load(write_config(tmp_path, values))
    for name in ("a.txt", "b.csv", "gnss.txt"):
        (tmp_path / f"{name}.gz").write_bytes(gzip.compress((tmp_path / name).read_bytes()))
        (tmp_path / name).unlink()
    packed = load(tmp_path / "drive.yaml")
    np.testing.assert_array_equal(packed.imus[1].dvel, plain.imus[1].dvel)
    np.testing.assert_array_equal(packed.gnss.position, plain.gnss.position)


def test_the_configuration_in_force_loads_to_the_same_recording(tmp_path: Path) -> None:
    recording = loaded(tmp_path, outages={"length_s": 2, "every_s": 3}, start={"heading_deg": 30.0})
    elsewhere = tmp_path / "elsewhere" / "config.yaml"
    elsewhere.parent.mkdir()
    elsewhere.write_text(recording.config_text)
    again = load(elsewhere)
    assert again.config_text == recording.config_text
    assert again.name == recording.name == "drive"
    assert again.outages == recording.outages
    np.testing.assert_array_equal(again.imus[1].dvel, recording.imus[1].dvel)


def write_local_track(folder: Path) -> tuple[np.ndarray, dict[str, Any]]:
    """A circle with 1 m/s, 10 times a second, whose attitude columns are 0.07 s ahead of its positions."""
    time = BEGIN + 0.1 + np.arange(90) * 0.1
    angle = 0.2 * (time - BEGIN)
    ahead = 0.2 * (time - 0.07 - BEGIN)
    heading = np.degrees(np.arctan2(np.cos(ahead), -np.sin(ahead)))
    rows = np.column_stack(
        [time * 1000, 5 * np.sin(angle), 5 * np.cos(angle), -3 + 0 * time, 0 * time, 1 + 0 * time, heading]
    )
    write_rows(folder / "ref.csv", rows, "ms, East, North, Up, roll, pitch, heading", ",")
    columns = {
        "time": {"name": "ms", "unit": "ms"},
        "position": {"names": ["East", "North", "Up"], "frame": "east-north-up"},
        "attitude": {"names": ["roll", "pitch", "heading"]},
    }
    return time, {"file": "ref.csv", "columns": columns}


def test_a_reference_table_with_a_lag_between_attitude_and_position(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    del values["gnss"]
    time, reference = write_local_track(tmp_path)
    # Row k holds the position of `time` and the attitude of 0.07 s before: stamps of the attitude plus the lag.
    values["reference"] = {**reference, "clock_offset_s": -0.07, "position_lag_s": 0.07, "point_m": [0, 0, -0.2]}
    found = load(write_config(tmp_path, values)).reference
    assert found is not None
    np.testing.assert_allclose(found.time, time[: len(found.time)], atol=1e-6)
    angle = 0.2 * (found.time - BEGIN)
    np.testing.assert_allclose(found.position[:, 0], 5 * np.cos(angle), atol=1e-6)
    np.testing.assert_allclose(found.position[:, 2], -3.0)
    expected = np.arctan2(np.cos(angle), -np.sin(angle))
    difference = np.angle(np.exp(1j * (found.attitude[:, 2] - expected)))
    np.testing.assert_allclose(difference, 0.0, atol=1e-6)
    np.testing.assert_allclose(found.lever_arm, [0, 0, -0.2])


def test_velocity_without_std_is_not_used_and_said_so(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    rows = np.column_stack([fixes(), np.tile([1.0, 2.0, 3.0], (10, 1))])
    write_rows(tmp_path / "gnss.csv", rows, "t,lat,lon,h,sn,se,sd,ve,vn,vu", ",")
    columns = {
        "time": {"name": "t"},
        "position": {"names": ["lat", "lon", "h"]},
        "std": {"names": ["sn", "se", "sd"]},
        "velocity": {"names": ["ve", "vn", "vu"], "frame": "east-north-up"},
    }
    values["gnss"] = {"file": "gnss.csv", "columns": columns}
    recording = load(write_config(tmp_path, values))
    assert recording.gnss.velocity is None
    assert "velocity has no std" in recording.warnings[0]
    columns["velocity_std"] = {"names": ["se", "sn", "sd"]}
    recording = load(write_config(tmp_path, values))
    np.testing.assert_array_equal(recording.gnss.velocity[0], [2.0, 1.0, -3.0])
    np.testing.assert_array_equal(recording.gnss.velocity_std[0], [0.02, 0.02, 0.04])


def test_columns_by_number_for_a_file_without_header(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    write_rows(tmp_path / "b.csv", still_imu(), "", ";")
    columns = {key: dict(group) for key, group in TABLE_COLUMNS.items()}
    columns["time"]["name"], columns["gyro"]["names"], columns["accel"]["names"] = 1, [2, 3, 4], [5, 6, 7]
    values["imus"][1]["columns"] = columns
    a, b = load(write_config(tmp_path, values)).imus
    np.testing.assert_allclose(a.dvel, b.dvel, atol=2e-9)


def test_quadrotor_example_is_a_valid_configuration() -> None:
    assert len(parse(read_yaml(EXAMPLES / "quadrotor.yaml")).imus) == 4


def test_quadrotor_example(data_folder: Path) -> None:
    recording = load(EXAMPLES / "quadrotor.yaml")
    assert [imu.name for imu in recording.rig.imus] == ["imu1", "imu2", "imu3", "imu4"]
    assert not recording.geodetic
    assert recording.gnss is not None
    assert len(recording.outages) == 3
    for begin, _ in recording.outages:
        before = recording.gnss.time[recording.gnss.time <= begin]
        assert 0.0 < begin - before[-1] < 0.1
    # Below 1 Hz a rigid array turns as one: what is left of the gyros' differences is small once axes, mounts and
    # clocks are right (0.2 to 1.7 % of the motion by the data set's description).
    first = recording.imus[0]
    grid = np.arange(first.time[0] + 1.0, first.time[-1] - 1.0, 1.0)
    turns = [
        np.diff(
            np.column_stack([np.interp(grid, stream.time, angle) for angle in np.cumsum(stream.dtheta, axis=0).T]),
            axis=0,
        )
        for stream in recording.imus
    ]
    motion = turns[0] - turns[0].mean(axis=0)
    for turn in turns[1:]:
        rest = turn - turn.mean(axis=0) - motion
        assert np.sqrt(np.mean(rest**2)) < 0.03 * np.sqrt(np.mean(motion**2))


def test_quadrotor_reference_attitude_is_in_step_with_the_array(data_folder: Path) -> None:
    recording = load(EXAMPLES / "quadrotor.yaml")
    reference, stream = recording.reference, recording.imus[0]
    assert reference is not None
    assert reference.attitude is not None
    angle = np.cumsum(stream.dtheta[:, 0])
    inside = (reference.time > stream.time[0]) & (reference.time < stream.time[-1])
    at = reference.time[inside]
    roll = np.diff(reference.attitude[inside, 0])
    agreement = {
        lag: np.corrcoef(np.diff(np.interp(at + lag, stream.time, angle)), roll)[0, 1] for lag in (-0.2, 0.0, 0.2)
    }
    assert max(agreement, key=agreement.__getitem__) == 0.0
    assert agreement[0.0] > 0.9


@pytest.mark.parametrize(
    ("header", "change", "message"),
    [
        ("t,lat,lon,h,sn,se,sd", {3: 1000.0}, r"line \d+: height is 500000 m; expected at most 100000 m: is it in mm"),
        (
            "t,lat,lon,h,vn,ve,vd",
            {4: 1000.0, 5: 1000.0},
            r"velocities are .* m/s in the middle, the positions change by",
        ),
    ],
)
def test_positions_in_other_units_are_refused(
    header: str, change: dict[int, float], message: str, tmp_path: Path
) -> None:
    values = write_recording(tmp_path)
    rows = fixes()
    rows[:, 1] += 1e-5 * np.arange(len(rows))
    rows[:, 3] = 500.0
    rows[:, 4:7] = [1.11, 0.01, 0.01]
    for column, factor in change.items():
        rows[:, column] *= factor
    names = header.split(",")
    write_rows(tmp_path / "fixes.csv", rows, header, ",")
    vector = "std" if names[4] == "sn" else "velocity"
    columns = {"time": {"name": "t"}, "position": {"names": names[1:4]}, vector: {"names": names[4:7]}}
    values["gnss"] = {"file": "fixes.csv", "columns": columns, "position_std_m": 0.02}
    with pytest.raises(InputError, match=message):
        load(write_config(tmp_path, values))
