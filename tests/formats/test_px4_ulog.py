"""ULogs written byte by byte as PX4's documentation has them: several IMUs at full rate, gaps, a torn end."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.px4_ulog import read
from polyins.formats.recognize import data_format
from polyins.model.rig import DEG
from polyins.tools.propose.proposal import propose

PACKED = {"uint64_t": "Q", "float": "f", "double": "d", "uint8_t": "B", "bool": "?", "int32_t": "i", "uint32_t": "I"}
Rows = Sequence[Sequence[float | Sequence[float]]]
UTC = 1.7e9

VEHICLE_IMU = (
    "uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
    "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;"
)
COMBINED = "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;"
GPS = (
    "uint64_t timestamp;uint64_t time_utc_usec;double latitude_deg;double longitude_deg;double altitude_ellipsoid_m;"
    "float s_variance_m_s;float eph;float epv;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;"
    "bool vel_ned_valid;"
)


def message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def layout(text: str) -> str:
    code = "<"
    for field in filter(None, text.split(";")):
        kind = field.split()[0]
        count = int(kind.partition("[")[2].rstrip("]") or 1)
        code += PACKED[kind.partition("[")[0]] * count
    return code


def ulog(path: Path, topics: Mapping[tuple[str, int], tuple[str, Rows]], **parameters: float) -> Path:
    """Write topics by name and instance: fields, and rows whose first value is the stamp, us."""
    content = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    for name, (fields, _) in {name: topic for (name, _), topic in topics.items()}.items():
        content += message("F", f"{name}:{fields}".encode())
    for name, value in parameters.items():
        key = f"float {name}".encode()
        content += message("P", bytes([len(key)]) + key + struct.pack("<f", value))
    data: list[tuple[float, bytes]] = []
    for number, ((name, instance), (fields, rows)) in enumerate(topics.items()):
        content += message("A", struct.pack("<BH", instance, number) + name.encode())
        for row in rows:
            flat = [one for value in row for one in (value if isinstance(value, Sequence) else [value])]
            packed = struct.pack("<H", number) + struct.pack(layout(fields), *flat)
            data.append((float(flat[0]), message("D", packed)))
    path.write_bytes(content + b"".join(packed for _, packed in sorted(data, key=lambda one: one[0])))
    return path


def increments(times_us: Sequence[int], every_us: int = 5000, rate: float = 0.2) -> Rows:
    step = every_us * 1e-6
    return [[t + 300, t, [rate * step, 0.0, 0.0], [0.0, 0.0, -9.8 * step], every_us, every_us] for t in times_us]


def fixes(times_us: Sequence[int], kind: int = 3) -> Rows:
    return [
        [t, int(UTC * 1e6) + t - 120_000, 48.0, 11.0, 500.0, 0.3, 0.8, 1.2, 1.0, 2.0, 3.0, kind, True] for t in times_us
    ]


FULL = [1_000_000 + 5000 * k for k in range(400)]


def test_imus_at_full_rate_are_all_used(tmp_path: Path) -> None:
    later = [t + 1700 for t in FULL if not 1_500_000 < t < 1_600_000]
    topics = {
        ("vehicle_imu", 0): (VEHICLE_IMU, increments(FULL)),
        ("vehicle_imu", 1): (VEHICLE_IMU, increments(later, rate=0.4)),
        ("sensor_combined", 0): (COMBINED, [[t, [0.2, 0, 0], [0, 0, -9.8]] for t in FULL]),
        ("vehicle_gps_position", 0): (GPS, fixes(FULL[::40])),
    }
    path = ulog(tmp_path / "a.ulg", topics, EKF2_GPS_DELAY=110.0)
    assert data_format(path) == "px4-ulog"
    log = read(path)
    assert [len(rows.time) for rows in log.imus.values()] == [400, 381, 400]
    assert log.unusable == {"sensor_combined[0]": "is one of the vehicle_imu"}
    second = log.imus["vehicle_imu[1]"]
    np.testing.assert_allclose(second.time, np.array(later) * 1e-6)
    np.testing.assert_allclose(second.dtheta[:, 0], 0.4 * 5e-3, rtol=1e-6)
    assert (second.gyro_unit, log.fix_age) == ("rad", pytest.approx(0.11))
    track = log.tracks["vehicle_gps_position[0]"]
    np.testing.assert_allclose(track.position[0], [48 * DEG, 11 * DEG, 500.0])
    np.testing.assert_allclose(track.velocity[0], [1.0, 2.0, 3.0])
    assert log.utc_of_zero == pytest.approx(UTC - 0.12)


def test_thin_increments_are_named_with_what_to_set(tmp_path: Path) -> None:
    topics = {
        ("vehicle_imu", 0): (VEHICLE_IMU, increments(FULL[::100])),
        ("sensor_combined", 0): (COMBINED, [[t, [0.2, 0, 0], [0, 0, -9.8]] for t in FULL]),
    }
    log = read(ulog(tmp_path / "a.ulg", topics))
    assert list(log.unusable) == ["vehicle_imu[0]"]
    assert "SDLOG_PROFILE" in log.unusable["vehicle_imu[0]"]
    np.testing.assert_allclose(log.imus["sensor_combined[0]"].dtheta[:, 0] / 5e-3, 0.2, rtol=1e-6)


def test_of_two_receivers_one_is_used_and_fixes_in_two_dimensions_are_not(tmp_path: Path) -> None:
    topics = {
        ("sensor_gps", 0): (GPS, [*fixes(FULL[:40:40], kind=2), *fixes(FULL[40::40])]),
        ("sensor_gps", 1): (GPS, fixes(FULL[::40])),
    }
    log = read(ulog(tmp_path / "a.ulg", topics))
    assert len(log.tracks["sensor_gps[0]"].time) == 9
    assert log.tracks["sensor_gps[0]"].quality == {"2D": 1, "3D": 9}
    assert list(log.unusable) == ["sensor_gps[1]"]
    assert log.utc_of_zero == pytest.approx(UTC - 0.12)


TRUE_PLACE = "uint64_t timestamp;double lat;double lon;float alt;float alt_ellipsoid;"
TRUE_ATTITUDE = "uint64_t timestamp;float[4] q;"


@pytest.mark.parametrize("height", [500.0, 0.0])
def test_the_truth_of_a_simulation_is_a_reference_if_it_has_heights(height: float, tmp_path: Path) -> None:
    half = 15.0 * DEG
    topics = {
        ("vehicle_imu", 0): (VEHICLE_IMU, increments(FULL)),
        ("vehicle_global_position_groundtruth", 0): (TRUE_PLACE, [[t, 48.0, 11.0, 454.0, height] for t in FULL[5::20]]),
        ("vehicle_attitude_groundtruth", 0): (TRUE_ATTITUDE, [[t, [np.cos(half), 0, 0, np.sin(half)]] for t in FULL]),
    }
    log = read(ulog(tmp_path / "a.ulg", topics))
    name = "vehicle_global_position_groundtruth[0]"
    assert (name in log.unusable) == (height == 0.0)
    np.testing.assert_allclose(log.tracks[name].attitude, np.tile([0.0, 0.0, 30.0 * DEG], (20, 1)), atol=1e-6)
    np.testing.assert_allclose(log.tracks[name].position[:, 2], height)
    assert log.references == {name}
    assert "vehicle_attitude_groundtruth[0]" in log.unusable


def test_a_torn_end_costs_its_last_message(tmp_path: Path) -> None:
    path = ulog(tmp_path / "a.ulg", {("vehicle_imu", 0): (VEHICLE_IMU, increments(FULL))})
    path.write_bytes(path.read_bytes()[:-20])
    assert len(read(path).imus["vehicle_imu[0]"].time) == 399


def test_a_topic_that_nobody_announced_is_a_note_and_nothing_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = ulog(tmp_path / "a.ulg", {("vehicle_imu", 0): (VEHICLE_IMU, increments(FULL))})
    path.write_bytes(path.read_bytes() + message("D", struct.pack("<HQ", 7, 3_000_000)))
    log = read(path)
    assert len(log.imus["vehicle_imu[0]"].time) == 400
    assert any("its library says" in text and "7" in text for text in log.notes)
    assert capsys.readouterr() == ("", "")


def test_dropouts_are_told(tmp_path: Path) -> None:
    path = ulog(tmp_path / "a.ulg", {("vehicle_imu", 0): (VEHICLE_IMU, increments(FULL))})
    path.write_bytes(path.read_bytes() + message("O", struct.pack("<H", 250)))
    assert "nothing logged for 250 ms" in read(path).notes[0]


def test_a_header_without_a_log_is_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.ulg"
    path.write_bytes(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
    with pytest.raises(InputError, match="no IMU data"):
        propose([path])
