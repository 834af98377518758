"""A robot with one IMU and an odometer through a minute without GNSS, its streams as tables."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import pytest

import polyins as pi

# the IMU lies on its side: its y is up and its -z points forward, as the filter's innovations of the odometer tell
CONFIG = """
imus:
  - file: imu.csv
    format: table
    columns:
      time: {name: t}
      gyro: {names: [gx, gy, gz], unit: rad/s}
      accel: {names: [ax, ay, az], unit: m/s^2}
    axes: [-z, x, -y]
    noise: consumer-mems
gnss:
  file: fix.csv
  format: table
  columns: &track
    time: {name: t}
    position: {names: [latitude, longitude, height]}
    std: {names: [north, east, down]}
reference: {file: fix.csv, format: table, columns: *track}
outages: {length_s: 60, every_s: 90, first_after_s: 60}
"""
ODOMETER = """
odometer:
  file: odometer.csv
  columns: {time: {name: t}, value: speed}
  std_m_s: 0.1
  scale_std: 0.05
"""
CONSTRAINT = "odometer: {constraint_interval_s: 0.5}\n"


def table(path: Path, names: Sequence[str], rows: list[tuple[float, ...]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows(sorted(rows))


@pytest.fixture(scope="module")
def husky(data_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from rosbags.highlevel import AnyReader

    rows: dict[str, list[tuple[float, ...]]] = {"imu": [], "fix": [], "odometer": []}
    with AnyReader([data_folder / "logs" / "rosbag" / "husky.bag"]) as bag:
        for connection, _, raw in bag.messages():
            found = bag.deserialize(raw, connection.msgtype)
            time = found.header.stamp.sec + 1e-9 * found.header.stamp.nanosec
            if connection.topic == "/imu/data":
                w, f = found.angular_velocity, found.linear_acceleration
                rows["imu"].append((time, w.x, w.y, w.z, f.x, f.y, f.z))
            elif connection.topic == "/fix":
                std = [math.sqrt(found.position_covariance[k]) for k in (4, 0, 8)]
                rows["fix"].append((time, found.latitude, found.longitude, found.altitude, *std))
            else:
                rows["odometer"].append((time, found.twist.twist.linear.x))
    folder = tmp_path_factory.mktemp("husky")
    table(folder / "imu.csv", ["t", "gx", "gy", "gz", "ax", "ay", "az"], rows["imu"])
    table(folder / "fix.csv", ["t", "latitude", "longitude", "height", "north", "east", "down"], rows["fix"])
    table(folder / "odometer.csv", ["t", "speed"], rows["odometer"])
    return folder


def outage_rms(folder: Path, extra: str) -> tuple[float, pi.Solution]:
    path = folder / "husky.yaml"
    path.write_text(CONFIG + extra)
    recording = pi.load(path)
    solution = pi.run(recording, "single")
    document = pi.evaluate(solution, recording.reference, outages=recording.outages)
    return document["outages"]["horizontal_max_rms_m"], solution


def test_its_odometer_carries_it_through_outages(husky: Path) -> None:
    alone, _ = outage_rms(husky, "")
    assumed, _ = outage_rms(husky, CONSTRAINT)
    driven, solution = outage_rms(husky, ODOMETER)
    assert assumed < 0.3 * alone
    assert driven < 0.2 * assumed
    assert driven < 12.0
    scale = solution.offsets["speed_scale"]
    assert abs(scale.value[-1]) < 0.1
    assert scale.std[-1] < 0.01
    assert solution.measurements["odometer"].accepted.all()
